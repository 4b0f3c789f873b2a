//! Stores outlive versions: a changed byte order or a moved field would make old runs unreadable without
//! anyone noticing. This reader follows `docs/design/store.md` and uses nothing of the crate's own.

mod common;

use std::fs;

use common::*;
use store::{Encoding, Frame, FrameId, Role, Seal, StepIndex, Store};

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn u64_at(bytes: &[u8], at: usize) -> usize {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize
}

/// Checks the frame at the beginning of `bytes`; returns its stored payload.
fn frame(bytes: &[u8]) -> &[u8] {
    assert_eq!(&bytes[..4], b"FDF1");
    let stored = &bytes[56..56 + u32_at(bytes, 12) as usize];
    let crc = crc32fast::hash(&[&bytes[4..52], stored].concat());
    assert_eq!(u32_at(bytes, 52), crc);
    stored
}

fn unshuffled(stored: &[u8], len: usize) -> Vec<u8> {
    let shuffled = zstd::bulk::decompress(stored, len).unwrap();
    let words = len / 8;
    let place = |i: usize| {
        if i < words * 8 {
            i % 8 * words + i / 8
        } else {
            i
        }
    };
    (0..len).map(|i| shuffled[place(i)]).collect()
}

#[test]
fn a_pack_reads_by_the_document_alone() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let bytes = fs::read(dir.path().join("packs/b/00000003.pack")).unwrap();
    assert_eq!(&bytes[..8], b"FDFPACK1");
    let trailer = &bytes[bytes.len() - 92..];
    assert_eq!(&trailer[..8], b"FDFSEAL1");
    assert_eq!(u32_at(trailer, 88), crc32fast::hash(&trailer[..88]));
    let all = blake3::hash(&bytes[..bytes.len() - 36]);
    assert_eq!(&trailer[56..88], all.as_bytes());

    let index = frame(&bytes[u64_at(trailer, 8)..]);
    assert_eq!(u64_at(trailer, 8) + u64_at(trailer, 16), bytes.len() - 92);
    let mut content = Vec::new();
    let mut found = Vec::new();
    for entry in index.chunks_exact(56) {
        let at = u64_at(entry, 48);
        assert_eq!(entry[..48], bytes[at + 4..at + 52]);
        let (kind, number, len) = (u16_at(entry, 0), u32_at(entry, 4), u32_at(entry, 12));
        let stored = frame(&bytes[at..]);
        let payload = match entry[3] {
            0 => stored.to_vec(),
            _ => unshuffled(stored, len as usize),
        };
        assert_eq!(blake3::hash(&payload).as_bytes(), &entry[16..48]);
        if entry[2] == 0 {
            content.extend_from_slice(&entry[..2]);
            content.extend_from_slice(&entry[4..8]);
            content.extend_from_slice(&entry[12..48]);
        }
        if kind <= 0xffef {
            found.push((FrameId::new(kind, number), payload));
        } else if kind == 0xfffd {
            assert_eq!(payload, summary(3));
        } else {
            // [ "b", 3, [ ["a", 2], digest ] ]
            assert_eq!(
                payload[..9],
                [0x93, 0xa1, b'b', 3, 0x92, 0x92, 0xa1, b'a', 2]
            );
            assert_eq!((&payload[9..11], payload.len()), (&[0xc4, 32][..], 43));
        }
    }
    assert_eq!(found, expected(3));
    assert_eq!(&trailer[24..56], blake3::hash(&content).as_bytes());
}

#[test]
fn a_record_reads_by_the_document_alone() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let read = |name: &str| {
        let bytes = fs::read(dir.path().join("packs/b").join(name)).unwrap();
        let (body, hash) = bytes.split_at(bytes.len() - 32);
        assert_eq!(blake3::hash(body).as_bytes(), hash);
        assert_eq!(
            (&body[..8], u64_at(body, 8)),
            (&b"FDFREC1\n"[..], body.len() - 16)
        );
        body[16..].to_vec()
    };
    let run = b"\x94\xa1b\x2a\x92\xa1a\x02\xc4\x0dmanifest of b";
    assert_eq!(read("run.rmp"), run);
    assert_eq!(read("run.copy.rmp"), run);
    assert_eq!(read("state.rmp"), b"\x93\xa8Prepared\xa0\xc0");
    let format = fs::read(dir.path().join("FORMAT")).unwrap();
    assert_eq!(format, b"femdem-flow store format 2\n");
    store::rename_run(dir.path(), &name("b"), &name("bent")).unwrap();
    assert_eq!(read("label.rmp"), b"\x92\xa1b\xa4bent");
}

#[test]
fn an_archive_reads_by_the_document_alone() {
    let dir = tempfile::tempdir().unwrap();
    build(dir.path());
    let file = dir.path().join("b.runs");
    let store = Store::open_read_only(dir.path()).unwrap();
    store
        .export_archive(&name("b"), store::Extent::Run, &file)
        .unwrap();
    let bytes = fs::read(&file).unwrap();
    let (body, hash) = bytes.split_at(bytes.len() - 32);
    assert_eq!(blake3::hash(body).as_bytes(), hash);
    assert_eq!(&body[..8], b"FDFARCH1");
    let mut entries = Vec::new();
    let mut at = 8;
    while &body[at..at + 4] == b"FDE1" {
        let head = u32_at(body, at + 4) as usize;
        let content = u64_at(body, at + 8);
        let from = at + 16;
        entries.push((
            body[from..from + head].to_vec(),
            body[from + head..from + head + content].to_vec(),
        ));
        at = from + head + content;
    }
    assert_eq!(
        (&body[at..at + 8], u64_at(body, at + 8)),
        (&b"FDFAEND1"[..], entries.len())
    );
    assert_eq!(at + 16, body.len());
    let heads: Vec<&[u8]> = entries.iter().map(|(head, _)| head.as_slice()).collect();
    let expected: [&[u8]; 8] = [
        b"\x93\xa8Contents\xa1b\xc0",
        b"\x93\xa6Record\xa1a\xc0",
        b"\x93\xa5State\xa1a\xc0",
        b"\x93\xa4Pack\xa1a\x01",
        b"\x93\xa4Pack\xa1a\x02",
        b"\x93\xa6Record\xa1b\xc0",
        b"\x93\xa5State\xa1b\xc0",
        b"\x93\xa4Pack\xa1b\x03",
    ];
    assert_eq!(heads, expected);
    // [ "b", [ [ "a", "a", 2, [ [ 1, digest, false ], … ] ], … ] ]
    let table = &entries[0].1;
    assert_eq!(table[..12], *b"\x92\xa1b\x92\x94\xa1a\xa1a\x02\x92\x93");
    assert_eq!(table[12..15], [1, 0xc4, 32]);
    assert_eq!(table[47], 0xc2);
    assert_eq!(
        entries[5].1,
        b"\x94\xa1b\x2a\x92\xa1a\x02\xc4\x0dmanifest of b"
    );
    assert!(entries[2].1.starts_with(b"\x93\xabInterrupted"));
    let pack = fs::read(dir.path().join("packs/b/00000003.pack")).unwrap();
    assert_eq!(entries[7].1, pack);
}

/// Holds a step's digest to a number, so that a change of its definition cannot slip in: old and new runs
/// could not be compared any more.
#[test]
fn the_definition_of_the_digest_does_not_drift() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let run = store.create_run(new_run("a")).unwrap().name;
    let frame = Frame {
        id: FrameId::new(1, 2),
        role: Role::Content,
        encoding: Encoding::Raw,
        payload: b"stress".to_vec(),
    };
    let seal = Seal {
        extra: vec![frame],
        ..Seal::default()
    };
    let journal = store.journal(&run, StepIndex(1)).unwrap();
    let digest = journal.commit(seal, |_| true).unwrap().digest;
    assert_eq!(digest.to_string(), GOLDEN);
}

const GOLDEN: &str = "8c255ed158a31b123e009c1f6128ac99865b9b8d8c9c7a99aaa77888863b77d3";
