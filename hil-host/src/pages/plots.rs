//! Charts in print: lines, points, bands, histograms and rows over categories, with labelled axes.
//!
//! Colours are the eight of Okabe & Ito, which people with any common colour blindness can tell apart; series also differ
//! in mark or dash. Drawn by `plotters` (MIT, SVG backend only); files of them: [`crate::pages::figure`].

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::pages::chart::{Chart, Mark, Series, robust_range};

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

/// Ranges of an axis each, from where to where it is drawn.
type Ranges = ((f64, f64), (f64, f64));

/// A chart's drawing area with its axes.
type Drawn<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

type Said = DrawingAreaErrorKind<std::io::Error>;

/// Height of a row of a chart over categories, and of its title and axis, px.
const ROW: (u32, u32) = (24, 110);

/// With a margin to either side.
fn padded((low, high): (f64, f64)) -> (f64, f64) {
    let pad = if high > low { 0.04 * (high - low) } else { 0.5 };
    (low - pad, high + pad)
}

impl Chart {
    /// Height of its panel, px.
    pub(super) fn height(&self, paper: &Paper) -> u32 {
        let rows = (f64::from(self.categories.len() as u32 * ROW.0 + ROW.1) * paper.letters).round() as u32;
        if self.categories.is_empty() { paper.px.1 } else { rows }
    }

    /// The corner where the legend covers the fewest points.
    /// How many it covers, and its share of the chart's height.
    fn free_corner(&self, paper: &Paper, x: (f64, f64), y: (f64, f64)) -> (SeriesLabelPosition, usize, f64) {
        let letters = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0);
        // Shares of the chart: 8 px a letter and 60 px of marks and margins; 18 px a line and 16 px of margins.
        let share = |px: f64, of: u32, margins: f64| px * paper.letters / (f64::from(of) - margins * paper.letters);
        let wide = share(60.0 + 8.0 * letters as f64, paper.px.0, 100.0);
        let high = share(16.0 + 18.0 * self.series.len() as f64, paper.px.1, 90.0);
        let covered = |right: bool, top: bool| {
            let inside = |p: &(f64, f64)| {
                let (across, up) = ((p.0 - x.0) / (x.1 - x.0), (p.1 - y.0) / (y.1 - y.0));
                let (across, up) = (if right { 1.0 - across } else { across }, if top { 1.0 - up } else { up });
                (0.0..wide).contains(&across) && (0.0..high).contains(&up)
            };
            self.series.iter().flat_map(Series::points).filter(inside).count()
        };
        use SeriesLabelPosition::{LowerLeft, LowerRight, UpperLeft, UpperRight};
        let corners = [(UpperRight, true, true), (UpperLeft, false, true), (LowerRight, true, false), (LowerLeft, false, false)];
        let counted = corners.map(|(place, right, top)| (place, covered(right, top), high));
        counted.into_iter().min_by_key(|c| c.1).unwrap_or((UpperRight, 0, high))
    }

    /// Ranges of the axes, and the corner of the legend. An axis of ordinates leaves spikes beyond its edge.
    fn room(&self, paper: &Paper) -> (Ranges, SeriesLabelPosition) {
        let abscissae: Vec<f64> = self.series.iter().flat_map(Series::points).filter(|p| p.1.is_finite()).map(|p| p.0).collect();
        let ends =
            |v: &[f64]| v.iter().filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let (mut x, mut y) = (ends(&abscissae), robust_range(&self.ordinates()).unwrap_or((0.0, 1.0)));
        if x.0 > x.1 {
            x = (0.0, 1.0);
        }
        if self.series.iter().any(|s| self.mark_of(s) == Mark::Bar) {
            let (low, high) = (y.0.min(0.0), y.1.max(0.0));
            y = if low == 0.0 { (0.0, padded((low, high)).1) } else { padded((low, high)) };
        } else {
            y = padded(y);
        }
        x = padded(x);
        if self.equal {
            (x, y) = equal(paper, x, y);
        }
        if self.y.inverted {
            y = (y.1, y.0);
        }
        let (x, mut y) = (self.x_range.unwrap_or(x), self.y_range.unwrap_or(y));
        let (mut corner, covered, share) = self.free_corner(paper, x, y);
        // In print, where letters take much of the chart, a legend that would cover points gets room above them.
        if paper.width_mm.is_some() && self.y_range.is_none() && self.series.len() > 1 && covered > 0 {
            y.1 += (y.1 - y.0) * share / (1.0 - share.min(0.6));
            corner = self.free_corner(paper, x, y).0;
        }
        ((x, y), corner)
    }

    /// Draws it into an area.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn draw(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, paper: &Paper) -> anyhow::Result<()> {
        let drawn = if self.categories.is_empty() { self.draw_axes(area, paper) } else { self.draw_rows(area, paper) };
        drawn.map_err(|e| anyhow!("drawing `{}`: {e}", self.title))
    }

    fn draw_axes(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, paper: &Paper) -> Result<(), Said> {
        let u = |px| paper.u(px);
        let (((x0, x1), (y0, y1)), corner) = self.room(paper);
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", u(20)))
            .margin(u(14))
            .x_label_area_size(u(48))
            .y_label_area_size(u(64))
            .build_cartesian_2d(x0..x1, y0..y1)?;
        let (bottom, top) = (y0.min(y1), y0.max(y1));
        let beyond = self.ordinates().iter().filter(|v| !(bottom..=top).contains(*v)).count();
        let beyond = if beyond > 0 && self.y_range.is_none() { format!(" ({beyond} beyond)") } else { String::new() };
        chart
            .configure_mesh()
            .x_labels(paper.numbers(paper.px.0, 64.0))
            .y_labels(paper.numbers(paper.px.1, 40.0))
            .x_desc(self.x.text())
            .y_desc(self.y.text() + &beyond)
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .max_light_lines(1)
            .light_line_style(GRID.stroke_width(u(1)))
            .bold_line_style(GRID.stroke_width(u(1)))
            .axis_style(AXIS.stroke_width(u(1)))
            .set_all_tick_mark_size(u(5))
            .label_style(("sans-serif", u(14)))
            .axis_desc_style(("sans-serif", u(16)))
            .draw()?;
        for (s, (r, g, b)) in self.series.iter().zip(PALETTE.iter().copied().cycle()) {
            draw_series(&mut chart, s, self.mark_of(s), RGBColor(r, g, b), (bottom, top), paper)?;
        }
        if self.series.len() > 1 { legend(&mut chart, corner, paper) } else { Ok(()) }
    }

    /// A row for each category, its name before it and its label after it.
    fn draw_rows(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, paper: &Paper) -> Result<(), Said> {
        let (u, rows) = (|px| paper.u(px), self.categories.len() as f64);
        let values = self.ordinates();
        let zero = self.series.iter().any(|s| self.mark_of(s) == Mark::Bar);
        let ends = values.iter().fold(if zero { (0.0, 0.0) } else { (f64::INFINITY, f64::NEG_INFINITY) }, |(l, h), v| (v.min(l), v.max(h)));
        let (x0, x1) = if ends.0 > ends.1 { (0.0, 1.0) } else { padded(ends) };
        let (x0, x1) = self.x_range.unwrap_or((if zero && ends.0 == 0.0 { 0.0 } else { x0 }, x1));
        let wide = |of: &[String], most: f64| (of.iter().map(|t| t.chars().count()).max().unwrap_or(0) as f64 * 7.4 + 14.0).min(most);
        let share = |part: f64| part * f64::from(paper.px.0) / paper.letters;
        let labels = if self.labels.is_empty() { self.values() } else { self.labels.clone() };
        let (before, after) = (wide(&self.categories, share(0.34)), wide(&labels, share(0.48)));
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", u(18)))
            .margin(u(10))
            .x_label_area_size(u(48))
            .y_label_area_size(u(before as u32))
            .right_y_label_area_size(u(after as u32))
            .build_cartesian_2d(x0..x1, rows - 0.5..-0.5)?;
        chart
            .configure_mesh()
            .disable_y_mesh()
            .y_labels(0)
            .x_labels(paper.numbers((f64::from(paper.px.0) - (before + after) * paper.letters).max(60.0) as u32, 56.0))
            .x_desc(self.y.text())
            .x_label_formatter(&tick)
            .max_light_lines(1)
            .light_line_style(GRID.stroke_width(u(1)))
            .bold_line_style(GRID.stroke_width(u(1)))
            .axis_style(AXIS.stroke_width(u(1)))
            .label_style(("sans-serif", u(14)))
            .axis_desc_style(("sans-serif", u(15)))
            .draw()?;
        for (s, (r, g, b)) in self.series.iter().zip(PALETTE.iter().copied().cycle()) {
            draw_row_marks(&mut chart, s, self.mark_of(s), RGBColor(r, g, b), (x0, x1), paper)?;
        }
        let style = |h: HPos| ("sans-serif", u(14)).into_font().color(&BLACK).pos(Pos::new(h, VPos::Center));
        for (texts, x, side, h) in [(&self.categories, x0, -8, HPos::Right), (&labels, x1, 8, HPos::Left)] {
            let at = texts
                .iter()
                .enumerate()
                .map(|(i, text)| EmptyElement::at((x, i as f64)) + Text::new(text.clone(), (paper.i(side), 0), style(h)));
            chart.draw_series(at)?;
        }
        Ok(())
    }

    /// The values of the last series with points, as they stand at the end of its rows.
    fn values(&self) -> Vec<String> {
        let last = self.series.iter().rfind(|s| self.mark_of(s) != Mark::Band);
        let text = |v: &f64| if v.is_finite() { format!("{v:.3}") } else { String::new() };
        last.map_or_else(Vec::new, |s| s.y.iter().map(text).collect())
    }
}

const GRID: RGBColor = RGBColor(232, 232, 232);
const AXIS: RGBColor = RGBColor(80, 80, 80);

/// Ranges in which a metre is as long along one axis as along the other.
fn equal(paper: &Paper, x: (f64, f64), y: (f64, f64)) -> Ranges {
    // What margins, title and labels leave of the panel.
    let px = (f64::from(paper.px.0) - 92.0 * paper.letters, f64::from(paper.px.1) - 106.0 * paper.letters);
    let step = ((x.1 - x.0) / px.0).max((y.1 - y.0) / px.1);
    let about = |(low, high): (f64, f64), px: f64| (0.5 * (low + high - step * px), 0.5 * (low + high + step * px));
    (about(x, px.0), about(y, px.1))
}

/// Runs of neighbours that are finite.
fn runs<T: Copy>(all: impl Iterator<Item = T>, is_there: impl Fn(&T) -> bool) -> Vec<Vec<T>> {
    let all: Vec<T> = all.collect();
    all.split(|p| !is_there(p)).filter(|r| !r.is_empty()).map(<[T]>::to_vec).collect()
}

fn draw_series(
    chart: &mut Drawn<'_, '_>,
    s: &Series,
    mark: Mark,
    colour: RGBColor,
    (bottom, top): (f64, f64),
    paper: &Paper,
) -> Result<(), Said> {
    let u = |px| paper.u(px);
    let [five, eight, nine, eighteen] = [5, 8, 9, 18].map(|px| paper.i(px));
    let (thick, dot, dot_shown) = (u(2), u(2), u(3));
    // What is beyond the axis is drawn at its edge.
    let inside = |(x, y): (f64, f64)| (x, y.clamp(bottom, top));
    let there = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let finite = || s.points().filter(there).map(inside);
    let block = move |(x, y): (i32, i32), share: f64| Rectangle::new([(x, y - five), (x + eighteen, y + five)], colour.mix(share).filled());
    match mark {
        Mark::Line => {
            for (k, run) in runs(s.points().map(inside), there).into_iter().enumerate() {
                let drawn = chart.draw_series(LineSeries::new(run, colour.stroke_width(thick)))?;
                if k == 0 {
                    drawn.label(&s.name).legend(move |(x, y)| PathElement::new([(x, y), (x + eighteen, y)], colour.stroke_width(thick)));
                }
            }
        }
        Mark::Dashed => {
            for (k, run) in runs(s.points().map(inside), there).into_iter().enumerate() {
                let drawn = chart.draw_series(DashedLineSeries::new(run, eight, five, colour.stroke_width(thick)))?;
                if k == 0 {
                    let dashes = move |(x, y): (i32, i32)| {
                        DashedPathElement::new([(x, y), (x + eighteen, y)], five, five, colour.stroke_width(thick))
                    };
                    drawn.label(&s.name).legend(dashes);
                }
            }
        }
        Mark::Band => {
            let ends = runs(s.ends(), |p| p.1.is_finite() && p.2.is_finite());
            let around = ends.into_iter().map(|run| {
                let back = run.iter().rev().map(|p| inside((p.0, p.2)));
                let corners: Vec<(f64, f64)> = run.iter().map(|p| inside((p.0, p.1))).chain(back).collect();
                Polygon::new(corners, colour.mix(0.2))
            });
            chart.draw_series(around)?.label(&s.name).legend(move |at| block(at, 0.2));
        }
        Mark::Bar => {
            let half = half_width(&s.x);
            let bars = finite().map(|(x, y)| Rectangle::new([(x - half, 0.0), (x + half, y)], colour.mix(0.45).filled()));
            chart.draw_series(bars)?.label(&s.name).legend(move |at| block(at, 0.45));
        }
        Mark::Point | Mark::Interval | Mark::Map => {
            let whiskers = s.ends().filter(|e| e.1.is_finite() && e.2.is_finite());
            let whiskers =
                whiskers.map(|(x, low, high)| PathElement::new([inside((x, low)), inside((x, high))], colour.stroke_width(u(1))));
            chart.draw_series(whiskers)?;
            chart
                .draw_series(finite().map(|p| Circle::new(p, dot, colour.mix(0.6).filled())))?
                .label(&s.name)
                .legend(move |(x, y)| Circle::new((x + nine, y), dot_shown, colour.filled()));
        }
    }
    Ok(())
}

/// The marks of one series in the rows of a chart over categories: values run to the right.
fn draw_row_marks(
    chart: &mut Drawn<'_, '_>,
    s: &Series,
    mark: Mark,
    colour: RGBColor,
    (left, right): (f64, f64),
    paper: &Paper,
) -> Result<(), Said> {
    let to = |v: f64| v.clamp(left, right);
    let block = |i: f64, half: f64, from: f64, until: f64, share: f64| {
        Rectangle::new([(to(from), i - half), (to(until), i + half)], colour.mix(share).filled())
    };
    let there = |p: &(f64, f64, f64)| p.1.is_finite() && p.2.is_finite();
    match mark {
        Mark::Band => {
            chart.draw_series(s.ends().filter(there).map(|(i, low, high)| block(i, 0.5, low, high, 0.15)))?;
        }
        Mark::Bar => {
            chart.draw_series(s.points().filter(|p| p.1.is_finite()).map(|(i, v)| block(i, 0.3, 0.0, v, 0.6)))?;
        }
        _ => {
            let dots = s.points().filter(|p| p.1.is_finite()).map(|(i, v)| Circle::new((to(v), i), paper.u(4), colour.filled()));
            chart.draw_series(dots)?;
        }
    }
    if mark != Mark::Band {
        let whiskers =
            s.ends().filter(there).map(|(i, low, high)| PathElement::new([(to(low), i), (to(high), i)], BLACK.stroke_width(paper.u(2))));
        chart.draw_series(whiskers)?;
    }
    Ok(())
}

/// The box that says which colour is which series.
fn legend<'a, 'b: 'a>(chart: &mut Drawn<'a, 'b>, corner: SeriesLabelPosition, paper: &Paper) -> Result<(), Said> {
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

/// Half the width of a bar.
fn half_width(x: &[f64]) -> f64 {
    match x {
        [a, b, ..] => 0.5 * (b - a).abs(),
        _ => 0.5,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_legend_goes_where_nothing_is_drawn() {
        let rising = Chart::lines("T", "x", "y").plus("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(i))));
        assert!(matches!(rising.free_corner(&Paper::SCREEN, (0.0, 99.0), (0.0, 99.0)).0, SeriesLabelPosition::UpperLeft));
        let falling = Chart::lines("T", "x", "y").plus("a", Mark::Line, (0..100).map(|i| (f64::from(i), f64::from(-i))));
        assert!(matches!(falling.free_corner(&Paper::SCREEN, (0.0, 99.0), (-99.0, 0.0)).0, SeriesLabelPosition::UpperRight));
        assert_eq!([-0.0, 5.0, 0.1 + 0.2, -2.5, 35_000.0].map(|v| tick(&v)), ["0", "5", "0.3", "-2.5", "35000"]);
    }
}
