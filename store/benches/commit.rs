//! What a load step costs the store: 512 REV states of 30 KB journalled, flushed and committed, and read back.

#![allow(missing_docs)] // criterion's macro writes a public item of its own.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use store::{Frame, FrameId, NewRun, RunName, Seal, StepIndex, Store, WaveIndex};

const REVS: u32 = 512;
const WORDS: usize = 3840;

fn step(store: &Store, run: &RunName, index: StepIndex, frames: &[Frame]) {
    let mut journal = store.journal(run, index).expect("it is the next step");
    let wave = WaveIndex(0);
    journal.open_wave(wave, b"header").expect("there is space");
    for frame in frames {
        journal.append(wave, frame).expect("there is space");
    }
    let seal = Seal {
        final_wave: Some(wave),
        ..Seal::default()
    };
    journal.commit(seal, |_| true).expect("there is space");
}

fn commit(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a folder for the benchmark");
    let store = Store::open(dir.path()).expect("an empty folder");
    let new = NewRun {
        name: RunName::new("bench").expect("a good name"),
        created: 0,
        parent: None,
        manifest: Vec::new(),
    };
    let run = store.create_run(new).expect("there is space").name;
    let frames: Vec<Frame> = (0..REVS)
        .map(|rev| {
            let numbers = (0..WORDS).map(|i| (f64::from(rev) + i as f64 * 1e-3).sin());
            let payload = numbers.flat_map(f64::to_le_bytes).collect();
            Frame::content(FrameId::new(1, rev), payload)
        })
        .collect();
    let mut group = criterion.benchmark_group("step of 512 REVs");
    group.sample_size(10);
    group.throughput(Throughput::Bytes(u64::from(REVS) * WORDS as u64 * 8));
    let mut next = 0;
    group.bench_function("journal and commit", |bencher| {
        bencher.iter(|| {
            step(&store, &run, StepIndex(next), &frames);
            next += 1;
        });
    });
    group.bench_function("read back", |bencher| {
        let reader = store.step(&run, StepIndex(0)).expect("it is committed");
        bencher.iter(|| {
            for frame in &frames {
                reader.frame(frame.id).expect("it is sound");
            }
        });
    });
    group.finish();
}

criterion_group!(benches, commit);
criterion_main!(benches);
