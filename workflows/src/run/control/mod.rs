//! What reaches a computing process from outside: signals, its deadline, and requests that others leave in the folder of
//! a run. They stop a session, hold it up or have it flush its journal; no number depends on any of them.

mod ask;
mod attend;
mod mailbox;
mod signals;
mod stop;

pub use self::ask::{cancel, go_on, pause};
pub use self::attend::{Attendant, Desk};
pub use self::mailbox::{Asker, Extent, Order, Urgency};
pub use self::signals::Signals;
pub use self::stop::Stop;
