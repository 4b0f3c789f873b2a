//! The page: grains on the left, roses and figures on the right.

use super::{Subject, figures, legend, packing, rose};
use crate::plot::{Anchor, Scene, Text, palette::GREY};

/// Size of the page.
const PAGE: [f64; 2] = [880.0, 660.0];
/// The packing: upper left corner and size.
const PACKING: ([f64; 2], [f64; 2]) = ([20.0, 44.0], [570.0, 560.0]);
/// The column on the right.
const COLUMN: f64 = 615.0;
/// Heights of what stands in it.
const ROSES: f64 = 44.0;
const FIGURES: f64 = 488.0;

/// The picture of a REV.
pub fn draw(subject: &Subject) -> Scene {
    let mut scene = Scene::new(PAGE[0], PAGE[1]);
    scene.text([20.0, 28.0], &Text::new(&subject.title, 16.0));
    let size = format!(
        "{} grains, {} contacts",
        subject.statistics.grains, subject.statistics.contacts
    );
    let corner = [PACKING.0[0] + PACKING.1[0], 28.0];
    scene.text(
        corner,
        &Text::new(&size, 12.5).anchored(Anchor::End).coloured(GREY),
    );
    let (corner, room) = PACKING;
    let mean = packing::draw(&mut scene, corner, room, subject);
    legend::draw(
        &mut scene,
        [corner[0], corner[1] + room[1] + 26.0],
        mean,
        subject,
    );
    rose::draw_all(&mut scene, [COLUMN, ROSES], subject);
    figures::draw(&mut scene, [COLUMN, FIGURES], PAGE[0] - 20.0, subject);
    scene
}
