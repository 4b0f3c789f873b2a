//! A REV that gives way: under a fixed cell its contacts lose all force within some thousand cycles, down to rounding,
//! though grains still touch. Taken for one that does not settle it costs a hundred times as much and stops the run.

use solver_dem::{
    EquilibriumError, LossOfConfinement, Method, Settings, exchange::PackingRecord, respond,
};

/// Behind the peak of a biaxial test: coordination 3.3 without rattlers, mean stress 1.55, ten rattlers.
const PACKING: &str = include_str!("data/gives_way100.json");

/// The increment that it gave way under: a shear of 1e-4, hardly any dilation.
const INCREMENT: [[f64; 2]; 2] = [
    [1.0000585111936187, -0.00003574740470790611],
    [0.00005144947724065201, 0.9999539642554369],
];

#[test]
fn a_rev_that_gives_way_is_a_void_and_found_to_be_one_soon() {
    let record: PackingRecord = serde_json::from_str(PACKING).expect("a packing");
    let rev = record.to_rev().expect("sound");
    let allowing = Settings {
        loss_of_confinement: LossOfConfinement::Allow,
        ..Settings::default()
    };
    let response = respond(&rev, None, &INCREMENT, &allowing).expect("a void is an answer");
    assert_eq!(response.report.contacts, 0);
    assert_eq!(response.report.method, Method::Path);
    assert_eq!(response.stress, [[0.0; 2]; 2]);
    assert_eq!(response.tangent, [[[[0.0; 2]; 2]; 2]; 2]);
    assert_eq!(response.elastic_tangent, response.tangent);
    assert!(
        response.report.cycles < 20_000,
        "{}",
        response.report.cycles
    );
    match respond(&rev, None, &INCREMENT, &Settings::default()) {
        Err(EquilibriumError::ConfinementLost { .. }) => {}
        other => panic!("{other:?}"),
    }
    // Pressed together it carries again.
    let mut void = rev.clone();
    void.state = response.state;
    let pressed = [[0.995, 0.0], [0.0, 0.995]];
    let again = respond(&void, None, &pressed, &allowing).expect("an equilibrium");
    assert!(again.report.contacts > 100, "{:?}", again.report);
    assert!(again.stress[0][0] < -0.1 && again.stress[1][1] < -0.1);
}
