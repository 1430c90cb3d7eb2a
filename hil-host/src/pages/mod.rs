//! What a person sees: one self-contained HTML page, the same visual language
//! for every command and for the live workbench.
//!
//! A [`Page`] is plain data: four lines of answer, then sections of text,
//! tables and charts. It is written into the file as JSON; `page.js` draws it
//! with uPlot (MIT, 51 kB, vendored in `vendor/`, chosen because it draws
//! 100,000 points without a framework). The file opens without a network, in
//! light and dark, by keyboard, and prints.
//!
//! Long traces are thinned by [`thin`], which keeps each bucket's extremes, so
//! that a 3 h flight stays below 1 MB and no spike is lost.

pub mod control_scorecard;
pub mod diagnosis_scorecard;
pub mod effect_list;
pub mod fault_campaign;
pub mod figure;
pub mod flight_report;
pub mod places;
pub mod plots;
#[cfg(feature = "figures")]
mod printed;
pub mod real_scorecard;

use serde::Serialize;

mod thinning;
pub use thinning::thin;

/// Where the numbers come from; printed in the footer.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Provenance {
    /// The command line.
    pub command: String,
    /// Version of this tool.
    pub version: String,
    /// Hash of the data read, hexadecimal; empty if none was read.
    pub data_hash: String,
    /// Seed of the random numbers, if any were used.
    pub seed: Option<u64>,
}

impl Provenance {
    /// Of this process: its command line and version.
    #[must_use]
    pub fn of_this_run() -> Self {
        let command = std::iter::once("glider".to_owned()).chain(std::env::args().skip(1)).collect::<Vec<_>>().join(" ");
        Self { command, version: env!("CARGO_PKG_VERSION").into(), ..Self::default() }
    }
}

/// A whole page.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Page {
    /// Heading.
    pub title: String,
    /// The first screen: label and sentence, at most four ("How wrong", "Where", "Why", "What next").
    pub answer: Vec<(String, String)>,
    /// The rest.
    pub sections: Vec<Section>,
    /// Footer.
    pub provenance: Provenance,
}

/// A headed part of the page.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Section {
    /// Heading.
    pub title: String,
    /// What to look for, one or two sentences.
    pub lead: String,
    /// Content in order.
    pub items: Vec<Item>,
}

/// One thing in a section.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum Item {
    /// A paragraph.
    Text {
        /// Its text.
        text: String,
    },
    /// A table.
    Table(Table),
    /// A table with shaded cells.
    Heat(Heat),
    /// A chart.
    Chart(Chart),
}

/// A table; numbers are formatted by who makes it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Column heads with units.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<String>>,
}

/// A table whose cells are shaded by how remarkable they are, besides what they say: no meaning by colour alone.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Heat {
    /// What it shows.
    pub caption: String,
    /// Column heads with units.
    pub head: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<String>>,
    /// By cell: 0 to 1 from pale to strong (orange), negative: wrong (red), NaN: plain.
    #[serde(serialize_with = "short::rows")]
    pub shade: Vec<Vec<f64>>,
}

/// How a chart's series are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mark {
    /// Joined by lines.
    Line,
    /// Single points.
    Point,
    /// Bars over categories (`categories` of the chart), with optional intervals.
    Bar,
    /// Colour map: `x` and `y` are bin centres, `z` the values, row by row.
    Map,
}

/// One axis.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Axis {
    /// Quantity.
    pub label: String,
    /// Unit, empty for none.
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
}

/// One series.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
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
}

/// One chart.
#[derive(Clone, Debug, Serialize)]
pub struct Chart {
    /// What it shows; also its text alternative.
    pub title: String,
    /// How.
    pub mark: Mark,
    /// Abscissa.
    pub x: Axis,
    /// Ordinate.
    pub y: Axis,
    /// Series in drawing order.
    pub series: Vec<Series>,
    /// Names of the bars.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub categories: Vec<String>,
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
    pub fn new(title: &str, mark: Mark, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            mark,
            x,
            y,
            series: Vec::new(),
            categories: Vec::new(),
            group: None,
            clock: None,
            at: Vec::new(),
            places: Vec::new(),
        }
    }

    /// With one more series.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
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
        let series = Series { name: name.into(), x, y: values.into(), low: low.into(), high: high.into(), z: Vec::new() };
        Self { categories, ..Self::new(title, Mark::Bar, Axis::default(), y) }.with(series)
    }
}

impl From<Chart> for Item {
    fn from(chart: Chart) -> Self {
        Self::Chart(chart)
    }
}

impl From<Heat> for Item {
    fn from(table: Heat) -> Self {
        Self::Heat(table)
    }
}

impl From<Table> for Item {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

impl From<&str> for Item {
    fn from(text: &str) -> Self {
        Self::Text { text: text.into() }
    }
}

/// The style sheets and scripts that every page carries.
pub mod assets {
    /// uPlot 1.6.32.
    pub const UPLOT_JS: &str = include_str!("vendor/uPlot.iife.min.js");
    /// Its style.
    pub const UPLOT_CSS: &str = include_str!("vendor/uPlot.min.css");
    /// Our style.
    pub const PAGE_CSS: &str = include_str!("page.css");
    /// Our drawing.
    pub const PAGE_JS: &str = include_str!("page.js");
}

impl Page {
    /// The whole file.
    #[must_use]
    pub fn to_html(&self) -> String {
        // "</" would end the script element early, "<!--<script" swallow the next one; JSON reads "\u003c" as "<".
        let data = serde_json::to_string(self).unwrap_or_default().replace('<', "\\u003c");
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">\
             <link rel=\"icon\" href=\"data:,\"><title>{}</title>\n<style>{}</style>\n<style>{}</style></head>\n<body>\n\
             <main id=\"page\"><noscript>This report draws itself with JavaScript; the numbers are in the page source as JSON.</noscript></main>\n\
             <script type=\"application/json\" id=\"data\">{data}</script>\n<script>{}</script>\n<script>{}\nGlider.page(document.getElementById('page'), JSON.parse(document.getElementById('data').textContent));</script>\n\
             </body></html>\n",
            escape(&self.title),
            assets::UPLOT_CSS,
            assets::PAGE_CSS,
            assets::UPLOT_JS,
            assets::PAGE_JS,
        )
    }

    /// Writes the file; a half-written report never replaces a whole one.
    ///
    /// # Errors
    /// Names the file.
    pub fn write(&self, path: &std::path::Path) -> anyhow::Result<()> {
        use anyhow::Context;
        if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        rig::whole_file::write(path, self.to_html()).with_context(|| format!("cannot write {}", path.display()))
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Numbers as short as a screen needs: five significant digits, gaps as null.
mod short {
    use serde::{Serializer, ser::SerializeSeq};

    /// Two digits: a shade.
    pub fn rows<S: Serializer>(rows: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        let shade = |v: &f64| if v.is_finite() { Some((v * 100.0).round() / 100.0) } else { None };
        serializer.collect_seq(rows.iter().map(|row| row.iter().map(shade).collect::<Vec<_>>()))
    }

    /// Eight digits: a time axis must tell rows of a 30-day log apart.
    pub fn long<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        rounded(values, 8, serializer)
    }

    pub fn columns<S: Serializer>(columns: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        let short = |v: &f64| v.is_finite().then(|| (v * 1e4).round() / 1e4);
        serializer.collect_seq(columns.iter().map(|c| c.iter().map(short).collect::<Vec<_>>()))
    }

    pub fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        rounded(values, 5, serializer)
    }

    fn rounded<S: Serializer>(values: &[f64], digits: i32, serializer: S) -> Result<S::Ok, S::Error> {
        let mut seq = serializer.serialize_seq(Some(values.len()))?;
        for &v in values {
            if !v.is_finite() {
                seq.serialize_element(&None::<f64>)?;
                continue;
            }
            let places = if v == 0.0 { 0 } else { digits - v.abs().log10().ceil() as i32 };
            let scale = 10f64.powi(places.clamp(-12, 12));
            let rounded = (v * scale).round() / scale;
            if rounded == rounded.trunc() && rounded.abs() < 1e15 {
                seq.serialize_element(&(rounded as i64))?;
            } else {
                seq.serialize_element(&rounded)?;
            }
        }
        seq.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(n: usize) -> Page {
        let t: Vec<f64> = (0..n).map(|i| i as f64 * 4.0).collect();
        let d: Vec<f64> = t.iter().map(|t| 15.0 + 12.0 * (t / 60.0).sin()).collect();
        let mut page = Page { title: "A </script> & flight".into(), ..Page::default() };
        page.answer.push(("How wrong".into(), "</script><b>1.2 cm/s".into()));
        let chart = Chart::new("Depth", Mark::Line, Axis::new("time", "s"), Axis::new("depth", "m").down())
            .with(Series::new("measured", &t, &d))
            .grouped("time");
        page.sections.push(Section { title: "Traces".into(), lead: String::new(), items: vec![chart.into()] });
        page
    }

    #[test]
    fn text_cannot_break_out_of_the_page() {
        let html = sample(10).to_html();
        assert_eq!(html.matches("</script>").count(), 3, "only our own script elements end");
        assert!(html.contains("<title>A &lt;/script&gt; &amp; flight</title>"));
        // Nor swallow what comes behind it: as an element's text, not even an opening one may stand in the data.
        let html = Page { title: "d<!--<script>".into(), ..sample(10) }.to_html();
        let data = html.split("id=\"data\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("the data");
        assert!(!data.contains('<'), "{data}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(data).expect("JSON")["title"], "d<!--<script>");
    }

    #[test]
    fn the_page_asks_nothing_of_the_network() {
        let html = sample(10).to_html();
        for needle in ["src=\"http", "href=\"http", "@import", "url(http", "fetch(\"http"] {
            assert!(!html.contains(needle), "{needle}");
        }
    }

    #[test]
    fn a_day_of_ten_traces_stays_below_a_megabyte() {
        let mut page = sample(86_400);
        let one = page.sections[0].items[0].clone();
        page.sections[0].items = vec![one; 10];
        let bytes = page.to_html().len();
        assert!(bytes < 1_000_000, "{bytes} bytes");
    }

    #[test]
    fn numbers_keep_their_digits_and_gaps_are_null() {
        let values = vec![1.0 / 3.0, 2_591_999.04, 0.0, f64::NAN];
        let s = Series { x: values.clone(), y: values, ..Series::default() };
        let json = serde_json::to_value(&s).expect("a series is JSON");
        assert_eq!(json["x"], serde_json::json!([0.333_333_33, 2_591_999, 0, null]));
        assert_eq!(json["y"], serde_json::json!([0.333_33, 2_592_000, 0, null]));
    }
}
