//! Progress for whoever looks: a live line at a terminal, plain lines in a log, nothing with `--quiet`.

mod bar;
mod lines;
mod quiet;
mod remaining;

use std::sync::Arc;

use crate::progress::Progress;

/// Who looks at the progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Audience {
    /// A person at a terminal.
    Terminal,
    /// A file or another program.
    Log,
    /// Nobody.
    Nobody,
}

/// The view for `audience`; it writes to stderr.
pub fn for_audience(audience: Audience) -> Arc<dyn Progress> {
    match audience {
        Audience::Terminal => Arc::new(bar::Bar::new()),
        Audience::Log => Arc::new(lines::Lines::new(std::io::stderr())),
        Audience::Nobody => Arc::new(quiet::Quiet),
    }
}
