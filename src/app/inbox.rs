//! The place at which something arrives that a page asked the browser for.

use eframe::egui;
use std::sync::{Arc, Mutex, PoisonError};

/// Holds what has arrived; in a page, where the browser answers while it draws, some frames after the question.
pub struct Inbox<T>(Arc<Mutex<Option<T>>>);

impl<T> Inbox<T> {
    /// Lets something arrive, in place of what was not taken.
    pub fn put(&self, arrival: T, ctx: &egui::Context) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(arrival);
        ctx.request_repaint();
    }

    pub fn take(&self) -> Option<T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl<T> Default for Inbox<T> {
    fn default() -> Inbox<T> {
        Inbox(Arc::default())
    }
}

impl<T> Clone for Inbox<T> {
    fn clone(&self) -> Inbox<T> {
        Inbox(self.0.clone())
    }
}
