//! A figure as a PDF page of its own size: vectors, for papers set with LaTeX.
//!
//! The SVG of a figure (paths, and letters as their outlines, so that no font is missing at the printer's) is read back by `usvg` and
//! written with `pdf-writer`, the typst project's own writer.

use std::collections::BTreeMap;

use anyhow::ensure;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Finish as _, Name, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::PathSegment;
use resvg::usvg::{FillRule, Group, LineCap, LineJoin, Node, Paint, Path, Transform, Tree};

/// Points of print in a px of 1/96 inch.
const PT: f32 = 72.0 / 96.0;

/// What is drawn, and which opacities (in thousandths) it names.
struct Drawing {
    content: Content,
    opacities: BTreeMap<u16, String>,
}

impl Drawing {
    fn group(&mut self, group: &Group, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        for node in group.children() {
            match node {
                Node::Group(inside) => self.group(inside, opacity),
                Node::Path(path) if path.is_visible() => self.path(path, opacity),
                Node::Text(text) => self.group(text.flattened(), opacity),
                // A figure holds no picture.
                Node::Path(_) | Node::Image(_) => {}
            }
        }
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        let flat =
            |paint: &Paint| if let Paint::Color(c) = paint { Some([c.red, c.green, c.blue].map(|v| f32::from(v) / 255.0)) } else { None };
        self.content.save_state();
        let Transform { sx, kx, ky, sy, tx, ty } = path.abs_transform();
        self.content.transform([sx, ky, kx, sy, tx, ty]);
        if let Some((fill, [r, g, b])) = path.fill().and_then(|f| Some((f, flat(f.paint())?))) {
            self.opacity(opacity * fill.opacity().get());
            self.content.set_fill_rgb(r, g, b);
            self.outline(path);
            match fill.rule() {
                FillRule::NonZero => self.content.fill_nonzero(),
                FillRule::EvenOdd => self.content.fill_even_odd(),
            };
        }
        if let Some((stroke, [r, g, b])) = path.stroke().and_then(|s| Some((s, flat(s.paint())?))) {
            self.opacity(opacity * stroke.opacity().get());
            self.content.set_stroke_rgb(r, g, b).set_line_width(stroke.width().get());
            self.content.set_line_cap(match stroke.linecap() {
                LineCap::Butt => LineCapStyle::ButtCap,
                LineCap::Round => LineCapStyle::RoundCap,
                LineCap::Square => LineCapStyle::ProjectingSquareCap,
            });
            self.content.set_line_join(match stroke.linejoin() {
                LineJoin::Round => LineJoinStyle::RoundJoin,
                LineJoin::Bevel => LineJoinStyle::BevelJoin,
                LineJoin::Miter | LineJoin::MiterClip => LineJoinStyle::MiterJoin,
            });
            self.content.set_dash_pattern(stroke.dasharray().unwrap_or_default().iter().copied(), stroke.dashoffset());
            self.outline(path);
            self.content.stroke();
        }
        self.content.restore_state();
    }

    fn opacity(&mut self, opacity: f32) {
        let thousandths = (opacity.clamp(0.0, 1.0) * 1000.0).round() as u16;
        let name = self.opacities.entry(thousandths).or_insert_with(|| format!("O{thousandths}"));
        self.content.set_parameters(Name(name.as_bytes()));
    }

    fn outline(&mut self, path: &Path) {
        let mut at = (0.0, 0.0);
        for segment in path.data().segments() {
            match segment {
                PathSegment::MoveTo(p) => drop(self.content.move_to(p.x, p.y)),
                PathSegment::LineTo(p) => drop(self.content.line_to(p.x, p.y)),
                PathSegment::QuadTo(c, p) => {
                    // The cubic of the same curve.
                    let third = |from: f32, to: f32| from + 2.0 / 3.0 * (to - from);
                    self.content.cubic_to(third(at.0, c.x), third(at.1, c.y), third(p.x, c.x), third(p.y, c.y), p.x, p.y);
                }
                PathSegment::CubicTo(c, d, p) => drop(self.content.cubic_to(c.x, c.y, d.x, d.y, p.x, p.y)),
                PathSegment::Close => drop(self.content.close_path()),
            }
            if let PathSegment::MoveTo(p) | PathSegment::LineTo(p) | PathSegment::QuadTo(_, p) | PathSegment::CubicTo(_, _, p) = segment {
                at = (p.x, p.y);
            }
        }
    }
}

/// One page as large as the picture.
///
/// # Errors
/// A picture that PDF readers cannot show: larger than 200 inches.
pub fn page(tree: &Tree, title: &str) -> anyhow::Result<Vec<u8>> {
    let (wide, high) = (tree.size().width() * PT, tree.size().height() * PT);
    ensure!(wide <= 14_400.0 && high <= 14_400.0, "a PDF page is at most 5 m wide and high");
    let mut drawing = Drawing { content: Content::new(), opacities: BTreeMap::new() };
    // SVG counts from the top.
    drawing.content.transform([PT, 0.0, 0.0, -PT, 0.0, high]);
    drawing.group(tree.root(), 1.0);
    let [catalog, pages, page, content, about] = [1, 2, 3, 4, 5].map(Ref::new);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let mut written = pdf.page(page);
    written.parent(pages).media_box(Rect::new(0.0, 0.0, wide, high)).contents(content);
    let mut resources = written.resources();
    let mut states = resources.ext_g_states();
    for (thousandths, name) in &drawing.opacities {
        let opacity = f32::from(*thousandths) / 1000.0;
        states
            .insert(Name(name.as_bytes()))
            .start::<pdf_writer::writers::ExtGraphicsState<'_>>()
            .non_stroking_alpha(opacity)
            .stroking_alpha(opacity);
    }
    states.finish();
    resources.finish();
    written.finish();
    pdf.stream(content, &drawing.content.finish());
    pdf.document_info(about).title(TextStr(title)).producer(TextStr("glider"));
    Ok(pdf.finish())
}
