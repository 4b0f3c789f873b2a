//! Where a run comes from and what comes from it.

use serde_json::{Value, json};

use super::{
    manifest::Kind,
    view::{RunView, View},
};

/// Runs that take up a step of `run`: name and the step, in the order of the names. Runs that cannot be read are left
/// out: `runs` names them.
pub fn children(view: &View, run: &RunView) -> Vec<(String, u32)> {
    let names = view.store.run_names().unwrap_or_default();
    names
        .into_iter()
        .filter_map(|name| {
            let record = view.store.run(&name).ok()?;
            let parent = record.parent.as_ref()?;
            (parent.run == *run.id()).then(|| (record.shown().to_string(), parent.step.0))
        })
        .collect()
}

/// The lines of `show` on parent, changes and branches.
pub fn in_words(view: &View, run: &RunView) -> String {
    let mut text = String::new();
    if let (Some(parent), Some(descent)) = (&run.record.parent, &run.manifest.descent) {
        let (what, hint) = match descent.kind {
            Kind::Branch => ("branch of", ""),
            Kind::Rerun => ("rerun of", ""),
            Kind::Seeded => (
                "new start",
                ": these settings could not have come to the states of that step",
            ),
        };
        let parent = view.shown(parent);
        text.push_str(&format!("  {what:<10} {parent}{hint}\n"));
        for change in &descent.changes {
            text.push_str(&format!(
                "             {} {} → {} ({})\n",
                change.key, change.from, change.to, change.to_place
            ));
        }
    }
    for note in &run.place.notes {
        text.push_str(&format!("  note       {note}\n"));
    }
    let children = children(view, run);
    if !children.is_empty() {
        let list: Vec<String> = children
            .iter()
            .map(|(name, step)| format!("{name} from {step}"))
            .collect();
        text.push_str(&format!("  taken up   by {}\n", list.join(", ")));
    }
    text
}

/// The same for machines: what sets the run apart from its parent, and the runs that take it up.
pub fn data(view: &View, run: &RunView) -> (Value, Value) {
    let descent = run.manifest.descent.as_ref().map(|descent| {
        let changes: Vec<Value> = descent.changes.iter().map(|change| json!(change)).collect();
        json!({ "kind": descent.kind.word(), "changes": changes })
    });
    let children: Vec<Value> = children(view, run)
        .into_iter()
        .map(|(name, step)| json!({ "name": name, "step": step }))
        .collect();
    (json!(descent), json!(children))
}
