//! Bundles: a session's files, written completely or not at all, and verified byte by byte.
//!
//! A bundle is a folder on disk or in memory ([`BundleFolder`]), and can be handed on as one zip file. While a session
//! runs, its recording grows in a folder named `….partial`; when all files are written, the folder is renamed. All other
//! files follow from the recording: [`verify`] derives them again and compares. Every file is synced to the disk before
//! the folder is renamed, so that a bundle is whole even after a power cut.

mod bundle_folder;
mod bundle_zip;
mod comparison;
mod derived_files;
mod partial_bundle;
mod template_name;

pub use bundle_folder::BundleFolder;
pub use comparison::{Verification, VerificationOutcome, compare_results, verify, verify_recording};
pub(super) use comparison::{compare_facts, compare_files, compare_scores, unlisted_complaint, unlisted_files};
pub(super) use derived_files::derive_maps;
pub use partial_bundle::{
    BundleError, CompletedBundle, CompletionObserver, CompletionStep, PartialBundle, RecordingChange, RecordingGrowth,
    is_in_use, is_partial,
};
pub(super) use template_name::named_template;

use sha2::{Digest, Sha256};
use typodont_exercise::scenario::hex;

/// Name of the result within a bundle.
pub const SESSION_FILE: &str = "session.json";

/// Name of the page within a bundle.
pub const REPORT_FILE: &str = "report.html";

/// SHA-256 of bytes, as a hexadecimal number in small letters.
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}
