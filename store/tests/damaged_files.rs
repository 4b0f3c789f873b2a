//! Disks lose bits and tails. Over all files of a store: each damage ends as a repair or as an error that
//! names the file, never as a panic, an empty store, a missing step, or other bytes than were written.

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use common::*;
use store::{Depth, Digest, OpenError, ReadError, StepIndex, Store};

/// A small generator of our own (splitmix64), so that a failure names one reproducible case.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

fn files_below(dir: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            files_below(&path, out);
        } else {
            out.push(path);
        }
    }
}

/// Flips a bit, cuts the tail, or fills a stretch with zeros as a lost page does; says which.
fn damage(bytes: &mut Vec<u8>, random: &mut Random) -> String {
    if bytes.is_empty() {
        bytes.push(1);
        return "one byte added".to_owned();
    }
    let at = random.below(bytes.len());
    match random.below(4) {
        0 => {
            bytes.truncate(at);
            format!("cut at {at}")
        }
        1 => {
            let end = bytes.len().min(at + 64);
            bytes[at..end].iter_mut().for_each(|byte| *byte = !*byte);
            format!("64 bytes garbled at {at}")
        }
        _ => {
            bytes[at] ^= 1 << random.below(8);
            format!("a bit flipped at {at}")
        }
    }
}

/// Reads all there is; every answer must be the original or an error that names the file.
fn examine(dir: &Path, victim: &Path, original: &[Digest], case: &str) {
    let names = |error: &str| error.contains(&*victim.display().to_string());
    let store = match Store::open(dir) {
        Ok(store) => store,
        Err(error) => {
            let text = error.to_string();
            let format = victim.ends_with("FORMAT");
            let clear = matches!(error, OpenError::UnknownFormat { .. }) || names(&text);
            assert!(format && clear, "{case}: {text}");
            return;
        }
    };
    assert_eq!(store.run_names().unwrap(), [name("a"), name("b")], "{case}");
    let onlooker = Store::open_read_only(dir).unwrap();
    let mut lost = 0;
    for run in [name("a"), name("b")] {
        assert_eq!(
            store.run(&run).unwrap().manifest,
            format!("manifest of {run}").as_bytes()
        );
        let steps = store.steps(&run).unwrap();
        assert_eq!(onlooker.steps(&run).unwrap().len(), steps.len(), "{case}");
        let listed: Vec<_> = steps.iter().map(|step| step.index.0).collect();
        assert_eq!(listed, [1, 2, 3], "{case}: steps went missing");
        for record in steps {
            let known = original[record.index.0 as usize - 1];
            assert!(record.digest.is_none_or(|digest| digest == known), "{case}");
            match read_all(&store, &run, record.index) {
                Ok(frames) => assert_eq!(frames, expected(record.index.0), "{case}"),
                Err(error) => {
                    assert!(names(&error.to_string()), "{case}: {error}");
                    lost += 1;
                }
            }
        }
    }
    let journal = onlooker.read_wave(&name("a"), StepIndex(4), WAVE).unwrap();
    for frame in journal.iter().flat_map(|wave| &wave.frames) {
        assert_eq!(frame.payload, state(4, frame.id.index, 40), "{case}");
    }
    let cached = store.cache_get(&Digest::of(b"key"));
    assert!(
        cached.is_none_or(|payload| payload == state(0, 0, 30)),
        "{case}"
    );
    // A flip in a pack's own unread bytes (say its header frame) is for the deep check to find.
    let report = store.check(Depth::Deep).unwrap();
    let in_pack =
        victim.extension().is_some_and(|e| e == "pack") && victim.starts_with(dir.join("packs"));
    assert_eq!(report.is_sound(), !in_pack, "{case}: {:?}", report.findings);
    assert!(lost == 0 || in_pack, "{case}");
}

type Frames = Vec<(store::FrameId, Vec<u8>)>;

fn read_all(store: &Store, run: &store::RunName, step: StepIndex) -> Result<Frames, ReadError> {
    let reader = store.step(run, step)?;
    assert_eq!(
        reader.summary().unwrap_or_else(|_| summary(step.0)),
        summary(step.0)
    );
    let ids = reader.ids().into_iter();
    ids.map(|id| Ok((id, reader.frame(id)?))).collect()
}

#[test]
fn any_damage_to_any_file_is_repaired_or_named() {
    let original = tempfile::tempdir().unwrap();
    build(original.path());
    let store = Store::open(original.path()).unwrap();
    let steps = store.steps(&name("a")).unwrap();
    let digests: Vec<_> = steps.iter().filter_map(|step| step.digest).collect();
    drop(store);
    let mut files = Vec::new();
    files_below(original.path(), &mut files);
    assert!(files.len() > 12);
    let mut random = Random(1);
    for round in 0..CASES {
        let from = &files[round % files.len()];
        let relative = from.strip_prefix(original.path()).unwrap();
        let dir = tempfile::tempdir().unwrap();
        copy_folder(original.path(), dir.path());
        let victim = dir.path().join(relative);
        let mut bytes = fs::read(&victim).unwrap();
        let what = damage(&mut bytes, &mut random);
        fs::write(&victim, bytes).unwrap();
        let case = format!("case {round}: {}, {what}", relative.display());
        examine(dir.path(), &victim, &digests, &case);
    }
}

/// Each case opens a database, which costs some flushes to the disk.
const CASES: usize = 300;
