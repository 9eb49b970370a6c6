//! Work on a picture's rows, shared out to threads.

use std::num::NonZero;
use std::thread;

/// How many threads may help.
pub fn processors() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

/// Calls `work` with each row's number and pixels. Rows are dealt out in turn, so that dear ones are shared fairly.
pub fn in_rows<T: Send>(pixels: &mut [T], width: u32, threads: usize, work: impl Fn(u32, &mut [T]) + Sync) {
    let threads = threads.max(1);
    let mut hands: Vec<Vec<(u32, &mut [T])>> = (0..threads).map(|_| Vec::new()).collect();
    for (y, row) in pixels.chunks_mut(width.max(1) as usize).enumerate() {
        hands[y % threads].push((y as u32, row));
    }
    let work = &work;
    thread::scope(|scope| {
        for hand in hands {
            scope.spawn(move || hand.into_iter().for_each(|(y, row)| work(y, row)));
        }
    });
}
