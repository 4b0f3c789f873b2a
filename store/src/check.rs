//! Looking for damage and leftovers. Findings are what is wrong in the store; errors are what kept us from
//! looking.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::cache;
use crate::error::{CheckError, ReadError};
use crate::files;
use crate::id::{Digest, RunName, StepAddress};
use crate::label;
use crate::layout::{Layout, RunFile};
use crate::queue::Queue;
use crate::run;
use crate::source::Source;
use crate::step::{StepHealth, StepReader};

/// How closely to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Records, trailers, indexes, lineage, leftovers.
    Quick,
    /// All that, and every byte of every pack.
    Deep,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Something that costs nothing but space.
    Leftover,
    /// Something was of an earlier format and is of the present one now.
    Upgraded,
    /// Something was wrong and has been put right.
    Repaired,
    /// Something is lost or unreadable.
    Damage,
}

/// One thing found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// The file or folder.
    pub path: PathBuf,
    /// What is the matter.
    pub what: String,
    /// What to do about it; empty where nothing need be done.
    pub remedy: String,
}

impl Finding {
    pub(crate) fn new(severity: Severity, path: &Path, what: &str, remedy: &str) -> Self {
        Self {
            severity,
            path: path.to_owned(),
            what: what.to_owned(),
            remedy: remedy.to_owned(),
        }
    }

    pub(crate) fn damage(path: &Path, error: &ReadError) -> Self {
        match error {
            ReadError::Damaged(damage) => {
                Self::new(Severity::Damage, &damage.path, &damage.what, &damage.remedy)
            }
            other => {
                let what = format!("failed to {other}");
                Self::new(Severity::Damage, path, &what, "see the message")
            }
        }
    }
}

/// What a check found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CheckReport {
    /// What was found, run by run.
    pub findings: Vec<Finding>,
    /// Packs looked at, cache entries included.
    pub packs: usize,
    /// Their bytes.
    pub bytes: u64,
}

impl CheckReport {
    /// Whether nothing is lost or unreadable.
    pub fn is_sound(&self) -> bool {
        self.findings
            .iter()
            .all(|finding| finding.severity != Severity::Damage)
    }
}

/// Checks everything but the database.
pub(crate) fn files(source: &impl Source, depth: Depth) -> Result<CheckReport, CheckError> {
    let layout = source.layout();
    let mut report = CheckReport::default();
    let mut digests = BTreeMap::new();
    let names = layout.run_names()?;
    for name in &names {
        check_run(source, name, depth, &mut digests, &mut report)?;
    }
    check_lineage(source, &names, &digests, &mut report);
    for dir in layout.unfinished_runs()? {
        report.findings.push(Finding::new(
            Severity::Leftover,
            &dir,
            "a run that was never finished being created or deleted",
            "the next opening for writing removes it",
        ));
    }
    check_cache(layout, depth, &mut report)?;
    check_queue(layout, &mut report)?;
    Ok(report)
}

fn check_queue(layout: &Layout, report: &mut CheckReport) -> Result<(), CheckError> {
    let queue = Queue::of(layout.root());
    for entry in queue.entries()? {
        if let Err(what) = &entry.payload {
            report.findings.push(Finding::new(
                Severity::Damage,
                &layout.queue(),
                &format!(
                    "number {} of the queue cannot be read: failed to {what}",
                    entry.id
                ),
                "remove it from the queue and queue the work again",
            ));
        }
    }
    Ok(())
}

type Digests = BTreeMap<StepAddress, (Digest, Option<(StepAddress, Digest)>)>;

fn check_run(
    source: &impl Source,
    name: &RunName,
    depth: Depth,
    digests: &mut Digests,
    report: &mut CheckReport,
) -> Result<(), CheckError> {
    let layout = source.layout();
    for error in run::damaged_records(layout, name) {
        report
            .findings
            .push(Finding::damage(&layout.run(name), &error));
    }
    if let Err(error) = run::read_state(layout, name) {
        report
            .findings
            .push(Finding::damage(&layout.state(name), &error));
    }
    if let Err(error) = label::read(layout, name) {
        let finding = Finding::damage(&layout.label(name), &error);
        report.findings.push(finding);
    }
    let steps = match source.own_steps(name) {
        Ok(steps) => steps,
        Err(error) => {
            report
                .findings
                .push(Finding::damage(&layout.run(name), &error));
            Vec::new()
        }
    };
    let next = steps.last().map(|step| step.index.0.saturating_add(1));
    for step in steps {
        let path = layout.pack(name, step.index);
        let address = step.address();
        if step.health == StepHealth::Missing && !path.exists() {
            let error = ReadError::PackMissing {
                step: address,
                path: path.clone(),
            };
            report.findings.push(Finding::damage(&path, &error));
            continue;
        }
        if let (StepHealth::Pruned, Some(digest)) = (&step.health, step.digest) {
            // What it continued from went with its pack; what continues from it can still be held against it.
            digests.insert(address, (digest, None));
            continue;
        }
        report.packs += 1;
        report.bytes += crate::pack::stored_bytes(&path);
        match check_step(&path, &address, depth) {
            Ok(facts) => drop(digests.insert(address, facts)),
            Err(error) => report.findings.push(Finding::damage(&path, &error)),
        }
    }
    for (path, file) in layout.run_files(name)? {
        let what = match file {
            RunFile::Part(step, _) if next.is_some_and(|next| step.0 < next) => {
                "a journal of a step that is committed"
            }
            RunFile::Part(step, _) if next.is_some_and(|next| step.0 > next) => {
                "a journal of a step that cannot come next"
            }
            RunFile::SetAside => "a step that was set aside",
            RunFile::Stub(step) if layout.pack(name, step).exists() => {
                "the stub of a step that was not pruned after all"
            }
            // The owner of the store may be writing it at this moment.
            RunFile::Temporary
            | RunFile::Part(..)
            | RunFile::Pack(_)
            | RunFile::Stub(_)
            | RunFile::Other => continue,
        };
        let remedy = "remove it when you do not need it";
        report
            .findings
            .push(Finding::new(Severity::Leftover, &path, what, remedy));
    }
    Ok(())
}

type StepFacts = (Digest, Option<(StepAddress, Digest)>);

fn check_step(path: &Path, address: &StepAddress, depth: Depth) -> Result<StepFacts, ReadError> {
    let reader = StepReader::open(path, address)?;
    if depth == Depth::Deep {
        reader.verify()?;
    }
    let before = reader
        .predecessor()
        .map(|(address, digest)| (address.clone(), digest));
    Ok((reader.digest(), before))
}

/// Every step must continue from the step it says it continues from, with the content that one had.
fn check_lineage(
    source: &impl Source,
    names: &[RunName],
    digests: &Digests,
    report: &mut CheckReport,
) {
    let layout = source.layout();
    for (address, (_, before)) in digests {
        let Some((before, digest)) = before else {
            continue;
        };
        let what = match digests.get(before) {
            Some((found, _)) if found == digest => continue,
            Some(_) => format!("it continues from {before}, which has another content now"),
            // Reported where the predecessor's own run was checked, if that run still exists.
            None if names.contains(&before.run) => continue,
            None => format!("it continues from {before}, which is gone"),
        };
        let path = layout.pack(&address.run, address.step);
        let remedy = "restore that step from a copy";
        report
            .findings
            .push(Finding::new(Severity::Damage, &path, &what, remedy));
    }
}

fn check_cache(layout: &Layout, depth: Depth, report: &mut CheckReport) -> Result<(), CheckError> {
    for name in files::list(&layout.cache())? {
        let path = layout.cache().join(&name);
        let Some(key) = name.strip_suffix(".pack").and_then(Digest::from_hex) else {
            continue;
        };
        report.packs += 1;
        report.bytes += crate::pack::stored_bytes(&path);
        let sound = cache::read(&path, &key).and_then(|_| match depth {
            Depth::Quick => Ok(()),
            Depth::Deep => crate::pack::PackFile::open(&path)?.verify(),
        });
        if sound.is_err() {
            report.findings.push(Finding::new(
                Severity::Leftover,
                &path,
                "a damaged cache entry, which is not used",
                "remove it; it will be computed again",
            ));
        }
    }
    Ok(())
}
