//! Progress for whoever looks: a live line at a terminal, plain lines in a log, nothing with `--quiet`.

mod bar;
mod lines;
mod remaining;

use crate::progress::{Progress, Silent};

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
pub fn for_audience(audience: Audience) -> Box<dyn Progress> {
    match audience {
        Audience::Terminal => Box::new(bar::Bar::new()),
        Audience::Log => Box::new(lines::Lines::new(std::io::stderr())),
        Audience::Nobody => Box::new(Silent),
    }
}
