//! What computes: the processor and the program, for the record.

use serde::{Deserialize, Serialize};

/// A processor and a build of the program.
///
/// Grains and the macro solve give the same bits on all of them, the latter where it is not faer that solves; see
/// docs/design/determinism.md.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// Its processor as the system names it; the architecture where it names none.
    pub processor: String,
    /// Its architecture, and of the instruction sets that numerical libraries dispatch on those that are there.
    pub features: Vec<String>,
    /// Version of femdem-flow.
    pub version: String,
    /// What solves the macro scale's linear systems, with versions; the input says which of them does.
    pub linear_algebra: String,
}

impl Machine {
    /// This one.
    pub fn this() -> Self {
        Self {
            processor: processor(),
            features: features(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            linear_algebra: solver_fem::linear_solver::VERSIONS.to_owned(),
        }
    }
}

/// The name of this host in its network.
pub fn host() -> String {
    let system = rustix::system::uname();
    system.nodename().to_string_lossy().into_owned()
}

/// The first `model name` of Linux's /proc/cpuinfo.
fn processor() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
    });
    model.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

fn features() -> Vec<String> {
    #[cfg(target_arch = "x86_64")]
    let found = [
        ("sse2", std::is_x86_feature_detected!("sse2")),
        ("avx", std::is_x86_feature_detected!("avx")),
        ("avx2", std::is_x86_feature_detected!("avx2")),
        ("fma", std::is_x86_feature_detected!("fma")),
        ("avx512f", std::is_x86_feature_detected!("avx512f")),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let found: [(&str, bool); 0] = [];
    let there = found.iter().filter(|(_, there)| *there);
    let names = there.map(|(name, _)| (*name).to_owned());
    std::iter::once(std::env::consts::ARCH.to_owned())
        .chain(names)
        .collect()
}
