//! The examples are what users copy. Each one, made smaller, is taken and its first load step computed; what `workflows`
//! checks about their numbers stays there.

use std::fs;

use tests::history;
use tests::workplace::Workplace;

/// The last number of `key: …` inside the flow mapping or line where it stands, replaced.
fn with(text: &str, key: &str, value: &str) -> String {
    let lines = text
        .lines()
        .map(|line| match line.split_once(&format!("{key}: ")) {
            Some((before, after)) => {
                let end = after.find([' ', ',', '}']).unwrap_or(after.len());
                format!("{before}{key}: {value}{}\n", &after[end..])
            }
            None => format!("{line}\n"),
        });
    lines.collect()
}

/// The example with 30 grains, few elements, the first stage only and of that the first step.
fn reduced(text: &str) -> String {
    let text = with(text, "grains", "30");
    let text = text
        .replace("elements: [8, 16]", "elements: [2, 2]")
        .replace("elements: [6, 8]", "elements: [2, 3]")
        .replace("elements: [51]", "elements: [1]");
    let programme = text.lines().position(|line| line == "programme:");
    let first = programme.expect("an example has a programme of one-line stages") + 1;
    let kept: Vec<&str> = text.lines().take(first + 1).collect();
    let (before, ramp) = kept[first]
        .split_once("ramp: { ")
        .expect("it begins with a ramp");
    let (load, rest) = ramp.split_once(": ").expect("the ramp drives a load");
    let (target, _) = rest.split_once(' ').expect("to a value");
    let target: f64 = target.parse().expect("which is a number");
    let steps = text
        .lines()
        .nth(first)
        .and_then(|line| line.split_once("steps: "));
    let steps = steps
        .and_then(|(_, after)| after.split([' ', '}']).next())
        .expect("in some steps");
    let steps: f64 = steps.parse().expect("a number of them");
    let start = match load {
        "cavity" => 1.0,
        _ => 0.0,
    };
    let target = start + (target - start) / steps;
    format!(
        "{}\n{before}ramp: {{ {load}: {target} }}, steps: 1 }}\n",
        kept[..first].join("\n")
    )
}

#[test]
fn every_example_starts() {
    let folder = tests::root().join("workflows/examples");
    let examples: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    let (meshes, mut examples): (Vec<_>, Vec<_>) = examples
        .into_iter()
        .partition(|path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "msh"));
    examples.retain(|path| path.extension().is_some_and(|e| e == "yaml"));
    examples.sort();
    assert!(examples.len() >= 4);
    for example in examples {
        let place = Workplace::new();
        for mesh in &meshes {
            fs::copy(mesh, place.dir().join(mesh.file_name().unwrap())).unwrap();
        }
        let name = example.file_stem().unwrap().to_str().unwrap();
        let file = place.write(
            &format!("{name}.yaml"),
            &reduced(&fs::read_to_string(&example).unwrap()),
        );
        let outcome = place.run(["submit", file.to_str().unwrap()]).success();
        assert!(outcome.out.contains(name), "{}", outcome.out);
        let history = history::of(&place.store(), name).expect("the run has the name of the file");
        assert!(history.steps.len() >= 2, "{name}: nothing was computed");
    }
}
