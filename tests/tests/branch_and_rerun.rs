//! A branch that is not what its parent would have become, or that touches its parent, makes every comparison with it
//! worthless: the unloading modulus of an experiment that never took place. What is shared has to be shared to the last
//! bit, what is changed has to act, and what would change the past has to be refused before anything is written.

use std::collections::BTreeMap;
use std::fs;
use std::sync::OnceLock;

use store::{Digest, RunState};
use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::{Blow, Ordeal};
use tests::workplace::{Outcome, Signal, Workplace};

/// A body of 32 REVs in six load steps, with cuts in it.
fn parent() -> String {
    inputs::biaxial_with_cuts("parent", 40, 3)
}

fn submitted(input: &str) -> Workplace {
    let place = Workplace::new();
    let file = place.write("input.yaml", input);
    place.run(["submit", file.to_str().unwrap()]).success();
    place
}

fn digests(place: &Workplace, run: &str) -> Vec<(u32, Digest)> {
    of(place, run).steps
}

fn of(place: &Workplace, run: &str) -> History {
    history::of(&place.store(), run).unwrap_or_else(|| panic!("there is no run {run}"))
}

fn json(outcome: &Outcome) -> serde_json::Value {
    serde_json::from_str(&outcome.out).unwrap_or_else(|error| panic!("{error}: {outcome:?}"))
}

fn loads(place: &Workplace, run: &str) -> Vec<f64> {
    let show = json(&place.run(["show", run, "--json"]).success());
    let steps = show["per_step"].as_array().unwrap();
    steps
        .iter()
        .map(|step| step["loads"][0].as_f64().unwrap())
        .collect()
}

/// Every file of a run, by name.
fn files(place: &Workplace, run: &str) -> BTreeMap<String, Vec<u8>> {
    let folder = place.store().join("packs").join(run);
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    entries
        .map(|path| {
            (
                path.file_name().unwrap().to_str().unwrap().to_owned(),
                fs::read(&path).unwrap(),
            )
        })
        .collect()
}

#[test]
fn a_branch_with_nothing_changed_is_its_parent_bit_for_bit_from_every_step() {
    let place = submitted(&parent());
    let calm = of(&place, "parent");
    assert!(
        calm.steps.len() > 5,
        "nothing was cut: the test shows nothing"
    );
    let before = files(&place, "parent");
    for step in [0, 1, 2, calm.steps.len() - 2] {
        let name = format!("same-{step}");
        let at = format!("parent@{step}");
        for verb in ["branch", "rerun"] {
            let name = format!("{name}-{verb}");
            place.run([verb, &at, "--name", &name]).success();
            assert_eq!(of(&place, &name), calm, "{verb} {at}");
            // The past is read from the parent: the branch holds what follows, and nothing else.
            let packs = files(&place, &name)
                .into_keys()
                .filter(|file| file.ends_with(".pack"));
            assert_eq!(packs.count(), calm.steps.len() - 1 - step, "{verb} {at}");
        }
    }
    assert_eq!(
        files(&place, "parent"),
        before,
        "a branch wrote into its parent"
    );
    place.run(["store", "check", "--deep"]).success();
}

#[test]
fn an_element_test_branches_like_a_body() {
    let input = "name: parent\nelement_test: { path: biaxial }\nmaterials: { sand: { rev: { grains: 30 } } }\n\
                 programme: [ { name: load, ramp: { axial: -0.002 }, steps: 4 } ]\n";
    let place = submitted(input);
    place
        .run(["branch", "parent@2", "--name", "same"])
        .success();
    assert_eq!(of(&place, "same"), of(&place, "parent"));
    place
        .run([
            "branch", "parent@2", "--ramp", "axial=0", "--steps", "2", "--name", "back",
        ])
        .success();
    let (parent, back) = (
        history::element_test(&place.store(), "parent"),
        history::element_test(&place.store(), "back"),
    );
    assert_eq!(back[..3], parent[..3]);
    assert_eq!(back[4].gradient[1][1], 1.0);
    assert!(
        back[3].stress[1][1] > parent[2].stress[1][1],
        "unloading does not unload"
    );
}

#[test]
fn a_branch_begins_with_the_loads_of_its_step_also_in_the_middle_of_an_increment() {
    let place = submitted(&parent());
    let parent = loads(&place, "parent");
    let show = json(&place.run(["show", "parent", "--json"]).success());
    let part = |step: usize| show["per_step"][step]["position"].as_f64().unwrap();
    let middle = (1..parent.len())
        .find(|&step| part(step) < 1.0)
        .expect("a step was cut");
    for step in [middle, 0, parent.len() - 1] {
        let (at, name) = (format!("parent@{step}"), format!("back-{step}"));
        let options = [
            "--ramp",
            "shortening=0.0002",
            "--steps",
            "2",
            "--name",
            &name,
        ];
        // Two iterations were to provoke cuts; a reversal needs more.
        let easier = [
            "--set",
            "solver.iterations=12",
            "--set",
            "solver.relaxation_iterations=150",
        ];
        place
            .run(["branch", &at].iter().chain(&options).chain(&easier))
            .success();
        let branch = loads(&place, &name);
        assert_eq!(branch[..=step], parent[..=step]);
        assert_eq!(
            digests(&place, &name)[..=step],
            digests(&place, "parent")[..=step]
        );
        assert_eq!(branch.last(), Some(&0.0002));
        let half = (parent[step] + 0.0002) / 2.0;
        assert!(
            branch[step + 1..].iter().any(|x| (x - half).abs() < 1e-15),
            "{branch:?}"
        );
    }
}

#[test]
fn a_branch_of_a_branch_of_a_branch_survives_kills_and_other_thread_counts() {
    static CALM: OnceLock<Vec<History>> = OnceLock::new();
    let second = [
        "branch",
        "parent@1",
        "--ramp",
        "shortening=0",
        "--steps",
        "3",
        "--name",
        "second",
    ];
    let third = [
        "branch",
        "second@3",
        "--cycle",
        "shortening=-0.001,0",
        "--steps",
        "2",
        "--name",
        "third",
    ];
    let fourth = [
        "branch",
        "third@5",
        "--set",
        "solver.force_tolerance=1e-4",
        "--name",
        "fourth",
    ];
    let input = inputs::biaxial("parent", 40, 2);
    let calm = CALM.get_or_init(|| {
        let place = submitted(&input);
        for branch in [&second[..], &third, &fourth] {
            place.run(branch).success();
        }
        ["second", "third", "fourth"]
            .map(|run| of(&place, run))
            .to_vec()
    });
    let place = submitted(&input);
    for (run, branch) in [
        ("second", &second[..]),
        ("third", &third),
        ("fourth", &fourth),
    ] {
        place
            .run(branch.iter().chain(&["--prepare-only"]))
            .success();
        assert_eq!(of(&place, run).state, RunState::Prepared);
        let ordeal = Ordeal {
            input: std::path::Path::new("unused"),
            run,
            threads: 1,
        };
        let mut hit = 0;
        for events in [3, 9] {
            let blow = Blow {
                events,
                then: std::time::Duration::from_millis(2),
                signal: Signal::KILL,
            };
            hit += u32::from(ordeal.hit(&place, blow).signal == Some(9));
        }
        assert!(hit > 0, "no kill hit {run}: the test shows nothing");
        place.run(["resume", run, "--threads", "2"]).success();
    }
    assert_eq!(
        ["second", "third", "fourth"]
            .map(|run| of(&place, run))
            .to_vec(),
        *calm
    );
    // A step before the fourth began to differ is the third's, and what follows there is the third's future.
    place
        .run(["branch", "fourth@4", "--name", "again"])
        .success();
    assert_eq!(of(&place, "again"), calm[1]);
    place
        .run(["branch", "fourth@5", "--name", "once-more"])
        .success();
    assert_eq!(of(&place, "once-more"), calm[2]);
}

#[test]
fn several_branches_of_one_command_are_named_apart_and_computed() {
    let place = submitted(&inputs::biaxial("parent", 40, 2));
    let made = place.run([
        "branch",
        "parent@1",
        "--set",
        "solver.force_tolerance=[1e-3, 1e-7]",
        "--json",
    ]);
    let made = json(&made.success());
    let name = |index: usize| made["runs"][index]["name"].as_str().unwrap().to_owned();
    assert_eq!(
        [name(0), name(1)],
        ["parent-force_tolerance-1e-3", "parent-force_tolerance-1e-7"]
    );
    assert_eq!(
        digests(&place, &name(0)),
        digests(&place, "parent"),
        "1e-3 is the default"
    );
    assert_ne!(digests(&place, &name(1)), digests(&place, "parent"));
    let file = place.write(
        "branches.yaml",
        "branches:\n  - { name: up, programme: { up: { ramp: { shortening: 0 }, steps: 1 } } }\n  \
         - programme: [ { name: wait, hold: {}, steps: 2 } ]\n    solver: { iterations: 20 }\n",
    );
    let made = place.run(["branch", "parent@1", file.to_str().unwrap(), "--json"]);
    let made = json(&made.success());
    let steps = made["runs"].as_array().unwrap().iter();
    let steps: Vec<_> = steps
        .map(|run| {
            (
                run["name"].as_str().unwrap(),
                run["steps"].as_u64().unwrap(),
            )
        })
        .collect();
    assert_eq!(steps, [("up", 2), ("parent-wait", 3)]);
}

#[test]
fn a_rerun_with_another_law_is_a_new_start_that_says_so() {
    let place = submitted(&inputs::biaxial("parent", 40, 3));
    let before = files(&place, "parent");
    let softer = [
        "rerun",
        "parent@1",
        "--set",
        "materials.sand.rev.friction=0.2",
        "--name",
        "slippery",
    ];
    place.run(softer).success();
    let (parent, slippery) = (of(&place, "parent"), of(&place, "slippery"));
    assert_eq!(slippery.steps[..2], parent.steps[..2]);
    assert_ne!(
        slippery.steps[2], parent.steps[2],
        "the friction does not act"
    );
    // Less friction bears less: the platen's force is smaller at the same shortening.
    let force = |run: &str| {
        let state = history::bodies(&place.store(), run).pop().unwrap();
        state.reactions.iter().map(|r| r.abs()).sum::<f64>()
    };
    assert!(force("slippery") < force("parent"));
    let show = place.run(["show", "slippery"]).success().out;
    assert!(
        show.contains("parent@1") && show.contains("friction 0.5 → 0.2"),
        "{show}"
    );
    assert!(show.contains("new start"), "{show}");
    // What goes on from there goes on under the new law.
    place
        .run(["branch", "slippery@2", "--name", "on"])
        .success();
    assert_eq!(of(&place, "on"), slippery);
    assert_eq!(files(&place, "parent"), before);
}

#[test]
fn what_would_change_the_past_is_refused_with_the_reason_and_nothing_is_made() {
    let place = submitted(&inputs::biaxial("parent", 40, 1));
    let mesh = place.write(
        "mesh.yaml",
        "solver: { iterations: 9 }\nmesh: { rectangle: { size: [1, 1], elements: [2, 2] } }\n",
    );
    let typo = place.write(
        "typo.yaml",
        "programme:\n  - { name: a, ramp: { shortning: 0 }, steps: 2 }\n",
    );
    let (mesh, typo) = (mesh.to_str().unwrap(), typo.to_str().unwrap());
    let cases: [(&[&str], &[&str]); 12] = [
        (
            &["branch", "parent@1", mesh],
            &[
                "mesh.yaml:2:1",
                "`mesh` decided what came before parent@1",
                "submit",
            ],
        ),
        (
            &["branch", "parent@1", typo],
            &[
                "typo.yaml:2:24",
                "no load `shortning`",
                "did you mean `shortening`?",
            ],
        ),
        (
            &[
                "branch",
                "parent@0",
                "--set",
                "materials.sand.rev.friction=0.1",
            ],
            &["--set:1:1", "rerun parent@0"],
        ),
        (
            &["branch", "parent@0", "--set", "solver.iteration=3"],
            &["--set:1:8", "did you mean `iterations`?"],
        ),
        (
            &["branch", "parent@0", "--set", "solver.iterations=many"],
            &["--set:1:19", "must be a whole number"],
        ),
        (
            &["branch", "parent@0", "--set", "solver.iterations"],
            &["there is no `=` in it"],
        ),
        (
            &[
                "branch",
                "parent@0",
                "--programme",
                "up: { ramp: { shortening: 0 } }",
            ],
            &["--programme:1", "`steps` is missing"],
        ),
        (
            &["branch", "parent@1"],
            &["the programme ends there", "--ramp"],
        ),
        (&["branch", "parent"], &["parent@last"]),
        (&["branch", "parent@7"], &["0 to 1"]),
        (
            &["rerun", "parent@0", "--set", "programme=[]"],
            &["a rerun keeps the programme", "branch parent@0"],
        ),
        (
            &["rerun", "parent@0", "--set", "materials.sand.rev.grains=50"],
            &["other grains", "`friction`", "submit"],
        ),
    ];
    for (command, expected) in cases {
        let refused = place.run(command).ended_with(2);
        for words in expected {
            assert!(refused.err.contains(words), "{command:?}: {}", refused.err);
        }
    }
    let runs = json(&place.run(["runs", "--json"]).success());
    assert_eq!(runs["runs"].as_array().unwrap().len(), 1, "{runs}");
}

#[test]
fn a_plan_names_what_is_shared_what_is_computed_and_why_and_writes_nothing() {
    let place = submitted(&inputs::biaxial("parent", 40, 3));
    let other = inputs::biaxial("parent", 40, 4).replace("seed: 7", "seed: 8");
    let other = place.write("other.yaml", &other);
    let before = files(&place, "parent");
    let plan = |command: &[&str]| {
        let text = place.run(["plan"].iter().chain(command)).success().out;
        let data = json(
            &place
                .run(["plan", "--json"].iter().chain(command))
                .success(),
        );
        (text, data["runs"][0].clone())
    };
    let (text, data) = plan(&[
        "branch",
        "parent@1",
        "--ramp",
        "shortening=0",
        "--steps",
        "5",
    ]);
    assert_eq!(
        (
            data["reused"]["steps"].as_u64(),
            data["increments"].as_f64()
        ),
        (Some(2), Some(5.0))
    );
    assert!(
        text.contains("(line 13 of the input) →") && text.contains("(--ramp)"),
        "{text}"
    );
    assert!(data["cpu_s"].as_f64().unwrap() > 0.0 && data["bytes"].as_f64().unwrap() > 0.0);
    let (_, data) = plan(&["rerun", "parent@2"]);
    assert_eq!(
        (
            data["increments"].as_f64(),
            data["changes"].as_array().unwrap().len()
        ),
        (Some(1.0), 0)
    );
    let (text, data) = plan(&["submit", other.to_str().unwrap()]);
    assert_eq!(data["increments"].as_f64(), Some(4.0));
    let seed = "materials.sand.rev.seed: 7 (line 5 of the input) → 8 (line 5 of the input)";
    assert!(
        text.contains(seed) && text.contains("programme: "),
        "{text}"
    );
    assert_eq!(data["reused"]["packings"], serde_json::json!([3, 0]));
    let (text, data) = plan(&["resume", "parent"]);
    assert!(
        data["increments"].as_f64() == Some(0.0) && text.contains("nothing"),
        "{text}"
    );
    place
        .run(["plan", "branch", "parent@9", "--hold", "--steps", "1"])
        .ended_with(2);
    assert_eq!(files(&place, "parent"), before);
    assert_eq!(
        json(&place.run(["runs", "--json"]).success())["runs"]
            .as_array()
            .unwrap()
            .len(),
        1
    );
}

#[test]
fn pruning_and_deleting_leave_what_other_runs_stand_on() {
    let place = submitted(&inputs::biaxial("parent", 40, 5));
    let calm = of(&place, "parent");
    place
        .run(["branch", "parent@2", "--name", "child", "--prepare-only"])
        .success();
    place.run(["delete", "parent"]).ended_with(2);
    let dry = place
        .run(["prune", "parent", "--keep-last", "1", "--dry-run"])
        .success()
        .out;
    assert!(dry.contains("1, 3 to 4"), "{dry}");
    assert_eq!(of(&place, "parent"), calm);
    place
        .run(["note", "parent", "the one with the band"])
        .success();
    place.run(["prune", "parent", "--keep-last", "1"]).success();
    place.run(["store", "check", "--deep"]).success();
    let show = place.run(["show", "parent"]).success().out;
    assert!(
        show.contains("the one with the band") && show.contains("pruned"),
        "{show}"
    );
    // Nothing is damaged, and nothing may say so.
    let gone = place.run(["show", "parent@1"]).ended_with(2).err;
    assert!(gone.contains("show RUN"), "{gone}");
    let export = place.run(["export", "parent"]).success().err;
    assert!(export.contains("3 pruned load steps"), "{export}");
    // The child goes on from the step that was kept for it, to the same bits; so does a rerun.
    place.run(["resume", "child"]).success();
    let digest = |run: &str| json(&place.run(["show", run, "--json"]).success())["digest"].clone();
    assert_eq!(digest("child"), digest("parent"));
    place.run(["rerun", "parent@4"]).ended_with(2);
    place
        .run(["rerun", "parent@2", "--name", "again"])
        .success();
    assert_eq!(digest("again"), digest("parent"));
    for run in ["again", "child", "parent"] {
        place.run(["delete", run]).success();
    }
    assert!(!place.store().join("packs/parent").exists());
    assert!(
        place
            .run(["log", "parent"])
            .ended_with(2)
            .err
            .contains("no runs")
    );
}
