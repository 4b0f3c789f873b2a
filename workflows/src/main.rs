//! The command `femdem-flow`.

fn main() -> std::process::ExitCode {
    workflows::cli::run(std::env::args_os())
}
