//! Reasons for which a workpiece cannot be made.

use super::lesion::DecayPlacementError;
use std::fmt;

/// Reason for which a workpiece cannot be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WorkpieceError {
    /// A decay contains no hard tissue: tooth and decay by index.
    DecayOutside { tooth: usize, decay: usize },
    /// A decay that follows a groove finds none: tooth and decay by index.
    NoGroove { tooth: usize, decay: usize },
    /// A stain contains no sound tissue, or finds no groove to follow: tooth and stain by index.
    StainOutside { tooth: usize, stain: usize },
    /// A cavity contains no tissue: tooth by index.
    CavityOutside { tooth: usize },
    /// A cavity opens the pulp: tooth by index.
    CavityInPulp { tooth: usize },
    /// There is no root at the site of a deposit: tooth and deposit by index.
    NoRoot { tooth: usize, calculus: usize },
    /// An existing filling contains no hard tissue: tooth and filling by index.
    FillingOutside { tooth: usize, filling: usize },
    /// A pocket extends below the root: excess of the deepest pocket, tenths of a millimetre.
    PocketTooDeep { tenths: u32 },
    /// Two teeth of a pair have different voxel sizes.
    UnequalSpacing,
    /// A tooth has no enamel, so that its crown cannot be determined.
    NoEnamel { tooth: usize },
    /// A zone's label map differs in size from the workpiece: zone by index, size of the map and of the workpiece in
    /// voxels.
    ZoneSize { zone: usize, map: [u32; 3], workpiece: [u32; 3] },
    /// The volume would have too many voxels.
    TooLarge { voxels: u64 },
    /// There is no tooth of this number.
    NoSuchTooth { fdi: u8 },
    /// The teeth's shapes were not read, since the volume is to be taken from a recording.
    OnlyRecorded,
}

impl fmt::Display for WorkpieceError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            WorkpieceError::DecayOutside { .. } => f.write_str("the caries is outside the tooth's hard tissue"),
            WorkpieceError::NoGroove { .. } => {
                f.write_str("there is no fissure in the occlusal surface near the position of the caries")
            }
            WorkpieceError::StainOutside { .. } => f.write_str("the stain is outside the tooth's sound tissue"),
            WorkpieceError::CavityOutside { .. } => f.write_str("the cavity is outside the tooth"),
            WorkpieceError::CavityInPulp { .. } => f.write_str("the cavity exposes the pulp"),
            WorkpieceError::NoRoot { .. } => f.write_str("there is no tooth surface at the position of the calculus"),
            WorkpieceError::FillingOutside { .. } => f.write_str("the old filling is outside the crown's hard tissue"),
            WorkpieceError::PocketTooDeep { tenths } => {
                write!(f, "the deepest pocket extends {:.1} mm beyond the apex of the root", f64::from(*tenths) / 10.0)
            }
            WorkpieceError::UnequalSpacing => f.write_str("the two teeth have different voxel sizes"),
            WorkpieceError::NoEnamel { .. } => f.write_str("the tooth has no enamel, so its crown cannot be located"),
            WorkpieceError::ZoneSize { map, workpiece, .. } => write!(
                f,
                "the zone's label map has {}×{}×{} voxels, but the workpiece has {}×{}×{}",
                map[0], map[1], map[2], workpiece[0], workpiece[1], workpiece[2]
            ),
            WorkpieceError::NoSuchTooth { fdi } => write!(f, "there is no tooth {fdi}"),
            WorkpieceError::OnlyRecorded => f.write_str("the shapes of the teeth are available only in the recording"),
            WorkpieceError::TooLarge { voxels } => {
                write!(f, "the volume would have {voxels} voxels, which is too many")
            }
        }
    }
}

impl std::error::Error for WorkpieceError {}

impl WorkpieceError {
    /// The error of a decay that cannot be placed, tooth and decay by index.
    pub(super) fn of_decay(reason: DecayPlacementError, tooth: usize, decay: usize) -> WorkpieceError {
        match reason {
            DecayPlacementError::Outside => WorkpieceError::DecayOutside { tooth, decay },
            DecayPlacementError::NoGroove => WorkpieceError::NoGroove { tooth, decay },
        }
    }
}
