//! The command in this process, and inputs that it computes in an instant.

#![allow(dead_code, reason = "each test file uses its part")]

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use workflows::cli::{Audience, execute};

/// What a call of the command gave.
pub struct Outcome {
    pub code: u8,
    pub out: String,
    pub err: String,
}

impl Outcome {
    /// Its stdout as JSON.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {}", self.out))
    }

    /// Itself, if it went well.
    #[track_caller]
    pub fn good(self) -> Self {
        assert_eq!(self.code, 0, "{}", self.err);
        self
    }
}

/// Calls the command.
pub fn femdem(args: &[&str]) -> Outcome {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let args = std::iter::once("femdem-flow")
        .chain(args.iter().copied())
        .map(Into::into);
    let code = execute(args, &mut out, &mut err, Audience::Nobody);
    Outcome {
        code,
        out: String::from_utf8(out).unwrap(),
        err: String::from_utf8(err).unwrap(),
    }
}

/// Four elastic elements held on all sides, under −1 all round, pressed from above by 0.3 % in three steps.
pub const BLOCK: &str = "\
name: block
mesh: { rectangle: { size: [1.0, 1.0], elements: [2, 2] } }
materials: { rock: { elastic: { young: 100.0, poisson: 0.25, initial_stress: -1.0 } } }
material: rock
loads: { down: 0.0 }
boundary:
  - { on: left, displacement: { x: 0 } }
  - { on: right, displacement: { x: 0 } }
  - { on: bottom, displacement: { y: 0 } }
  - { on: top, displacement: { y: down } }
programme:
  - { name: press, ramp: { down: -0.003 }, steps: 3 }
output: { every: 2 }
";

/// Thirty grains, pressed and released.
pub const GRAINS: &str = "\
name: grains
element_test: { path: biaxial }
materials: { sand: { rev: { grains: 30 } } }
programme:
  - { name: load, ramp: { axial: -0.001 }, steps: 2 }
  - { name: back, ramp: { axial: -0.0005 }, steps: 1 }
";

/// A folder with inputs and a store, gone at its end.
pub struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("block.yaml"), BLOCK).unwrap();
        fs::write(folder.path().join("grains.yaml"), GRAINS).unwrap();
        Self { folder }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The same as text, for arguments.
    pub fn arg(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    /// The store's folder.
    pub fn store(&self) -> PathBuf {
        self.path("store")
    }

    /// Calls the command on the store.
    pub fn run(&self, args: &[&str]) -> Outcome {
        let store = self.arg("store");
        let mut all = args.to_vec();
        all.extend(["--store", &store, "--threads", "1"]);
        femdem(&all)
    }

    /// Submits one of the inputs.
    #[track_caller]
    pub fn submit(&self, file: &str) -> Outcome {
        self.run(&["submit", &self.arg(file), "--json"]).good()
    }
}

/// The columns of a curve, by name, and its rows.
pub fn curve(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines().skip_while(|line| line.starts_with('#'));
    let names = lines
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    let rows = lines
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    (names, rows)
}
