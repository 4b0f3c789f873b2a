//! The signals of the process, listened to from the first moment of a command that computes to its last, so that none is
//! lost between two runs.

use std::{io, sync::mpsc, thread};

use tokio::{
    signal::unix::{Signal, SignalKind, signal},
    sync::{oneshot, watch},
};

/// So many requests to stop end the process, whatever it is at: the first two are for whoever computes.
const ENOUGH: u32 = 3;

/// What has been received so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Received {
    /// How often SIGINT or SIGTERM came.
    pub stops: u32,
    /// Which of them came last.
    pub last: i32,
    /// How often SIGUSR1 came.
    pub checkpoints: u32,
}

/// Listens to SIGINT, SIGTERM and SIGUSR1 while it lives.
pub struct Signals {
    received: watch::Receiver<Received>,
    /// Dropped to end the listening.
    _end: oneshot::Sender<()>,
}

impl Signals {
    /// Begins to listen.
    ///
    /// # Errors
    /// The system does not let it.
    pub fn listen() -> io::Result<Self> {
        let (end, ended) = oneshot::channel();
        let (sender, received) = watch::channel(Received::default());
        let (begun, beginning) = mpsc::channel();
        thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || {
                let runtime = tokio::runtime::Builder::new_current_thread()
                    .enable_all()
                    .build();
                let runtime = match runtime {
                    Ok(runtime) => runtime,
                    Err(error) => return drop(begun.send(Err(error))),
                };
                runtime.block_on(async {
                    match Kinds::new() {
                        Ok(kinds) => {
                            let _ = begun.send(Ok(()));
                            tokio::select! {
                                _ = ended => {}
                                () = kinds.count(&sender) => {}
                            }
                        }
                        Err(error) => drop(begun.send(Err(error))),
                    }
                });
            })?;
        beginning
            .recv()
            .unwrap_or_else(|_| Err(io::Error::other("the thread that listens ended")))?;
        Ok(Self {
            received,
            _end: end,
        })
    }

    /// What has been received, now and from now on.
    pub fn received(&self) -> watch::Receiver<Received> {
        self.received.clone()
    }

    /// The signal by which the process was asked to stop, if it was.
    pub fn stop(&self) -> Option<i32> {
        let received = *self.received.borrow();
        (received.stops > 0).then_some(received.last)
    }
}

struct Kinds {
    interrupt: Signal,
    terminate: Signal,
    checkpoint: Signal,
}

impl Kinds {
    fn new() -> io::Result<Self> {
        Ok(Self {
            interrupt: signal(SignalKind::interrupt())?,
            terminate: signal(SignalKind::terminate())?,
            checkpoint: signal(SignalKind::user_defined1())?,
        })
    }

    async fn count(mut self, received: &watch::Sender<Received>) {
        loop {
            let stop = tokio::select! {
                _ = self.interrupt.recv() => SignalKind::interrupt().as_raw_value(),
                _ = self.terminate.recv() => SignalKind::terminate().as_raw_value(),
                _ = self.checkpoint.recv() => {
                    received.send_modify(|received| received.checkpoints += 1);
                    continue;
                }
            };
            received.send_modify(|received| {
                received.stops += 1;
                received.last = stop;
            });
            if received.borrow().stops >= ENOUGH {
                // Somebody at a terminal who is not heard, as while a damaged store is read. Nothing that is committed
                // or journalled can be lost by it.
                std::process::exit(128 + stop);
            }
        }
    }
}
