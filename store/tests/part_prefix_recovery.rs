//! A killed step goes on from its journal: whatever the kill cut, whole frames before the cut count and
//! nothing else does.

mod common;

use std::fs;

use common::*;
use store::{Frame, StepIndex, Store, WaveOpening};

fn part(dir: &std::path::Path) -> std::path::PathBuf {
    dir.join("packs/a/00000004.wave000000.part")
}

/// The frames in the journal now, if it has anything sound.
fn recovered(store: &Store) -> Option<Vec<Frame>> {
    let mut journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    let wave = journal.read_wave(WAVE).unwrap()?;
    assert_eq!(wave.header, b"header");
    Some(wave.frames)
}

fn sorted(mut frames: Vec<Frame>) -> Vec<(store::FrameId, Vec<u8>)> {
    frames.sort_by_key(|frame| frame.id);
    frames.into_iter().map(|f| (f.id, f.payload)).collect()
}

#[test]
fn a_cut_at_any_byte_leaves_the_longest_valid_prefix() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let path = part(dir.path());
    let whole = fs::read(&path).unwrap();
    let store = Store::open(dir.path()).unwrap();
    let written = wave_frames(4, 10);
    let mut last = None;
    for cut in 0..=whole.len() {
        fs::write(&path, &whole[..cut]).unwrap();
        let count = match recovered(&store) {
            None => None,
            Some(frames) => {
                let expected = written[..frames.len()].to_vec();
                assert_eq!(sorted(frames.clone()), sorted(expected), "cut at {cut}");
                Some(frames.len())
            }
        };
        assert!(count >= last, "a longer file gave less, cut at {cut}");
        last = count;
    }
    assert_eq!(last, Some(10));
}

#[test]
fn after_a_torn_write_the_journal_is_continued_behind_the_last_whole_frame() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let path = part(dir.path());
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 5]).unwrap();
    let store = Store::open(dir.path()).unwrap();
    let mut journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    let torn = journal.read_wave(WAVE).unwrap().unwrap().torn;
    assert!(torn > 0);
    let opening = journal.open_wave(WAVE, b"header").unwrap();
    assert_eq!(opening, WaveOpening::Continued { frames: 9 });
    journal.append(WAVE, &wave_frames(4, 10)[9]).unwrap();
    assert_eq!(journal.read_wave(WAVE).unwrap().unwrap().torn, 0);
    let digest = journal.commit(seal(4), |_| true).unwrap().digest;
    assert_step(&store, &name("a"), 4);

    let other = tempfile::tempdir().unwrap();
    build(other.path());
    let store = Store::open(other.path()).unwrap();
    let journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    let uninterrupted = journal.commit(seal(4), |_| true).unwrap().digest;
    assert_eq!(digest, uninterrupted, "the kill shows in the digest");
}

#[test]
fn frames_of_other_work_are_not_taken_over() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let store = Store::open(dir.path()).unwrap();
    let mut journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    let opening = journal.open_wave(WAVE, b"another displacement").unwrap();
    assert_eq!(opening, WaveOpening::Replaced);
    assert!(journal.read_wave(WAVE).unwrap().unwrap().frames.is_empty());
    journal.abandon().unwrap();
    assert!(!part(dir.path()).exists());
}

#[test]
fn a_journal_that_lost_frames_behind_our_back_is_not_committed() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let store = Store::open(dir.path()).unwrap();
    let mut journal = store.journal(&name("a"), StepIndex(4)).unwrap();
    journal.open_wave(WAVE, b"header").unwrap();
    let path = part(dir.path());
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(&path, bytes).unwrap();
    let error = journal.commit(seal(4), |_| true).unwrap_err();
    assert!(error.to_string().contains("lost frames"), "{error}");
    assert_eq!(store.steps(&name("a")).unwrap().len(), 3);
}
