//! Message passing between threads: bounded, non-blocking, with losses counted.
//!
//! [`channel`] delivers every message in order until it is full. [`SeqLock`] holds a few words, of which the newest
//! win. Never locks, never allocates after construction.

use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

/// Creates a bounded channel that delivers every message in order. Messages that do not fit are lost and counted.
pub fn channel<T>(capacity: usize) -> (Sender<T>, Receiver<T>) {
    let (ring, end) = RingBuffer::new(capacity);
    let lost = Arc::new(AtomicU64::new(0));
    (Sender { ring, lost: lost.clone() }, Receiver { ring: end, lost })
}

pub struct Sender<T> {
    ring: Producer<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Sender<T> {
    /// Sends a message.
    ///
    /// # Errors
    /// If the channel is full: the message is returned and counted as lost.
    pub fn try_send(&mut self, message: T) -> Result<(), T> {
        self.ring.push(message).map_err(|rtrb::PushError::Full(letter)| {
            self.lost.fetch_add(1, Ordering::Relaxed);
            letter
        })
    }

    /// Number of messages that can be sent now.
    pub fn free_slots(&self) -> usize {
        self.ring.slots()
    }

    /// Number of messages lost so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Returns true if the receiver was dropped.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

pub struct Receiver<T> {
    ring: Consumer<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Receiver<T> {
    /// Returns the next message, if there is one.
    pub fn try_recv(&mut self) -> Option<T> {
        self.ring.pop().ok()
    }

    /// Number of messages waiting to be received.
    pub fn pending(&self) -> usize {
        self.ring.slots()
    }

    /// Number of messages lost so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Returns true if the sender was dropped; messages may still be waiting.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// A few 32-bit words, of which only the newest are of interest. One thread writes, any thread may read.
///
/// The sequence count is odd while words are being written; a reader that saw it change reads again.
#[derive(Debug)]
pub struct SeqLock<const N: usize> {
    count: AtomicU64,
    words: [AtomicU32; N],
}

/// Read attempts before a reader gives up. A writer that was interrupted in the middle of a write may be suspended
/// for long, and a reader never waits for it.
const READ_ATTEMPTS: usize = 64;

impl<const N: usize> SeqLock<N> {
    pub fn new() -> SeqLock<N> {
        SeqLock { count: AtomicU64::new(0), words: std::array::from_fn(|_| AtomicU32::new(0)) }
    }

    /// Replaces the words. Only one thread may call this function.
    pub fn write(&self, words: [u32; N]) {
        let count = self.count.load(Ordering::Relaxed);
        self.count.store(count + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        for (to, word) in self.words.iter().zip(words) {
            to.store(word, Ordering::Relaxed);
        }
        self.count.store(count + 2, Ordering::Release);
    }

    /// Returns the newest words and the number of writes so far; `None` before the first write, or if every attempt
    /// met a write in progress.
    pub fn read(&self) -> Option<(u64, [u32; N])> {
        for _ in 0..READ_ATTEMPTS {
            let before = self.count.load(Ordering::Acquire);
            if before == 0 {
                return None;
            }
            let words = std::array::from_fn(|i| self.words[i].load(Ordering::Relaxed));
            fence(Ordering::Acquire);
            if before.is_multiple_of(2) && self.count.load(Ordering::Relaxed) == before {
                return Some((before / 2, words));
            }
            std::hint::spin_loop();
        }
        None
    }
}

impl<const N: usize> Default for SeqLock<N> {
    fn default() -> Self {
        SeqLock::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_box_counts_what_it_loses() {
        let (mut sender, mut receiver) = channel(2);
        assert_eq!(sender.try_send(1), Ok(()));
        assert_eq!(sender.try_send(2), Ok(()));
        assert_eq!(sender.try_send(3), Err(3));
        assert_eq!((receiver.try_recv(), receiver.try_recv(), receiver.try_recv()), (Some(1), Some(2), None));
        assert_eq!((sender.lost(), receiver.lost()), (1, 1));
        assert!(!receiver.is_abandoned());
        drop(sender);
        assert!(receiver.is_abandoned());
    }

    #[test]
    fn the_newest_words_are_never_torn() {
        // Aim: a reader never sees parts of two messages. Method: all words of a message are equal; one writer, and
        // one reader on another thread.
        let slot = Arc::new(SeqLock::<12>::new());
        assert_eq!(slot.read(), None);
        let writer = slot.clone();
        let thread = std::thread::spawn(move || (1..200_000u32).for_each(|i| writer.write([i; 12])));
        let mut last = 0;
        while !thread.is_finished() {
            if let Some((count, words)) = slot.read() {
                assert!(words.iter().all(|w| *w == words[0]), "{words:?}");
                assert_eq!(u64::from(words[0]), count);
                assert!(words[0] >= last);
                last = words[0];
            }
        }
        thread.join().unwrap();
        assert_eq!(slot.read(), Some((199_999, [199_999; 12])));
    }
}
