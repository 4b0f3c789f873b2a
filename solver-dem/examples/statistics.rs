//! Biaxial compression of independent packings, dense, cohesive and loose: the curves as CSV on stdout, their figures as a
//! table on stderr.
//!
//! ```text
//! cargo run --release -p solver-dem --example statistics > docs/images/biaxial-statistics.csv
//! python docs/images/biaxial-statistics.py
//! ```
//!
//! `statistics 3` takes three packings of each kind instead of ten. The strain of 10 % along y is reached in
//! steps of 5e-4 by return mapping, at the lateral stress of the preparation.

use solver_dem::{
    Component, Control, Method, Quality, Recipe, Rev, Settings, drive, prepare, tensor,
};

const STEP: f64 = 5e-4;
const STEPS: u32 = 200;

/// A packing's figures, one column each.
const COLUMNS: [&str; 6] = [
    "e0",
    "z0",
    "peak σ1/σ2",
    "strain at peak (%)",
    "σ1/σ2, 9.5–10 %",
    "volume strain at 10 % (%)",
];

/// (axial strain, σ1/σ2, volume strain, dilation positive), by step.
type Curve = Vec<[f64; 3]>;

fn main() {
    let packings = match std::env::args().nth(1).map(|text| text.parse()) {
        None => 10,
        Some(Ok(count)) => count,
        Some(Err(_)) => {
            eprintln!("usage: statistics [PACKINGS]");
            std::process::exit(2);
        }
    };
    let dense = Recipe::default();
    let cases = [
        ("dense", dense.clone()),
        (
            "cohesive",
            Recipe {
                cohesion_ratio: 1.0,
                ..dense.clone()
            },
        ),
        (
            "loose",
            Recipe {
                preparation_friction: 0.5,
                ..dense
            },
        ),
    ];
    println!("case,seed,axial_strain,stress_ratio,volume_strain");
    for (name, recipe) in cases {
        let figures: Vec<[f64; 6]> = (1..=packings)
            .filter_map(|seed| {
                let outcome = compressed(&Recipe {
                    seed,
                    ..recipe.clone()
                });
                match outcome {
                    Ok((quality, curve)) => {
                        // Every second step is enough for a picture.
                        for [strain, ratio, volume] in curve.iter().skip(1).step_by(2) {
                            println!("{name},{seed},{strain:.4},{ratio:.5},{volume:.6}");
                        }
                        Some(figures(&quality, &curve))
                    }
                    Err(reason) => {
                        eprintln!("{name}, seed {seed}: {reason}");
                        None
                    }
                }
            })
            .collect();
        eprintln!("{name}, {} packings", figures.len());
        for (k, column) in COLUMNS.iter().enumerate() {
            let mut values: Vec<f64> = figures.iter().map(|row| row[k]).collect();
            values.sort_by(f64::total_cmp);
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            if let [first, .., last] = values.as_slice() {
                eprintln!("  {column:26} {mean:8.4}  [{first:.4}, {last:.4}]");
            }
        }
    }
}

fn compressed(recipe: &Recipe) -> Result<(Quality, Curve), Box<dyn std::error::Error>> {
    let (rev, quality) = prepare(recipe)?;
    Ok((quality, biaxial(rev, -recipe.confining_stress)?))
}

fn biaxial(mut rev: Rev<2, 1>, lateral: f64) -> Result<Curve, Box<dyn std::error::Error>> {
    let mut gradient: tensor::Tensor2<2> = tensor::identity();
    let mut curve = Vec::new();
    for step in 1..=STEPS {
        let strain = f64::from(step) * STEP;
        let control = Control {
            components: [
                [Component::Stress(lateral), Component::Gradient(0.0)],
                [Component::Gradient(0.0), Component::Gradient(1.0 - strain)],
            ],
        };
        let method = Method::ReturnMapping;
        let response = drive(&rev, &gradient, &control, method, &Settings::default())?;
        gradient = response.gradient;
        rev.state = response.state;
        let ratio = response.stress[1][1] / response.stress[0][0];
        let volume = gradient[0][0] * gradient[1][1] - 1.0;
        curve.push([strain, ratio, volume]);
    }
    Ok(curve)
}

fn figures(quality: &Quality, curve: &Curve) -> [f64; 6] {
    let [strain, peak, _] = curve.iter().fold(
        [0.0; 3],
        |best, row| if row[1] > best[1] { *row } else { best },
    );
    let tail = &curve[curve.len() - 10..];
    let late = tail.iter().map(|row| row[1]).sum::<f64>() / tail.len() as f64;
    let volume = curve.last().map_or(0.0, |row| row[2]);
    [
        quality.void_ratio,
        quality.coordination,
        peak,
        100.0 * strain,
        late,
        100.0 * volume,
    ]
}
