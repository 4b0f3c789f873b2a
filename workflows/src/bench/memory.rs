//! The largest memory that a piece of work takes.

/// Does the work and tells the process's largest resident memory meanwhile, in bytes; `None` where the system does not
/// say (it is Linux's /proc that does).
pub fn peak_during<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    // "5" sets the peak back to what is resident now.
    let counted = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let done = work();
    (done, counted.then(peak).flatten())
}

fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kilobytes)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_seen_and_forgotten() {
        let size = 200_000_000;
        let (_, with) = peak_during(|| std::hint::black_box(vec![1_u8; size]).len());
        let (_, without) = peak_during(|| ());
        let (with, without) = (with.unwrap(), without.unwrap());
        assert!(with > without + size as u64 / 2, "{with} and {without}");
    }
}
