//! A disk fills up at night, mostly not by our doing. The run has to say so, with the exit code that scripts wait for, keep
//! what it has, and go on to the same bits when there is space again; never may it hang or take the store with it.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use tests::history::{self, History};
use tests::inputs;
use tests::ordeal::Ordeal;
use tests::workplace::{Signal, Workplace};

const RUN: &str = "small";
const LIMIT: Duration = Duration::from_secs(120);

fn ordeal() -> Ordeal<'static> {
    Ordeal {
        input: Path::new("input.yaml"),
        run: RUN,
        threads: 2,
    }
}

fn calm(input: &str) -> (History, u64) {
    let place = Workplace::new();
    place.write("input.yaml", input);
    ordeal().arrive(&place);
    let history = history::of(&place.store(), RUN).unwrap();
    (history, ordeal().events(&place))
}

/// No file may grow beyond a limit: the system cuts the write that passes it and refuses the next. That is how a disk
/// fails that is full, and it needs no rights.
#[test]
fn a_file_that_may_not_grow_ends_the_run_in_words_and_it_resumes() {
    let input = inputs::least(RUN, 2);
    let (calm, _) = calm(&input);
    let mut refused = 0;
    for blocks in (1..24).chain([64, 1100]) {
        let place = Workplace::new();
        place.write("input.yaml", &input);
        let submit = ["submit", "input.yaml", "--threads", "1"];
        let outcome = place
            .start_with_file_limit(submit, blocks)
            .end(LIMIT)
            .unwrap();
        match outcome.code {
            Some(0) => {}
            Some(3) => {
                assert!(outcome.err.contains("Error: "), "{outcome:#?}");
                refused += 1;
            }
            _ => panic!("with {blocks} blocks: {outcome:#?}"),
        }
        ordeal().arrive(&place);
        assert_eq!(
            history::of(&place.store(), RUN).as_ref(),
            Some(&calm),
            "{blocks} blocks"
        );
        place.run(["store", "check", "--deep"]).success();
    }
    assert!(
        refused > 5,
        "{refused} runs met the limit: the test shows nothing"
    );
}

/// A file system of its own in memory.
struct SmallDisk {
    folder: tempfile::TempDir,
}

impl SmallDisk {
    /// `None` where this user may not mount one.
    fn mount(mebibytes: u32) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let status = Command::new("mount")
            .args([
                "-t",
                "tmpfs",
                "-o",
                &format!("size={mebibytes}m"),
                "small-disk",
            ])
            .arg(folder.path())
            .output();
        let mounted = status.is_ok_and(|output| output.status.success());
        mounted.then_some(Self { folder })
    }

    /// Takes all the space that is left but this much.
    fn fill(&self, but: usize) -> PathBuf {
        let path = self.folder.path().join("ballast");
        let mut ballast = File::create(&path).unwrap();
        let block = vec![7; 1 << 16];
        let mut written = 0_u64;
        while ballast.write_all(&block).is_ok() {
            written += block.len() as u64;
        }
        ballast.set_len(written.saturating_sub(but as u64)).unwrap();
        path
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(self.folder.path()).status();
    }
}

/// The same on a real file system that is really full, where the user may mount one: from the beginning, and filled by
/// somebody else in the midst of the run.
#[test]
fn a_full_disk_ends_the_run_in_words_and_it_resumes_when_there_is_space() {
    let Some(disk) = SmallDisk::mount(96) else {
        eprintln!(
            "no right to mount a file system: only the test with a file limit says something here"
        );
        return;
    };
    let input = inputs::biaxial(RUN, 60, 10);
    let (calm, events) = calm(&input);

    let place = Workplace::below(disk.folder.path());
    place.write("input.yaml", &input);
    let ballast = disk.fill(32 << 20);
    let outcome = ordeal().session(&place).end(LIMIT).unwrap().ended_with(3);
    assert!(outcome.err.contains("free"), "{}", outcome.err);
    fs::remove_file(ballast).unwrap();

    let mut stopped = 0;
    for part in 1..5 {
        let mut session = ordeal().session(&place);
        while session.is_alive() && ordeal().events(&place) < events * part / 8 {
            sleep(Duration::from_micros(500));
        }
        // It stands still until the disk is full, however fast it is.
        session.signal(Signal::STOP);
        let ballast = disk.fill(0);
        session.signal(Signal::CONT);
        let outcome = session.end(LIMIT).unwrap();
        match outcome.code {
            Some(0) => {}
            Some(3) => stopped += 1,
            _ => panic!("{outcome:#?}"),
        }
        // Looking does not need space.
        place.run(["show", RUN]).success();
        place.run(["runs"]).success();
        fs::remove_file(ballast).unwrap();
    }
    assert!(
        stopped > 0,
        "the disk was full too late: the test shows nothing"
    );
    ordeal().arrive(&place);
    assert_eq!(history::of(&place.store(), RUN), Some(calm));
    place.run(["store", "check", "--deep"]).success();
}
