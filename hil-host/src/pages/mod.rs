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

pub mod answer_charts;
pub mod chart;
pub mod effect_list;
pub mod fault_campaign;
pub mod figure;
pub mod flight_report;
pub mod forecast_map;
pub mod places;
pub mod plots;
#[cfg(feature = "figures")]
mod printed;
pub mod timeline_document;
pub mod timeline_figure;
pub mod track_map;

use serde::Serialize;

mod short;
mod thinning;
pub use chart::{Axis, Chart, Mark, Series};
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
    /// The first screen: label and sentence, at most six ("How wrong", "Where", and the four parts of an answer).
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
// A page has a dozen of them: nothing is gained by a box.
#[allow(clippy::large_enum_variant)]
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
