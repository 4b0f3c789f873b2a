//! Benchmarks print figures that scripts rely on. Never how large they are: that is the machine's business.

mod common;

use common::femdem;

#[test]
fn the_figures_of_a_rev_have_the_names_that_scripts_read() {
    let args = ["bench", "rev", "--quick", "--grains", "30", "--json"];
    let figures = femdem(&args).good().json();
    let machine = &figures["machine"];
    for key in ["processor", "version", "linear_algebra"] {
        assert!(!machine[key].as_str().unwrap().is_empty(), "{key}");
    }
    let cycles = &figures["cycles"][0];
    assert_eq!(cycles["grains"], 30);
    for key in [
        "contact_updates_per_cpu_s",
        "us_per_cycle",
        "ns_per_listed_pair",
    ] {
        assert!(cycles[key].as_f64().unwrap() > 0.0, "{key}");
    }
    // Contact updates are contacts times cycles, over the same seconds as the cycles.
    let rate = cycles["contacts"].as_f64().unwrap() / cycles["us_per_cycle"].as_f64().unwrap();
    let told = cycles["contact_updates_per_cpu_s"].as_f64().unwrap();
    assert!((1e6 * rate / told - 1.0).abs() < 1e-9);

    let kinds = figures["increments"].as_array().unwrap();
    let ratios: Vec<_> = kinds.iter().map(|kind| &kind["cohesion_ratio"]).collect();
    assert_eq!(ratios, [0.0, 1.0]);
    let mut failures = 0;
    for kind in kinds {
        let windows = kind["windows"].as_array().unwrap();
        // To 2 %: 10 increments before the peak, 20 at it and 10 after it.
        let counts: Vec<_> = windows.iter().map(|w| &w["increments"]).collect();
        assert_eq!(counts, [10, 20, 10]);
        for window in windows {
            let ms = &window["increment_ms"];
            let [median, p95, max] = ["median", "p95", "max"].map(|k| ms[k].as_f64().unwrap());
            assert!(0.0 < median && median <= p95 && p95 <= max);
            failures += window["failures"].as_u64().unwrap();
        }
    }
    assert_eq!(figures["failures"], failures);
}
