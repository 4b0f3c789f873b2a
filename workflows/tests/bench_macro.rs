//! Benchmarks print figures that scripts rely on. Never how large they are: that is the machine's business.

mod common;

use common::femdem;

#[test]
fn the_figures_of_the_macro_scale_have_the_names_that_scripts_read() {
    let figures = femdem(&["bench", "macro", "--quick", "--json"])
        .good()
        .json();
    assert!(
        !figures["machine"]["linear_algebra"]
            .as_str()
            .unwrap()
            .is_empty()
    );
    assert_eq!(figures["rev"]["grains"], 400);
    let answer = figures["rev"]["mean_ms"].as_f64().unwrap();
    assert!(answer > 0.0);

    let meshes = figures["meshes"].as_array().unwrap();
    let kinds: Vec<_> = meshes.iter().map(|mesh| &mesh["second_gradient"]).collect();
    assert_eq!(kinds, [false, true]);
    for mesh in meshes {
        assert_eq!(mesh["elements"], serde_json::json!([8, 16]));
        assert_eq!(mesh["revs"], 512);
        assert!(mesh["unknowns"].as_u64().unwrap() > 800);
        assert!(mesh["entries"].as_u64().unwrap() > 20_000);
        let solvers = mesh["solvers"].as_array().unwrap();
        let names: Vec<_> = solvers.iter().map(|solver| &solver["name"]).collect();
        assert_eq!(names, ["multifrontal", "faer"]);
        for solver in solvers {
            assert!(solver["analysis_ms"].as_f64().unwrap() > 0.0);
            assert!(solver["residual"].as_f64().unwrap() < 1e-12);
            assert!(solver["peak_memory"].is_null() || solver["peak_memory"].as_u64().unwrap() > 0);
        }
        // The iteration is made of its parts, and is compared with the REVs beside it.
        let median = |spread: &serde_json::Value| spread["median"].as_f64().unwrap();
        let parts = median(&mesh["assembly_ms"])
            + median(&solvers[0]["factorisation_ms"])
            + median(&solvers[0]["solution_ms"]);
        let iteration = mesh["iteration_ms"].as_f64().unwrap();
        assert!((parts / iteration - 1.0).abs() < 1e-9);
        let share = mesh["share_of_iteration"].as_f64().unwrap();
        assert!((share * (iteration + 512.0 * answer) / iteration - 1.0).abs() < 1e-9);
    }
}
