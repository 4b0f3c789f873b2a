//! Roses: what the contacts of each direction have in common, and the series fitted to it.

use std::f64::consts::PI;

use solver_dem::anatomy::{Anisotropy, ContactForce, Harmonic};

use super::Subject;
use crate::plot::{
    Paint, Scene, Text, labels,
    palette::{BLUE, GREY, HAIRLINE, INK, VERMILION},
    ticks,
};

/// Radius of a rose and the distance from one to the next.
const RADIUS: f64 = 58.0;
const PITCH: f64 = 150.0;
/// Sectors of half a turn where there are many contacts, and where there are few.
const SECTORS: (usize, usize) = (18, 9);
const MANY_CONTACTS: usize = 300;

/// What reaches to the rim at least: shear forces of a packing made without friction are rounding, not petals.
const LEAST_PEAK: f64 = 0.02;
/// The least anisotropy, of stress too, whose direction is more than noise.
const LEAST_ANISOTROPY: f64 = 5e-3;

/// What one rose shows.
struct Rose<'a> {
    title: &'a str,
    /// Values in the sectors of half a turn, from θ = 0; the other half is the same.
    sectors: Vec<f64>,
    /// The fitted series.
    fit: Harmonic,
    /// Letter of its anisotropy, and the anisotropy.
    result: (&'a str, Option<Anisotropy>),
}

/// Draws the three roses below each other: contacts, normal forces, shear forces.
pub fn draw_all(scene: &mut Scene, corner: [f64; 2], subject: &Subject) {
    let s = &subject.statistics;
    let contacts = &subject.anatomy.contacts;
    let scale = |fit: &Harmonic| {
        let base = s.normal_fit.mean;
        let by = if base > 0.0 { 1.0 / base } else { 0.0 };
        Harmonic {
            mean: by * fit.mean,
            cosine: by * fit.cosine,
            sine: by * fit.sine,
        }
    };
    let mean_of = |force: fn(&ContactForce) -> f64| {
        let base = s.normal_fit.mean;
        let sectors = sectors(contacts, force).into_iter();
        let means = sectors.map(|(count, sum)| {
            if count > 0.0 && base > 0.0 {
                sum / (count * base)
            } else {
                0.0
            }
        });
        means.collect::<Vec<f64>>()
    };
    let counted = sectors(contacts, |_| 0.0);
    let even = contacts.len().max(1) as f64 / counted.len() as f64;
    let a = &s.contact_anisotropy;
    let roses = [
        Rose {
            title: "contacts  *E*(*θ*)",
            sectors: counted.iter().map(|(count, _)| count / even).collect(),
            fit: Harmonic {
                mean: 1.0,
                cosine: a.amplitude * (2.0 * a.direction).cos(),
                sine: a.amplitude * (2.0 * a.direction).sin(),
            },
            result: ("c", Some(*a)),
        },
        Rose {
            title: "normal force  *f*_{n}(*θ*)/*f*_{0}",
            sectors: mean_of(|c| c.normal_force),
            fit: scale(&s.normal_fit),
            result: ("n", s.normal_anisotropy),
        },
        Rose {
            title: "shear force  *f*_{t}(*θ*)/*f*_{0}",
            sectors: mean_of(|c| c.tangential_force),
            fit: scale(&s.shear_fit),
            result: ("t", s.shear_anisotropy),
        },
    ];
    let compression = s
        .stress_ratio
        .filter(|ratio| ratio.amplitude >= LEAST_ANISOTROPY)
        .map(|ratio| ratio.direction);
    for (k, rose) in roses.iter().enumerate() {
        rose.draw(
            scene,
            [corner[0], corner[1] + PITCH * k as f64],
            compression,
        );
    }
}

/// The number of contacts and the sum of a force in each sector of half a turn.
fn sectors(contacts: &[ContactForce], force: impl Fn(&ContactForce) -> f64) -> Vec<(f64, f64)> {
    let number = if contacts.len() >= MANY_CONTACTS {
        SECTORS.0
    } else {
        SECTORS.1
    };
    let mut sectors = vec![(0.0, 0.0); number];
    for contact in contacts {
        let theta = contact.normal[1].atan2(contact.normal[0]);
        // Half a turn and back to 0: a contact has no beginning.
        let part = theta.rem_euclid(PI) / PI;
        let sector = &mut sectors[((part * number as f64) as usize).min(number - 1)];
        sector.0 += 1.0;
        sector.1 += force(contact);
    }
    sectors
}

impl Rose<'_> {
    fn draw(&self, scene: &mut Scene, corner: [f64; 2], compression: Option<f64>) {
        let [left, top] = corner;
        scene.text([left, top + 10.0], &Text::new(self.title, 12.5));
        let centre = [left + RADIUS + 4.0, top + 24.0 + RADIUS];
        let point = |theta: f64, r: f64| [centre[0] + r * theta.cos(), centre[1] - r * theta.sin()];
        let fit_peak = self.fit.mean.abs() + self.fit.cosine.hypot(self.fit.sine);
        let peak = self
            .sectors
            .iter()
            .fold(fit_peak.max(LEAST_PEAK), |peak, value| {
                peak.max(value.abs())
            });
        let unit = RADIUS / peak;
        let circles = ticks(0.0, peak, 3);
        for circle in circles.iter().filter(|circle| **circle > 0.0) {
            scene.circle(centre, circle * unit, &Paint::line(HAIRLINE, 0.8));
        }
        self.petals(scene, unit, point);
        let fitted: Vec<[f64; 2]> = (0..=120)
            .map(|k| {
                let theta = 2.0 * PI * f64::from(k) / 120.0;
                point(theta, unit * self.fit.at(theta).abs())
            })
            .collect();
        scene.polyline(&fitted, &Paint::line(INK, 1.3));
        if let Some(theta) = compression {
            let [from, to] = [-1.06, 1.06].map(|r| point(theta, r * RADIUS));
            scene.line(from, to, &Paint::line(GREY, 1.0).dashed(4.0, 3.0));
        }
        self.write(
            scene,
            [left + 2.0 * RADIUS + 34.0, top + 6.0 + RADIUS],
            &circles,
        );
    }

    fn petals(&self, scene: &mut Scene, unit: f64, point: impl Fn(f64, f64) -> [f64; 2]) {
        const POINTS: u32 = 6;
        let width = PI / self.sectors.len() as f64;
        for turn in 0..2 {
            for (k, value) in self.sectors.iter().enumerate() {
                let colour = if *value < 0.0 { VERMILION } else { BLUE };
                let start = f64::from(turn) * PI + width * k as f64;
                let mut corners = vec![point(start, 0.0)];
                corners.extend((0..=POINTS).map(|m| {
                    let theta = start + width * f64::from(m) / f64::from(POINTS);
                    point(theta, unit * value.abs())
                }));
                let paint = Paint::fill(colour).translucent(0.4).outlined(colour, 0.6);
                scene.polygon(&corners, &paint);
            }
        }
    }

    /// The anisotropy in figures, and what the circles stand for.
    fn write(&self, scene: &mut Scene, at: [f64; 2], circles: &[f64]) {
        let (letter, result) = self.result;
        let (amplitude, direction) = match result {
            Some(a) => (format!("{:.3}", a.amplitude), angle(&a)),
            None => ("–".to_owned(), "–".to_owned()),
        };
        for (k, (symbol, value)) in [("a", amplitude), ("θ", direction)].iter().enumerate() {
            let text = format!("*{symbol}*_{{{letter}}} = {value}");
            let at = [at[0], at[1] + 21.0 * k as f64];
            scene.text(at, &Text::new(&text, 13.0));
        }
        let values: Vec<String> = labels(circles).into_iter().skip(1).collect();
        if !values.is_empty() {
            let text = format!("circles: {}", values.join(", "));
            let text = Text::new(&text, 10.5).coloured(GREY);
            scene.text([at[0], at[1] + 40.0], &text);
        }
    }
}

/// An anisotropy as text: `0.412 at 90°`, without a direction where there is none to speak of.
pub fn directed(a: &Anisotropy) -> String {
    if a.amplitude < LEAST_ANISOTROPY {
        format!("{:.3}", a.amplitude)
    } else {
        format!("{:.3} at {}", a.amplitude, angle(a))
    }
}

/// The direction in degrees from x, in [0, 180); a dash where there is none to speak of.
fn angle(a: &Anisotropy) -> String {
    if a.amplitude < LEAST_ANISOTROPY {
        return "–".to_owned();
    }
    let degrees = a.direction.to_degrees().rem_euclid(180.0);
    // What would be rounded to 180 is 0.
    let degrees = if degrees >= 179.5 { 0.0 } else { degrees };
    format!("{degrees:.0}°")
}
