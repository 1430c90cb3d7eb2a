//! Figures as PNG and PDF: the drawing of the SVG, in pixels or on a page of its own size.

use std::sync::Arc;

use anyhow::{Context as _, anyhow};
use resvg::{tiny_skia, usvg};

use crate::pages::figure::Figure;
use crate::pages::plots::Paper;

/// A px of a figure is 1/96 inch.
const PX_PER_INCH: f32 = 96.0;

/// Letters are Noto Sans, which the program carries: a figure is the same on every machine.
fn read_back(svg: &str) -> anyhow::Result<usvg::Tree> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(ttf_noto_sans::REGULAR.to_vec());
    fonts.set_sans_serif_family("Noto Sans");
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    usvg::Tree::from_str(svg, &options).context("reading back a figure")
}

impl Figure {
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
        let page = svg2pdf::PageOptions { dpi: PX_PER_INCH };
        let conversion = svg2pdf::ConversionOptions { compress: false, ..svg2pdf::ConversionOptions::default() };
        svg2pdf::to_pdf(&read_back(&self.svg(paper)?)?, conversion, page).map_err(|e| anyhow!("writing a PDF: {e}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pages::figure::tests::figure;
    use crate::pages::plots::PALETTE;

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
        // The line in its colour, and text as text of a font that lies in the file.
        assert!(text.contains("0 0.44705883 0.69803923 SCN"), "{text}");
        assert!(text.contains("/FontFile") && text.contains("/ToUnicode") && text.contains("NotoSans"), "{text}");
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }
}
