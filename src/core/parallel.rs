//! Parallel loops over image rows or index ranges.

use std::num::NonZero;
use std::thread;

/// Number of threads to use: the available parallelism, or 1 if it is unknown or the platform has no threads.
pub fn available_threads() -> usize {
    if cfg!(target_family = "wasm") { 1 } else { thread::available_parallelism().map_or(1, NonZero::get) }
}

/// Calls `work` with the index and pixels of each row. Rows are assigned to threads in turn, so that expensive rows
/// are shared evenly.
pub fn par_rows<T: Send>(pixels: &mut [T], width: u32, threads: usize, work: impl Fn(u32, &mut [T]) + Sync) {
    let threads = threads.max(1);
    if threads == 1 {
        return pixels.chunks_mut(width.max(1) as usize).enumerate().for_each(|(y, row)| work(y as u32, row));
    }
    let mut batches: Vec<Vec<(u32, &mut [T])>> = (0..threads).map(|_| Vec::new()).collect();
    for (y, row) in pixels.chunks_mut(width.max(1) as usize).enumerate() {
        batches[y % threads].push((y as u32, row));
    }
    let work = &work;
    thread::scope(|scope| {
        for batch in batches {
            scope.spawn(move || batch.into_iter().for_each(|(y, row)| work(y, row)));
        }
    });
}

/// Calls `make` with each index below `count` in parallel; returns the results in index order.
pub fn par_map<T: Send>(count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    /// Enough chunks per thread to share expensive ones evenly.
    const CHUNKS_PER_THREAD: usize = 8;
    let threads = available_threads();
    let chunk = (count / (CHUNKS_PER_THREAD * threads)).max(1);
    let mut results: Vec<Option<T>> = (0..count).map(|_| None).collect();
    par_rows(&mut results, chunk as u32, threads, |number, row| {
        for (place, one) in row.iter_mut().enumerate() {
            *one = Some(make(number as usize * chunk + place));
        }
    });
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_gets_its_own_in_order() {
        for count in [0, 1, 7, 1000] {
            assert_eq!(par_map(count, |n| 3 * n), (0..count).map(|n| 3 * n).collect::<Vec<_>>());
        }
    }
}
