//! The named loads and who refers to them.

use std::collections::BTreeSet;

use super::read::Reader;
use crate::input::document;
use crate::input::path::Path;
use crate::input::problem::Amount;
use crate::input::report::suggest;
use crate::input::tree::Value;

struct Load {
    name: String,
    initial: f64,
    used: bool,
    declared: bool,
}

/// The loads, in alphabetical order of their names, then those that a path of the element test brings along.
pub struct Loads {
    loads: Vec<Load>,
    /// Whether the section could be read; if not, unknown names are no news.
    known: bool,
    /// Names already reported as not declared.
    missed: BTreeSet<String>,
}

impl Loads {
    pub fn read(reader: &mut Reader<'_, '_>) -> Self {
        let path = Path::root().key("loads");
        let keys = reader.keys(&path);
        let known = keys.is_some() || !reader.has(&path);
        let mut names = keys.unwrap_or_default();
        names.sort();
        let loads = names
            .into_iter()
            .map(|name| {
                let initial = reader.required(&path.key(name.as_str())).unwrap_or(0.0);
                Load {
                    name,
                    initial,
                    used: false,
                    declared: true,
                }
            })
            .collect();
        Self {
            loads,
            known,
            missed: BTreeSet::new(),
        }
    }

    /// Loads that are there already, at these values.
    pub fn given(names: &[String], values: &[f64]) -> Self {
        let loads = names.iter().zip(values).map(|(name, value)| Load {
            name: name.clone(),
            initial: *value,
            used: true,
            declared: true,
        });
        Self {
            loads: loads.collect(),
            known: true,
            missed: BTreeSet::new(),
        }
    }

    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.loads.iter().map(|load| load.name.as_str())
    }

    pub fn initial(&self) -> Vec<f64> {
        self.loads.iter().map(|load| load.initial).collect()
    }

    /// The load `name`, declared with `initial` where the input does not declare it.
    pub fn bring(&mut self, name: &str, initial: f64) -> Amount {
        let index = self
            .loads
            .iter()
            .position(|load| load.name == name)
            .unwrap_or_else(|| {
                self.loads.push(Load {
                    name: name.to_owned(),
                    initial,
                    used: false,
                    declared: false,
                });
                self.loads.len() - 1
            });
        self.loads[index].used = true;
        Amount::Load(index)
    }

    /// Some loads may be missing here through another mistake: unknown names are no news any more.
    pub fn forget(&mut self) {
        self.known = false;
    }

    /// The load that is named by the key or the value at `path`.
    pub fn find(&mut self, reader: &mut Reader<'_, '_>, path: &Path, name: &str) -> Option<usize> {
        let found = self.loads.iter().position(|load| load.name == name);
        if found.is_none() && self.known && !self.missed.contains(name) {
            let help = if self.loads.is_empty() {
                // One declaration settles all that use it.
                self.missed.insert(name.to_owned());
                format!("declare it with its initial value: `loads: {{ {name}: 0 }}`")
            } else {
                suggest(name, self.names(), "loads")
            };
            let message = format!("there is no load `{name}`");
            match reader
                .report
                .tree()
                .locate(path)
                .map(|(node, _)| &node.value)
            {
                Some(Value::Text(_)) => reader.report.at(path, message, help),
                _ => reader.report.at_key(path, message, help),
            }
        }
        found
    }

    /// An amount that is written at `path`.
    pub fn amount(
        &mut self,
        reader: &mut Reader<'_, '_>,
        path: &Path,
        amount: &document::Amount,
    ) -> Option<Amount> {
        match amount {
            document::Amount::Number(value) => Some(Amount::Constant(*value)),
            document::Amount::Load(name) => {
                let index = self.find(reader, path, name)?;
                self.loads[index].used = true;
                Some(Amount::Load(index))
            }
        }
    }

    /// Reports the loads that nothing follows: a ramp of such a load would do nothing, unnoticed.
    pub fn report_idle(&self, reader: &mut Reader<'_, '_>) {
        for load in self.loads.iter().filter(|load| load.declared && !load.used) {
            let path = Path::root().key("loads").key(load.name.as_str());
            let help = format!(
                "use it as a value, as in `pressure: {}`, or remove it",
                load.name
            );
            reader.report.at_key(
                &path,
                format!("nothing follows the load `{}`", load.name),
                help,
            );
        }
    }
}
