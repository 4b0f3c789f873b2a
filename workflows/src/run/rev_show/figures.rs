//! The figures of a REV, in the picture and as text.

use solver_dem::anatomy::Anisotropy;

use super::{Subject, rose};
use crate::plot::{Anchor, Paint, Scene, Text, minus, palette::HAIRLINE};

/// Height of the letters and of a line.
const SIZE: f64 = 12.0;
const LINE: f64 = 17.0;

/// Name and value of each figure, the names with the marks of labels.
fn figures(subject: &Subject) -> Vec<(&'static str, String)> {
    let (s, rev) = (&subject.statistics, &subject.rev);
    let or_dash =
        |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
    let directed = |a: Option<Anisotropy>| a.map_or_else(|| "–".to_owned(), |a| rose::directed(&a));
    vec![
        ("void ratio *e*", format!("{:.4}", rev.void_ratio())),
        ("coordination *z*", format!("{:.3}", s.coordination)),
        ("*z* without rattlers", or_dash(s.backbone_coordination)),
        (
            "rattlers",
            format!(
                "{} ({:.1} %)",
                s.rattlers,
                100.0 * f64::from(s.rattlers) / f64::from(s.grains)
            ),
        ),
        (
            "sliding contacts",
            format!("{:.1} %", 100.0 * s.sliding_fraction),
        ),
        ("mean stress *p*", format!("{:.4}", s.pressure)),
        ("stress ratio *q*/*p*", directed(s.stress_ratio)),
        (
            "from *a*_{c}, *a*_{n}, *a*_{t}",
            directed(s.ratio_from_anisotropies),
        ),
        ("residual", format!("{:.1e}", subject.anatomy.residual)),
    ]
}

/// Draws them as two columns from `corner` to the right edge at `right`.
pub fn draw(scene: &mut Scene, corner: [f64; 2], right: f64, subject: &Subject) {
    let [left, mut y] = corner;
    for (name, value) in figures(subject) {
        y += LINE;
        scene.text([left, y], &Text::new(name, SIZE));
        let value = minus(&value);
        scene.text([right, y], &Text::new(&value, SIZE).anchored(Anchor::End));
        let under = y + 4.5;
        scene.line([left, under], [right, under], &Paint::line(HAIRLINE, 0.6));
    }
}

/// The figures as lines of text.
pub fn text(subject: &Subject) -> String {
    let s = &subject.statistics;
    let mut text = format!(
        "{}: {} grains, {} contacts\n",
        subject.title, s.grains, s.contacts
    );
    for (name, value) in figures(subject) {
        let name: String = name.chars().filter(|c| !"*_{}".contains(*c)).collect();
        text.push_str(&format!("  {name:<36}{value}\n"));
    }
    for (name, a) in [
        ("contact anisotropy ac", Some(s.contact_anisotropy)),
        ("normal-force anisotropy an", s.normal_anisotropy),
        ("shear-force anisotropy at", s.shear_anisotropy),
    ] {
        if let Some(a) = a {
            text.push_str(&format!("  {name:<36}{}\n", rose::directed(&a)));
        }
    }
    text
}
