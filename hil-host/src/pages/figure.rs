//! Charts below each other with one caption, as large as they are printed: SVG, PDF and PNG of the same drawing, csv and JSON of the same
//! numbers.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, anyhow};
use plotters::prelude::*;
use resvg::{tiny_skia, usvg};
use serde_json::{Value, json};

use crate::pages::pdf;
use crate::pages::plots::{Chart, Paper, units};

/// Letters are Noto Sans, which the program carries: a figure is the same on every machine.
fn read_back(svg: &str) -> anyhow::Result<usvg::Tree> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(ttf_noto_sans::REGULAR.to_vec());
    fonts.set_sans_serif_family("Noto Sans");
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).context("reading back a figure")
}

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
        let charts = units(paper.px.1) * self.panels.len() as u32;
        let step = paper.u(CAPTION.0);
        let foot = if lines.is_empty() { 0 } else { paper.u(14) + step * lines.len() as u32 };
        let (wide, high) = (units(paper.px.0), charts + foot);
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (wide, high)).into_drawing_area();
            let said = |e: DrawingAreaErrorKind<std::io::Error>| anyhow!("drawing a figure: {e}");
            root.fill(&WHITE).map_err(said)?;
            let (upper, _) = root.split_vertically(charts);
            for (chart, area) in self.panels.iter().zip(upper.split_evenly((self.panels.len().max(1), 1))) {
                chart.draw(&area, paper)?;
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

    /// The figure as PNG.
    ///
    /// # Errors
    /// What the drawing library said, or it does not fit into memory.
    pub fn png(&self, paper: &Paper) -> anyhow::Result<Vec<u8>> {
        let tree = read_back(&self.svg(paper)?)?;
        let size = tree.size().to_int_size().scale_by(paper.pixels).context("a figure without size")?;
        let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height()).context("a figure too large for memory")?;
        resvg::render(&tree, tiny_skia::Transform::from_scale(paper.pixels, paper.pixels), &mut pixels.as_mut());
        pixels.encode_png().context("encoding a PNG")
    }

    /// The figure as PDF, one page of its own size.
    ///
    /// # Errors
    /// What the drawing library said.
    pub fn pdf(&self, paper: &Paper) -> anyhow::Result<Vec<u8>> {
        let title: Vec<&str> = self.panels.iter().map(|c| c.title.as_str()).collect();
        pdf::page(&read_back(&self.svg(paper)?)?, &title.join("; "))
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
        for ending in ["svg", "png", "csv", "json"] {
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
            "pdf" => self.pdf(paper)?,
            "png" => self.png(paper)?,
            "csv" => self.csv().into(),
            "json" => format!("{:#}\n", self.json()).into_bytes(),
            other => anyhow::bail!("cannot write .{other}; name a file that ends in .svg, .pdf, .png, .csv or .json"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pages::plots::{Mark, PALETTE, histogram};

    #[test]
    fn a_chart_names_its_axes_series_and_survives_gaps() {
        let c = Chart::new("T", "angle of attack, deg", "L/D, 1")
            .with("a & b", Mark::Line, [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0)])
            .with("points", Mark::Points, [(0.0, 1.0)])
            .with("bars", Mark::Bars, histogram(&[0.1, 0.2, 0.7], 0.0, 1.0, 2));
        let svg = Figure::from(c.clone()).svg(&Paper::SCREEN).unwrap();
        for want in ["<svg", "angle of attack, deg", "L/D, 1", "points", "a &amp; b"] {
            assert!(svg.contains(want), "{want}");
        }
        assert!(!svg.contains("NaN"));
        assert!(svg.contains("width=\"800\" height=\"520\" viewBox=\"0 0 3200 2080\""), "{}", &svg[..200]);
        assert!(c.csv().starts_with("series,angle of attack in deg,L/D in 1\na & b,0,1\n"));
        assert!(c.json()["series"][0]["y"][1].is_null());
        assert!(Figure::from(Chart::new("empty", "x", "y")).svg(&Paper::SCREEN).unwrap().contains("</svg>"));
    }

    #[test]
    fn a_figure_has_its_caption_and_every_panel() {
        let panel = |t: &str| Chart::new(t, "time, s", "depth, m").with("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)]);
        let caption = "word ".repeat(40);
        let f = Figure { panels: vec![panel("upper"), panel("lower").within(None, Some((3.0, 0.0)))], caption };
        let svg = f.svg(&Paper::SCREEN).unwrap();
        assert!(svg.contains("upper") && svg.contains("lower") && svg.contains("word word"), "{svg}");
        assert_eq!(f.caption_lines(&Paper::SCREEN).len(), 2);
        assert_eq!(f.csv().lines().count(), 5);
        assert_eq!(f.json()["panels"][1]["title"], "lower");
    }

    fn figure(title: &str) -> Figure {
        let lines = Chart::new(title, "α, deg", "L/D, 1").with("a", Mark::Line, [(0.0, 1.0), (1.0, 2.0)]);
        Figure { panels: vec![lines.with("b", Mark::Points, [(0.0, 1.5), (1.0, 1.5)])], caption: "One line.".into() }
    }

    #[test]
    fn a_png_has_its_size_its_colours_and_its_letters() {
        let pixels = |title: &str, paper: &Paper| tiny_skia::Pixmap::decode_png(&figure(title).png(paper).unwrap()).unwrap();
        let p = pixels("Title", &Paper::SCREEN);
        assert_eq!((p.width(), p.height()), (3 * 800, 3 * (520 + 14 + 19)));
        let of = |(r, g, b): (u8, u8, u8)| p.pixels().iter().filter(|q| (q.red(), q.green(), q.blue()) == (r, g, b)).count();
        assert!(of(PALETTE[0]) > 1000, "the line in its colour");
        assert!(of((255, 255, 255)) > p.pixels().len() / 2, "white ground");
        let ink = |p: &tiny_skia::Pixmap| p.pixels().iter().filter(|q| q.red() < 64 && q.green() < 64 && q.blue() < 64).count();
        assert!(ink(&pixels("Titles of more letters", &Paper::SCREEN)) > ink(&p) + 500, "letters are drawn");
        // A column of 84 mm at 300 dpi.
        let column = pixels("Title", &Paper::printed(84.0, None));
        assert!(column.width().abs_diff(992) <= 2, "{}", column.width());
    }

    #[test]
    fn a_pdf_is_a_page_of_the_width_that_was_asked_for() {
        let text = String::from_utf8_lossy(&figure("Title").pdf(&Paper::printed(84.0, Some(60.0))).unwrap()).into_owned();
        assert!(text.starts_with("%PDF-") && text.trim_end().ends_with("%%EOF"), "{text:.60}");
        let page: Vec<f64> = text
            .split("/MediaBox")
            .nth(1)
            .and_then(|rest| rest.split_once('[')?.1.split(']').next())
            .unwrap_or_default()
            .split_whitespace()
            .filter_map(|n| n.parse().ok())
            .collect();
        // 84 mm are 238.1 points; the panel is 60 mm high, the caption a line below it.
        assert!(page.len() == 4 && (page[2] - 238.1).abs() < 0.6 && (170.0..195.0).contains(&page[3]), "{page:?}");
        // The line in its colour, the points half transparent, letters as outlines.
        assert!(text.contains("0 0.44705883 0.69803923 RG") && text.contains("/ca 0.6") && text.matches(" c\n").count() > 50, "{text}");
        assert!(!text.contains("NaN") && !text.contains("inf"));
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
