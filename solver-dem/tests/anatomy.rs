//! A picture of a REV is believed: the forces in it must be those that make its stress, and the
//! anisotropies read off it those that make its strength.

mod common;

use common::{SHEARED, biaxial_step, imported, recipe};
use solver_dem::{
    Rev, Settings, anatomy, anatomy::Statistics, exchange::PackingRecord, prepare, respond,
};

#[test]
fn forces_shown_are_not_those_of_another_state() {
    for rev in [&*SHEARED, &imported()] {
        let shown = anatomy(rev).unwrap();
        let solved = respond(rev, None, &common::UNIT, &Settings::default()).unwrap();
        let pairs: Vec<_> = shown.contacts.iter().map(|c| (c.i, c.j)).collect();
        let expected: Vec<_> = solved.state.contacts.iter().map(|c| (c.i, c.j)).collect();
        assert_eq!(pairs, expected);
        // σ = −(1/V) Σ f ⊗ l with the force on j, f_n n − f_t t.
        let mut stress = [[0.0; 2]; 2];
        for c in &shown.contacts {
            let [nx, ny] = c.normal;
            let force = [
                c.normal_force * nx + c.tangential_force * ny,
                c.normal_force * ny - c.tangential_force * nx,
            ];
            for k in 0..2 {
                for l in 0..2 {
                    stress[k][l] -= force[k] * c.branch[l] / rev.state.cell.volume();
                }
            }
        }
        for k in 0..2 {
            for l in 0..2 {
                let symmetric = 0.5 * (stress[k][l] + stress[l][k]);
                assert!((symmetric - shown.stress[k][l]).abs() < 1e-12);
                assert!((solved.stress[k][l] - shown.stress[k][l]).abs() < 1e-3);
            }
        }
        assert!(shown.residual < 1e-3, "{}", shown.residual);
        // What the grains carry fills the solid part of the cell: Σ p_g A_g ≈ p V.
        let carried: f64 = shown
            .grains
            .iter()
            .zip(&rev.grains.radii)
            .map(|(grain, r)| grain.pressure * std::f64::consts::PI * r * r)
            .sum();
        let pressure = shown.statistics().pressure;
        assert!((carried / (pressure * rev.state.cell.volume()) - 1.0).abs() < 1e-10);
        let statistics = shown.statistics();
        assert_eq!(statistics.rattlers as usize, rev.rattlers());
        assert!((statistics.coordination - rev.coordination()).abs() < 1e-12);
    }
}

#[test]
fn a_state_that_is_no_rev_is_refused() {
    let mut rev = SHEARED.clone();
    rev.state.positions[3][0] = f64::NAN;
    assert!(anatomy(&rev).is_err());
    let mut rev = SHEARED.clone();
    rev.state.cell.h[0][0] *= 0.1;
    assert!(anatomy(&rev).is_err());
}

#[test]
fn a_rev_without_contacts_has_no_directions_and_no_ratio() {
    let mut rev = SHEARED.clone();
    for row in &mut rev.state.cell.h {
        row.iter_mut().for_each(|x| *x *= 2.0);
    }
    for x in &mut rev.state.positions {
        x.iter_mut().for_each(|x| *x *= 2.0);
    }
    let statistics = anatomy(&rev).unwrap().statistics();
    assert_eq!((statistics.contacts, statistics.rattlers), (0, 100));
    assert_eq!(statistics.contact_anisotropy.amplitude, 0.0);
    assert_eq!(statistics.stress_ratio, None);
    assert_eq!(statistics.ratio_from_anisotropies, None);
}

/// q/p measured and from the anisotropies after each step of `strain`.
fn path(mut rev: Rev<2, 1>, strain: f64, steps: u32) -> Vec<Statistics> {
    (0..steps)
        .map(|_| {
            rev.state = biaxial_step(&rev, strain, &Settings::default()).state;
            anatomy(&rev).unwrap().statistics()
        })
        .collect()
}

/// Stress–force–fabric (Rothenburg, Bathurst 1989) on the way to 1.5 % and past the peak of two packings.
/// Measured: the series is 2.3 % above q/p in the mean and 4.5 % at most; the bare half sum of the anisotropies,
/// which leaves out their product, 9.2 % in the mean.
#[test]
fn anisotropies_account_for_the_strength() {
    let (mut mean, mut worst, mut mean_of_sum): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let mut peak: f64 = 0.0;
    const STEPS: u32 = 30;
    for seed in [1, 2] {
        let rev = prepare(&recipe(400, seed)).unwrap().0;
        for s in path(rev, 5e-4, STEPS) {
            let measured = s.stress_ratio.unwrap();
            let predicted = s.ratio_from_anisotropies.unwrap();
            let error = predicted.amplitude / measured.amplitude - 1.0;
            mean += error / f64::from(2 * STEPS);
            worst = worst.max(error.abs());
            peak = peak.max(measured.amplitude);
            // The specimen is pressed along y; ±π/2 are one direction.
            assert!(
                predicted.direction.abs() > 1.5 && measured.direction.abs() > 1.5,
                "{predicted:?} for {measured:?}"
            );
            let sum = s.contact_anisotropy.amplitude
                + s.normal_anisotropy.unwrap().amplitude
                + s.shear_anisotropy.unwrap().amplitude;
            let without = 0.5 * sum / measured.amplitude - 1.0;
            mean_of_sum += without / f64::from(2 * STEPS);
        }
    }
    assert!(
        peak > 0.4,
        "the packings were not sheared to their strength: {peak}"
    );
    assert!(mean.abs() < 0.03, "{mean}");
    assert!(worst < 0.06, "{worst}");
    assert!(mean_of_sum < 0.12, "{mean_of_sum}");
}

/// Two grains that press on each other from one side only: the whole contact force is unbalanced.
#[test]
fn a_packing_out_of_balance_is_not_called_good() {
    let mut record = PackingRecord {
        units: String::new(),
        lx: 10.0,
        ly: 10.0,
        shear_of_cell: [0.0; 2],
        kn: 100.0,
        kt: 100.0,
        mu_shear: 0.5,
        cohesion: 0.0,
        sigma0: 1.0,
        bodies: vec![[0.0, 1.0, 1.0, 0.5], [1.0, 1.9, 1.0, 0.5]],
        contacts_list: vec![vec![0.0, 1.0]],
    };
    let residual = |record: &PackingRecord| anatomy(&record.to_rev().unwrap()).unwrap().residual;
    assert!((residual(&record) - 1.0).abs() < 1e-12);
    // A third one from the other side balances the middle one; the outer two stay.
    record.bodies.push([2.0, 2.8, 1.0, 0.5]);
    record.contacts_list.push(vec![1.0, 2.0]);
    assert!((residual(&record) - 1.0).abs() < 1e-12);
}
