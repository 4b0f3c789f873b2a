//! Waiting for what another process does, but not for ever.

use std::thread::sleep;
use std::time::{Duration, Instant};

/// So long on a machine that is busy with other things; nothing here takes a hundredth of it.
const LIMIT: Duration = Duration::from_secs(300);

/// Waits until `condition` holds.
///
/// # Panics
/// Where it does not in five minutes: `what` was waited for.
pub fn until(what: &str, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < LIMIT, "waited in vain: {what}");
        sleep(Duration::from_millis(2));
    }
}
