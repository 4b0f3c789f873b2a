//! The queue of a store: what is submitted while another process computes waits there for it.

mod enqueue;
mod entry;
mod list;
mod work;
mod worker;

pub use self::enqueue::{enqueue, ready};
pub use self::entry::{Entry, Work};
pub use self::list::{counts, is_waiting, list, needed, remove, waiting};
pub use self::work::{Worked, find_ticket, work};
pub use self::worker::{Mark, worker};
