//! The curve of an element test as a figure: two panels above each other over what drives the test.

use crate::{
    input::problem::{Amount, Control, ElementTest},
    output::csv::Table,
    plot::{
        Axes, Curve, Range, Scene, Secondary, Text, labels,
        palette::{BLUE, VERMILION},
        ticks,
    },
};

/// Size of the page, and of its panels.
const PAGE: [f64; 2] = [620.0, 640.0];
const PANEL: [f64; 2] = [450.0, 250.0];
const LEFT: f64 = 90.0;
const TOP: f64 = 46.0;
const GAP: f64 = 24.0;

/// The narrowest spans that are drawn large: what is smaller is noise of a REV at its tolerance.
const LEAST_RATIO: f64 = 1e-2;
const LEAST_PERCENT: f64 = 1e-2;
const LEAST_COORDINATION: f64 = 0.2;

/// Up to this q/p a stress path counts as isotropic: the solver's tolerance and a held shear strain leave a little.
const ISOTROPIC: f64 = 0.02;

/// One axis of the figure: its label, and its number in each row of the curve.
#[derive(Clone)]
struct Quantity {
    label: &'static str,
    values: Vec<f64>,
    /// The narrowest span worth an axis.
    least: f64,
}

/// Whether a second scale gives σ1/σ2.
#[derive(Clone, Copy, PartialEq, Eq)]
enum RatioScale {
    None,
    PrincipalStresses,
    AxialOverLateral,
}

/// The figure of the test `name`; `curve` is the one that `rev test` prints.
pub fn draw(name: &str, test: &ElementTest, curve: &Table) -> Scene {
    let driven = Driven::of(test, curve);
    let (x, upper, lower, scale) = driven.quantities(test, curve);
    let mut scene = Scene::new(PAGE[0], PAGE[1]);
    scene.text([LEFT, 28.0], &Text::new(name, 14.0));
    let shared = Range::around(x.values.iter().copied(), x.least);
    let axes = |k: usize, y: &Quantity| Axes {
        corner: [LEFT, TOP + k as f64 * (PANEL[1] + GAP)],
        size: PANEL,
        x: shared,
        y: Range::around(y.values.iter().copied(), y.least),
    };
    let (above, below) = (axes(0, &upper), axes(1, &lower));
    let second = second_scale(&above.y, scale);
    above.draw(&mut scene, upper.label, None, second.as_ref());
    below.draw(&mut scene, lower.label, Some(x.label), None);
    for (axes, y, colour) in [(&above, &upper, BLUE), (&below, &lower, VERMILION)] {
        let points = x.values.iter().zip(&y.values);
        let points = points.map(|(x, y)| [*x, *y]).collect();
        axes.curve(&mut scene, &Curve { points, colour });
    }
    scene
}

/// What drives a test.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Driven {
    /// The strain along x.
    AlongX,
    /// The strain along y.
    AlongY,
    /// The shear strain.
    Shear,
    /// Stresses alone.
    Stress,
}

impl Driven {
    /// The component whose strain follows a load; of several, the one that goes furthest.
    fn of(test: &ElementTest, curve: &Table) -> Self {
        let candidates = [
            (test.yy, "eyy", Self::AlongY),
            (test.xx, "exx", Self::AlongX),
            (test.xy, "exy", Self::Shear),
        ];
        let mut furthest = (0.0, Self::Stress);
        for (control, column, driven) in candidates {
            if !matches!(control, Control::Strain(Amount::Load(_))) {
                continue;
            }
            let reach = values(curve, column)
                .iter()
                .fold(0.0_f64, |a, x| a.max(x.abs()));
            if reach > furthest.0 {
                furthest = (reach, driven);
            }
        }
        furthest.1
    }

    /// What is drawn along x, above and below.
    fn quantities(
        self,
        test: &ElementTest,
        curve: &Table,
    ) -> (Quantity, Quantity, Quantity, RatioScale) {
        let column = |name: &str| values(curve, name);
        let percent = |name: &str, sign: f64| -> Vec<f64> {
            column(name).iter().map(|x| 100.0 * sign * x).collect()
        };
        let (sxx, syy, p) = (column("sxx"), column("syy"), column("p"));
        let each = |of: &dyn Fn(usize) -> f64| (0..p.len()).map(of).collect::<Vec<f64>>();
        let volume = Quantity {
            label: "volume strain (%), dilation positive",
            values: percent("volume_strain", 1.0),
            least: LEAST_PERCENT,
        };
        let ratio = |values: Vec<f64>, label| Quantity {
            label,
            values,
            least: LEAST_RATIO,
        };
        let mean = Quantity {
            label: "mean stress *p*",
            values: p.clone(),
            least: 1e-3 * p.iter().fold(0.0_f64, |a, p| a.max(p.abs())),
        };
        let keeps_volume = [test.xx, test.yy].contains(&Control::KeepVolume);
        let (x, upper, scale) = match self {
            Self::Stress => {
                let ratios = column("stress_ratio");
                if ratios.iter().any(|s| *s > ISOTROPIC) {
                    let upper = ratio(ratios, "stress ratio *q*/*p*");
                    (mean.clone(), upper, RatioScale::PrincipalStresses)
                } else {
                    let upper = Quantity {
                        label: "coordination *z*",
                        values: column("coordination"),
                        least: LEAST_COORDINATION,
                    };
                    (mean.clone(), upper, RatioScale::None)
                }
            }
            Self::AlongX | Self::AlongY => {
                let (name, along, across) = if self == Self::AlongY {
                    ("eyy", &syy, &sxx)
                } else {
                    ("exx", &sxx, &syy)
                };
                // Compression positive, so that extension shows as such on a cycle.
                let signed = each(&|k| (along[k] - across[k]) / (along[k] + across[k]));
                let x = Quantity {
                    label: "axial shortening (%)",
                    values: percent(name, -1.0),
                    least: LEAST_PERCENT,
                };
                let label = "stress ratio *q*/*p* = (*σ*_{a} − *σ*_{l})/(*σ*_{a} + *σ*_{l})";
                (x, ratio(signed, label), RatioScale::AxialOverLateral)
            }
            Self::Shear => {
                let x = Quantity {
                    label: "shear strain *γ* (%)",
                    values: percent("exy", 1.0),
                    least: LEAST_PERCENT,
                };
                let cyclic = column("exy").iter().any(|x| *x < 0.0);
                if cyclic {
                    let shear = column("sxy");
                    let signed = each(&|k| shear[k] / p[k]);
                    (
                        x,
                        ratio(signed, "shear stress ratio *σ*_{xy}/*p*"),
                        RatioScale::None,
                    )
                } else {
                    let label = "stress ratio *q*/*p*";
                    (
                        x,
                        ratio(column("stress_ratio"), label),
                        RatioScale::PrincipalStresses,
                    )
                }
            }
        };
        (x, upper, if keeps_volume { mean } else { volume }, scale)
    }
}

/// Round values of σ1/σ2 on a scale of s = q/p: σ1/σ2 = (1 + s)/(1 − s), s = (r − 1)/(r + 1).
fn second_scale(left: &Range, scale: RatioScale) -> Option<Secondary> {
    let label = match scale {
        RatioScale::None => return None,
        RatioScale::PrincipalStresses => "*σ*_{1}/*σ*_{2}",
        RatioScale::AxialOverLateral => "*σ*_{a}/*σ*_{l}",
    };
    // Cohesion takes s to 1 and beyond, where the lateral stress vanishes: there is no such ratio there.
    let ratio = |s: f64| (1.0 + s) / (1.0 - s);
    let [low, high] = [left.low.max(-0.9), left.high.min(0.9)];
    if low >= high {
        return None;
    }
    let rounds = ticks(ratio(low), ratio(high), 7);
    let at = rounds.iter().map(|r| (r - 1.0) / (r + 1.0));
    Some(Secondary {
        label: label.to_owned(),
        ticks: at.zip(labels(&rounds)).collect(),
    })
}

/// The values of one column.
fn values(curve: &Table, name: &str) -> Vec<f64> {
    let index = curve
        .columns()
        .iter()
        .position(|column| column.name == name);
    let of = |row: &Vec<f64>| index.map_or(f64::NAN, |index| row[index]);
    curve.rows().iter().map(of).collect()
}
