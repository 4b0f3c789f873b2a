//! Warnings from inside the program, shown to the user: what went wrong without ending the run, as a packing that could
//! not be cached or a database that is lost.

use std::fmt::{self, Write as _};
use std::str::FromStr;
use std::sync::Arc;

use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Context, SubscriberExt};

use crate::progress::Progress;

/// Shows warnings through `progress`, so that they tear no live line; `RUST_LOG` asks for more or less, as in
/// `RUST_LOG=store=debug`. For the process as a whole, and only once.
pub fn show(progress: Arc<dyn Progress>) {
    let wished = std::env::var("RUST_LOG").ok();
    let subscriber = tracing_subscriber::registry()
        .with(Notes { progress }.with_filter(targets(wished.as_deref())));
    // Somebody else's subscriber, as a test may have, shows them too.
    let _ = tracing::subscriber::set_global_default(subscriber);
}

/// Which events are shown: what `RUST_LOG` says, and warnings where it names no level for all.
fn targets(wished: Option<&str>) -> Targets {
    let wished = wished.and_then(|text| Targets::from_str(text).ok());
    let wished = wished.unwrap_or_default();
    let level = wished.default_level();
    wished.with_default(level.unwrap_or(LevelFilter::WARN))
}

struct Notes {
    progress: Arc<dyn Progress>,
}

impl<S: Subscriber> Layer<S> for Notes {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut text = Text::default();
        event.record(&mut text);
        let level = match *event.metadata().level() {
            Level::ERROR => "Error",
            Level::WARN => "Warning",
            Level::INFO => "info",
            Level::DEBUG => "debug",
            Level::TRACE => "trace",
        };
        self.progress
            .warning(&format!("{level}: {}{}", text.message, text.fields));
    }
}

/// The message of an event and its fields behind it.
#[derive(Default)]
struct Text {
    message: String,
    fields: String,
}

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        // Writing into a string does not fail.
        let _ = match field.name() {
            "message" => write!(self.message, "{value:?}"),
            // What went wrong reads as part of the sentence.
            "error" | "errno" => write!(self.fields, ": {value:?}"),
            name => write!(self.fields, " ({name} {value:?})"),
        };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::progress::{CommittedStep, Progress};

    #[derive(Default)]
    struct Kept(Mutex<Vec<String>>);

    impl Progress for Kept {
        fn run_started(&self, _: &str, _: u64, _: u64) {}
        fn step_started(&self, _: u64, _: u64, _: &str) {}
        fn wave_started(&self, _: u32, _: u64, _: u64) {}
        fn task_done(&self) {}
        fn iteration(&self, _: u32, _: f64) {}
        fn step_cut(&self, _: f64, _: &str) {}
        fn step_committed(&self, _: &CommittedStep) {}
        fn note(&self, _: &str) {}
        fn warning(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
        fn finished(&self) {}
    }

    fn shown(wished: Option<&str>) -> Vec<String> {
        let kept = Arc::new(Kept::default());
        let notes = Notes {
            progress: kept.clone(),
        };
        let subscriber = tracing_subscriber::registry().with(notes.with_filter(targets(wished)));
        tracing::subscriber::with_default(subscriber, || {
            let error = std::io::Error::other("no space left");
            tracing::warn!(%error, "a packing could not be cached");
            tracing::warn!(path = "a.part", "a journal had nothing usable");
            tracing::debug!("looked");
        });
        kept.0.lock().unwrap().clone()
    }

    /// In a process of its own: what one subscriber is not interested in is remembered for all of them, and other tests
    /// make subscribers meanwhile.
    #[test]
    fn warnings_read_as_sentences_with_their_cause_and_more_or_less_can_be_asked_for() {
        const ALONE: &str = "FEMDEM_FLOW_TEST_ALONE";
        if std::env::var_os(ALONE).is_none() {
            let this = std::thread::current().name().unwrap().to_owned();
            let alone = std::process::Command::new(std::env::current_exe().unwrap())
                .args(["--exact", &this])
                .env(ALONE, "1")
                .output()
                .unwrap();
            let out = String::from_utf8_lossy(&alone.stdout);
            assert!(alone.status.success() && out.contains("1 passed"), "{out}");
            return;
        }
        let expected = [
            "Warning: a packing could not be cached: no space left",
            "Warning: a journal had nothing usable (path \"a.part\")",
        ];
        assert_eq!(shown(None), expected);
        assert_eq!(shown(Some("%%% nonsense %%%")), expected);
        assert_eq!(shown(Some("debug")).len(), 3);
        assert_eq!(shown(Some("error")).len(), 0);
        assert_eq!(shown(Some("store=debug")), expected);
    }
}
