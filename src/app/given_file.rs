//! Files that the user gives to the window: chosen in the browser, or dropped.

use eframe::egui;
use std::sync::{Arc, Mutex, PoisonError};

/// A file that the user gave to the window.
#[derive(Debug)]
pub struct GivenFile {
    pub name: String,
    pub content: GivenContent,
    /// Number of files that were given with it and are left out.
    pub left_out: usize,
}

/// Content of a [`GivenFile`].
#[derive(Debug)]
pub enum GivenContent {
    /// The bytes, or the reason why they cannot be read.
    Read(Result<Vec<u8>, String>),
    /// A file on this computer.
    #[cfg(not(target_family = "wasm"))]
    OnDisk(std::path::PathBuf),
}

impl GivenContent {
    /// The bytes.
    ///
    /// # Errors
    /// The reason why they cannot be read.
    pub fn read(self) -> Result<Vec<u8>, String> {
        match self {
            GivenContent::Read(read) => read,
            #[cfg(not(target_family = "wasm"))]
            GivenContent::OnDisk(path) => typodont_formats::read_file(&path).map_err(|complaint| complaint.headline()),
        }
    }
}

/// The place at which a given file arrives; in a page, which reads files while it draws, some frames later.
#[derive(Clone, Default)]
pub struct FileInbox(Arc<Mutex<Option<GivenFile>>>);

impl FileInbox {
    /// Lets a file arrive, in place of one that was not taken.
    pub fn put(&self, file: GivenFile, ctx: &egui::Context) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(file);
        ctx.request_repaint();
    }

    pub fn take(&self) -> Option<GivenFile> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}
