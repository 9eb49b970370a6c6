//! Trying again, for as long as somebody is willing to wait.

use std::thread;
use std::time::{Duration, Instant};

/// Between two tries: the first and the longest pause.
const PAUSE: Duration = Duration::from_millis(200);
const PAUSE_MAX: Duration = Duration::from_secs(10);

/// For how long a server that does not answer is tried again.
#[derive(Clone, Copy, Debug)]
pub struct Patience(pub Duration);

/// Whether trying again may help.
pub trait Passing {
    fn is_passing(&self) -> bool;
}

impl Patience {
    /// Does something until it works, cannot work, or patience is over.
    pub fn keep<T, E: Passing>(self, mut what: impl FnMut() -> Result<T, E>) -> Result<T, E> {
        let begun = Instant::now();
        let mut pause = PAUSE;
        loop {
            match what() {
                Err(error) if error.is_passing() && begun.elapsed() + pause < self.0 => thread::sleep(pause),
                result => return result,
            }
            pause = (pause * 2).min(PAUSE_MAX);
        }
    }
}
