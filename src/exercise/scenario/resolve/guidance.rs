//! Haptic guidance: recorded forces, and paths.

use super::Resolver;

use crate::scenario::file;
use std::sync::Arc;
use typodont_core::touch::{AnchorMode, DAMPING_TIME, Fixture, ForceSpace, ForceTable, Guidance};
use typodont_formats::diagnostic::{Diagnostic, SourceText};

/// Default damping of a fixture, as a share of its stiffness, s: somewhat more than the required minimum.
const USUAL_DAMPING_TIME: f32 = 1.25 * DAMPING_TIME;

impl Resolver<'_> {
    /// Returns the index of the guidance; `None` only after a diagnostic.
    pub(super) fn guidance(&mut self, written: &file::GuidanceFile, path: &str) -> Option<usize> {
        let guidance = match written {
            file::GuidanceFile::Path(fixture) => Guidance::Path(self.fixture(fixture, &format!("{path}/path"))?),
            file::GuidanceFile::Forces(forces) => Guidance::Forces(self.forces(forces, &format!("{path}/forces"))?),
        };
        self.guidances.push(guidance);
        Some(self.guidances.len() - 1)
    }

    fn fixture(&mut self, written: &file::FixtureFile, path: &str) -> Option<Fixture> {
        let is_tube = written.kind == file::FixtureKindFile::Tube;
        let of_follow =
            [("look_ahead_mm", written.look_ahead_mm.is_some()), ("speed_mm_s", written.speed_mm_s.is_some())];
        for (key, _) in of_follow.iter().filter(|(_, is_written)| *is_written && is_tube) {
            let message = format!("\"kind\": \"tube\" does not use {key}");
            self.complain(&format!("{path}/{key}"), "unused-key", message, "remove it, or set \"kind\" to \"follow\"");
        }
        let stiffness = written.stiffness_n_per_mm;
        let damping = written.damping_n_s_per_mm.unwrap_or(USUAL_DAMPING_TIME * stiffness);
        if damping < DAMPING_TIME * stiffness {
            let message = format!("a spring of {stiffness} N/mm would be unstable with so little damping");
            let help = format!("use at least {:.4}, or remove the key", DAMPING_TIME * stiffness);
            self.complain(&format!("{path}/damping_n_s_per_mm"), "unstable-spring", message, help);
        }
        let kind = match written.kind {
            file::FixtureKindFile::Tube => AnchorMode::Tube,
            file::FixtureKindFile::Follow => {
                AnchorMode::Follow { look_ahead: written.look_ahead_mm.unwrap_or(2.0), speed: written.speed_mm_s }
            }
        };
        Some(Fixture {
            path: Arc::new(self.measured(
                &written.file,
                &format!("{path}/file"),
                typodont_formats::csv_tables::parse_path,
            )?),
            anchor_mode: kind,
            radius: written.radius_mm.unwrap_or(if is_tube { 0.5 } else { 0.0 }),
            stiffness,
            damping,
            max_force: written.max_force_n,
        })
    }

    fn forces(&mut self, written: &file::ForcesFile, path: &str) -> Option<ForceTable> {
        let rows = self.measured(&written.file, &format!("{path}/file"), typodont_formats::csv_tables::parse_forces)?;
        let strongest = rows.iter().map(|row| row.force.length()).fold(0.0, f32::max) * written.scale;
        if strongest > typodont_formats::csv_tables::FORCE_MAX {
            let message = format!("after scaling, the greatest force is {strongest:.1} N");
            let help = format!("use a smaller scale: the maximum is {} N", typodont_formats::csv_tables::FORCE_MAX);
            self.complain(&format!("{path}/scale"), "out-of-range", message, help);
        }
        let space = match written.space {
            file::SpaceFile::World => ForceSpace::World,
            file::SpaceFile::Tooth => ForceSpace::Tooth,
        };
        Some(ForceTable { rows: rows.into(), repeat: written.repeat, scale: written.scale, space })
    }

    /// Reads a table of measured numbers. A missing file is reported in the scenario, an invalid file in the table
    /// itself.
    fn measured<T>(
        &mut self,
        name: &str,
        path: &str,
        read: impl FnOnce(Arc<SourceText>) -> Result<T, Vec<Diagnostic>>,
    ) -> Option<T> {
        let bytes = self.library.bytes(name).and_then(|bytes| Ok((bytes, self.library.text(name)?)));
        match bytes {
            Ok((bytes, text)) => {
                self.files.insert(name.to_string(), bytes);
                read(text).map_err(|mut complaints| self.found.append(&mut complaints)).ok()
            }
            Err(Diagnostic { code, message, help, .. }) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }
}
