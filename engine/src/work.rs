//! What a task does.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::TaskContext;

/// What a task does: a value that any executor, on this machine or on another one, can carry out.
///
/// The value, its output and its error serialise, so that the same graph can run over message
/// passing, and so that a failed task can be saved and reproduced alone.
pub trait Work: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// What the task gives.
    type Output: Serialize + DeserializeOwned + Send + 'static;
    /// How the task fails.
    type Error: std::error::Error + Serialize + DeserializeOwned + Send + 'static;

    /// Carries the task out.
    ///
    /// Pure: the same value gives the same output, bit for bit, on any thread and at any time.
    /// `context` is there to see a request to stop (a long task should look every few milliseconds
    /// and return any error; the engine reports why it had to stop) and the number of the attempt.
    ///
    /// A panic is contained and reported as a failure of this task. Do not use rayon inside a task:
    /// a thread that waits for its share may pick up another task and be charged for it.
    ///
    /// # Errors
    /// Whatever the task itself calls a failure.
    fn run(&self, context: &TaskContext) -> Result<Self::Output, Self::Error>;

    /// Whether another attempt would only end in this error again, so that none is made. It is for
    /// errors that follow from the task's own value, as a law without a solution; not for those that
    /// come from the machine. By default every error is tried again.
    fn repeats(_error: &Self::Error) -> bool {
        false
    }
}
