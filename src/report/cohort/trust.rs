//! Verification of a cohort: each result against its recording, each recording once.

use super::Cohort;
use crate::display_format::sanitize_display;
use crate::verification::{VerificationStatus, Verifier};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use typodont_exercise::record;

/// Number of sessions by their relation to their recordings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct VerificationCounts {
    pub verified: usize,
    pub not_verified: usize,
    pub differs: usize,
}

impl Cohort {
    /// Judges every session, and counts each recording once. `progress` is called with the number of sessions done.
    pub fn verify(&mut self, verifier: &Verifier, progress: impl Fn(usize) + Sync) {
        let statuses = verifier.verify_all(&self.sessions, progress);
        self.verification = self.sessions.iter().map(|(path, _)| path.clone()).zip(statuses).collect();
        self.skip_repeated_recordings();
    }

    /// Relation of a session's result to its recording, by the path of its bundle.
    pub fn status(&self, bundle: &Path) -> &VerificationStatus {
        self.verification.get(bundle).unwrap_or(&VerificationStatus::Pending)
    }

    pub fn verification_counts(&self) -> VerificationCounts {
        let mut counts = VerificationCounts::default();
        for (path, _) in &self.sessions {
            match self.status(path) {
                VerificationStatus::Verified => counts.verified += 1,
                VerificationStatus::Differs(_) => counts.differs += 1,
                VerificationStatus::Pending | VerificationStatus::Unverified(_) => counts.not_verified += 1,
            }
        }
        counts
    }

    /// Skips every session but one of the same recording, whoever is named in them: the one that its recording
    /// confirms, if there is one, else the first.
    pub fn skip_repeated_recordings(&mut self) {
        let mut by_recording: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        for (index, (_, session)) in self.sessions.iter().enumerate() {
            if let Some(digest) = session.digests.get(record::FILE_NAME) {
                by_recording.entry(digest).or_default().push(index);
            }
        }
        let rank = |index: usize| match self.status(&self.sessions[index].0) {
            VerificationStatus::Verified => 0,
            VerificationStatus::Pending | VerificationStatus::Unverified(_) => 1,
            VerificationStatus::Differs(_) => 2,
        };
        let name = |index: usize| {
            let (path, session) = &self.sessions[index];
            let participant = sanitize_display(&session.participant, 64);
            format!("{} (participant \"{participant}\")", path.display())
        };
        let mut repeated = BTreeMap::new();
        for same in by_recording.into_values().filter(|same| same.len() > 1) {
            let Some(counted) = same.iter().copied().min_by_key(|&index| (rank(index), index)) else { continue };
            for &other in same.iter().filter(|&&other| other != counted) {
                let ((path, first), (_, second)) = (&self.sessions[counted], &self.sessions[other]);
                // A backup beside its original is no second attempt.
                let is_copy = (&first.participant, &first.started) == (&second.participant, &second.started);
                let participant = sanitize_display(&second.participant, 64);
                let why = match is_copy {
                    true => format!("duplicate of the session in {}", path.display()),
                    false => format!(
                        "repeated recording: participant \"{participant}\" has the same recording as {}, which is counted",
                        name(counted)
                    ),
                };
                repeated.insert(other, why);
            }
        }
        let mut index = 0;
        let (sessions, skipped) = (&mut self.sessions, &mut self.skipped);
        sessions.retain(|(path, _)| {
            let why = repeated.remove(&index);
            index += 1;
            let is_kept = why.is_none();
            skipped.extend(why.map(|why| (path.clone(), why)));
            is_kept
        });
    }
}
