//! A resumed run must continue with the same bits: what is read is what was written, and a digest depends on
//! content alone.

mod common;

use common::*;
use store::{
    Encoding, Frame, FrameError, FrameId, JournalError, NewRun, ReadError, Role, RunState, Seal,
    StepAddress, StepIndex, Store, WaveIndex, WaveOpening,
};

#[test]
fn every_bit_of_a_float_survives() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("a")).unwrap().name;
    let odd = [
        0.0,
        -0.0,
        f64::NAN,
        f64::INFINITY,
        f64::MIN_POSITIVE / 2.0,
        1.0 / 3.0,
    ];
    let bytes: Vec<u8> = odd.iter().flat_map(|x| x.to_le_bytes()).collect();
    let with_tail = [&bytes[..], b"tail"].concat();
    let payloads = [bytes, with_tail, Vec::new(), vec![0; 100_000]];
    let extra = |encoding| {
        let frames = payloads.iter().zip(0..).map(|(payload, i)| Frame {
            id: FrameId::new(FIELD, i),
            role: Role::Content,
            encoding,
            payload: payload.clone(),
        });
        frames.collect::<Vec<_>>()
    };
    let mut digests = Vec::new();
    for (step, encoding) in [(1, Encoding::Raw), (2, Encoding::Floats)] {
        let journal = store.journal(&run, StepIndex(step)).unwrap();
        let seal = Seal {
            extra: extra(encoding),
            ..Seal::default()
        };
        digests.push(journal.commit(seal, |_| true).unwrap().digest);
        let reader = store.step(&run, StepIndex(step)).unwrap();
        for (payload, i) in payloads.iter().zip(0..) {
            assert_eq!(&reader.frame(FrameId::new(FIELD, i)).unwrap(), payload);
        }
        reader.verify().unwrap();
    }
    assert_eq!(digests[0], digests[1], "the digest depends on the encoding");
}

#[test]
fn the_digest_forgets_order_of_arrival_and_timings_but_no_bit_of_content() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let digest = |run: &str, change: &dyn Fn(&mut Vec<Frame>)| {
        let run = store.create_run(new_run(run)).unwrap().name;
        let mut journal = store.journal(&run, StepIndex(0)).unwrap();
        journal.open_wave(WAVE, run.as_str().as_bytes()).unwrap();
        let mut frames = wave_frames(0, 10);
        frames.push(Frame::diagnostic(FrameId::new(TIMING, 0), b"1 s".to_vec()));
        change(&mut frames);
        for frame in &frames {
            journal.append(WAVE, frame).unwrap();
        }
        let seal = Seal {
            final_wave: Some(WAVE),
            ..Seal::default()
        };
        journal.commit(seal, |_| true).unwrap().digest
    };
    let first = digest("a", &|_| {});
    assert_eq!(first, digest("b", &|frames| frames.reverse()));
    assert_eq!(
        first,
        digest("c", &|frames| frames[10].payload = b"2 s".to_vec())
    );
    assert_ne!(first, digest("d", &|frames| frames[4].payload[17] ^= 1));
    assert_ne!(first, digest("e", &|frames| drop(frames.remove(0))));
    assert_ne!(first, digest("f", &|frames| frames[0].id.index = 77));
}

#[test]
fn a_branch_sees_its_parents_steps_and_no_later_ones() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let store = Store::open(dir.path()).unwrap();
    assert!(
        store.opening_report().is_empty(),
        "{:?}",
        store.opening_report()
    );
    let steps = store.steps(&name("b")).unwrap();
    let listed: Vec<_> = steps.iter().map(|s| s.address().to_string()).collect();
    assert_eq!(listed, ["a@1", "a@2", "b@3"]);
    assert_eq!(steps[1].summary, summary(2));
    for step in 1..=3 {
        assert_step(&store, &name("b"), step);
    }
    let reader = store.step(&name("b"), StepIndex(3)).unwrap();
    let (before, digest) = reader.predecessor().unwrap();
    assert_eq!(before.to_string(), "a@2");
    assert_eq!(Some(digest), steps[1].digest);
    let onlooker = Store::open_read_only(dir.path()).unwrap();
    assert_eq!(onlooker.steps(&name("b")).unwrap(), steps);
    assert_eq!(onlooker.runs().unwrap(), store.runs().unwrap());
    assert_eq!(store.run(&name("b")).unwrap().last_step, Some(StepIndex(3)));
}

#[test]
fn a_taken_name_never_overwrites_a_run() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let names: Vec<_> = (0..3)
        .map(|_| {
            store
                .create_run(new_run("hollow"))
                .unwrap()
                .name
                .to_string()
        })
        .collect();
    assert_eq!(names, ["hollow", "hollow-2", "hollow-3"]);
    let parent = Some(StepAddress {
        run: name("hollow"),
        step: StepIndex(5),
    });
    let error = store
        .create_run(NewRun {
            parent,
            ..new_run("x")
        })
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "branch from hollow@5: could not find the step hollow@5"
    );
    store
        .set_run_state(&name("hollow"), RunState::Failed, "e46.2 broke")
        .unwrap();
    drop(store);
    let record = Store::open(dir.path())
        .unwrap()
        .run(&name("hollow"))
        .unwrap();
    assert_eq!(
        (record.state, record.note.as_str()),
        (RunState::Failed, "e46.2 broke")
    );
    assert_eq!(record.manifest, b"manifest of hollow");
}

#[test]
fn steps_cannot_be_committed_twice_or_with_a_gap() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("a")).unwrap().name;
    commit(&store, &run, 1);
    let again = store.journal(&run, StepIndex(1)).unwrap_err();
    assert!(matches!(again, JournalError::Committed(_)), "{again}");
    let gap = store.journal(&run, StepIndex(3)).unwrap_err();
    assert!(
        matches!(
            gap,
            JournalError::OutOfOrder {
                expected: StepIndex(2),
                ..
            }
        ),
        "{gap}"
    );
    let open = store.journal(&run, StepIndex(2)).unwrap();
    assert!(matches!(
        store.journal(&run, StepIndex(2)),
        Err(JournalError::Busy(_))
    ));
    drop(open);
    store.journal(&run, StepIndex(2)).unwrap();
}

#[test]
fn a_frame_of_the_stores_own_kind_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("a")).unwrap().name;
    let mut journal = store.journal(&run, StepIndex(1)).unwrap();
    journal.open_wave(WAVE, b"").unwrap();
    let bad = Frame::content(FrameId::new(0xffff, 0), vec![1]);
    let error = journal.append(WAVE, &bad).unwrap_err();
    assert!(matches!(
        error,
        JournalError::Frame(FrameError::ReservedKind(_))
    ));
    let frame = Frame::content(FrameId::new(REV, 0), vec![1]);
    let closed = journal.append(WaveIndex(9), &frame).unwrap_err();
    assert!(matches!(closed, JournalError::WaveNotOpen(WaveIndex(9))));
}

#[test]
fn only_the_waves_kept_and_the_frames_carried_remain() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("a")).unwrap().name;
    let mut journal = store.journal(&run, StepIndex(1)).unwrap();
    for wave in 0..4 {
        let opening = journal.open_wave(WaveIndex(wave), &[wave as u8]).unwrap();
        assert_eq!(opening, WaveOpening::New);
        for frame in wave_frames(wave, 10) {
            journal.append(WaveIndex(wave), &frame).unwrap();
        }
    }
    journal.keep(&[WaveIndex(2), WaveIndex(3)]).unwrap();
    assert_eq!(journal.waves().unwrap(), [WaveIndex(2), WaveIndex(3)]);
    let base = journal.read_wave(WaveIndex(2)).unwrap().unwrap();
    assert_eq!(
        (base.header.as_slice(), base.frames.len(), base.torn),
        (&[2_u8][..], 10, 0)
    );
    let seal = Seal {
        final_wave: Some(WaveIndex(3)),
        ..Seal::default()
    };
    journal.commit(seal, |id| id.index < 5).unwrap();
    let reader = store.step(&run, StepIndex(1)).unwrap();
    assert_eq!(reader.ids().len(), 5);
    assert_eq!(reader.frame(FrameId::new(REV, 4)).unwrap(), state(3, 4, 40));
    assert!(matches!(
        reader.frame(FrameId::new(REV, 5)),
        Err(ReadError::NoSuchFrame { .. })
    ));
    let journal = store.journal(&run, StepIndex(2)).unwrap();
    assert!(journal.waves().unwrap().is_empty());
}

#[test]
fn what_is_compressed_only_once_sealed_is_whole_in_the_journal_and_small_in_the_pack() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("late")).unwrap();
    let payload: Vec<u8> = (0..4096).flat_map(|k| (k as f64).to_le_bytes()).collect();
    let mut digests = Vec::new();
    for (step, encoding) in [Encoding::Floats, Encoding::FloatsOnceSealed]
        .into_iter()
        .enumerate()
    {
        let mut journal = store.journal(&run.name, StepIndex(step as u32)).unwrap();
        journal.open_wave(WaveIndex(0), b"w").unwrap();
        let frame = Frame {
            encoding,
            ..Frame::content(FrameId::new(1, 0), payload.clone())
        };
        journal.append(WaveIndex(0), &frame).unwrap();
        let read = journal.read_wave(WaveIndex(0)).unwrap().unwrap();
        assert_eq!(read.frames[0].payload, payload);
        let seal = Seal {
            final_wave: Some(WaveIndex(0)),
            ..Seal::default()
        };
        let committed = journal.commit(seal, |_| true).unwrap();
        assert!(
            committed.bytes < payload.len() as u64,
            "{}",
            committed.bytes
        );
        digests.push(committed.digest);
        let step = store.step(&run.name, StepIndex(step as u32)).unwrap();
        assert_eq!(step.frame(FrameId::new(1, 0)).unwrap(), payload);
    }
    assert_eq!(digests[0], digests[1], "the digest is of what frames say");
}
