//! Charts for papers: lines, points and histograms with labelled axes, as SVG, PNG, csv and JSON of the same numbers.
//!
//! Colours are the eight of Okabe & Ito, which people with any common colour blindness can tell apart; series also differ
//! in mark or dash. Drawn by `plotters` (MIT, SVG backend only); a PNG is that same SVG put into pixels by `resvg`, set in
//! Noto Sans, which the program carries: the picture is the same on every machine.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use resvg::{tiny_skia, usvg};
use serde_json::{Value, json};

/// Okabe–Ito palette, in the order series take them.
pub const PALETTE: [(u8, u8, u8); 7] =
    [(0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0), (0, 0, 0)];

/// Width and height, px.
const SIZE: (u32, u32) = (800, 520);

/// Units of drawing in one px: the backend knows only whole units, and lines drawn in whole px are kinked.
const FINE: u32 = 4;

/// A length of `px` in units of drawing.
const fn u(px: u32) -> u32 {
    px * FINE
}

/// The same with a sign, for coordinates.
const fn i(px: i32) -> i32 {
    px * FINE as i32
}

/// A tick label: as many decimals as the number has, no more.
fn tick(v: &f64) -> String {
    let rounded = (v * 1e6).round() / 1e6;
    // Adding zero turns a rounded -0 into 0.
    format!("{}", rounded + 0.0)
}

/// Pixels of a PNG for one of the SVG: 2400 across, 300 dpi over the 20 cm of a full page.
const PNG_SCALE: u32 = 3;

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line through the points.
    Line,
    /// A dashed line.
    Dashed,
    /// Points only.
    Points,
    /// Bars from zero, centred on x, as wide as the spacing of the first two points.
    Bars,
}

/// One series.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Points; those that are not finite are left out and interrupt a line.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub mark: Mark,
}

/// A chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Label of the x axis with unit: "angle of attack, deg".
    pub x: String,
    /// Label of the y axis with unit.
    pub y: String,
    /// Fixed x range; none: from the data.
    pub x_range: Option<(f64, f64)>,
    /// Fixed y range; none: from the data.
    pub y_range: Option<(f64, f64)>,
    /// Series.
    pub series: Vec<Series>,
}

impl Chart {
    /// A chart without series.
    #[must_use]
    pub fn new(title: &str, x: &str, y: &str) -> Self {
        Self { title: title.into(), x: x.into(), y: y.into(), x_range: None, y_range: None, series: Vec::new() }
    }

    /// With a series more.
    #[must_use]
    pub fn with(mut self, name: &str, mark: Mark, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        self.series.push(Series { name: name.into(), points: points.into_iter().collect(), mark });
        self
    }

    /// With fixed ranges.
    #[must_use]
    pub fn within(mut self, x: Option<(f64, f64)>, y: Option<(f64, f64)>) -> Self {
        (self.x_range, self.y_range) = (x, y);
        self
    }

    fn range(&self, of: impl Fn(&(f64, f64)) -> f64, zero: bool) -> (f64, f64) {
        let values = self.series.iter().flat_map(|s| &s.points).filter(|p| p.0.is_finite() && p.1.is_finite()).map(of);
        let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if zero {
            (low, high) = (low.min(0.0), high.max(0.0));
        }
        if low > high {
            return (0.0, 1.0);
        }
        let pad = if high > low { 0.04 * (high - low) } else { 0.5 };
        (if zero && low == 0.0 { 0.0 } else { low - pad }, high + pad)
    }

    /// The chart as SVG text.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn svg(&self) -> anyhow::Result<String> {
        Figure { panels: vec![self.clone()], caption: String::new() }.svg()
    }

    /// The corner where the legend covers the fewest points.
    fn free_corner(&self, x: (f64, f64), y: (f64, f64)) -> SeriesLabelPosition {
        let letters = self.series.iter().map(|s| s.name.chars().count() + 9 * usize::from(s.mark == Mark::Dashed)).max().unwrap_or(0);
        // Shares of the chart: 8 px a letter and 60 px of marks and margins in 700; 18 px a line and 16 px of margins in 430.
        let (wide, high) = ((60.0 + 8.0 * letters as f64) / 700.0, (16.0 + 18.0 * self.series.len() as f64) / 430.0);
        let covered = |right: bool, top: bool| {
            let inside = |p: &&(f64, f64)| {
                let (across, up) = ((p.0 - x.0) / (x.1 - x.0), (p.1 - y.0) / (y.1 - y.0));
                let (across, up) = (if right { 1.0 - across } else { across }, if top { 1.0 - up } else { up });
                (0.0..wide).contains(&across) && (0.0..high).contains(&up)
            };
            self.series.iter().flat_map(|s| &s.points).filter(inside).count()
        };
        use SeriesLabelPosition::{LowerLeft, LowerRight, UpperLeft, UpperRight};
        let corners = [(UpperRight, true, true), (UpperLeft, false, true), (LowerRight, true, false), (LowerLeft, false, false)];
        corners.into_iter().min_by_key(|(_, right, top)| covered(*right, *top)).map_or(UpperRight, |c| c.0)
    }

    fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>) -> anyhow::Result<()> {
        let bars = self.series.iter().any(|s| s.mark == Mark::Bars);
        let (x0, x1) = self.x_range.unwrap_or_else(|| self.range(|p| p.0, false));
        let (y0, y1) = self.y_range.unwrap_or_else(|| self.range(|p| p.1, bars));
        let said = |e: DrawingAreaErrorKind<std::io::Error>| anyhow!("drawing `{}`: {e}", self.title);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", u(20)))
            .margin(u(14))
            .x_label_area_size(u(48))
            .y_label_area_size(u(64))
            .build_cartesian_2d(x0..x1, y0..y1)
            .map_err(said)?;
        chart
            .configure_mesh()
            .x_desc(&self.x)
            .y_desc(&self.y)
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .max_light_lines(1)
            .light_line_style(RGBColor(232, 232, 232).stroke_width(u(1)))
            .bold_line_style(RGBColor(232, 232, 232).stroke_width(u(1)))
            .axis_style(RGBColor(80, 80, 80).stroke_width(u(1)))
            .set_all_tick_mark_size(u(5))
            .label_style(("sans-serif", u(14)))
            .axis_desc_style(("sans-serif", u(16)))
            .draw()
            .map_err(said)?;
        for (s, (r, g, b)) in self.series.iter().zip(PALETTE.iter().copied().cycle()) {
            let colour = RGBColor(r, g, b);
            let finite = s.points.iter().copied().filter(|p| p.0.is_finite() && p.1.is_finite());
            let runs: Vec<Vec<(f64, f64)>> =
                s.points.split(|p| !(p.0.is_finite() && p.1.is_finite())).filter(|r| !r.is_empty()).map(<[(f64, f64)]>::to_vec).collect();
            let legend_line = move |(x, y): (i32, i32)| PathElement::new([(x, y), (x + i(18), y)], colour.stroke_width(u(2)));
            match s.mark {
                Mark::Line => {
                    for (k, run) in runs.into_iter().enumerate() {
                        let drawn = chart.draw_series(LineSeries::new(run, colour.stroke_width(u(2)))).map_err(said)?;
                        if k == 0 {
                            drawn.label(&s.name).legend(legend_line);
                        }
                    }
                }
                Mark::Dashed => {
                    for (k, run) in runs.into_iter().enumerate() {
                        let drawn = chart.draw_series(DashedLineSeries::new(run, u(8), u(5), colour.stroke_width(u(2)))).map_err(said)?;
                        if k == 0 {
                            drawn.label(format!("{} (dashed)", s.name)).legend(legend_line);
                        }
                    }
                }
                Mark::Points => {
                    chart
                        .draw_series(finite.map(|p| Circle::new(p, u(2), colour.mix(0.6).filled())))
                        .map_err(said)?
                        .label(&s.name)
                        .legend(move |(x, y)| Circle::new((x + i(9), y), u(3), colour.filled()));
                }
                Mark::Bars => {
                    let half = half_width(&s.points);
                    chart
                        .draw_series(finite.map(|(x, y)| Rectangle::new([(x - half, 0.0), (x + half, y)], colour.mix(0.45).filled())))
                        .map_err(said)?
                        .label(&s.name)
                        .legend(move |(x, y)| Rectangle::new([(x, y - i(5)), (x + i(18), y + i(5))], colour.mix(0.45).filled()));
                }
            }
        }
        if self.series.len() > 1 {
            chart
                .configure_series_labels()
                .position(self.free_corner((x0, x1), (y0, y1)))
                .margin(u(8))
                .legend_area_size(u(26))
                .background_style(WHITE.mix(0.85))
                .border_style(RGBColor(160, 160, 160).stroke_width(u(1)))
                .label_font(("sans-serif", u(14)))
                .draw()
                .map_err(said)?;
        }
        Ok(())
    }

    /// The numbers as csv: series, x, y; the axis labels are in the header.
    #[must_use]
    pub fn csv(&self) -> String {
        let clean = |s: &str| s.replace(',', ";");
        let mut out = format!("series,{},{}\n", clean(&self.x).replace("; ", " in "), clean(&self.y).replace("; ", " in "));
        for s in &self.series {
            for (x, y) in &s.points {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{},{x},{y}", clean(&s.name));
            }
        }
        out
    }

    /// The numbers as JSON; what is not finite is null.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({"title": self.title, "x": self.x, "y": self.y, "series": self.series.iter().map(|s| json!({
            "name": s.name,
            "x": s.points.iter().map(|p| p.0).collect::<Vec<_>>(),
            "y": s.points.iter().map(|p| p.1).collect::<Vec<_>>(),
        })).collect::<Vec<_>>()})
    }

    /// Writes `stem`.svg, .png, .csv and .json into a folder, which is made if it is not there.
    ///
    /// # Errors
    /// The folder or a file cannot be written.
    pub fn write(&self, folder: &Path, stem: &str) -> anyhow::Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let svg = self.svg()?;
        let png = png(&svg)?;
        for (end, bytes) in [("svg", svg.into()), ("png", png), ("csv", self.csv().into()), ("json", format!("{:#}\n", self.json()).into())]
        {
            let path = folder.join(format!("{stem}.{end}"));
            crate::whole_file::write(&path, bytes).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }
}

/// Puts SVG text of this room into pixels.
///
/// # Errors
/// The text is no SVG, or the picture does not fit into memory.
pub fn png(svg: &str) -> anyhow::Result<Vec<u8>> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(ttf_noto_sans::REGULAR.to_vec());
    fonts.set_sans_serif_family("Noto Sans");
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).context("reading back a figure")?;
    let size = tree.size().to_int_size().scale_by(PNG_SCALE as f32).context("a figure without size")?;
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height()).context("a figure too large for memory")?;
    let scale = tiny_skia::Transform::from_scale(PNG_SCALE as f32, PNG_SCALE as f32);
    resvg::render(&tree, scale, &mut pixels.as_mut());
    pixels.encode_png().context("encoding a PNG")
}

/// Height of one line of a caption, px, and about how many characters fit in it.
const CAPTION: (u32, usize) = (19, 108);

/// Charts below each other with one caption.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// From top to bottom.
    pub panels: Vec<Chart>,
    /// What it shows, for the reader of a paper; may be empty.
    pub caption: String,
}

impl Figure {
    fn caption_lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in self.caption.split_whitespace() {
            match lines.last_mut() {
                Some(l) if l.chars().count() + 1 + word.chars().count() <= CAPTION.1 => {
                    l.push(' ');
                    l.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// The figure as SVG text.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn svg(&self) -> anyhow::Result<String> {
        let lines = self.caption_lines();
        let charts = SIZE.1 * self.panels.len() as u32;
        let foot = if lines.is_empty() { 0 } else { 14 + CAPTION.0 * lines.len() as u32 };
        let (wide, high) = (SIZE.0, charts + foot);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (u(wide), u(high))).into_drawing_area();
            let said = |e: DrawingAreaErrorKind<std::io::Error>| anyhow!("drawing a figure: {e}");
            root.fill(&WHITE).map_err(said)?;
            let (upper, _) = root.split_vertically(u(charts));
            for (chart, area) in self.panels.iter().zip(upper.split_evenly((self.panels.len().max(1), 1))) {
                chart.draw(&area)?;
            }
            let style = ("sans-serif", u(15)).into_text_style(&root);
            for (y, line) in (charts..).step_by(CAPTION.0 as usize).zip(&lines) {
                root.draw_text(line, &style, (i(20), i(y as i32))).map_err(said)?;
            }
            root.present().map_err(said)?;
        }
        // As large as meant, in the units it was drawn in.
        let drawn = format!("width=\"{}\" height=\"{}\"", u(wide), u(high));
        Ok(text.replacen(&drawn, &format!("width=\"{wide}\" height=\"{high}\""), 1))
    }

    /// The figure as PNG.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn png(&self) -> anyhow::Result<Vec<u8>> {
        png(&self.svg()?)
    }

    /// The numbers as csv: of one panel as [`Chart::csv`], of several with a column for the panel.
    #[must_use]
    pub fn csv(&self) -> String {
        if let [only] = self.panels.as_slice() {
            return only.csv();
        }
        let mut out = String::from("panel,series,x,y\n");
        for chart in &self.panels {
            let panel = format!("{}: {} over {}", chart.title, chart.y, chart.x).replace(", ", " in ").replace(',', ";");
            for line in chart.csv().lines().skip(1) {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{panel},{line}");
            }
        }
        out
    }

    /// The numbers as JSON.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({"caption": self.caption, "panels": self.panels.iter().map(Chart::json).collect::<Vec<_>>()})
    }
}

/// Histogram of values as (bin centre, share of all values), over `[low, high)` in `bins` equal bins.
#[must_use]
pub fn histogram(values: &[f64], low: f64, high: f64, bins: usize) -> Vec<(f64, f64)> {
    let width = (high - low) / bins as f64;
    let mut counts = vec![0u32; bins];
    let mut all = 0u32;
    for v in values.iter().filter(|v| v.is_finite()) {
        all += 1;
        let bin = ((v - low) / width).floor();
        if bin >= 0.0 && bin < bins as f64 {
            counts[bin as usize] += 1;
        }
    }
    let share = |n: u32| if all > 0 { f64::from(n) / f64::from(all) } else { 0.0 };
    counts.iter().enumerate().map(|(i, n)| (low + (i as f64 + 0.5) * width, share(*n))).collect()
}

/// Half the width of a bar.
fn half_width(points: &[(f64, f64)]) -> f64 {
    match points {
        [a, b, ..] => 0.5 * (b.0 - a.0).abs(),
        _ => 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_names_its_axes_series_and_survives_gaps() {
        let c = Chart::new("T", "angle of attack, deg", "L/D, 1")
            .with("a & b", Mark::Line, [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)])
            .with("points", Mark::Points, [(0.0, 1.0)])
            .with("bars", Mark::Bars, histogram(&[0.1, 0.2, 0.7], 0.0, 1.0, 2));
        let svg = c.svg().unwrap();
        for want in ["<svg", "angle of attack, deg", "L/D, 1", "points", "a &amp; b"] {
            assert!(svg.contains(want), "{want}");
        }
        assert!(!svg.contains("NaN"));
        assert!(svg.contains("width=\"800\" height=\"520\" viewBox=\"0 0 3200 2080\""), "{}", &svg[..200]);
        assert!(c.csv().starts_with("series,angle of attack in deg,L/D in 1\na & b,0,1\n"));
        assert!(c.json()["series"][0]["y"][1].is_null());
        assert!(Chart::new("empty", "x", "y").svg().unwrap().contains("</svg>"));
    }

    #[test]
    fn a_figure_has_its_caption_and_every_panel() {
        let panel = |t: &str| Chart::new(t, "time, s", "depth, m").with("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)]);
        let caption = "word ".repeat(40);
        let f = Figure { panels: vec![panel("upper"), panel("lower").within(None, Some((3.0, 0.0)))], caption };
        let svg = f.svg().unwrap();
        assert!(svg.contains("upper") && svg.contains("lower") && svg.contains("word word"), "{svg}");
        assert_eq!(f.caption_lines().len(), 2);
        assert_eq!(f.csv().lines().count(), 5);
        assert_eq!(f.json()["panels"][1]["title"], "lower");
    }

    #[test]
    fn the_legend_goes_where_nothing_is_drawn() {
        let rising = Chart::new("T", "x", "y").with("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(i))));
        assert!(matches!(rising.free_corner((0.0, 99.0), (0.0, 99.0)), SeriesLabelPosition::UpperLeft));
        let falling = Chart::new("T", "x", "y").with("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(-i))));
        assert!(matches!(falling.free_corner((0.0, 99.0), (-99.0, 0.0)), SeriesLabelPosition::UpperRight));
        assert_eq!([-0.0, 5.0, 0.1 + 0.2, -2.5, 35_000.0].map(|v| tick(&v)), ["0", "5", "0.3", "-2.5", "35000"]);
    }

    #[test]
    fn a_png_has_its_size_its_colours_and_its_letters() {
        let figure = |title: &str| Figure {
            panels: vec![Chart::new(title, "α, deg", "L/D, 1").with("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)])],
            caption: "One line.".into(),
        };
        let pixels = |title: &str| tiny_skia::Pixmap::decode_png(&figure(title).png().unwrap()).unwrap();
        let p = pixels("Title");
        assert_eq!((p.width(), p.height()), (3 * 800, 3 * (520 + 14 + 19)));
        let of = |(r, g, b): (u8, u8, u8)| p.pixels().iter().filter(|q| (q.red(), q.green(), q.blue()) == (r, g, b)).count();
        assert!(of(PALETTE[0]) > 1000, "the line in its colour");
        assert!(of((255, 255, 255)) > p.pixels().len() / 2, "white ground");
        let ink = |p: &tiny_skia::Pixmap| p.pixels().iter().filter(|q| q.red() < 64 && q.green() < 64 && q.blue() < 64).count();
        assert!(ink(&pixels("Titles of more letters")) > ink(&p) + 500, "letters are drawn");
    }

    #[test]
    fn a_histogram_counts_shares() {
        let h = histogram(&[0.1, 0.2, 0.7, 5.0, f64::NAN], 0.0, 1.0, 2);
        assert_eq!(h, vec![(0.25, 0.5), (0.75, 0.25)]);
    }
}
