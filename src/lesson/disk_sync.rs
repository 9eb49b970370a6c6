//! Syncs a growing recording to the disk once a second, on a thread of its own.
//!
//! The recorder hands its bytes to the system ten times a second, which survives the end of the program. Only a sync
//! survives a power cut. A sync may take long, so neither the servo nor the session waits for one.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;
use typodont_formats::sync_folder;

/// Pause between two syncs. With the 0.1 s that the recorder keeps, a power cut loses at most 1.2 s as long as a sync
/// takes no more than 0.1 s.
const SYNC_PAUSE: Duration = Duration::from_millis(900);

/// A thread that syncs a file until it is finished or dropped.
pub(super) struct DiskSync {
    /// Dropped to stop the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
    error: Arc<Mutex<Option<String>>>,
}

impl DiskSync {
    /// Starts to sync a recording, once its name and the name of its folder are on the disk.
    ///
    /// # Errors
    ///
    /// When the file cannot be opened, or the thread cannot be started.
    pub fn start(recording: &Path) -> io::Result<DiskSync> {
        // A handle that may write, because some systems sync no other.
        let file = File::options().write(true).open(recording)?;
        let folders: Vec<PathBuf> = recording.ancestors().skip(1).take(3).map(Path::to_path_buf).collect();
        let mut are_folders_synced = false;
        DiskSync::start_with(SYNC_PAUSE, move || {
            if !are_folders_synced {
                folders.iter().for_each(|folder| sync_folder(folder));
                are_folders_synced = true;
            }
            file.sync_data()
        })
    }

    fn start_with(pause: Duration, sync: impl FnMut() -> io::Result<()> + Send + 'static) -> io::Result<DiskSync> {
        let (stop, stopped) = mpsc::channel();
        let error = Arc::new(Mutex::new(None));
        let thread = std::thread::Builder::new().name("disk-sync".into());
        let thread = thread.spawn({
            let error = error.clone();
            move || sync_until_stopped(pause, sync, &stopped, &error)
        })?;
        Ok(DiskSync { stop: Some(stop), thread: Some(thread), error })
    }

    /// Reason for which the file cannot be synced; `None` as long as it can.
    pub fn error(&self) -> Option<String> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Syncs the file a last time, and stops.
    ///
    /// # Errors
    ///
    /// The reason for which the file could not be synced, now or earlier.
    pub fn finish(mut self) -> Result<(), String> {
        self.stop_and_join();
        self.error().map_or(Ok(()), Err)
    }

    fn stop_and_join(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // The thread does not panic; if it did, the file would be as safe as without it.
            let _ = thread.join();
        }
    }
}

impl Drop for DiskSync {
    fn drop(&mut self) {
        self.stop_and_join();
    }
}

/// Syncs at once, after every pause, and a last time when the other end of `stopped` is dropped.
fn sync_until_stopped(
    pause: Duration,
    mut sync: impl FnMut() -> io::Result<()>,
    stopped: &Receiver<()>,
    error: &Mutex<Option<String>>,
) {
    let mut is_last = false;
    loop {
        match sync() {
            Ok(()) if is_last => return,
            Ok(()) => is_last = !matches!(stopped.recv_timeout(pause), Err(RecvTimeoutError::Timeout)),
            // The file system cannot sync: nothing more can be done on it.
            Err(e) if matches!(e.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => return,
            Err(e) => {
                let why = typodont_formats::write_failure(&e);
                let why = format!("the recording cannot be synced to the disk: {why}");
                *error.lock().unwrap_or_else(PoisonError::into_inner) = Some(why);
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn a_file_is_synced_in_every_interval_and_once_more_at_the_end() {
        // Aim: the loss of a power cut is bounded by the interval. Method: count the syncs of a file during ten
        // intervals; a busy machine may skip some, and never adds any.
        let count = Arc::new(AtomicUsize::new(0));
        let counted = count.clone();
        let pause = Duration::from_millis(50);
        let sync = DiskSync::start_with(pause, move || {
            counted.fetch_add(1, Ordering::Relaxed);
            Ok(())
        });
        let sync = sync.unwrap();
        std::thread::sleep(10 * pause);
        let before_the_end = count.load(Ordering::Relaxed);
        sync.finish().unwrap();
        let at_the_end = count.load(Ordering::Relaxed);
        assert!((3..=11).contains(&before_the_end), "{before_the_end} syncs");
        assert!(at_the_end > before_the_end, "no sync at the end");
        assert!(SYNC_PAUSE < Duration::from_secs(1));
    }

    #[test]
    fn a_failing_disk_is_reported_and_a_file_system_that_cannot_sync_is_not() {
        let check = |kind: io::ErrorKind, is_reported: bool| {
            let sync = DiskSync::start_with(Duration::from_millis(1), move || Err(io::Error::from(kind))).unwrap();
            assert_eq!(sync.finish().is_err(), is_reported, "{kind}");
        };
        check(io::ErrorKind::StorageFull, true);
        check(io::ErrorKind::Other, true);
        check(io::ErrorKind::InvalidInput, false);
        check(io::ErrorKind::Unsupported, false);
    }
}
