//! Result of one check.

use super::remedies::{OperatingSystem, StationFault};
use serde::Serialize;
use std::fmt::Display;

/// Result of one check: a subject, its status and, unless all is well, the remedy.
#[derive(Serialize)]
pub struct Finding {
    /// Name of the check; a contract with those who monitor stations.
    pub check: &'static str,
    pub status: FindingStatus,
    /// Object that was found, or the defect, in one line.
    pub message: String,
    pub remedy: Option<String>,
}

/// Status of a finding, in order of seriousness.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingStatus {
    Ok,
    /// This build does not have the part.
    NotIncluded,
    /// A session can be held, but with a limitation.
    Warning,
    /// A session cannot be held, or its records would be wrong.
    Missing,
}

impl FindingStatus {
    pub fn word(self) -> &'static str {
        match self {
            FindingStatus::Ok => "ok",
            FindingStatus::NotIncluded => "not included",
            FindingStatus::Warning => "warning",
            FindingStatus::Missing => "missing",
        }
    }
}

impl Finding {
    pub fn ok(check: &'static str, message: impl Display) -> Finding {
        Finding { check, status: FindingStatus::Ok, message: message.to_string(), remedy: None }
    }

    /// A finding with a remedy in the words of this system.
    pub fn fault(check: &'static str, status: FindingStatus, message: impl Display, fault: StationFault) -> Finding {
        Finding::with_remedy(check, status, message, fault.remedy(OperatingSystem::CURRENT))
    }

    pub fn with_remedy(
        check: &'static str,
        status: FindingStatus,
        message: impl Display,
        remedy: impl Display,
    ) -> Finding {
        Finding { check, status, message: message.to_string(), remedy: Some(remedy.to_string()) }
    }

    #[cfg(not(all(feature = "desktop", feature = "devices", feature = "audio")))]
    pub fn not_included(check: &'static str, part: &str, feature: &str) -> Finding {
        Finding {
            check,
            status: FindingStatus::NotIncluded,
            message: format!("this build does not include {part} (feature `{feature}`)"),
            remedy: None,
        }
    }
}
