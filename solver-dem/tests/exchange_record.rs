//! Packings of other codes: what is read must be what was written, and a damaged file must not become a REV.

mod common;

use common::{SHEARED, UNIT, distance, imported, record, tight};
use solver_dem::{exchange::PackingRecord, respond};

#[test]
fn an_imported_packing_is_in_the_equilibrium_its_author_reports() {
    let rev = imported();
    let response = respond(&rev, None, &UNIT, &solver_dem::Settings::default()).unwrap();
    let reported = [
        [-0.999_999_857, 0.040_466_959],
        [0.040_466_959, -0.999_999_424],
    ];
    assert!(distance(&response.stress, &reported) < 1e-6);
    assert_eq!(rev.state.contacts.len(), 819);
    assert_eq!(rev.rattlers(), 7);
}

#[test]
fn export_and_import_give_the_same_rev() {
    let text = serde_json::to_string(&PackingRecord::from_rev(&SHEARED, 1.0)).unwrap();
    let back = serde_json::from_str::<PackingRecord>(&text)
        .unwrap()
        .to_rev()
        .unwrap();
    assert_eq!(back.state.contacts.len(), SHEARED.state.contacts.len());
    assert_eq!(back.law, SHEARED.law);
    let a = respond(&SHEARED, None, &UNIT, &tight()).unwrap();
    let b = respond(&back, None, &UNIT, &tight()).unwrap();
    assert!(distance(&a.stress, &b.stress) < 1e-9);
    // The tangential forces made the trip, in sign too.
    for (x, y) in back.state.contacts.iter().zip(&SHEARED.state.contacts) {
        assert_eq!((x.i, x.j), (y.i, y.j));
        assert!((x.tangential[0] - y.tangential[0]).abs() < 1e-12);
    }
}

#[test]
fn bad_records_are_refused_with_the_row() {
    type Damage = fn(&mut PackingRecord);
    let cases: [(Damage, &str); 9] = [
        (|r| r.lx = -1.0, "Lx"),
        (|r| r.kn = f64::NAN, "kn"),
        (|r| r.mu_shear = -0.5, "mu_shear"),
        (|r| r.shear_of_cell = [20.0, 20.0], "shear_of_cell"),
        (|r| r.bodies.clear(), "bodies"),
        (|r| r.bodies[7][0] = 3.0, "row 7"),
        (|r| r.bodies[7][3] = 0.0, "row 7"),
        (|r| r.contacts_list[5][1] = 400.0, "row 5"),
        (|r| r.contacts_list[5].truncate(1), "row 5"),
    ];
    for (damage, word) in cases {
        let mut bad = record();
        damage(&mut bad);
        let error = bad.to_rev().unwrap_err().to_string();
        assert!(error.contains(word), "{error:?} does not name {word}");
    }
}
