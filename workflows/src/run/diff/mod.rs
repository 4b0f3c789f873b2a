//! Where two runs part: `femdem-flow diff`.

mod field;
mod points;
mod waves;

use std::path::Path;

use serde_json::json;
use store::{StepHealth, StepIndex};

use self::{points::Apart, waves::Parting};
use super::{
    Context,
    error::RunError,
    frames::{DEAL, MACRO, PACKING, POINT, PROGRESS},
    open::explain,
    place::place_of,
    text::{self, Align, Table},
    view::{RunView, View},
};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    report::Report,
};

/// How many REVs are listed for people.
const MOST_REVS: usize = 10;

/// Names the first step, iteration and REV at which two runs part, how far apart they are there, and writes the mesh
/// coloured by that to `into`.
///
/// # Errors
/// A run or step that cannot be read; an output that has no mesh to show or no difference.
pub fn diff(
    context: &Context<'_>,
    a: &RunName,
    b: &RunName,
    into: Option<&Path>,
) -> Result<Report, Failure> {
    let view = View::open(context)?;
    let runs = [view.run(a)?, view.run(b)?];
    let what = format!("compare `{a}` with `{b}`");
    let compared = compare(&view, &runs).map_err(|error| explain(&what, error))?;
    let Some(parted) = compared.parted else {
        return same(&runs, compared.common, into);
    };
    let written = match into {
        Some(path) => {
            field::write(&view, &runs, parted.step, &parted.apart, path).map_err(|error| {
                Failure::new(FailureKind::Usage, format!("failed to {what}")).because(error)
            })?;
            Some(path.display().to_string())
        }
        None => None,
    };
    Ok(describe(&runs, &parted, written))
}

/// What a comparison found.
struct Compared {
    /// Steps that both have.
    common: usize,
    parted: Option<Parted>,
}

/// The first step that differs.
struct Parted {
    step: StepIndex,
    /// Kinds of content that differ, in words.
    contents: Vec<&'static str>,
    /// Iteration of the step from which on the runs differ, and in what.
    parting: Option<Parting>,
    /// Gauss points whose states or stresses differ, in order.
    apart: Vec<Apart>,
    /// Gauss points compared.
    points: usize,
}

fn compare(view: &View, runs: &[RunView; 2]) -> Result<Compared, RunError> {
    let [a, b] = runs;
    let mut common = 0;
    for left in &a.steps {
        let index = left.record.index;
        let Some(right) = b.steps.iter().find(|step| step.record.index == index) else {
            continue;
        };
        common += 1;
        // A damaged step has no digest to compare: reading it says what is wrong.
        if left.record.digest.is_some() && left.record.digest == right.record.digest {
            continue;
        }
        let pruned = [left, right]
            .iter()
            .any(|step| step.record.health == StepHealth::Pruned);
        if pruned {
            let parted = Parted {
                step: index,
                contents: vec!["the digest; the states are pruned"],
                parting: None,
                apart: Vec::new(),
                points: 0,
            };
            return Ok(Compared {
                common,
                parted: Some(parted),
            });
        }
        let readers = [
            view.store.step(a.id(), index)?,
            view.store.step(b.id(), index)?,
        ];
        let (apart, points) = points::apart(view, runs, &readers)?;
        let parted = Parted {
            step: index,
            contents: contents(&readers),
            parting: waves::parting(&readers, [&left.summary, &right.summary]),
            apart,
            points,
        };
        return Ok(Compared {
            common,
            parted: Some(parted),
        });
    }
    Ok(Compared {
        common,
        parted: None,
    })
}

/// The kinds of frames that differ: by their hashes, without reading them.
fn contents(readers: &[store::StepReader; 2]) -> Vec<&'static str> {
    const NAMES: [(u16, &str); 5] = [
        (PACKING, "packings"),
        (DEAL, "which point got which packing"),
        (POINT, "states of Gauss points"),
        (MACRO, "macro state"),
        (PROGRESS, "place in the programme"),
    ];
    let hashes = |kind: u16, reader: &store::StepReader| -> Vec<_> {
        let frames = reader.frames().into_iter();
        frames
            .filter(|frame| frame.id.kind == kind)
            .map(|frame| (frame.id, frame.hash))
            .collect()
    };
    let [a, b] = readers;
    let differing = NAMES
        .iter()
        .filter(|(kind, _)| hashes(*kind, a) != hashes(*kind, b));
    differing.map(|(_, name)| *name).collect()
}

fn same(runs: &[RunView; 2], common: usize, into: Option<&Path>) -> Result<Report, Failure> {
    let [a, b] = runs;
    if common == 0 {
        let what = format!(
            "failed to compare `{}` with `{}`: they have no load step of the same number",
            a.name(),
            b.name()
        );
        return Err(Failure::new(FailureKind::Usage, what));
    }
    let mut text = format!(
        "`{}` and `{}` are the same bits in all {} that both have\n",
        a.name(),
        b.name(),
        text::count(common, "step")
    );
    if a.last_index() != b.last_index() {
        text.push_str(&format!(
            "  `{}` ends at step {}, `{}` at step {}\n",
            a.name(),
            a.last_index(),
            b.name(),
            b.last_index()
        ));
    }
    if into.is_some() {
        text.push_str("  nothing differs, so no file was written\n");
    }
    let data = json!({
        "a": a.name().as_str(),
        "b": b.name().as_str(),
        "equal": true,
        "common_steps": common,
    });
    Ok(Report::new(text, &data))
}

fn describe(runs: &[RunView; 2], parted: &Parted, written: Option<String>) -> Report {
    let [a, b] = runs;
    let mut out = format!(
        "`{}` and `{}` part at load step {}\n  differing  {}\n",
        a.name(),
        b.name(),
        parted.step,
        parted.contents.join(", ")
    );
    if let Some(parting) = &parted.parting {
        out.push_str(&format!("  iteration  {}\n", parting.phrase()));
    }
    out.push_str(&format!(
        "  points     {} of {} differ",
        parted.apart.len(),
        parted.points
    ));
    if let Some(first) = parted.apart.first() {
        out.push_str(&format!(", the first is {}", place_of(a, first.point)));
    }
    out.push('\n');
    let mut furthest: Vec<&Apart> = parted.apart.iter().collect();
    furthest.sort_by(|x, y| x.furthest_first(y));
    let mut table = Table::new([
        ("furthest apart", Align::Left),
        ("stress", Align::Right),
        ("positions / diameter", Align::Right),
        ("cell", Align::Right),
        ("contacts in one only", Align::Right),
    ]);
    for apart in furthest.iter().take(MOST_REVS) {
        table.row([
            place_of(a, apart.point).to_string(),
            format!("{:.2e}", apart.stress),
            format!("{:.2e}", apart.positions),
            format!("{:.2e}", apart.cell),
            apart.contacts.to_string(),
        ]);
    }
    if !furthest.is_empty() {
        out.push_str(&table.render("  "));
    }
    if let Some(file) = &written {
        out.push_str(&format!("  written    {file}\n"));
    }
    let revs: Vec<_> = parted
        .apart
        .iter()
        .map(|apart| {
            json!({
                "rev": place_of(a, apart.point).to_string(),
                "stress": apart.stress,
                "positions": apart.positions,
                "cell": apart.cell,
                "contacts": apart.contacts,
            })
        })
        .collect();
    let data = json!({
        "a": a.name().as_str(),
        "b": b.name().as_str(),
        "equal": false,
        "step": parted.step.0,
        "contents": parted.contents,
        "iteration": parted.parting.as_ref().map(Parting::to_json),
        "points": parted.points,
        "revs": revs,
        "file": written,
    });
    Report::new(out, &data)
}
