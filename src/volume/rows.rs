//! Work on a picture's rows, or on anything that can be counted, shared out to threads.

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

/// Makes one thing for each number below `count`, in their order.
pub fn each<T: Send>(count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    /// Shares per thread: enough for dear ones to be dealt out fairly.
    const SHARES: usize = 8;
    let threads = processors();
    let share = (count / (SHARES * threads)).max(1);
    let mut made: Vec<Option<T>> = (0..count).map(|_| None).collect();
    in_rows(&mut made, share as u32, threads, |number, row| {
        for (place, one) in row.iter_mut().enumerate() {
            *one = Some(make(number as usize * share + place));
        }
    });
    made.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_gets_its_own_in_order() {
        for count in [0, 1, 7, 1000] {
            assert_eq!(each(count, |n| 3 * n), (0..count).map(|n| 3 * n).collect::<Vec<_>>());
        }
    }
}
