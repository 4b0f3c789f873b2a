//! The grains in their periodic cell and the forces between them.

use solver_dem::{anatomy::ContactForce, tensor::apply};

use super::Subject;
use crate::plot::{
    Paint, Scene,
    palette::{BLUE, Colour, GREY, INK, VERMILION, WHITE, YELLOW},
};

/// Width of a line that carries the mean normal force, over the mean diameter; and the widest, over that.
const MEAN_WIDTH: f64 = 0.14;
const WIDEST: f64 = 6.0;
/// Radius of the mark of a sliding contact, over the mean diameter.
const SLIDING_MARK: f64 = 0.1;
/// How far images are drawn around the cell, over the mean diameter, and how strongly.
const BORDER: f64 = 1.0;
const FAINT: f64 = 0.3;
/// A grain that carries load, and its outline.
pub const GRAIN: (Colour, Colour) = ("#e9e7e2", "#b3b0a8");

/// Draws the packing as large as fits into the rectangle from `corner` of the size `room`. Returns the width of the line
/// of a mean normal force.
pub fn draw(scene: &mut Scene, corner: [f64; 2], room: [f64; 2], subject: &Subject) -> f64 {
    let view = View::new(corner, room, subject);
    scene.clipped(corner, room, |scene| {
        scene.group("images", FAINT, |scene| {
            view.grains(scene, Part::Border);
            view.forces(scene, Part::Border);
        });
        scene.group("grains", 1.0, |scene| view.grains(scene, Part::Cell));
        scene.group("contacts", 1.0, |scene| view.forces(scene, Part::Cell));
        scene.group("sliding", 1.0, |scene| view.sliding(scene));
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|s| view.place(view.subject.rev.state.cell.translation(&s)));
        scene.polygon(&corners, &Paint::line(INK, 1.1).dashed(6.0, 3.0));
    });
    MEAN_WIDTH * view.diameter * view.scale
}

/// Where a thing is: once in the cell, and perhaps again around it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Cell,
    Border,
}

/// Lengths to picture coordinates.
struct View<'a> {
    subject: &'a Subject,
    /// Grain centres in [0, 1)², by grain number.
    scaled: Vec<[f64; 2]>,
    inverse: [[f64; 2]; 2],
    /// Width of the border in cell vectors.
    border: [f64; 2],
    diameter: f64,
    scale: f64,
    /// What is drawn in the middle, and where that is.
    middle: [f64; 2],
    centre: [f64; 2],
}

impl<'a> View<'a> {
    fn new(corner: [f64; 2], room: [f64; 2], subject: &'a Subject) -> Self {
        let rev = &subject.rev;
        let cell = &rev.state.cell;
        let diameter = rev.grains.mean_diameter();
        let inverse = cell
            .inverse()
            .expect("the forces were computed in this cell, which is not degenerate");
        let margin = BORDER * diameter;
        let mut extent = [0.0; 2];
        for k in 0..2 {
            let across: f64 = (0..2).map(|l| cell.h[k][l].abs()).sum();
            extent[k] = room[k] / (across + 2.0 * margin);
        }
        Self {
            subject,
            scaled: rev
                .state
                .positions
                .iter()
                .map(|x| apply(&inverse, x).map(|s| s - s.floor()))
                .collect(),
            inverse,
            border: cell.heights().map(|height| margin / height),
            diameter,
            scale: extent[0].min(extent[1]),
            middle: cell.translation(&[0.5, 0.5]),
            centre: [corner[0] + 0.5 * room[0], corner[1] + 0.5 * room[1]],
        }
    }

    fn place(&self, x: [f64; 2]) -> [f64; 2] {
        [
            self.centre[0] + self.scale * (x[0] - self.middle[0]),
            self.centre[1] - self.scale * (x[1] - self.middle[1]),
        ]
    }

    /// The images of what is at `s` that lie in this part.
    fn images(&self, s: [f64; 2], part: Part) -> impl Iterator<Item = [f64; 2]> {
        let border = self.border;
        (0..9)
            .map(move |k| [s[0] + f64::from(k % 3) - 1.0, s[1] + f64::from(k / 3) - 1.0])
            .filter(move |s| {
                let inside = s.iter().all(|s| (0.0..1.0).contains(s));
                let near = (0..2).all(|k| (-border[k]..=1.0 + border[k]).contains(&s[k]));
                match part {
                    Part::Cell => inside,
                    Part::Border => near && !inside,
                }
            })
    }

    fn grains(&self, scene: &mut Scene, part: Part) {
        let loads = &self.subject.anatomy.grains;
        let radii = &self.subject.rev.grains.radii;
        for ((s, load), radius) in self.scaled.iter().zip(loads).zip(radii) {
            let paint = if load.is_rattler() {
                Paint::fill(WHITE).outlined(GREY, 0.9).dashed(2.0, 1.5)
            } else {
                Paint::fill(GRAIN.0).outlined(GRAIN.1, 0.7)
            };
            for image in self.images(*s, part) {
                let at = self.place(self.subject.rev.state.cell.translation(&image));
                scene.circle(at, radius * self.scale, &paint);
            }
        }
    }

    /// The middles of the images of a contact in this part of the picture, in length units.
    fn middles(&self, contact: &ContactForce, part: Part) -> impl Iterator<Item = [f64; 2]> {
        let from = self.scaled[contact.i as usize];
        let half = apply(&self.inverse, &contact.branch.map(|x| 0.5 * x));
        let middle = [from[0] + half[0], from[1] + half[1]].map(|s| s - s.floor());
        let cell = self.subject.rev.state.cell;
        self.images(middle, part).map(move |s| cell.translation(&s))
    }

    fn forces(&self, scene: &mut Scene, part: Part) {
        let contacts = &self.subject.anatomy.contacts;
        let total: f64 = contacts.iter().map(|c| c.normal_force.abs()).sum();
        let mean = total / contacts.len().max(1) as f64;
        if mean == 0.0 {
            return;
        }
        let mut ordered: Vec<_> = contacts.iter().collect();
        // The thick lines above the thin ones.
        ordered.sort_by(|a, b| a.normal_force.abs().total_cmp(&b.normal_force.abs()));
        for contact in ordered {
            let colour = if contact.normal_force < 0.0 {
                VERMILION
            } else {
                BLUE
            };
            let thickness = (contact.normal_force.abs() / mean).min(WIDEST);
            let width = thickness * MEAN_WIDTH * self.diameter * self.scale;
            for middle in self.middles(contact, part) {
                let [from, to] = [-0.5, 0.5].map(|part| {
                    let [x, y] = contact.branch.map(|x| part * x);
                    self.place([middle[0] + x, middle[1] + y])
                });
                scene.bar(from, to, colour, width);
            }
        }
    }

    fn sliding(&self, scene: &mut Scene) {
        let paint = Paint::fill(YELLOW).outlined(INK, 0.7);
        let sliding = self.subject.anatomy.contacts.iter().filter(|c| c.sliding);
        for contact in sliding {
            // The contact point is not the middle of the branch where radii differ.
            let [a, b] = [contact.i, contact.j].map(|k| self.subject.rev.grains.radii[k as usize]);
            let off = 0.5 * (a - b);
            for [x, y] in self.middles(contact, Part::Cell) {
                let at = [x + off * contact.normal[0], y + off * contact.normal[1]];
                let radius = SLIDING_MARK * self.diameter * self.scale;
                scene.circle(self.place(at), radius, &paint);
            }
        }
    }
}
