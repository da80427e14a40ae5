//! Drawing on a page. The only place that knows the plotting library: shapes go in, PNG bytes or SVG come out.

use kuva::backend::raster::RasterBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::color::Color;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor, TextSpan, build_path};

use crate::colour::Rgb;

/// Width of every page [px].
pub(super) const PAGE_WIDTH: f64 = 1600.0;
/// Room at the edges of a page [px].
pub(super) const MARGIN: f64 = 30.0;

/// A page could not be turned into a PNG.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a page to encode as PNG, found: {0}")]
pub struct EncodeError(String);

/// A place on the page, right and down from the upper left corner [px].
pub(super) type Point = (f64, f64);

/// An upright rectangle on the page [px].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

impl Rect {
    pub(super) fn right(&self) -> f64 {
        self.x + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.y + self.height
    }
}

/// A line's look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    pub colour: Rgb,
    pub width: f64,
    /// SVG dash pattern, e.g. "6 4"; empty = solid.
    pub dash: &'static str,
}

impl Stroke {
    pub(super) const fn solid(colour: Rgb, width: f64) -> Self {
        Self { colour, width, dash: "" }
    }
}

/// Where a text's anchor lies.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A text's look.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextStyle {
    pub size: u32,
    pub anchor: Anchor,
    pub weight: Weight,
    pub colour: Rgb,
}

/// How strong a text stands out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Weight {
    Regular,
    Bold,
}

impl TextStyle {
    pub(super) const fn new(size: u32, anchor: Anchor) -> Self {
        Self { size, anchor, weight: Weight::Regular, colour: Rgb::INK }
    }

    pub(super) const fn bold(self) -> Self {
        Self { weight: Weight::Bold, ..self }
    }

    pub(super) const fn coloured(self, colour: Rgb) -> Self {
        Self { colour, ..self }
    }
}

/// An image, row-major from the upper left corner.
#[derive(Clone, Debug)]
pub(super) struct Image {
    pub width: usize,
    pub pixels: Vec<Rgb>,
}

/// Where the line after so many others below the title stands [px].
pub(super) fn below_title(n_lines: u32) -> f64 {
    78.0 + 26.0 * f64::from(n_lines)
}

/// A white page that shapes are laid on, later ones over earlier ones.
pub(super) struct Canvas {
    scene: Scene,
}

impl Canvas {
    /// An empty page of a size [px].
    pub(super) fn blank(width: f64, height: f64) -> Self {
        Self { scene: Scene::new(width.round(), height.round()) }
    }

    /// A page of a height [px] with a title and lines below it; what else it shows begins at [`below_title`].
    pub(super) fn titled(height: f64, title: &str, lines: &[&str]) -> Self {
        let mut canvas = Self::blank(PAGE_WIDTH, height);
        canvas.text((MARGIN, 48.0), title, TextStyle::new(30, Anchor::Start).bold());
        let soft = TextStyle::new(18, Anchor::Start).coloured(Rgb::INK_SOFT);
        for (line, place) in lines.iter().zip(0..) {
            canvas.text((MARGIN, below_title(place)), line, soft);
        }
        canvas
    }

    /// An image, one of its pixels on one of the page's; (`x`, `y`) is its upper left corner.
    pub(super) fn image(&mut self, x: f64, y: f64, image: &Image) {
        let n = image.pixels.len();
        let place = |i: usize| ((i % image.width) as f64, (i / image.width) as f64);
        self.scene.add(Primitive::RectBatch {
            x: (0..n).map(|i| x.round() + place(i).0).collect(),
            y: (0..n).map(|i| y.round() + place(i).1).collect(),
            w: vec![1.0; n],
            h: vec![1.0; n],
            fills: image.pixels.iter().map(|&pixel| pixel.into()).collect(),
        });
    }

    /// A filled rectangle.
    pub(super) fn rect(&mut self, rect: Rect, fill: Rgb, opacity: f64) {
        self.scene.add(Primitive::Rect {
            x: rect.x,
            y: rect.y,
            width: rect.width,
            height: rect.height,
            fill: fill.into(),
            stroke: None,
            stroke_width: None,
            opacity: Some(opacity),
        });
    }

    /// The edge of a rectangle.
    pub(super) fn frame(&mut self, rect: Rect, stroke: Stroke) {
        let (right, bottom) = (rect.right(), rect.bottom());
        let corners =
            [(rect.x, rect.y), (right, rect.y), (right, bottom), (rect.x, bottom), (rect.x, rect.y)];
        self.polyline(&corners, stroke);
    }

    pub(super) fn line(&mut self, from: Point, to: Point, stroke: Stroke) {
        self.polyline(&[from, to], stroke);
    }

    pub(super) fn polyline(&mut self, points: &[Point], stroke: Stroke) {
        self.scene.add(Primitive::PolyLine {
            points: points.to_vec(),
            stroke: stroke.colour.into(),
            stroke_width: stroke.width,
            stroke_dasharray: (!stroke.dash.is_empty()).then(|| stroke.dash.to_owned()),
        });
    }

    /// A filled closed shape.
    pub(super) fn polygon(&mut self, points: &[Point], fill: Rgb, opacity: f64) {
        self.scene.add(Primitive::Path(Box::new(PathData {
            d: build_path(points) + " Z",
            fill: Some(fill.into()),
            stroke: Color::None,
            stroke_width: 0.0,
            opacity: Some(opacity),
            stroke_dasharray: None,
        })));
    }

    pub(super) fn circle(&mut self, centre: Point, radius: f64, fill: Rgb, outline: Stroke) {
        self.scene.add(Primitive::Circle {
            cx: centre.0,
            cy: centre.1,
            r: radius,
            fill: fill.into(),
            fill_opacity: None,
            stroke: Some(outline.colour.into()),
            stroke_width: Some(outline.width),
        });
    }

    /// A line of text with its baseline at `place`.
    pub(super) fn text(&mut self, place: Point, content: &str, style: TextStyle) {
        // Plain text of the library ignores weight in PNGs and reads mathematics into dollar signs; spans do not.
        let span = TextSpan {
            text: content.to_owned(),
            bold: style.weight == Weight::Bold,
            italic: false,
            underline: false,
            code: false,
            math: false,
        };
        self.scene.add(Primitive::RichText {
            x: place.0,
            y: place.1,
            spans: vec![span],
            size: style.size,
            anchor: match style.anchor {
                Anchor::Start => TextAnchor::Start,
                Anchor::Middle => TextAnchor::Middle,
                Anchor::End => TextAnchor::End,
            },
            color: Some(style.colour.into()),
        });
    }

    /// Text with a white rim, to be read on any ground.
    pub(super) fn rimmed_text(&mut self, place: Point, content: &str, style: TextStyle) {
        for step in 0..12 {
            let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 12.0).sin_cos();
            let rim = (place.0 + 2.5 * cos, place.1 + 2.5 * sin);
            self.text(rim, content, style.coloured(Rgb::WHITE));
        }
        self.text(place, content, style);
    }

    /// Draws what `draw` draws, but only inside the rectangle.
    pub(super) fn clipped(&mut self, inside: Rect, draw: impl FnOnce(&mut Self)) {
        let Rect { x, y, width, height } = inside;
        // A name of its own: of several shapes with the same a viewer takes the first.
        let id = format!("inside{}", self.scene.elements.len());
        // PNGs are clipped by the numbers, SVG by a shape that it defines before all others.
        self.scene.defs.push(format!(
            "<clipPath id=\"{id}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>"
        ));
        self.scene.add(Primitive::ClipStart { x, y, width, height, id });
        draw(self);
        self.scene.add(Primitive::ClipEnd);
    }

    /// The page as SVG.
    pub(super) fn svg(&self) -> String {
        SvgBackend::new().render_scene(&self.scene)
    }

    /// The page as a PNG file's bytes.
    pub(super) fn png(&self) -> Result<Vec<u8>, EncodeError> {
        RasterBackend::new().with_scale(1.0).render_scene(&self.scene).map_err(EncodeError)
    }
}

impl From<Rgb> for Color {
    fn from(colour: Rgb) -> Self {
        Self::Rgb(colour.0, colour.1, colour.2)
    }
}
