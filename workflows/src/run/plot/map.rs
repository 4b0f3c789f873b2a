//! The picture of a quantity on the mesh: the body, its elements, a bar that says what the colours mean.

use std::sync::Arc;

use solver_fem::problem::Problem;

use super::cells::Cell;
use super::quantity::Scale;
use crate::plot::{
    Anchor, Colour, Paint, Range, Scene, Text, colourmap, labels,
    palette::{GREY, INK},
    ticks,
};

/// The largest body that is drawn, width and height.
const LARGEST: [f64; 2] = [560.0, 560.0];
const MARGIN: f64 = 26.0;
/// Room above the body for the title.
const HEAD: f64 = 66.0;
/// The bar of colours: distance from the body, width, greatest height.
const BAR: [f64; 3] = [30.0, 15.0, 300.0];
/// Room on the right of the bar for numbers and the label.
const BESIDE: f64 = 84.0;
/// The least width of a picture: titles need it.
const LEAST_WIDTH: f64 = 430.0;
/// Pieces that a side with a node in its middle is drawn in.
const PIECES: usize = 6;
/// The shortest mean side of an element, in units of the picture, for which the elements are outlined.
const SHOWN_SIDE: f64 = 5.0;
/// What has no value: elements without grains.
const NOTHING: Colour = "#e3e3e3";

/// What is written on a map.
pub struct Words {
    /// The run and its step.
    pub title: String,
    /// Stage, loads, deformation.
    pub subtitle: String,
    /// What the colours mean.
    pub label: String,
}

/// From the coordinates of the mesh to those of the picture.
pub struct Frame {
    low: [f64; 2],
    size: [f64; 2],
    scale: f64,
}

impl Frame {
    /// The frame that holds the nodes at all of these positions (flat, node after node).
    pub fn around<'a>(positions: impl IntoIterator<Item = &'a [f64]>) -> Self {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for x in positions.into_iter().flat_map(|flat| flat.chunks_exact(2)) {
            for i in 0..2 {
                low[i] = low[i].min(x[i]);
                high[i] = high[i].max(x[i]);
            }
        }
        Self::between(low, high)
    }

    /// The frame from one corner to the opposite one.
    pub fn between(low: [f64; 2], high: [f64; 2]) -> Self {
        let size = [0, 1].map(|i| (high[i] - low[i]).max(1e-300));
        let scale = (LARGEST[0] / size[0]).min(LARGEST[1] / size[1]);
        Self { low, size, scale }
    }

    /// Whether what lies between these positions may be seen.
    pub fn shows(&self, positions: impl IntoIterator<Item = [f64; 2]>) -> bool {
        let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let (low, high) = positions.into_iter().fold(start, |(low, high), x| {
            (
                [low[0].min(x[0]), low[1].min(x[1])],
                [high[0].max(x[0]), high[1].max(x[1])],
            )
        });
        (0..2).all(|i| low[i] <= self.low[i] + self.size[i] && high[i] >= self.low[i])
    }

    /// Number of elements that it shows, with the nodes at `positions`.
    pub fn elements(&self, problem: &Problem<2>, positions: &[f64]) -> usize {
        let mesh = problem.mesh();
        let at = |node: &usize| [positions[2 * node], positions[2 * node + 1]];
        (0..mesh.element_count())
            .filter(|&element| self.shows(mesh.element(element).iter().map(at)))
            .count()
    }

    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            MARGIN + (x - self.low[0]) * self.scale,
            HEAD + (self.low[1] + self.size[1] - y) * self.scale,
        ]
    }

    /// Mean side of an element as drawn, for a mesh of so many.
    pub fn side(&self, elements: usize) -> f64 {
        (self.size[0] * self.size[1] / elements.max(1) as f64).sqrt() * self.scale
    }
}

/// The numbers that the colours span.
pub fn range(scale: Scale, least: f64, greatest: f64) -> Range {
    let (low, high) = match scale {
        Scale::FromZero => (0.0, greatest),
        Scale::Spread => (least, greatest),
        Scale::Signed => {
            let reach = least.abs().max(greatest.abs());
            (-reach, reach)
        }
    };
    // A constant field is no error; it is drawn in one colour.
    let span = (high - low)
        .max(1e-9 * high.abs().max(low.abs()))
        .max(1e-12);
    Range {
        low,
        high: low + span,
    }
}

/// The table of colours of a scale.
fn table(scale: Scale) -> &'static [Colour; 64] {
    match scale {
        Scale::Signed => &colourmap::DIVERGING,
        Scale::FromZero | Scale::Spread => &colourmap::SEQUENTIAL,
    }
}

/// The picture. `positions` are where the nodes are drawn; `initial`, where it is given, is outlined beside them.
pub fn draw(
    problem: &Arc<Problem<2>>,
    frame: &Frame,
    cells: &[Cell],
    positions: &[f64],
    initial: Option<&[f64]>,
    (scale, range): (Scale, Range),
    words: &Words,
) -> Scene {
    let [width, height] = frame.size.map(|length| length * frame.scale);
    let bar = height.clamp(140.0, BAR[2]);
    let page = [
        (MARGIN + width + BAR[0] + BAR[1] + BESIDE).max(LEAST_WIDTH),
        HEAD + height.max(bar) + MARGIN,
    ];
    let mut scene = Scene::new(page[0], page[1]);
    scene.text([MARGIN, 26.0], &Text::new(&words.title, 14.0));
    scene.text(
        [MARGIN, 45.0],
        &Text::new(&words.subtitle, 11.5).coloured(GREY),
    );
    // Half of the line around the body lies outside of it.
    let (corner, size) = ([MARGIN - 1.0, HEAD - 1.0], [width + 2.0, height + 2.0]);
    scene.clipped(corner, size, |scene| {
        if let Some(initial) = initial {
            let (outline, _) = sides(problem, frame, initial);
            scene.lines(&outline, &Paint::line(GREY, 0.8).dashed(4.0, 3.0));
        }
        paint(scene, frame, cells, (table(scale), &range));
        let (outline, inner) = sides(problem, frame, positions);
        if frame.side(frame.elements(problem, positions)) >= SHOWN_SIDE {
            scene.group("elements", 0.28, |scene| {
                scene.lines(&inner, &Paint::line(INK, 0.45));
            });
        }
        scene.lines(&outline, &Paint::line(INK, 1.0));
    });
    let corner = [MARGIN + width + BAR[0], HEAD];
    draw_bar(
        &mut scene,
        corner,
        bar,
        (table(scale), &range),
        &words.label,
    );
    scene
}

/// All cells, those of one colour as one shape.
fn paint(
    scene: &mut Scene,
    frame: &Frame,
    cells: &[Cell],
    (table, range): (&'static [Colour; 64], &Range),
) {
    let mut levels: Vec<Vec<Vec<[f64; 2]>>> = vec![Vec::new(); table.len() + 1];
    for cell in cells {
        let level = match cell.value.is_finite() {
            true => colourmap::level((cell.value - range.low) / (range.high - range.low)),
            false => table.len(),
        };
        let corners = cell.corners.iter().map(|x| frame.place(*x));
        levels[level].push(corners.collect());
    }
    for (level, shapes) in levels.iter().enumerate() {
        let colour = table.get(level).copied().unwrap_or(NOTHING);
        scene.tiles(shapes, colour);
    }
}

/// A line through points of the picture.
type Polyline = Vec<[f64; 2]>;

/// The sides of the elements as lines: those of one element, which outline the body, and the others.
fn sides(problem: &Problem<2>, frame: &Frame, positions: &[f64]) -> (Vec<Polyline>, Vec<Polyline>) {
    let (mesh, element) = (problem.mesh(), problem.element());
    let (mut outline, mut inner) = (Vec::new(), Vec::new());
    for users in mesh.sides(element).values() {
        let Some(facet) = users.first() else { continue };
        let nodes = mesh.element(facet.element);
        let at = |local: usize| [0, 1].map(|i| positions[2 * nodes[local] + i]);
        let line: Polyline = match *element.facet_nodes(facet.local) {
            [a, b, c] => (0..=PIECES)
                .map(|k| {
                    let s = 2.0 * k as f64 / PIECES as f64 - 1.0;
                    let shape = solver_fem::element::Line3::shape(s);
                    let (a, b, c) = (at(a), at(b), at(c));
                    [0, 1].map(|i| shape[0] * a[i] + shape[1] * b[i] + shape[2] * c[i])
                })
                .map(|x| frame.place(x))
                .collect(),
            ref ends => ends.iter().map(|&a| frame.place(at(a))).collect(),
        };
        if users.len() == 1 {
            outline.push(line);
        } else {
            inner.push(line);
        }
    }
    (outline, inner)
}

/// The bar of colours with its ticks and its label.
fn draw_bar(
    scene: &mut Scene,
    [x, y]: [f64; 2],
    height: f64,
    (table, range): (&'static [Colour; 64], &Range),
    label: &str,
) {
    let step = height / table.len() as f64;
    for (level, &colour) in table.iter().enumerate() {
        let bottom = y + height - level as f64 * step;
        // A little overlap, so that no light shines through.
        let top = (bottom - step - 0.4).max(y);
        let shape = vec![
            [x, bottom],
            [x + BAR[1], bottom],
            [x + BAR[1], top],
            [x, top],
        ];
        scene.polygon(&shape, &Paint::fill(colour));
    }
    let right = x + BAR[1];
    scene.polygon(
        &[[x, y], [right, y], [right, y + height], [x, y + height]],
        &Paint::line(INK, 0.8),
    );
    let marks = ticks(range.low, range.high, (height / 38.0) as usize);
    let mut widest = 0;
    for (mark, text) in marks.iter().zip(labels(&marks)) {
        let at = y + height * (1.0 - (mark - range.low) / (range.high - range.low));
        scene.line([right, at], [right + 4.0, at], &Paint::line(INK, 0.8));
        scene.text([right + 8.0, at + 4.2], &Text::new(&text, 11.5));
        widest = widest.max(text.chars().count());
    }
    let text = Text::new(label, 12.5).anchored(Anchor::Middle).turned(90.0);
    let clear = 24.0 + 7.2 * widest as f64;
    scene.text([right + clear, y + 0.5 * height], &text);
}
