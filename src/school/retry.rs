//! Retries of failed requests, with growing pauses and a time limit.

use std::thread;
use std::time::{Duration, Instant};

/// First and longest pause between two attempts.
const BACKOFF: Duration = Duration::from_millis(200);
const BACKOFF_MAX: Duration = Duration::from_secs(10);

/// Time for which a server that does not answer is tried again.
#[derive(Clone, Copy, Debug)]
pub struct RetryPolicy(pub Duration);

/// Errors that may be temporary.
pub trait Transient {
    fn is_transient(&self) -> bool;
}

impl RetryPolicy {
    /// Repeats `attempt` until it succeeds, fails permanently, or the time is over.
    ///
    /// # Errors
    /// The error of the last attempt.
    pub fn retry<T, E: Transient>(self, mut attempt: impl FnMut() -> Result<T, E>) -> Result<T, E> {
        let begun = Instant::now();
        let mut pause = BACKOFF;
        loop {
            match attempt() {
                Err(error) if error.is_transient() && begun.elapsed() + pause < self.0 => thread::sleep(pause),
                result => return result,
            }
            pause = (pause * 2).min(BACKOFF_MAX);
        }
    }
}
