//! Where threads meet: bounded, never waiting, losses counted.
//!
//! Two kinds. [`ordered`]: every letter in order, until the box is full. [`Newest`]: a few words, the newest wins.
//! Never locks, never allocates once made.

use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};

/// A box in which every letter arrives in order. What does not fit is lost, and counted.
pub fn ordered<T>(capacity: usize) -> (Sender<T>, Receiver<T>) {
    let (ring, end) = RingBuffer::new(capacity);
    let lost = Arc::new(AtomicU64::new(0));
    (Sender { ring, lost: lost.clone() }, Receiver { ring: end, lost })
}

pub struct Sender<T> {
    ring: Producer<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Sender<T> {
    /// Posts a letter; gives it back when the box is full, and counts it as lost.
    pub fn try_send(&mut self, letter: T) -> Result<(), T> {
        self.ring.push(letter).map_err(|rtrb::PushError::Full(letter)| {
            self.lost.fetch_add(1, Ordering::Relaxed);
            letter
        })
    }

    /// Letters that fit now.
    pub fn room(&self) -> usize {
        self.ring.slots()
    }

    /// Letters lost so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// True when nobody can receive any more.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

pub struct Receiver<T> {
    ring: Consumer<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Receiver<T> {
    /// The next letter, if one lies there.
    pub fn try_recv(&mut self) -> Option<T> {
        self.ring.pop().ok()
    }

    /// Letters that lie there.
    pub fn waiting(&self) -> usize {
        self.ring.slots()
    }

    /// Letters lost so far.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// True when nobody can send any more; letters may still lie there.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }
}

/// A few 32-bit words of which only the newest count. One thread writes, any may read.
///
/// A sequence lock: the count is odd while words are being written, and a reader that saw it change looks again.
#[derive(Debug)]
pub struct Newest<const N: usize> {
    count: AtomicU64,
    words: [AtomicU32; N],
}

/// Looks a reader takes before it makes do with what it had: a writer that was interrupted in the middle may be away for
/// long, and nobody waits for it.
const LOOKS: usize = 64;

impl<const N: usize> Newest<N> {
    pub fn new() -> Newest<N> {
        Newest { count: AtomicU64::new(0), words: std::array::from_fn(|_| AtomicU32::new(0)) }
    }

    /// Replaces the words. Only one thread may do so.
    pub fn write(&self, words: [u32; N]) {
        let count = self.count.load(Ordering::Relaxed);
        self.count.store(count + 1, Ordering::Relaxed);
        fence(Ordering::Release);
        for (to, word) in self.words.iter().zip(words) {
            to.store(word, Ordering::Relaxed);
        }
        self.count.store(count + 2, Ordering::Release);
    }

    /// The newest words and how often they were replaced; `None` before the first, or while they are being replaced.
    pub fn read(&self) -> Option<(u64, [u32; N])> {
        for _ in 0..LOOKS {
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

impl<const N: usize> Default for Newest<N> {
    fn default() -> Self {
        Newest::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_box_counts_what_it_loses() {
        let (mut sender, mut receiver) = ordered(2);
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
        // Aim: a reader never sees half of one letter and half of the next. Method: all words alike, one writer, one
        // reader on another thread.
        let slot = Arc::new(Newest::<12>::new());
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
