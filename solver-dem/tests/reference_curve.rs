//! The same packing in an established code and here: nothing of our own making could agree by accident.

mod common;

use common::{biaxial_step, imported};
use solver_dem::Settings;

#[test]
fn biaxial_curve_agrees_with_yade_up_to_half_a_percent() {
    let reference: Vec<Vec<f64>> = include_str!("data/biaxial400.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    let settings = Settings {
        tolerance: 1e-5,
        ..Settings::default()
    };
    let mut rev = imported();
    let volume = rev.state.cell.volume();
    // (axial strain, q/p, volume strain positive in compression)
    let mut curve = vec![[0.0; 3]];
    const STEP: f64 = 2e-4;
    for k in 0..27 {
        let before = 1.0 - STEP * f64::from(k);
        let response = biaxial_step(&rev, STEP / before, &settings);
        rev.state = response.state;
        let [[lateral, _], [_, axial]] = response.stress;
        curve.push([
            STEP * f64::from(k + 1),
            (axial - lateral) / (axial + lateral),
            -(rev.state.cell.volume() / volume).ln(),
        ]);
    }
    let mut compared = 0;
    for row in reference.iter().filter(|row| row[0] <= 0.0052) {
        let (strain, q_over_p, volume_strain) = (row[0], row[4], row[5]);
        let after = curve.iter().position(|p| p[0] > strain).unwrap();
        let (p, q) = (curve[after - 1], curve[after]);
        let t = (strain - p[0]) / (q[0] - p[0]);
        let at = |k: usize| p[k] + t * (q[k] - p[k]);
        assert!(
            (at(1) - q_over_p).abs() < 0.005,
            "{strain}: q/p {} for {q_over_p}",
            at(1)
        );
        assert!(
            (at(2) - volume_strain).abs() < 2e-4,
            "{strain}: {} for {volume_strain}",
            at(2)
        );
        compared += 1;
    }
    assert!(compared >= 12, "{compared} rows");
}
