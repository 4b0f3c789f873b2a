//! Disks fail in the midst of things. Whichever file operation fails, the program has to end in words, nothing that
//! was committed may be lost, and the same done again must come to the same bits; a run that cannot be resumed after
//! a full disk is a run lost. Here some operations of every verb fail; `fault-sweep` lets every one fail.

use rustix::io::Errno;
use tests::fault_sweep::{self, KINDS, Scene, Tally};
use tests::faults::{Calls, Fault, Lasting};

/// Lets every `stride`-th operation of the verbs fail, another kind of fault each time.
fn sweep(scenes: &[Scene], calls: Calls, stride: u64) {
    let mut tally = Tally::default();
    let mut kind = 0;
    for (number, scene) in scenes.iter().enumerate() {
        let operations = scene.operations(calls);
        assert!(operations > 0, "{}: nothing to fail", scene.command);
        // Another phase for each verb.
        let first = 1 + (7 * number as u64) % stride.min(operations);
        for at in (first..=operations).step_by(stride as usize) {
            let (error, lasting) = KINDS[kind % KINDS.len()];
            kind += 1;
            let fault = Fault {
                calls,
                at,
                error,
                lasting,
            };
            tally.meet(scene, fault);
        }
    }
    println!("{} faults hit: {:#?}", tally.count(), tally.hits);
    assert!(tally.failures.is_empty(), "{:#?}", tally.failures);
    assert!(tally.count() as usize > 2 * scenes.len());
    assert!(tally.hits.keys().any(|(_, code)| *code == 3));
}

#[test]
fn a_change_that_fails_loses_nothing() {
    sweep(&fault_sweep::writing(), Calls::Changes, 10);
}

#[test]
fn a_read_that_fails_changes_nothing() {
    sweep(&fault_sweep::reading(), Calls::Reads, 29);
}

/// The disk is full from some write of the run on: exit code 3, and what was full when it stopped is not when it resumes.
#[test]
fn a_disk_that_fills_up_is_a_matter_of_the_store_and_the_run_resumes() {
    let scenes = fault_sweep::writing();
    let scene = &scenes[0];
    let mut tally = Tally::default();
    let operations = scene.operations(Calls::Changes);
    for at in (operations / 3..operations).step_by(13) {
        let fault = Fault {
            calls: Calls::Changes,
            at,
            error: Errno::NOSPC,
            lasting: Lasting::On,
        };
        tally.meet(scene, fault);
    }
    assert!(tally.failures.is_empty(), "{:#?}", tally.failures);
    assert!(tally.count() > 3);
}
