//! What is fuzzed: everything that reads bytes which others may have written. Each function takes any bytes; none of them may
//! panic, whatever they are. The targets of `cargo fuzz` call them, and so does `tests/tests/fuzz_corpus.rs`, which
//! includes this file.
//!
//! The files of a store are protected by checksums, which random bytes do not pass. So each of them is read twice: as it is,
//! and with the outer checksums put right, so that what lies behind them has to stand any bytes too.

use std::cell::OnceCell;
use std::fs;
use std::path::{Path, PathBuf};

use store::{NewRun, RunName, StepIndex, Store, WaveIndex};
use tempfile::TempDir;

/// An input file.
pub fn yaml(bytes: &[u8]) {
    if let Ok(text) = std::str::from_utf8(bytes)
        && let Err(errors) = workflows::input::parse(text, "fuzz.yaml", Path::new(""))
    {
        assert!(!errors.errors.is_empty(), "refused without a reason");
        assert!(errors.to_string().starts_with("error: "));
    }
}

/// A mesh of Gmsh.
pub fn mesh(bytes: &[u8]) {
    match workflows::input::gmsh::read(bytes, "fuzz.msh") {
        Ok(mesh) => assert!(mesh.mesh().element_count() > 0, "a mesh of nothing"),
        Err(errors) => assert!(!errors.0.is_empty(), "refused without a reason"),
    }
}

/// A packing of another code.
pub fn packing(bytes: &[u8]) {
    let Ok(record) = serde_json::from_slice::<solver_dem::exchange::PackingRecord>(bytes) else {
        return;
    };
    if let Ok(rev) = record.to_rev() {
        assert!(!rev.state.positions.is_empty());
    }
}

/// A sealed step.
pub fn pack(bytes: &[u8]) {
    with_run(|run| {
        run.try_pack(bytes);
        run.try_pack(&sealed(bytes));
    });
}

/// The journal of a wave.
pub fn part(bytes: &[u8]) {
    with_run(|run| {
        run.try_part(bytes);
        run.try_part(&framed(bytes));
    });
}

/// A run's record, the record of its state, the stub of a pruned step.
pub fn record(bytes: &[u8]) {
    with_run(|run| {
        for name in ["run.rmp", "state.rmp", "label.rmp", "00000001.pruned"] {
            run.try_record(name, bytes);
        }
    });
}

/// A store with one run, in whose folder files of any content are put.
struct Run {
    store: TempDir,
    name: RunName,
}

/// One store for each thread: the targets run for millions of rounds.
fn with_run(act: impl FnOnce(&Run)) {
    thread_local! {
        static RUN: OnceCell<Run> = const { OnceCell::new() };
    }
    RUN.with(|run| act(run.get_or_init(Run::new)));
}

impl Run {
    fn new() -> Self {
        let dir = tempfile::tempdir().expect("the system has room for a temporary folder");
        let store = Store::open(dir.path()).expect("a store can be made");
        let name = RunName::new("fuzz").expect("it is a name");
        let new = NewRun {
            name: name.clone(),
            created: 0,
            parent: None,
            manifest: b"manifest".to_vec(),
        };
        store.create_run(new).expect("a run can be made");
        drop(store);
        Self { store: dir, name }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.store.path().join("packs/fuzz").join(name)
    }

    fn with_file(&self, name: &str, bytes: &[u8], act: impl FnOnce(&store::ReadOnlyStore)) {
        let file = self.file(name);
        let before = fs::read(&file).ok();
        fs::write(&file, bytes).expect("a file can be written");
        let store = Store::open_read_only(self.store.path()).expect("the store is one");
        act(&store);
        match before {
            Some(before) => fs::write(&file, before).expect("a file can be written"),
            None => fs::remove_file(&file).expect("a file can be removed"),
        }
    }

    fn try_pack(&self, bytes: &[u8]) {
        self.with_file("00000001.pack", bytes, |store| {
            let _ = store.steps(&self.name);
            if let Ok(step) = store.step(&self.name, StepIndex(1)) {
                let _ = (step.summary(), step.verify());
                for id in step.ids() {
                    let _ = step.frame(id);
                }
            }
        });
    }

    fn try_part(&self, bytes: &[u8]) {
        self.with_file("00000001.wave000000.part", bytes, |store| {
            let read = store.read_wave(&self.name, StepIndex(1), WaveIndex(0));
            if let Ok(Some(wave)) = read {
                assert!(wave.torn <= bytes.len() as u64);
            }
        });
    }

    fn try_record(&self, name: &str, bytes: &[u8]) {
        self.with_file(name, bytes, |store| {
            let _ = (
                store.run(&self.name),
                store.steps(&self.name),
                store.names(),
            );
            let _ = store.check(store::Depth::Quick);
        });
    }
}

/// The bytes with the trailer's mark and checksum put right (docs/design/store.md has the offsets).
fn sealed(bytes: &[u8]) -> Vec<u8> {
    const TRAILER: usize = 92;
    let mut bytes = bytes.to_vec();
    if let Some(at) = bytes.len().checked_sub(TRAILER) {
        bytes[at..at + 8].copy_from_slice(b"FDFSEAL1");
        let crc = crc32fast::hash(&bytes[at..at + TRAILER - 4]);
        bytes[at + TRAILER - 4..].copy_from_slice(&crc.to_le_bytes());
        // The index frame, where the trailer says that it is.
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("8 bytes"));
        let (index, length) = (word(at + 8) as usize, word(at + 16) as usize);
        if length >= HEADER && index.checked_add(length) == Some(at) {
            checked(&mut bytes[index..at]);
        }
    }
    bytes
}

/// Length of a frame before its payload.
const HEADER: usize = 56;

/// Puts a frame's mark and checksum right.
fn checked(frame: &mut [u8]) {
    frame[..4].copy_from_slice(b"FDF1");
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&frame[4..HEADER - 4]);
    hasher.update(&frame[HEADER..]);
    let crc = hasher.finalize();
    frame[HEADER - 4..HEADER].copy_from_slice(&crc.to_le_bytes());
}

/// The bytes as the frames of a journal: a right beginning, then a frame with a right checksum whose header and payload
/// are the bytes.
fn framed(bytes: &[u8]) -> Vec<u8> {
    let header_frame = |payload: &[u8]| {
        let mut frame = vec![0; HEADER];
        frame[4..6].copy_from_slice(&0xfffe_u16.to_le_bytes());
        frame[6] = 1;
        frame[12..16].copy_from_slice(&(payload.len() as u32).to_le_bytes());
        frame[16..20].copy_from_slice(&(payload.len() as u32).to_le_bytes());
        frame.extend_from_slice(payload);
        checked(&mut frame);
        frame
    };
    let mut part = b"FDFPART1".to_vec();
    part.extend(header_frame(&[1, 0, 0, 0, 0, 0, 0, 0, 7]));
    if bytes.len() >= HEADER {
        let mut frame = bytes.to_vec();
        let payload = (frame.len() - HEADER) as u32;
        frame[12..16].copy_from_slice(&payload.to_le_bytes());
        checked(&mut frame);
        part.extend(frame);
    }
    part
}
