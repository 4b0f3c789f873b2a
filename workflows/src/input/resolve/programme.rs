//! The programme: stages of one kind each, on loads that exist.

use super::follow;
use super::loads::Loads;
use super::read::Reader;
use super::subject::Subject;
use super::until::until;
use crate::input::document;
use crate::input::path::Path;
use crate::input::programme::{MOST_STEPS, Programme, Stage, Way};
use crate::input::report::list;

/// Reads the programme of what `subject` is; `None` where that could not be read.
pub fn read(
    reader: &mut Reader<'_, '_>,
    loads: &mut Loads,
    subject: Option<&Subject<'_>>,
) -> Option<Programme> {
    let section = Path::root().key("programme");
    let mut seen: Vec<String> = Vec::new();
    let mut stages = Some(Vec::new());
    for index in 0..reader.count(&section) {
        let stage = stage(reader, &section.index(index), loads, subject, &mut seen);
        stages = stages.zip(stage).map(|(mut stages, stage)| {
            stages.push(stage);
            stages
        });
    }
    let programme = Programme {
        past: Vec::new(),
        initial: loads.initial(),
        stages: stages.filter(|stages| !stages.is_empty())?,
    };
    if programme.len() > MOST_STEPS {
        let message = format!(
            "the programme has {} load steps, at most {MOST_STEPS} can be handled",
            programme.len()
        );
        reader.report.at(&section, message, None);
    }
    Some(programme)
}

fn stage(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    loads: &mut Loads,
    subject: Option<&Subject<'_>>,
    seen: &mut Vec<String>,
) -> Option<Stage> {
    // The name is looked at even where the rest of the stage is wrong.
    let name: Option<String> = reader.required(&path.key("name"));
    if let Some(name) = &name {
        if name.trim().is_empty() {
            let message = format!("`{}` is empty", path.key("name"));
            let help = "give the stage a name, as in `loading`: reports and plots call it so";
            reader
                .report
                .at(&path.key("name"), message, help.to_owned());
        } else if seen.contains(name) {
            let message = format!("there are two stages `{name}`");
            reader.report.at(
                &path.key("name"),
                message,
                "give each its own name".to_owned(),
            );
        }
        seen.push(name.clone());
    }
    let written: document::Stage = reader.required(path)?;
    let kinds = (
        &written.ramp,
        &written.hold,
        &written.cycle,
        &written.control,
    );
    let ways = match kinds {
        (Some(ramp), None, None, None) => {
            let path = path.key("ramp");
            let targets = ramp.iter().map(|(load, value)| (load.as_str(), *value));
            way(reader, &path, loads, targets).map(|way| vec![way])
        }
        (None, Some(_), None, None) => Some(vec![Way {
            targets: Vec::new(),
            control: None,
        }]),
        (None, None, None, Some(control)) => {
            let path = path.key("control");
            let control = follow::control(reader, &path, control, loads, subject);
            control.map(|control| {
                vec![Way {
                    targets: Vec::new(),
                    control: Some(control),
                }]
            })
        }
        (None, None, Some(cycle), None) => {
            let path = path.key("cycle");
            let there = way(
                reader,
                &path,
                loads,
                cycle.iter().map(|(load, value)| (load.as_str(), value[0])),
            )?;
            let targets = cycle
                .iter()
                .zip(&there.targets)
                .map(|((_, value), (load, _))| (*load, value[1]));
            let back = Way {
                targets: targets.collect(),
                control: None,
            };
            Some(vec![there, back])
        }
        _ => {
            let given = [
                ("ramp", written.ramp.is_some()),
                ("hold", written.hold.is_some()),
                ("cycle", written.cycle.is_some()),
                ("control", written.control.is_some()),
            ];
            let given: Vec<&str> = given
                .into_iter()
                .filter(|(_, given)| *given)
                .map(|(key, _)| key)
                .collect();
            let message = match given.as_slice() {
                [] if reader.is_misspelt(path) => return None,
                [] => format!("stage `{}` does nothing", written.name),
                several => format!(
                    "stage `{}` cannot be {} at once",
                    written.name,
                    list(several.iter().copied())
                ),
            };
            let help = "write exactly one of `ramp: { load: value }`, `hold: {}`, `cycle: { load: [value, value] }`, `control: { load: …, volume: … }`";
            reader.report.at(path, message, help.to_owned());
            None
        }
    };
    if written.times.is_some() && written.cycle.is_none() {
        let message = "`times` belongs to a cycle";
        let help = match written.ramp {
            Some(_) => {
                "remove it, or write `cycle` for `ramp`, with two values: `cycle: { load: [value, value] }`"
            }
            None => "remove it",
        };
        reader
            .report
            .at_key(&path.key("times"), message, help.to_owned());
    }
    let until = until(reader, &path.key("until"), &written.until, loads, subject);
    Some(Stage {
        name: written.name,
        until: until?,
        ways: ways?,
        times: written.times.unwrap_or(1),
        steps: written.steps,
    })
}

fn way<'a>(
    reader: &mut Reader<'_, '_>,
    path: &Path,
    loads: &mut Loads,
    targets: impl Iterator<Item = (&'a str, f64)>,
) -> Option<Way> {
    let mut found = Vec::new();
    let mut count = 0;
    for (name, target) in targets {
        count += 1;
        let place = path.key(name);
        if let Some(load) = loads.find(reader, &place, name) {
            found.push((load, target));
        }
    }
    if count == 0 {
        let help = "name a load and its value, as in `{ cavity: 0.2 }`; to change nothing write `hold: {}`";
        reader
            .report
            .at(path, format!("`{path}` names no load"), help.to_owned());
    }
    (found.len() == count && count > 0).then_some(Way {
        targets: found,
        control: None,
    })
}
