//! Looking after the store.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;
use store::{CheckReport, Depth, Finding, OpenError, Severity, Store};

use super::{CheckDepth, Context, open::refused, text};
use crate::{
    address::RunName,
    failure::{Failure, FailureKind},
    report::Report,
};

/// What the store holds and how much room it takes.
pub fn info(context: &Context<'_>) -> Result<Report, Failure> {
    let store = Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    let info = store
        .info()
        .map_err(|error| failed(context, "measure", error))?;
    let rows = [
        ("runs", info.runs.to_string()),
        ("committed load steps", info.steps.to_string()),
        ("runs and their packs", text::bytes(info.pack_bytes)),
        ("database", text::bytes(info.meta_bytes)),
        ("cache of packings", text::bytes(info.cache_bytes)),
        ("free on the disk", text::bytes(info.free_bytes)),
    ];
    let mut out = format!(
        "Store {}, format {}\n",
        context.store.display(),
        store::FORMAT_VERSION
    );
    for (what, value) in rows {
        let _ = writeln!(out, "  {what:<22}{value:>12}");
    }
    let data = json!({
        "store": context.store.display().to_string(),
        "format": store::FORMAT_VERSION,
        "runs": info.runs,
        "steps": info.steps,
        "pack_bytes": info.pack_bytes,
        "database_bytes": info.meta_bytes,
        "cache_bytes": info.cache_bytes,
        "free_bytes": info.free_bytes,
    });
    Ok(Report::new(out, &data))
}

/// Looks for damage: with the database where nobody owns the store, otherwise at the files alone.
pub fn check(context: &Context<'_>, depth: CheckDepth) -> Result<Report, Failure> {
    let depth = match depth {
        CheckDepth::Quick => Depth::Quick,
        CheckDepth::Deep => Depth::Deep,
    };
    let onlooker =
        Store::open_read_only(&context.store).map_err(|error| refused(context, error))?;
    let (repaired, found, scope) = match Store::open(&context.store) {
        Ok(store) => {
            let found = store
                .check(depth)
                .map_err(|error| failed(context, "check", error))?;
            (store.opening_report().to_vec(), found, "files and database")
        }
        Err(OpenError::Held { .. }) => {
            let found = onlooker
                .check(depth)
                .map_err(|error| failed(context, "check", error))?;
            (Vec::new(), found, "files only, as a process owns the store")
        }
        Err(error) => return Err(refused(context, error)),
    };
    let report = check_report(context, &repaired, &found, scope);
    let damaged = damaged_places(&repaired, &found);
    if damaged == 0 {
        return Ok(report);
    }
    let what = format!(
        "store {} is damaged in {}",
        context.store.display(),
        if damaged == 1 {
            "one place".to_owned()
        } else {
            format!("{damaged} places")
        }
    );
    Err(Failure::new(FailureKind::Store, what)
        .hint("each finding says what to do; what is not named is sound")
        .with(report))
}

/// The number of files and folders with damage, whether the opening met it or the check.
fn damaged_places(repaired: &[Finding], found: &CheckReport) -> usize {
    let damage = repaired.iter().chain(&found.findings);
    let places: BTreeSet<&Path> = damage
        .filter(|finding| finding.severity == Severity::Damage)
        .map(|finding| finding.path.as_path())
        .collect();
    places.len()
}

fn check_report(
    context: &Context<'_>,
    repaired: &[Finding],
    found: &CheckReport,
    scope: &str,
) -> Report {
    let mut out = format!(
        "Store {}: {} packs, {} looked at ({scope})\n",
        context.store.display(),
        found.packs,
        text::bytes(found.bytes)
    );
    let findings: Vec<&Finding> = repaired.iter().chain(&found.findings).collect();
    for finding in &findings {
        let _ = writeln!(
            out,
            "  {}: {}: {}",
            word(finding.severity),
            finding.path.display(),
            finding.what
        );
        if !finding.remedy.is_empty() {
            let _ = writeln!(out, "    {}", finding.remedy);
        }
    }
    if findings.is_empty() {
        out.push_str("  nothing is wrong\n");
    }
    let listed: Vec<_> = findings
        .iter()
        .map(|finding| {
            json!({
                "severity": word(finding.severity),
                "path": finding.path.display().to_string(),
                "what": finding.what,
                "remedy": finding.remedy,
            })
        })
        .collect();
    let data = json!({
        "sound": damaged_places(repaired, found) == 0,
        "packs": found.packs,
        "bytes": found.bytes,
        "scope": scope,
        "findings": listed,
    });
    Report::new(out, &data)
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Leftover => "leftover",
        Severity::Upgraded => "upgraded",
        Severity::Repaired => "repaired",
        Severity::Damage => "damage",
    }
}

/// Makes the database anew from the packs.
pub fn rebuild(context: &Context<'_>) -> Result<Report, Failure> {
    let store = super::open::open_existing(context)?;
    let report = store
        .rebuild()
        .map_err(|error| failed(context, "rebuild", error))?;
    let lost = match report.lost {
        0 => String::new(),
        1 => ", 1 load step is lost: `femdem-flow store check` says which".to_owned(),
        lost => format!(", {lost} load steps are lost: `femdem-flow store check` says which"),
    };
    let text = format!(
        "Database of {} rebuilt: {}, {}{lost}",
        context.store.display(),
        text::count(report.runs, "run"),
        text::count(report.steps, "load step")
    );
    let data = json!({ "runs": report.runs, "steps": report.steps, "lost": report.lost });
    Ok(Report::new(text, &data))
}

/// Sets a run back to a load step, the way out where a later one is damaged: what follows is set aside, and `resume`
/// computes it again.
pub fn set_back(context: &Context<'_>, run: &RunName, step: u64) -> Result<Report, Failure> {
    let store = super::open::open_existing(context)?;
    let names = store
        .names()
        .map_err(|error| failed(context, "list the runs of", error))?;
    let name = super::open::find(&names, run)?;
    let steps = store
        .steps(&name)
        .map_err(|error| failed(context, "list the load steps in", error))?;
    let numbers = || steps.iter().map(|record| record.index);
    if !numbers().any(|number| u64::from(number.0) == step) {
        let last = numbers().next_back().map_or(0, |number| number.0);
        let what = format!("failed to find load step {step} of run `{run}`");
        return Err(Failure::new(FailureKind::Usage, what)
            .hint(format!("its committed load steps are 0 to {last}")));
    }
    let aside = match numbers().find(|number| u64::from(number.0) > step) {
        Some(next) => store
            .set_back(&name, next)
            .map_err(|error| failed(context, "set a run back in", error))?,
        None => 0,
    };
    let text = format!(
        "Run `{run}` is back at load step {step}; set aside: {aside}\n`femdem-flow resume {run}` goes on from there"
    );
    let data = json!({ "name": run.as_str(), "step": step, "set_aside": aside });
    Ok(Report::new(text, &data))
}

fn failed(
    context: &Context<'_>,
    what: &str,
    error: impl std::error::Error + Send + Sync + 'static,
) -> Failure {
    let what = format!("failed to {what} the store {}", context.store.display());
    Failure::new(FailureKind::Store, what).because(error)
}
