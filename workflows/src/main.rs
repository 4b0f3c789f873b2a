//! The command `femdem-flow`.

/// Every REV solve takes and frees a few megabytes: glibc hands them back to the operating system and fetches them
/// again page by page, a tenth of the time of a short solve.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    workflows::cli::run(std::env::args_os())
}
