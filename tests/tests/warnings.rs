//! What goes wrong without ending a run was told to nobody: who does not learn that the cache is damaged wonders why every
//! run prepares its packings anew.

use std::fs;

use tests::inputs;
use tests::workplace::Workplace;

#[test]
fn a_warning_reaches_the_user_also_where_no_progress_is_shown() {
    let place = Workplace::new();
    let input = place.write("input.yaml", &inputs::biaxial("small", 30, 1));
    let input = input.to_str().unwrap();
    let calm = place.run(["submit", input]).success();
    assert!(!calm.err.contains("Warning"), "{}", calm.err);
    for quiet in [&[][..], &["--quiet"]] {
        for entry in fs::read_dir(place.store().join("cache")).unwrap() {
            let path = entry.unwrap().path();
            let bytes = fs::read(&path).unwrap();
            fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        }
        let outcome = place.run([&["submit", input], quiet].concat()).success();
        let warning = "Warning: a cache entry cannot be used";
        assert_eq!(outcome.err.matches(warning).count(), 3, "{}", outcome.err);
        if !quiet.is_empty() {
            assert_eq!(outcome.err.lines().count(), 3, "{}", outcome.err);
        }
    }
}

/// Who has forgotten the trigger learns it before the hours are spent.
#[test]
fn what_makes_a_run_inhomogeneous_is_told_before_it_begins() {
    let place = Workplace::new();
    let text = inputs::least("small", 1);
    let input = place.write("with.yaml", &text);
    let outcome = place.run(["submit", input.to_str().unwrap()]).success();
    let trigger = "trigger of localisation: 2 packings dealt out (`sand`)\nrun small: ";
    assert!(outcome.err.contains(trigger), "{}", outcome.err);
    let without = text.replace("{ gallery: 2 }", "shared");
    let input = place.write("without.yaml", &without);
    let outcome = place.run(["submit", input.to_str().unwrap()]).success();
    assert!(
        outcome.err.contains("trigger of localisation: none: "),
        "{}",
        outcome.err
    );
}
