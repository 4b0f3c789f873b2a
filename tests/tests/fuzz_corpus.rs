//! What others write is read by us: inputs by hand, packings of other codes, files that a disk has changed. Whatever the
//! bytes are, they end in an answer and never in a panic, which would take a run or a whole store with it. The corpus of
//! the fuzz targets and a bounded number of mutations of it go through the same functions as under `cargo fuzz`.

#[path = "../../fuzz/src/entries.rs"]
mod entries;

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use tests::folder;
use tests::random::Random;

/// Mutations of a target that only computes; `FUZZ_ROUNDS=N` does N times as many.
const MANY: u64 = 4000;
/// Mutations of a target that writes files.
const SOME: u64 = 800;

fn corpus(target: &str, further: &[&str]) -> Vec<(PathBuf, Vec<u8>)> {
    let own = format!("fuzz/corpus/{target}");
    let folders = [own.as_str()].into_iter().chain(further.iter().copied());
    let files: Vec<PathBuf> = folders
        .flat_map(|folder| folder::files_below(&tests::root().join(folder)))
        .collect();
    assert!(files.len() >= 2, "{target}: {files:?}");
    let read = |path: PathBuf| (path.clone(), fs::read(path).expect("a file can be read"));
    files.into_iter().map(read).collect()
}

/// Calls the entry; where it panics, the bytes are kept for the corpus.
fn withstands(target: &str, entry: fn(&[u8]), bytes: &[u8], what: &Path) {
    if catch_unwind(AssertUnwindSafe(|| entry(bytes))).is_err() {
        let kept = std::env::temp_dir().join(format!("fuzz-{target}"));
        fs::write(&kept, bytes).expect("a file can be written");
        panic!(
            "{target} does not withstand a mutation of {}, kept as {}",
            what.display(),
            kept.display()
        );
    }
}

/// One to four changes: a bit, a byte, bytes taken out, doubled, or brought in from another file.
fn mutated(bytes: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len() as u64 + 1) as usize;
        let end = bytes.len().min(at + random.below(40) as usize);
        match random.below(6) {
            0 => bytes.truncate(at),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let twice = bytes[at..end].to_vec();
                bytes.splice(at..at, twice);
            }
            3 => {
                let from = random.below(other.len() as u64 + 1) as usize;
                let to = other.len().min(from + random.below(60) as usize);
                bytes.splice(at..at, other[from..to].iter().copied());
            }
            4 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            _ => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = random.below(256) as u8;
                }
            }
        }
    }
    bytes
}

fn replay(target: &str, entry: fn(&[u8]), further: &[&str], rounds: u64) {
    let corpus = corpus(target, further);
    for (path, bytes) in &corpus {
        withstands(target, entry, bytes, path);
    }
    let times = std::env::var("FUZZ_ROUNDS").ok();
    let rounds = rounds * times.and_then(|times| times.parse().ok()).unwrap_or(1);
    let mut random = Random::new(1);
    let any = |random: &mut Random| &corpus[random.below(corpus.len() as u64) as usize];
    for _ in 0..rounds {
        let ((path, bytes), (_, other)) = (any(&mut random), any(&mut random));
        withstands(target, entry, &mutated(bytes, other, &mut random), path);
    }
}

#[test]
fn any_input_is_taken_or_refused() {
    replay(
        "yaml",
        entries::yaml,
        &["workflows/examples", "workflows/tests/wrong"],
        MANY,
    );
}

#[test]
fn any_mesh_is_taken_or_refused() {
    replay("mesh", entries::mesh, &["workflows/tests/meshes"], MANY);
}

#[test]
fn any_packing_is_taken_or_refused() {
    replay("packing", entries::packing, &[], MANY);
}

#[test]
fn any_pack_is_read_or_refused() {
    replay("pack", entries::pack, &[], SOME);
}

#[test]
fn any_journal_is_read_as_far_as_it_is_sound() {
    replay("part", entries::part, &[], SOME);
}

#[test]
fn any_record_is_read_or_refused() {
    replay("record", entries::record, &[], SOME);
}
