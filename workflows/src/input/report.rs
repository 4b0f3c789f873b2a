//! Collects what is wrong with an input, by the place in it.

use super::error::{InputError, Span};
use super::path::{Path, Segment};
use super::tree::Node;

/// All problems found so far in one tree.
pub struct Report<'a> {
    tree: &'a Node,
    errors: Vec<InputError>,
}

impl<'a> Report<'a> {
    /// A report on `tree`, with what was found while reading it.
    pub fn new(tree: &'a Node, errors: Vec<InputError>) -> Self {
        Self { tree, errors }
    }

    /// The tree this is about.
    pub fn tree(&self) -> &'a Node {
        self.tree
    }

    /// The value at `path` is wrong; where it is missing, its nearest surroundings are pointed at.
    pub fn at(&mut self, path: &Path, message: impl Into<String>, help: impl Into<Option<String>>) {
        let mut place = Path::root();
        let mut span = self.tree.span;
        for segment in path.segments() {
            place = match segment {
                Segment::Key(key) => place.key(key.as_str()),
                Segment::Index(index) => place.index(*index),
            };
            match self.tree.locate(&place) {
                Some((_, found)) => span = found,
                None => break,
            }
        }
        self.push(span, path, message.into(), help.into());
    }

    /// The key at the end of `path` is wrong, whatever its value.
    pub fn at_key(
        &mut self,
        path: &Path,
        message: impl Into<String>,
        help: impl Into<Option<String>>,
    ) {
        let Some((Segment::Key(key), parents)) = path.segments().split_last() else {
            return self.at(path, message, help);
        };
        let parent = parents
            .iter()
            .fold(Path::root(), |path, segment| match segment {
                Segment::Key(key) => path.key(key.as_str()),
                Segment::Index(index) => path.index(*index),
            });
        match self
            .tree
            .locate(&parent)
            .and_then(|(node, _)| node.entry(key))
        {
            Some(entry) => self.push(entry.key_span, path, message.into(), help.into()),
            None => self.at(path, message, help),
        }
    }

    /// Nothing wrong so far.
    pub fn is_clean(&self) -> bool {
        self.errors.is_empty()
    }

    /// Nothing wrong so far with what lies below `path`: there one mistake needs no second message.
    pub fn is_clean_below(&self, path: &Path) -> bool {
        let path = path.to_string();
        !self.errors.iter().any(|error| {
            error
                .path
                .strip_prefix(&path)
                .is_some_and(|rest| rest.starts_with(['.', '[']))
        })
    }

    /// All that was found.
    pub fn into_errors(self) -> Vec<InputError> {
        self.errors
    }

    fn push(&mut self, span: Span, path: &Path, message: String, help: Option<String>) {
        self.errors.push(InputError {
            span: Some(span),
            path: path.to_string(),
            message,
            help,
        });
    }
}

/// The one of `known` that `word` probably means, if any is near.
pub fn nearest<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<&'k str> {
    known
        .into_iter()
        .map(|candidate| {
            (
                strsim::jaro_winkler(&word.to_lowercase(), &candidate.to_lowercase()),
                candidate,
            )
        })
        .filter(|(similarity, _)| *similarity > 0.8)
        // The first of equals wins, so that the message does not depend on the order of evaluation.
        .fold(None, |best: Option<(f64, &str)>, new| match best {
            Some(best) if best.0 >= new.0 => Some(best),
            _ => Some(new),
        })
        .map(|(_, candidate)| candidate)
}

/// "did you mean …?" where something is near, else the list of what there is.
pub fn suggest<'k>(
    word: &str,
    known: impl IntoIterator<Item = &'k str> + Clone,
    kind: &str,
) -> String {
    match nearest(word, known.clone()) {
        Some(candidate) => format!("did you mean `{candidate}`?"),
        None => {
            let list = list(known);
            if list.is_empty() {
                format!("there are no {kind} here")
            } else {
                format!("the {kind} here: {list}")
            }
        }
    }
}

/// `a`, `b`, `c`.
pub fn list<'k>(words: impl IntoIterator<Item = &'k str>) -> String {
    words
        .into_iter()
        .map(|word| format!("`{word}`"))
        .collect::<Vec<_>>()
        .join(", ")
}
