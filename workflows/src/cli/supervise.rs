//! Computing under supervision: a parent process that does nothing but start the same command again when it dies of
//! something that nobody ordered.

use std::ffi::OsString;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use rustix::process::{Pid, Signal, kill_process};

use crate::failure::{Failure, FailureKind};
use crate::run::{self, Context, Restart, Signals, Supervision};

/// By this variable a command learns that it is supervised: its ticket, and its deadline in milliseconds since 1970 or `-`.
const VARIABLE: &str = "FEMDEM_FLOW_SUPERVISED";
/// Exit code of a Rust program that panicked.
const PANICKED: i32 = 101;
/// How often the child and the signals are looked at.
const LOOK: Duration = Duration::from_millis(50);
/// The pause before the first restart; it doubles with each further one.
const FIRST_PAUSE: Duration = Duration::from_secs(1);
/// The longest pause.
const LONGEST_PAUSE: Duration = Duration::from_secs(300);

/// What a command is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Order {
    /// How often it is started again at most.
    pub restarts: u32,
    /// When it stops in order, at the latest.
    pub deadline: Option<SystemTime>,
}

/// Whether this process is supervised; where it is, it stops in order when its supervisor dies.
pub fn supervised() -> Option<Supervision> {
    let text = std::env::var(VARIABLE).ok()?;
    let (ticket, deadline) = text.split_once(' ')?;
    let deadline = deadline.parse().ok().map(Duration::from_millis);
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::set_parent_process_death_signal(Some(Signal::TERM)) {
        tracing::warn!(%error, "the end of the supervisor would not be noticed");
    }
    Some(Supervision {
        ticket: ticket.to_owned(),
        deadline: deadline.map(|since| UNIX_EPOCH + since),
    })
}

/// Runs the command `args` (its own name first) in child processes until it ends in order, in success or failure, or has
/// died once more often than `order` allows. Returns its exit code.
///
/// # Errors
/// It cannot be started, or died too often.
pub fn supervise(args: &[OsString], order: Order, context: &Context<'_>) -> Result<u8, Failure> {
    let failed = |what: &str, error: std::io::Error| {
        Failure::new(FailureKind::Run, format!("failed to {what}")).because(error)
    };
    let signals = Signals::listen().map_err(|error| failed("listen to signals", error))?;
    let program = std::env::current_exe().map_err(|error| failed("find this program", error))?;
    let task = variable(order.deadline);
    let mut restarts = 0;
    loop {
        let child = Command::new(&program)
            .args(args.iter().skip(1))
            .env(VARIABLE, &task)
            // Ctrl-C is for this process, which hands it on: otherwise the child would get it twice.
            .process_group(0)
            .spawn()
            .map_err(|error| failed("start the command under supervision", error))?;
        let pid = child.id();
        let status =
            attend(child, &signals).map_err(|error| failed("wait for the command", error))?;
        if let Some(code) = ended_in_order(status) {
            return Ok(code);
        }
        let why = cause(status);
        if signals.stop().is_some() || restarts == order.restarts {
            let count = match restarts {
                0 => String::new(),
                n => format!(", after {n} restarts"),
            };
            let what = format!("the computing process {pid} {why}{count}");
            return Err(Failure::new(FailureKind::Run, what).hint(
                "nothing that is committed or journalled is lost; `femdem-flow runs` lists the runs, `resume` goes on",
            ));
        }
        restarts += 1;
        let pause = FIRST_PAUSE
            .saturating_mul(1 << (restarts - 1).min(16))
            .min(LONGEST_PAUSE);
        let restart = Restart {
            pid,
            why: why.clone(),
            number: restarts,
            of: order.restarts,
            pause,
        };
        let runs = run::note_restart(context, &restart);
        let at = match runs.as_slice() {
            [] => String::new(),
            runs => format!(" at {}", runs.join(", ")),
        };
        context.progress.note(&format!(
            "process {pid} {why}{at}: restart {restarts} of {} in {} s",
            order.restarts,
            pause.as_secs()
        ));
        if let Some(kind) = wait(pause, &signals, order.deadline) {
            return Err(Failure::new(kind, "stopped before the restart")
                .hint("`femdem-flow runs` lists the runs, `resume` goes on"));
        }
    }
}

/// A name for the work that no other has, and its deadline, as the child reads them.
fn variable(deadline: Option<SystemTime>) -> String {
    let since = |time: SystemTime| time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let now = since(SystemTime::now()).as_nanos();
    let ticket = format!("{}-{now}@{}", std::process::id(), crate::machine::host());
    match deadline {
        Some(deadline) => format!("{ticket} {}", since(deadline).as_millis()),
        None => format!("{ticket} -"),
    }
}

/// Waits for the child and hands the signals on that this process gets.
fn attend(mut child: Child, signals: &Signals) -> std::io::Result<ExitStatus> {
    let received = signals.received();
    let mut seen = *received.borrow();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        let now = *received.borrow();
        let hand_on = |signal: Signal| {
            // Not waited for yet, so the number is the child's, dead or alive.
            let _ = kill_process(Pid::from_child(&child), signal);
        };
        if now.checkpoints != seen.checkpoints {
            hand_on(Signal::USR1);
        }
        for _ in seen.stops..now.stops {
            hand_on(match now.last {
                number if number == Signal::INT.as_raw() => Signal::INT,
                _ => Signal::TERM,
            });
        }
        seen = now;
        sleep(LOOK);
    }
}

/// The exit code of a process that ended as it was meant to, in success or failure; `None` where it died.
fn ended_in_order(status: ExitStatus) -> Option<u8> {
    let ordered = [Signal::INT.as_raw(), Signal::TERM.as_raw()];
    match (status.code(), status.signal()) {
        (Some(PANICKED), _) => None,
        (Some(code), _) => Some(u8::try_from(code).unwrap_or(1)),
        // It was stopped before it could listen.
        (None, Some(signal)) if ordered.contains(&signal) => u8::try_from(128 + signal).ok(),
        (None, _) => None,
    }
}

fn cause(status: ExitStatus) -> String {
    let names = [
        (Signal::KILL, "SIGKILL, as when memory runs out"),
        (Signal::SEGV, "SIGSEGV"),
        (Signal::ABORT, "SIGABRT"),
        (Signal::BUS, "SIGBUS"),
        (Signal::ILL, "SIGILL"),
        (Signal::FPE, "SIGFPE"),
    ];
    match status.signal() {
        Some(signal) => {
            let named = names.iter().find(|(known, _)| known.as_raw() == signal);
            let name = named.map_or(String::new(), |(_, name)| format!(" ({name})"));
            format!("died of signal {signal}{name}")
        }
        None => "panicked".to_owned(),
    }
}

/// Waits out a pause; the reason where it is not to be waited out.
fn wait(pause: Duration, signals: &Signals, deadline: Option<SystemTime>) -> Option<FailureKind> {
    let begun = Instant::now();
    while begun.elapsed() < pause {
        if let Some(signal) = signals.stop() {
            return Some(FailureKind::of_signal(signal));
        }
        if deadline.is_some_and(|at| SystemTime::now() >= at) {
            return Some(FailureKind::Deadline);
        }
        sleep(LOOK);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_death_that_nobody_ordered_is_a_reason_to_start_again() {
        let exited = |code: i32| ExitStatus::from_raw(code << 8);
        for code in [0, 1, 2, 3, 75, 130, 143] {
            assert_eq!(ended_in_order(exited(code)), Some(code as u8));
        }
        assert_eq!(ended_in_order(ExitStatus::from_raw(2)), Some(130));
        assert_eq!(ended_in_order(ExitStatus::from_raw(15)), Some(143));
        assert_eq!(ended_in_order(exited(PANICKED)), None);
        for signal in [4, 6, 7, 8, 9, 11] {
            assert_eq!(ended_in_order(ExitStatus::from_raw(signal)), None);
        }
        assert!(cause(ExitStatus::from_raw(9)).contains("SIGKILL"));
        assert_eq!(cause(exited(PANICKED)), "panicked");
    }
}
