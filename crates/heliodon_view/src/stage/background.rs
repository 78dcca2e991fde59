//! What a thread of its own reads while frames go on.

use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::sync::{Mutex, PoisonError};

/// Something that is being read.
pub(crate) struct Background<T>(Mutex<Receiver<T>>);

/// The thread ended without a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BrokenOff;

impl<T: Send + 'static> Background<T> {
    /// Begins to read.
    pub fn start(read: impl FnOnce() -> T + Send + 'static) -> Self {
        let (to_stage, read_there) = channel();
        // The stage may have gone to another bundle: then nobody wants to know.
        std::thread::spawn(move || to_stage.send(read()).ok());
        Self(Mutex::new(read_there))
    }

    /// What was read, once; `None` while it is not there yet.
    pub fn take(&self) -> Option<Result<T, BrokenOff>> {
        match self.0.lock().unwrap_or_else(PoisonError::into_inner).try_recv() {
            Ok(read) => Some(Ok(read)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(BrokenOff)),
        }
    }

    /// Waits for what is read, for those whose frames must not depend on how long that takes; once.
    pub fn wait(&self) -> Result<T, BrokenOff> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).recv().map_err(|_| BrokenOff)
    }
}
