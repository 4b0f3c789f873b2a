//! A panel with axes: numbers to picture coordinates, round ticks, grid, curves.

use super::palette::{Colour, GREY, HAIRLINE, INK};
use super::scene::{Anchor, Paint, Scene, Text};
use super::ticks::{labels, ticks};

/// Heights of letters.
const LABEL: f64 = 13.0;
const TICK_LABEL: f64 = 11.5;
/// Length of a tick.
const TICK: f64 = 4.0;
/// The least distance between ticks, along x and y.
const SPACING: [f64; 2] = [62.0, 34.0];
/// Room beside the data, over its span.
const PADDING: f64 = 0.05;
/// Curves of up to this many points show each of them.
const FEW_POINTS: usize = 60;

/// The numbers that an axis spans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Left or lower end.
    pub low: f64,
    /// Right or upper end.
    pub high: f64,
}

impl Range {
    /// A range that holds the values, with a little room; those that are not finite are passed over. It is never narrower
    /// than `least`, so that noise about a constant looks like one.
    pub fn around(values: impl Iterator<Item = f64>, least: f64) -> Self {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        if low > high {
            return Self {
                low: 0.0,
                high: 1.0,
            };
        }
        let (middle, span) = (0.5 * (low + high), (high - low).max(least));
        // Where the values are so large that the least span is lost in rounding, their size gives one.
        let half = (0.5 + PADDING) * span.max(1e-9 * middle.abs()).max(1e-12);
        Self {
            low: middle - half,
            high: middle + half,
        }
    }

    /// Whether a number lies in it.
    pub fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// 0 at the low end, 1 at the high one.
    fn part(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }
}

/// A second scale on the right, a function of the one on the left.
#[derive(Clone, Debug)]
pub struct Secondary {
    /// What it measures.
    pub label: String,
    /// Where on the left scale its ticks stand, and what is written there.
    pub ticks: Vec<(f64, String)>,
}

/// A curve through points; points that are not finite interrupt it.
#[derive(Clone, Debug)]
pub struct Curve {
    /// (x, y) in the numbers of the axes.
    pub points: Vec<[f64; 2]>,
    /// Its colour.
    pub colour: Colour,
}

/// A rectangle of the picture with a scale on two of its sides.
#[derive(Clone, Debug)]
pub struct Axes {
    /// Upper left corner.
    pub corner: [f64; 2],
    /// Width and height.
    pub size: [f64; 2],
    /// What it spans from left to right.
    pub x: Range,
    /// What it spans from bottom to top.
    pub y: Range,
}

impl Axes {
    /// Where a point is drawn.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.corner[0] + self.size[0] * self.x.part(x),
            self.corner[1] + self.size[1] * (1.0 - self.y.part(y)),
        ]
    }

    /// Frame, grid, ticks and the label of the left scale; `below` labels the lower one, which has no numbers without
    /// (the panel below shares it).
    pub fn draw(
        &self,
        scene: &mut Scene,
        left: &str,
        below: Option<&str>,
        right: Option<&Secondary>,
    ) {
        let most = |k: usize| (self.size[k] / SPACING[k]).floor().max(2.0) as usize;
        let [x_ticks, y_ticks] = [
            ticks(self.x.low, self.x.high, most(0)),
            ticks(self.y.low, self.y.high, most(1)),
        ];
        let ([left_edge, top], [width, height]) = (self.corner, self.size);
        let (right_edge, bottom) = (left_edge + width, top + height);
        self.grid(scene, &x_ticks, &y_ticks);
        let line = Paint::line(INK, 0.9);
        for (tick, label) in x_ticks.iter().zip(labels(&x_ticks)) {
            let x = self.place([*tick, self.y.low])[0];
            scene.line([x, bottom], [x, bottom - TICK], &line);
            if below.is_some() {
                let text = Text::new(&label, TICK_LABEL).anchored(Anchor::Middle);
                scene.text([x, bottom + 1.3 * TICK_LABEL], &text);
            }
        }
        let mut widest = 0;
        for (tick, label) in y_ticks.iter().zip(labels(&y_ticks)) {
            let y = self.place([self.x.low, *tick])[1];
            scene.line([left_edge, y], [left_edge + TICK, y], &line);
            let text = Text::new(&label, TICK_LABEL).anchored(Anchor::End);
            scene.text([left_edge - 5.0, y + 0.36 * TICK_LABEL], &text);
            widest = widest.max(label.chars().count());
        }
        scene.polygon(
            &[
                [left_edge, top],
                [right_edge, top],
                [right_edge, bottom],
                [left_edge, bottom],
            ],
            &line,
        );
        let middle = Text::new(left, LABEL).anchored(Anchor::Middle).turned(90.0);
        let clear = 16.0 + 0.62 * TICK_LABEL * widest as f64;
        scene.text([left_edge - clear, top + 0.5 * height], &middle);
        if let Some(label) = below {
            let text = Text::new(label, LABEL).anchored(Anchor::Middle);
            scene.text([left_edge + 0.5 * width, bottom + 2.9 * LABEL], &text);
        }
        if let Some(right) = right {
            self.draw_right(scene, right);
        }
    }

    fn grid(&self, scene: &mut Scene, x_ticks: &[f64], y_ticks: &[f64]) {
        let hairline = Paint::line(HAIRLINE, 0.6);
        for &tick in x_ticks {
            let [low, high] = [self.y.low, self.y.high].map(|y| self.place([tick, y]));
            scene.line(low, high, &hairline);
        }
        for &tick in y_ticks {
            // Zero is where signs change.
            let paint = if tick == 0.0 {
                Paint::line(GREY, 0.8)
            } else {
                hairline
            };
            let [low, high] = [self.x.low, self.x.high].map(|x| self.place([x, tick]));
            scene.line(low, high, &paint);
        }
    }

    fn draw_right(&self, scene: &mut Scene, right: &Secondary) {
        let edge = self.corner[0] + self.size[0];
        let mut widest = 0;
        let inside = |(at, _): &&(f64, String)| self.y.contains(*at);
        for (at, label) in right.ticks.iter().filter(inside) {
            let y = self.place([self.x.high, *at])[1];
            scene.line([edge - TICK, y], [edge, y], &Paint::line(INK, 0.9));
            scene.text(
                [edge + 5.0, y + 0.36 * TICK_LABEL],
                &Text::new(label, TICK_LABEL),
            );
            widest = widest.max(label.chars().count());
        }
        let text = Text::new(&right.label, LABEL)
            .anchored(Anchor::Middle)
            .turned(90.0);
        let clear = 16.0 + LABEL * 0.6 + 0.62 * TICK_LABEL * widest as f64;
        scene.text([edge + clear, self.corner[1] + 0.5 * self.size[1]], &text);
    }

    /// Draws a curve, cut off at the frame.
    pub fn curve(&self, scene: &mut Scene, curve: &Curve) {
        scene.clipped(self.corner, self.size, |scene| {
            let finite = |p: &[f64; 2]| p.iter().all(|x| x.is_finite());
            for part in curve.points.split(|p| !finite(p)) {
                let points: Vec<[f64; 2]> = part.iter().map(|p| self.place(*p)).collect();
                scene.polyline(&points, &Paint::line(curve.colour, 1.8));
                if curve.points.len() <= FEW_POINTS {
                    for point in points {
                        scene.circle(point, 2.4, &Paint::fill(curve.colour));
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_or_empty_curve_still_has_axes() {
        for values in [vec![], vec![3.0, 3.0], vec![f64::NAN], vec![1e20, 1e20]] {
            let range = Range::around(values.into_iter(), 0.0);
            assert!(range.low < range.high && range.low.is_finite(), "{range:?}");
        }
    }

    #[test]
    fn a_point_that_is_no_number_interrupts_a_curve_and_spoils_nothing() {
        let axes = Axes {
            corner: [0.0; 2],
            size: [100.0; 2],
            x: Range {
                low: 0.0,
                high: 1.0,
            },
            y: Range {
                low: 0.0,
                high: 1.0,
            },
        };
        let mut scene = Scene::new(100.0, 100.0);
        let points = vec![[0.0, 0.0], [0.5, f64::NAN], [1.0, 1.0]];
        axes.curve(
            &mut scene,
            &Curve {
                points,
                colour: INK,
            },
        );
        let svg = scene.to_svg();
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(!svg.contains("NaN"));
    }
}
