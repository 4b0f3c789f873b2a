//! What a run is, written once when it is created.

use serde::{Deserialize, Serialize};

use crate::input::Problem;

/// The description of a run. The input as resolved decides what is computed; the rest is for the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of femdem-flow.
    pub version: String,
    /// Instruction sets the macro solver's linear algebra may choose from on the first machine.
    pub cpu: Vec<String>,
    /// Threads of the first session.
    pub threads: usize,
    /// The input as resolved.
    pub problem: Problem,
}

impl Manifest {
    /// The manifest of a new run on this machine.
    pub fn new(problem: Problem, threads: usize) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            cpu: cpu_features(),
            threads,
            problem,
        }
    }

    /// Its bytes: MessagePack with names, in which every number keeps its bits.
    pub fn to_bytes(&self) -> Vec<u8> {
        rmp_serde::to_vec_named(self).expect("plain values serialise into memory")
    }

    /// The manifest back.
    ///
    /// # Errors
    /// Bytes of another version of the program or of none.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, rmp_serde::decode::Error> {
        rmp_serde::from_slice(bytes)
    }
}

/// The instruction sets that numerical libraries dispatch on, those that are there.
fn cpu_features() -> Vec<String> {
    #[cfg(target_arch = "x86_64")]
    let found = [
        ("avx", std::is_x86_feature_detected!("avx")),
        ("avx2", std::is_x86_feature_detected!("avx2")),
        ("fma", std::is_x86_feature_detected!("fma")),
        ("avx512f", std::is_x86_feature_detected!("avx512f")),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let found: [(&str, bool); 0] = [];
    let mut names = vec![std::env::consts::ARCH.to_owned()];
    names.extend(
        found
            .iter()
            .filter(|(_, there)| *there)
            .map(|(name, _)| (*name).to_owned()),
    );
    names
}
