//! Charts for papers: lines, points and histograms with labelled axes, and their numbers as csv and JSON.
//!
//! Colours are the eight of Okabe & Ito, which people with any common colour blindness can tell apart; series also differ
//! in mark or dash. Drawn by `plotters` (MIT, SVG backend only); files of them: [`crate::pages::figure`].

use std::fmt::Write as _;

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use serde_json::{Value, json};

/// Okabe–Ito palette, in the order series take them.
pub const PALETTE: [(u8, u8, u8); 7] =
    [(0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0), (0, 0, 0)];

/// Units of drawing in one px: the backend knows only whole units, and lines drawn in whole px are kinked.
const FINE: u32 = 4;

/// A length of `px` in units of drawing.
#[must_use]
pub const fn units(px: u32) -> u32 {
    px * FINE
}

/// A tick label: as many decimals as the number has, no more.
fn tick(v: &f64) -> String {
    let rounded = (v * 1e6).round() / 1e6;
    // Adding zero turns a rounded -0 into 0.
    format!("{}", rounded + 0.0)
}

/// How large a figure is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Width of the figure and height of each panel, px of 1/96 inch.
    pub px: (u32, u32),
    /// Size of letters, marks and lines, of those on a screen.
    pub letters: f64,
    /// Pixels of a PNG for a px.
    pub pixels: f32,
    /// Width in print, mm; none: on a screen.
    pub width_mm: Option<f64>,
}

/// Height of a panel over its width, unless it is asked for.
const SHAPE: f64 = 0.65;
/// Letters in print over those on a screen: axis numbers of 7 pt, the least that journals take.
const PRINTED: f64 = 0.827;
/// Resolution of a PNG in print, dots per inch.
const DPI: f64 = 300.0;

impl Paper {
    /// For a page or a slide: 800 px; as PNG 2400, which is 300 dpi over 20 cm.
    pub const SCREEN: Self = Self { px: (800, 520), letters: 1.0, pixels: 3.0, width_mm: None };

    /// Of a width in print, and of a height of each panel or the usual shape.
    #[must_use]
    pub fn printed(width_mm: f64, height_mm: Option<f64>) -> Self {
        let px = |mm: f64| (mm / 25.4 * 96.0).round() as u32;
        let height_mm = height_mm.unwrap_or((SHAPE * width_mm).clamp(55.0, 110.0));
        Self { px: (px(width_mm), px(height_mm)), letters: PRINTED, pixels: (DPI / 96.0) as f32, width_mm: Some(width_mm) }
    }

    /// A length of so many px on a screen, in units of drawing.
    #[must_use]
    pub fn u(&self, px: u32) -> u32 {
        (f64::from(units(px)) * self.letters).round() as u32
    }

    /// How many numbers fit beside each other along an axis of so many px.
    fn numbers(&self, px: u32, each: f64) -> usize {
        (f64::from(px) / (each * self.letters) - 1.4).clamp(2.0, 11.0) as usize
    }

    /// The same as `u` with a sign, for coordinates.
    #[must_use]
    pub fn i(&self, px: i32) -> i32 {
        px.signum() * self.u(px.unsigned_abs()) as i32
    }
}

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

    /// The corner where the legend covers the fewest points.
    /// How many it covers, and its share of the chart's height.
    fn free_corner(&self, paper: &Paper, x: (f64, f64), y: (f64, f64)) -> (SeriesLabelPosition, usize, f64) {
        let letters = self.series.iter().map(|s| s.name.chars().count() + 9 * usize::from(s.mark == Mark::Dashed)).max().unwrap_or(0);
        // Shares of the chart: 8 px a letter and 60 px of marks and margins; 18 px a line and 16 px of margins.
        let share = |px: f64, of: u32, margins: f64| px * paper.letters / (f64::from(of) - margins * paper.letters);
        let wide = share(60.0 + 8.0 * letters as f64, paper.px.0, 100.0);
        let high = share(16.0 + 18.0 * self.series.len() as f64, paper.px.1, 90.0);
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
        let counted = corners.map(|(place, right, top)| (place, covered(right, top), high));
        counted.into_iter().min_by_key(|c| c.1).unwrap_or((UpperRight, 0, high))
    }

    /// Ranges of the axes, and the corner of the legend.
    fn room(&self, paper: &Paper) -> ((f64, f64), (f64, f64), SeriesLabelPosition) {
        let bars = self.series.iter().any(|s| s.mark == Mark::Bars);
        let x = self.x_range.unwrap_or_else(|| self.range(|p| p.0, false));
        let mut y = self.y_range.unwrap_or_else(|| self.range(|p| p.1, bars));
        let (mut corner, covered, share) = self.free_corner(paper, x, y);
        // In print, where letters take much of the chart, a legend that would cover points gets room above them.
        if paper.width_mm.is_some() && self.y_range.is_none() && self.series.len() > 1 && covered > 0 {
            y.1 += (y.1 - y.0) * share / (1.0 - share.min(0.6));
            corner = self.free_corner(paper, x, y).0;
        }
        (x, y, corner)
    }

    /// Draws it into an area.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, paper: &Paper) -> anyhow::Result<()> {
        let u = |px| paper.u(px);
        let [five, eight, nine, eighteen] = [5, 8, 9, 18].map(|px| paper.i(px));
        let (dot, dot_shown) = (u(2), u(3));
        let ((x0, x1), (y0, y1), corner) = self.room(paper);
        let said = |e: Said| anyhow!("drawing `{}`: {e}", self.title);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", u(20)))
            .margin(u(14))
            .x_label_area_size(u(48))
            .y_label_area_size(u(64))
            .build_cartesian_2d(x0..x1, y0..y1)
            .map_err(said)?;
        chart
            .configure_mesh()
            .x_labels(paper.numbers(paper.px.0, 64.0))
            .y_labels(paper.numbers(paper.px.1, 40.0))
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
            let legend_line = move |(x, y): (i32, i32)| PathElement::new([(x, y), (x + eighteen, y)], colour.stroke_width(dot));
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
                        let drawn = chart.draw_series(DashedLineSeries::new(run, eight, five, colour.stroke_width(u(2)))).map_err(said)?;
                        if k == 0 {
                            drawn.label(format!("{} (dashed)", s.name)).legend(legend_line);
                        }
                    }
                }
                Mark::Points => {
                    chart
                        .draw_series(finite.map(|p| Circle::new(p, dot, colour.mix(0.6).filled())))
                        .map_err(said)?
                        .label(&s.name)
                        .legend(move |(x, y)| Circle::new((x + nine, y), dot_shown, colour.filled()));
                }
                Mark::Bars => {
                    let half = half_width(&s.points);
                    chart
                        .draw_series(finite.map(|(x, y)| Rectangle::new([(x - half, 0.0), (x + half, y)], colour.mix(0.45).filled())))
                        .map_err(said)?
                        .label(&s.name)
                        .legend(move |(x, y)| Rectangle::new([(x, y - five), (x + eighteen, y + five)], colour.mix(0.45).filled()));
                }
            }
        }
        if self.series.len() > 1 { legend(&mut chart, corner, paper).map_err(said) } else { Ok(()) }
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
}

type Said = DrawingAreaErrorKind<std::io::Error>;

/// The box that says which colour is which series.
fn legend<'a, 'b: 'a>(
    chart: &mut ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>,
    corner: SeriesLabelPosition,
    paper: &Paper,
) -> Result<(), Said> {
    chart
        .configure_series_labels()
        .position(corner)
        .margin(paper.u(8))
        .legend_area_size(paper.u(26))
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(160, 160, 160).stroke_width(paper.u(1)))
        .label_font(("sans-serif", paper.u(14)))
        .draw()
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
    fn the_legend_goes_where_nothing_is_drawn() {
        let rising = Chart::new("T", "x", "y").with("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(i))));
        assert!(matches!(rising.free_corner(&Paper::SCREEN, (0.0, 99.0), (0.0, 99.0)).0, SeriesLabelPosition::UpperLeft));
        let falling = Chart::new("T", "x", "y").with("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(-i))));
        assert!(matches!(falling.free_corner(&Paper::SCREEN, (0.0, 99.0), (-99.0, 0.0)).0, SeriesLabelPosition::UpperRight));
        assert_eq!([-0.0, 5.0, 0.1 + 0.2, -2.5, 35_000.0].map(|v| tick(&v)), ["0", "5", "0.3", "-2.5", "35000"]);
    }

    #[test]
    fn a_histogram_counts_shares() {
        let h = histogram(&[0.1, 0.2, 0.7, 5.0, f64::NAN], 0.0, 1.0, 2);
        assert_eq!(h, vec![(0.25, 0.5), (0.75, 0.25)]);
    }
}
