//! What a panic prints: nothing where it is contained and becomes an error of its own, otherwise whom to tell.

use std::panic::PanicHookInfo;

/// Names of the engine's threads begin so.
const TASK_THREAD: &str = "task-";

/// Replaces the panic hook of the process. Called once, by the command itself.
pub fn install_hook() {
    std::panic::set_hook(Box::new(|info| {
        let thread = std::thread::current();
        if !is_contained(thread.name()) {
            eprintln!("{}", explain(info));
        }
    }));
}

/// Whether a panic on this thread is caught and reported by whoever asked for the work: a damaged database is rebuilt,
/// a failed task goes to the run's director with its reason.
fn is_contained(thread: Option<&str>) -> bool {
    thread.is_some_and(|name| name == store::DATABASE_THREAD || name.starts_with(TASK_THREAD))
}

fn explain(info: &PanicHookInfo<'_>) -> String {
    let place = info
        .location()
        .map_or(String::new(), |place| format!(" ({place})"));
    let message = info.payload_as_str().unwrap_or("no message");
    format!(
        "Error: femdem-flow {} has a bug: {message}{place}\nWhat is committed is safe. Please report this text with the command and the input that led to it.",
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use super::is_contained;

    #[test]
    fn only_panics_that_become_errors_of_their_own_are_silent() {
        assert!(is_contained(Some(store::DATABASE_THREAD)) && is_contained(Some("task-0")));
        assert!(!is_contained(Some("main")) && !is_contained(None));
    }
}
