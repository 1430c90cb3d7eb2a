//! A chart as plain data: what the page draws ([`crate::pages`]), what a figure in print draws ([`crate::pages::plots`]), and its numbers
//! as csv and JSON.

use std::fmt::Write as _;

use logs::record::plausible::quantile;
use serde::Serialize;
use serde_json::{Value, json};

use crate::pages::short;
use crate::pages::thinning::thin;

/// How a chart or a series of it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// Joined by lines.
    Line,
    /// Joined by a dashed line.
    Dashed,
    /// Single points.
    Point,
    /// Single points with their intervals.
    Interval,
    /// The area between the ends of the intervals.
    Band,
    /// Bars from zero: over categories with optional intervals, else as wide as the spacing of the first two points.
    Bar,
    /// Colour map: `x` and `y` are bin centres, `z` the values, row by row.
    Map,
}

/// One axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit, empty for none, 1 for a pure number.
    pub unit: String,
    /// Larger values at the bottom (depth).
    pub inverted: bool,
}

impl Axis {
    /// A quantity and its unit.
    #[must_use]
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.into(), unit: unit.into(), inverted: false }
    }

    /// The same, growing downwards.
    #[must_use]
    pub fn down(self) -> Self {
        Self { inverted: true, ..self }
    }

    /// As it is printed, "angle of attack, deg".
    #[must_use]
    pub fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{}, {}", self.label, self.unit) }
    }

    /// Heads a column of a csv file.
    fn column(&self) -> String {
        let clean = self.label.replace(',', ";");
        if self.unit.is_empty() { clean } else { format!("{clean} in {}", self.unit) }
    }
}

/// Reads "angle of attack, deg".
impl From<&str> for Axis {
    fn from(text: &str) -> Self {
        let (label, unit) = text.rsplit_once(", ").unwrap_or((text, ""));
        Self::new(label, unit)
    }
}

/// One series.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// How it is drawn, if not as the chart is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mark: Option<Mark>,
    /// Abscissae; non-finite values are gaps.
    #[serde(serialize_with = "short::long")]
    pub x: Vec<f64>,
    /// Ordinates, same length; for maps, bin centres.
    #[serde(serialize_with = "short::serialize")]
    pub y: Vec<f64>,
    /// Lower end of each interval, if any.
    #[serde(serialize_with = "short::serialize", skip_serializing_if = "Vec::is_empty")]
    pub low: Vec<f64>,
    /// Upper end of each interval, if any.
    #[serde(serialize_with = "short::serialize", skip_serializing_if = "Vec::is_empty")]
    pub high: Vec<f64>,
    /// Map values, `y.len()` rows of `x.len()`.
    #[serde(serialize_with = "short::serialize", skip_serializing_if = "Vec::is_empty")]
    pub z: Vec<f64>,
}

impl Series {
    /// A series of points, thinned to what a screen can show.
    #[must_use]
    pub fn new(name: &str, x: &[f64], y: &[f64]) -> Self {
        let (x, y) = thin(x, y, 2400);
        Self { name: name.into(), x, y, ..Self::default() }
    }

    /// Points with the ends of their intervals.
    #[must_use]
    pub fn intervals(name: &str, mark: Mark, points: impl IntoIterator<Item = (f64, [f64; 3])>) -> Self {
        let mut out = Self { name: name.into(), mark: Some(mark), ..Self::default() };
        for (x, [y, low, high]) in points {
            out.x.push(x);
            out.y.push(y);
            out.low.push(low);
            out.high.push(high);
        }
        out
    }

    /// Its points, gaps too.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.x.iter().copied().zip(self.y.iter().copied())
    }

    /// Its intervals: abscissa, lower and upper end, gaps too.
    pub fn ends(&self) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        self.x.iter().zip(&self.low).zip(&self.high).map(|((x, low), high)| (*x, *low, *high))
    }
}

/// One chart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Chart {
    /// What it shows; also its text alternative.
    pub title: String,
    /// How.
    pub mark: Mark,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// Fixed x range in print; none: from the data.
    #[serde(skip)]
    pub x_range: Option<(f64, f64)>,
    /// Fixed y range in print; none: from the data.
    #[serde(skip)]
    pub y_range: Option<(f64, f64)>,
    /// As long along one axis as along the other: a chart of places.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub equal: bool,
    /// Series in drawing order.
    pub series: Vec<Series>,
    /// Names of the rows of a chart over categories.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub categories: Vec<String>,
    /// What stands at the end of each row, if not its value.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
    /// Charts of one group share cursor and zoom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// The group over time that a chart of something else follows: the moment pointed at there is ringed here.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clock: Option<String>,
    /// Moments of the points of the first series, or of the places of a map.
    #[serde(serialize_with = "short::long", skip_serializing_if = "Vec::is_empty")]
    pub at: Vec<f64>,
    /// Where on the axes of a map each moment is.
    #[serde(rename = "where", serialize_with = "short::columns", skip_serializing_if = "Vec::is_empty")]
    pub places: Vec<Vec<f64>>,
}

impl Chart {
    /// A chart without series.
    #[must_use]
    pub fn new(title: &str, mark: Mark, x: impl Into<Axis>, y: impl Into<Axis>) -> Self {
        Self {
            title: title.into(),
            mark,
            x: x.into(),
            y: y.into(),
            x_range: None,
            y_range: None,
            equal: false,
            series: Vec::new(),
            categories: Vec::new(),
            labels: Vec::new(),
            group: None,
            clock: None,
            at: Vec::new(),
            places: Vec::new(),
        }
    }

    /// A chart of lines without series.
    #[must_use]
    pub fn lines(title: &str, x: impl Into<Axis>, y: impl Into<Axis>) -> Self {
        Self::new(title, Mark::Line, x, y)
    }

    /// With one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// With one more series of points, drawn in a way of its own; points that are not finite are gaps.
    #[must_use]
    pub fn plus(self, name: &str, mark: Mark, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (x, y) = points.into_iter().unzip();
        self.with(Series { name: name.into(), mark: Some(mark), x, y, ..Series::default() })
    }

    /// With fixed ranges in print.
    #[must_use]
    pub fn within(mut self, x: Option<(f64, f64)>, y: Option<(f64, f64)>) -> Self {
        (self.x_range, self.y_range) = (x, y);
        self
    }

    /// In a group that shares cursor and zoom.
    #[must_use]
    pub fn grouped(mut self, group: &str) -> Self {
        self.group = Some(group.into());
        self
    }

    /// On the clock of a group: `at` are the moments of the points, `places` of a map where they are on its axes.
    #[must_use]
    pub fn following(mut self, group: &str, at: Vec<f64>, places: Vec<Vec<f64>>) -> Self {
        // A series that was thinned has lost which point is which moment.
        if self.mark == Mark::Map || self.series.first().is_some_and(|s| s.x.len() == at.len()) {
            (self.clock, self.at, self.places) = (Some(group.into()), at, places);
        }
        self
    }

    /// Bars over named categories, with intervals where `low` and `high` are given.
    #[must_use]
    pub fn bars(title: &str, y: Axis, categories: Vec<String>, name: &str, values: &[f64], low: &[f64], high: &[f64]) -> Self {
        let x = (0..values.len()).map(|i| i as f64).collect();
        let series = Series { name: name.into(), x, y: values.into(), low: low.into(), high: high.into(), ..Series::default() };
        Self { categories, ..Self::new(title, Mark::Bar, Axis::default(), y) }.with(series)
    }

    /// With every series in the order of x, and thinned to what a screen can show.
    #[must_use]
    pub fn thinned(mut self) -> Self {
        for s in &mut self.series {
            let mut points: Vec<(f64, f64)> = s.points().collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (x, y): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
            (s.x, s.y) = thin(&x, &y, 2400);
        }
        self
    }

    /// How a series of it is drawn.
    #[must_use]
    pub fn mark_of(&self, series: &Series) -> Mark {
        series.mark.unwrap_or(self.mark)
    }

    /// All finite ordinates, ends of intervals too.
    pub(super) fn ordinates(&self) -> Vec<f64> {
        let of = |s: &Series| -> Vec<f64> {
            let middle = if self.mark_of(s) == Mark::Band { &[][..] } else { &s.y[..] };
            middle.iter().chain(&s.low).chain(&s.high).copied().filter(|v| v.is_finite()).collect()
        };
        self.series.iter().flat_map(of).collect()
    }

    /// The numbers as csv: series, x, y, and the ends of the intervals where there are any; the axes' names are in the header.
    #[must_use]
    pub fn csv(&self) -> String {
        let clean = |s: &str| s.replace(',', ";");
        let [x, y] = [&self.x, &self.y].map(Axis::column);
        let ends = self.series.iter().any(|s| !s.low.is_empty());
        let head = if self.categories.is_empty() { x } else { "row".into() };
        let mut out = format!("series,{head},{y}{}\n", if ends { ",low,high" } else { "" });
        let number = |v: Option<&f64>| v.filter(|v| v.is_finite()).map_or_else(String::new, f64::to_string);
        for s in &self.series {
            for (i, (x, y)) in s.points().enumerate() {
                let row = self.categories.get(i).map_or_else(|| x.to_string(), |name| clean(name));
                let ends = if ends { format!(",{},{}", number(s.low.get(i)), number(s.high.get(i))) } else { String::new() };
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{},{row},{y}{ends}", clean(&s.name));
            }
        }
        out
    }

    /// The numbers as JSON; what is not finite is null.
    #[must_use]
    pub fn json(&self) -> Value {
        let series = |s: &Series| {
            let mut out = json!({"name": s.name, "x": s.x, "y": s.y});
            if !s.low.is_empty() {
                (out["low"], out["high"]) = (json!(s.low), json!(s.high));
            }
            out
        };
        let mut out = json!({"title": self.title, "x": self.x.text(), "y": self.y.text(), "series": self.series.iter().map(series).collect::<Vec<_>>()});
        if !self.categories.is_empty() {
            (out["rows"], out["labels"]) = (json!(self.categories), json!(self.labels));
        }
        out
    }
}

/// Range of values that shows all but spikes: where the outermost hundredth at an end would take more of the axis than all others, it
/// is left beyond the edge.
#[must_use]
pub fn robust_range(values: &[f64]) -> Option<(f64, f64)> {
    /// Fewest values of which an outermost one may be a spike.
    const FEWEST: usize = 50;
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if low > high || values.len() < FEWEST {
        return (low <= high).then_some((low, high));
    }
    let ends = [0.01, 0.99].map(|q| quantile(values, q));
    let inner = ends[1] - ends[0];
    let (below, above) = (inner > 0.0 && ends[0] - low > inner, inner > 0.0 && high - ends[1] > inner);
    Some((if below { ends[0] - 0.1 * inner } else { low }, if above { ends[1] + 0.1 * inner } else { high }))
}

/// Means of values over a grid of two others, all but their outermost hundredths: places along x and along y, values, in so many cells.
#[must_use]
pub fn map_of_means([x, y, value]: [&[f64]; 3], (nx, ny): (usize, usize)) -> Series {
    let there: Vec<[f64; 3]> =
        x.iter().zip(y).zip(value).map(|((x, y), v)| [*x, *y, *v]).filter(|p| p.iter().all(|v| v.is_finite())).collect();
    let ends = |k: usize| [0.01, 0.99].map(|q| quantile(&there.iter().map(|p| p[k]).collect::<Vec<_>>(), q));
    let ([x0, x1], [y0, y1]) = (ends(0), ends(1));
    let mut sums = vec![(0.0, 0u32); nx * ny];
    for [x, y, v] in there {
        let (i, j) = (((x - x0) / (x1 - x0) * nx as f64).floor(), ((y - y0) / (y1 - y0) * ny as f64).floor());
        if (0.0..nx as f64).contains(&i) && (0.0..ny as f64).contains(&j) {
            let cell = &mut sums[j as usize * nx + i as usize];
            *cell = (cell.0 + v, cell.1 + 1);
        }
    }
    let centre = |low: f64, high: f64, n: usize| (0..n).map(|i| low + (high - low) * (i as f64 + 0.5) / n as f64).collect();
    let z = sums.iter().map(|(s, n)| if *n > 0 { s / f64::from(*n) } else { f64::NAN }).collect();
    Series { name: "cm/s".into(), x: centre(x0, x1, nx), y: centre(y0, y1, ny), z, ..Series::default() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_counts_shares() {
        let h = histogram(&[0.1, 0.2, 0.7, 5.0, f64::NAN], 0.0, 1.0, 2);
        assert_eq!(h, vec![(0.25, 0.5), (0.75, 0.25)]);
    }

    #[test]
    fn regress_one_spike_does_not_flatten_a_plot() {
        let mut values: Vec<f64> = (0..200).map(|i| f64::from(i % 20)).collect();
        assert_eq!(robust_range(&values), Some((0.0, 19.0)));
        values[7] = 900.0;
        let (low, high) = robust_range(&values).expect("a range");
        assert!(low == 0.0 && (19.0..25.0).contains(&high), "{low} to {high}");
        // Few values, and two states that are both often there, are all shown.
        assert_eq!(robust_range(&[1.0, 2.0, 900.0]), Some((1.0, 900.0)));
        values.iter_mut().skip(150).for_each(|v| *v += 500.0);
        assert!(robust_range(&values).is_some_and(|r| r.1 > 515.0));
        assert_eq!(robust_range(&[]), None);
    }
}
