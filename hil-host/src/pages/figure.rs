//! Charts below each other with one caption, as large as they are printed: SVG, PDF and PNG of the same drawing, csv and JSON of the same
//! numbers.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context as _, anyhow};
use plotters::prelude::*;
use serde_json::{Value, json};

use crate::pages::chart::Chart;
use crate::pages::plots::{Paper, units};

/// Charts below each other with one caption.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// From top to bottom.
    pub panels: Vec<Chart>,
    /// What it shows, for the reader of a paper; may be empty.
    pub caption: String,
}

/// Height of one line of a caption, px, and about how wide a letter is.
const CAPTION: (u32, f64) = (19, 7.03);

impl From<Chart> for Figure {
    fn from(chart: Chart) -> Self {
        Self { panels: vec![chart], caption: String::new() }
    }
}

impl Figure {
    fn caption_lines(&self, paper: &Paper) -> Vec<String> {
        let letters = ((f64::from(paper.px.0) - 40.0 * paper.letters) / (CAPTION.1 * paper.letters)) as usize;
        let mut lines: Vec<String> = Vec::new();
        for word in self.caption.split_whitespace() {
            match lines.last_mut() {
                Some(l) if l.chars().count() + 1 + word.chars().count() <= letters => {
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
    pub fn svg(&self, paper: &Paper) -> anyhow::Result<String> {
        let lines = self.caption_lines(paper);
        let charts: u32 = self.panels.iter().map(|c| units(c.height(paper))).sum();
        let step = paper.u(CAPTION.0);
        let foot = if lines.is_empty() { 0 } else { paper.u(14) + step * lines.len() as u32 };
        let (wide, high) = (units(paper.px.0), charts + foot);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (wide, high)).into_drawing_area();
            let said = |e: DrawingAreaErrorKind<std::io::Error>| anyhow!("drawing a figure: {e}");
            root.fill(&WHITE).map_err(said)?;
            let mut below = root.clone();
            for chart in &self.panels {
                let (area, rest) = below.split_vertically(units(chart.height(paper)));
                chart.draw(&area, paper)?;
                below = rest;
            }
            let style = ("sans-serif", paper.u(15)).into_text_style(&root);
            for (y, line) in (charts..).step_by(step.max(1) as usize).zip(&lines) {
                root.draw_text(line, &style, (paper.i(20), y as i32)).map_err(said)?;
            }
            root.present().map_err(said)?;
        }
        // As large as meant, in the units it was drawn in.
        let drawn = format!("width=\"{wide}\" height=\"{high}\"");
        let over = f64::from(units(1));
        let meant = match paper.width_mm {
            Some(mm) => format!("width=\"{mm}mm\" height=\"{:.3}mm\"", mm * f64::from(high) / f64::from(wide)),
            None => format!("width=\"{}\" height=\"{}\"", f64::from(wide) / over, f64::from(high) / over),
        };
        Ok(text.replacen(&drawn, &meant, 1))
    }

    /// The numbers as csv: of one panel as [`Chart::csv`], of several with a column for the panel.
    #[must_use]
    pub fn csv(&self) -> String {
        if let [only] = self.panels.as_slice() {
            return only.csv();
        }
        let mut out = String::from("panel,series,x,y\n");
        for chart in &self.panels {
            let panel = format!("{}: {} over {}", chart.title, chart.y.text(), chart.x.text()).replace(", ", " in ").replace(',', ";");
            for line in chart.csv().lines().skip(1) {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "{panel},{line}");
            }
        }
        out
    }

    /// The numbers as JSON: of a chart alone as [`Chart::json`].
    #[must_use]
    pub fn json(&self) -> Value {
        if let ([only], true) = (self.panels.as_slice(), self.caption.is_empty()) {
            return only.json();
        }
        json!({"caption": self.caption, "panels": self.panels.iter().map(Chart::json).collect::<Vec<_>>()})
    }

    /// Writes `stem`.svg, .png, .csv and .json into a folder, which is made if it is not there.
    ///
    /// # Errors
    /// The folder or a file cannot be written.
    pub fn write(&self, folder: &Path, stem: &str) -> anyhow::Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let png = cfg!(feature = "figures").then_some("png");
        for ending in ["svg", "csv", "json"].into_iter().chain(png) {
            let path = folder.join(format!("{stem}.{ending}"));
            rig::whole_file::write(&path, self.bytes(ending, &Paper::SCREEN)?).with_context(|| path.display().to_string())?;
        }
        Ok(())
    }

    /// The figure in the format that a file's ending names: svg, pdf, png, csv or json.
    ///
    /// # Errors
    /// What the drawing library said, or another ending.
    pub fn bytes(&self, ending: &str, paper: &Paper) -> anyhow::Result<Vec<u8>> {
        Ok(match ending {
            "svg" => self.svg(paper)?.into(),
            #[cfg(feature = "figures")]
            "pdf" => self.pdf(paper)?,
            #[cfg(feature = "figures")]
            "png" => self.png(paper)?,
            #[cfg(not(feature = "figures"))]
            "pdf" | "png" => anyhow::bail!("this build draws no .{ending}, it lacks the feature `figures`; name a file that ends in .svg"),
            "csv" => self.csv().into(),
            "json" => format!("{:#}\n", self.json()).into_bytes(),
            other => anyhow::bail!("cannot write .{other}; name a file that ends in .svg, .pdf, .png, .csv or .json"),
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::pages::chart::{Mark, histogram};

    #[test]
    fn a_chart_names_its_axes_series_and_survives_gaps() {
        let c = Chart::lines("T", "angle of attack, deg", "L/D, 1")
            .plus("a & b", Mark::Line, [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)])
            .plus("points", Mark::Point, [(0.0, 1.0)])
            .plus("bars", Mark::Bar, histogram(&[0.1, 0.2, 0.7], 0.0, 1.0, 2));
        let svg = Figure::from(c.clone()).svg(&Paper::SCREEN).unwrap();
        for want in ["<svg", "angle of attack, deg", "L/D, 1", "points", "a &amp; b"] {
            assert!(svg.contains(want), "{want}");
        }
        assert!(!svg.contains("NaN"));
        assert!(svg.contains("width=\"800\" height=\"520\" viewBox=\"0 0 3200 2080\""), "{}", &svg[..200]);
        assert!(c.csv().starts_with("series,angle of attack in deg,L/D in 1\na & b,0,1\n"));
        assert!(c.json()["series"][0]["y"][1].is_null());
        assert!(Figure::from(Chart::lines("empty", "x", "y")).svg(&Paper::SCREEN).unwrap().contains("</svg>"));
    }

    #[test]
    fn a_figure_has_its_caption_and_every_panel() {
        let panel = |t: &str| Chart::lines(t, "time, s", "depth, m").plus("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)]);
        let caption = "word ".repeat(40);
        let f = Figure { panels: vec![panel("upper"), panel("lower").within(None, Some((3.0, 0.0)))], caption };
        let svg = f.svg(&Paper::SCREEN).unwrap();
        assert!(svg.contains("upper") && svg.contains("lower") && svg.contains("word word"), "{svg}");
        assert_eq!(f.caption_lines(&Paper::SCREEN).len(), 2);
        assert_eq!(f.csv().lines().count(), 5);
        assert_eq!(f.json()["panels"][1]["title"], "lower");
    }

    pub(in crate::pages) fn figure(title: &str) -> Figure {
        let lines = Chart::lines(title, "α, deg", "L/D, 1").plus("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)]);
        Figure { panels: vec![lines.plus("b", Mark::Point, [(0.0, 1.5), (1.0, 1.5)])], caption: "One line.".into() }
    }

    #[test]
    fn letters_in_print_are_seven_points_at_any_width() {
        for width_mm in [60.0, 84.0, 174.0] {
            let paper = Paper::printed(width_mm, None);
            let svg = figure("Title").svg(&paper).unwrap();
            assert!(svg.contains(&format!("width=\"{width_mm}mm\"")), "{}", &svg[..160]);
            let sizes = svg.split("font-size=\"").skip(1).filter_map(|s| s.split('"').next()?.parse::<f64>().ok());
            let points = sizes.fold(f64::INFINITY, f64::min) / f64::from(units(1)) * 72.0 / 96.0;
            assert!((6.9..7.2).contains(&points), "{points}");
        }
    }
}
