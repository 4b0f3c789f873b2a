//! A scene: shapes and labels in picture coordinates, x to the right and y down, one unit 1/96 inch.

use std::fmt::Write as _;

use super::label::{escape, spans};
use super::palette::{Colour, INK};

/// What every text is set in; DejaVu Sans is built in for PNG, the others are its nearest relatives elsewhere.
const FONTS: &str = "DejaVu Sans, Verdana, sans-serif";

/// How a shape is painted. Nothing is painted unless it is asked for.
#[derive(Clone, Copy, Debug, Default)]
pub struct Paint {
    /// Colour of the inside.
    pub fill: Option<Colour>,
    /// Opacity of the inside, 1 where it is not given.
    pub fill_opacity: Option<f64>,
    /// Colour and width of the line.
    pub line: Option<(Colour, f64)>,
    /// Lengths of dashes and gaps.
    pub dashes: Option<[f64; 2]>,
}

impl Paint {
    /// The inside alone.
    pub fn fill(colour: Colour) -> Self {
        Self {
            fill: Some(colour),
            ..Self::default()
        }
    }

    /// The line alone.
    pub fn line(colour: Colour, width: f64) -> Self {
        Self {
            line: Some((colour, width)),
            ..Self::default()
        }
    }

    /// With a line as well.
    pub fn outlined(self, colour: Colour, width: f64) -> Self {
        Self {
            line: Some((colour, width)),
            ..self
        }
    }

    /// With its line dashed.
    pub fn dashed(self, dash: f64, gap: f64) -> Self {
        Self {
            dashes: Some([dash, gap]),
            ..self
        }
    }

    /// With its inside this opaque.
    pub fn translucent(self, opacity: f64) -> Self {
        Self {
            fill_opacity: Some(opacity),
            ..self
        }
    }

    fn attributes(&self) -> String {
        let mut text = format!(r#" fill="{}""#, self.fill.unwrap_or("none"));
        if let Some(opacity) = self.fill_opacity {
            write!(text, r#" fill-opacity="{opacity:.2}""#).expect("a String takes everything");
        }
        if let Some((colour, width)) = self.line {
            write!(text, r#" stroke="{colour}" stroke-width="{width:.2}""#)
                .expect("a String takes everything");
        }
        if let Some([dash, gap]) = self.dashes {
            write!(text, r#" stroke-dasharray="{dash:.2} {gap:.2}""#)
                .expect("a String takes everything");
        }
        text
    }
}

/// Which point of a text stands at its position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    #[default]
    Start,
    /// Its middle.
    Middle,
    /// Its right end.
    End,
}

/// A line of text.
#[derive(Clone, Copy, Debug)]
pub struct Text<'a> {
    /// With `*italics*` and `_{subscripts}`.
    pub label: &'a str,
    /// Height of the letters.
    pub size: f64,
    /// What stands at the position.
    pub anchor: Anchor,
    /// Its colour.
    pub colour: Colour,
    /// Degrees by which it is turned to the left about its position.
    pub turned: f64,
}

impl<'a> Text<'a> {
    /// Dark text that begins at its position.
    pub fn new(label: &'a str, size: f64) -> Self {
        Self {
            label,
            size,
            anchor: Anchor::Start,
            colour: INK,
            turned: 0.0,
        }
    }

    /// Anchored there.
    pub fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// In this colour.
    pub fn coloured(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    /// Turned to the left by `degrees`.
    pub fn turned(self, degrees: f64) -> Self {
        Self {
            turned: degrees,
            ..self
        }
    }
}

/// Shapes and labels, the later ones above the earlier ones.
#[derive(Clone, Debug)]
pub struct Scene {
    width: f64,
    height: f64,
    body: String,
    clips: usize,
}

impl Scene {
    /// An empty scene of this size.
    pub fn new(width: f64, height: f64) -> Self {
        Self {
            width,
            height,
            body: String::new(),
            clips: 0,
        }
    }

    /// A disc.
    pub fn circle(&mut self, centre: [f64; 2], radius: f64, paint: &Paint) {
        let [x, y] = centre;
        self.add(format_args!(
            r#"<circle cx="{x:.2}" cy="{y:.2}" r="{radius:.2}"{}/>"#,
            paint.attributes()
        ));
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], paint: &Paint) {
        self.add(format_args!(
            r#"<line x1="{:.2}" y1="{:.2}" x2="{:.2}" y2="{:.2}"{}/>"#,
            from[0],
            from[1],
            to[0],
            to[1],
            paint.attributes()
        ));
    }

    /// A thick line with round ends, so that several meet in a point.
    pub fn bar(&mut self, from: [f64; 2], to: [f64; 2], colour: Colour, width: f64) {
        self.add(format_args!(
            r#"<line x1="{:.2}" y1="{:.2}" x2="{:.2}" y2="{:.2}" stroke="{colour}" stroke-width="{width:.2}" stroke-linecap="round"/>"#,
            from[0], from[1], to[0], to[1],
        ));
    }

    /// A line through points.
    pub fn polyline(&mut self, points: &[[f64; 2]], paint: &Paint) {
        self.points("polyline", points, paint);
    }

    /// A closed line through points.
    pub fn polygon(&mut self, points: &[[f64; 2]], paint: &Paint) {
        self.points("polygon", points, paint);
    }

    fn points(&mut self, shape: &str, points: &[[f64; 2]], paint: &Paint) {
        let text: Vec<String> = points
            .iter()
            .map(|[x, y]| format!("{x:.2},{y:.2}"))
            .collect();
        self.add(format_args!(
            r#"<{shape} points="{}"{} stroke-linejoin="round"/>"#,
            text.join(" "),
            paint.attributes()
        ));
    }

    /// Closed shapes of one colour that touch others: a thin line of the same colour closes the seams between them.
    pub fn tiles(&mut self, shapes: &[Vec<[f64; 2]>], colour: Colour) {
        self.path(shapes, "Z", &Paint::fill(colour).outlined(colour, 0.6));
    }

    /// Lines through points, all alike.
    pub fn lines(&mut self, lines: &[Vec<[f64; 2]>], paint: &Paint) {
        self.path(lines, "", paint);
    }

    /// Many shapes as one, so that a picture of many is no large file.
    fn path(&mut self, shapes: &[Vec<[f64; 2]>], end: &str, paint: &Paint) {
        if shapes.is_empty() {
            return;
        }
        let mut text = String::new();
        for shape in shapes {
            for (k, [x, y]) in shape.iter().enumerate() {
                let letter = if k == 0 { 'M' } else { 'L' };
                write!(text, "{letter}{x:.2} {y:.2}").expect("a String takes everything");
            }
            text.push_str(end);
        }
        self.add(format_args!(
            r#"<path d="{text}"{} stroke-linejoin="round" stroke-linecap="round"/>"#,
            paint.attributes()
        ));
    }

    /// A line of text.
    pub fn text(&mut self, at: [f64; 2], text: &Text<'_>) {
        let anchor = match text.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let [x, y] = at;
        let turn = if text.turned == 0.0 {
            String::new()
        } else {
            format!(r#" transform="rotate({:.2} {x:.2} {y:.2})""#, -text.turned)
        };
        self.add(format_args!(
            r#"<text x="{x:.2}" y="{y:.2}" font-size="{:.2}" fill="{}" text-anchor="{anchor}"{turn} xml:space="preserve">{}</text>"#,
            text.size,
            text.colour,
            spans(text.label, text.size)
        ));
    }

    /// What `draw` draws, as one group of this name and opacity.
    pub fn group(&mut self, name: &str, opacity: f64, draw: impl FnOnce(&mut Self)) {
        self.add(format_args!(
            r#"<g class="{}" opacity="{opacity:.2}">"#,
            escape(name)
        ));
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// What `draw` draws, cut off outside the rectangle from `corner` of this `size`.
    pub fn clipped(&mut self, corner: [f64; 2], size: [f64; 2], draw: impl FnOnce(&mut Self)) {
        self.clips += 1;
        let id = self.clips;
        let ([x, y], [width, height]) = (corner, size);
        self.add(format_args!(
            r#"<clipPath id="clip{id}"><rect x="{x:.2}" y="{y:.2}" width="{width:.2}" height="{height:.2}"/></clipPath><g clip-path="url(#clip{id})">"#
        ));
        draw(self);
        self.add(format_args!("</g>"));
    }

    /// The scene as an SVG document on white.
    pub fn to_svg(&self) -> String {
        let Self {
            width,
            height,
            body,
            ..
        } = self;
        format!(
            r##"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" font-family="{FONTS}">
<rect width="{width}" height="{height}" fill="#ffffff"/>
{body}</svg>
"##
        )
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.body
            .write_fmt(element)
            .expect("a String takes everything");
        self.body.push('\n');
    }
}
