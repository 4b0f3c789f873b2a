//! A small store to damage, and what it holds.
#![allow(dead_code)] // Each test file uses its part.

use std::fs;
use std::path::Path;

use store::{
    Committed, Digest, Frame, FrameId, NewRun, RunName, Seal, StepAddress, StepIndex, Store,
    WaveIndex,
};

pub const REV: u16 = 1;
pub const FIELD: u16 = 2;
pub const TIMING: u16 = 3;
pub const WAVE: WaveIndex = WaveIndex(0);

pub fn name(text: &str) -> RunName {
    RunName::new(text).unwrap()
}

pub fn new_run(text: &str) -> NewRun {
    NewRun {
        name: name(text),
        created: 42,
        parent: None,
        manifest: format!("manifest of {text}").into_bytes(),
    }
}

/// Numbers that look like a state: smooth, so that they compress, and different everywhere.
pub fn state(step: u32, rev: u32, len: usize) -> Vec<u8> {
    (0..len)
        .flat_map(|i| (f64::from(step) + (f64::from(rev) + i as f64 * 1e-3).sin()).to_le_bytes())
        .collect()
}

/// The frames of a wave of `step`, in a scrambled order as tasks would finish.
pub fn wave_frames(step: u32, revs: u32) -> Vec<Frame> {
    (0..revs)
        .map(|i| (i * 7 + 3) % revs)
        .map(|rev| Frame::content(FrameId::new(REV, rev), state(step, rev, 40)))
        .collect()
}

pub fn extra(step: u32) -> Vec<Frame> {
    vec![
        Frame::content(FrameId::new(FIELD, 0), state(step, 99, 25)),
        Frame::diagnostic(FrameId::new(TIMING, 0), format!("{step} s").into_bytes()),
    ]
}

pub fn summary(step: u32) -> Vec<u8> {
    format!("summary of {step}").into_bytes()
}

pub fn seal(step: u32) -> Seal {
    Seal {
        final_wave: Some(WAVE),
        extra: extra(step),
        summary: summary(step),
    }
}

/// Journals and commits one step of ten REVs.
pub fn commit(store: &Store, run: &RunName, step: u32) -> Committed {
    let mut journal = store.journal(run, StepIndex(step)).unwrap();
    journal.open_wave(WAVE, b"header").unwrap();
    for frame in wave_frames(step, 10) {
        journal.append(WAVE, &frame).unwrap();
    }
    journal.commit(seal(step), |_| true).unwrap()
}

/// What `commit` put into a step.
pub fn expected(step: u32) -> Vec<(FrameId, Vec<u8>)> {
    let mut frames: Vec<_> = wave_frames(step, 10)
        .into_iter()
        .chain(extra(step))
        .map(|frame| (frame.id, frame.payload))
        .collect();
    frames.sort();
    frames
}

/// Asserts that a step reads back as `commit` wrote it.
pub fn assert_step(store: &Store, run: &RunName, step: u32) {
    let reader = store.step(run, StepIndex(step)).unwrap();
    let found: Vec<_> = reader
        .ids()
        .into_iter()
        .map(|id| (id, reader.frame(id).unwrap()))
        .collect();
    assert_eq!(found, expected(step), "step {step}");
    assert_eq!(reader.summary().unwrap(), summary(step));
}

/// Two runs (`a`: steps 1–3 committed and 4 journalled; `b`: branches off a@2, step 3) and a cache entry.
pub fn build(dir: &Path) {
    let store = Store::open(dir).unwrap();
    let a = store.create_run(new_run("a")).unwrap().name;
    for step in 1..=3 {
        commit(&store, &a, step);
    }
    let parent = StepAddress {
        run: a.clone(),
        step: StepIndex(2),
    };
    let branch = NewRun {
        parent: Some(parent),
        ..new_run("b")
    };
    let b = store.create_run(branch).unwrap().name;
    commit(&store, &b, 3);
    let mut journal = store.journal(&a, StepIndex(4)).unwrap();
    journal.open_wave(WAVE, b"header").unwrap();
    for frame in wave_frames(4, 10) {
        journal.append(WAVE, &frame).unwrap();
    }
    journal.flush().unwrap();
    store
        .cache_put(&Digest::of(b"key"), state(0, 0, 30))
        .unwrap();
}

pub fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).unwrap();
        }
    }
}
