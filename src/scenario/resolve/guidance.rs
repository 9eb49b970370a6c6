//! What leads the hand: measured forces and paths.

use super::Resolver;
use crate::content;
use crate::diagnostic::{Diagnostic, Source};
use crate::scenario::file;
use crate::touch::{DAMPING_TIME, Fixture, Forces, Guidance, Kind, Space};
use std::sync::Arc;

/// Damping of a fixture whose author leaves it open, as a share of its stiffness, s: somewhat more than it needs.
const USUAL_DAMPING_TIME: f32 = 1.25 * DAMPING_TIME;

impl Resolver<'_> {
    /// Index of what leads the hand; `None` only when it was complained about.
    pub(super) fn guidance(&mut self, written: &file::GuidanceFile, path: &str) -> Option<usize> {
        let guidance = match written {
            file::GuidanceFile::Path(fixture) => Guidance::Path(self.fixture(fixture, &format!("{path}/path"))?),
            file::GuidanceFile::Forces(forces) => Guidance::Forces(self.forces(forces, &format!("{path}/forces"))?),
        };
        self.guidances.push(guidance);
        Some(self.guidances.len() - 1)
    }

    fn fixture(&mut self, written: &file::FixtureFile, path: &str) -> Option<Fixture> {
        let is_tube = written.kind == file::FixtureKind::Tube;
        let of_follow =
            [("look_ahead_mm", written.look_ahead_mm.is_some()), ("speed_mm_s", written.speed_mm_s.is_some())];
        for (key, _) in of_follow.iter().filter(|(_, is_written)| *is_written && is_tube) {
            let message = format!("a tube has no {key}");
            self.complain(
                &format!("{path}/{key}"),
                "unused-key",
                message,
                "leave it out, or set \"kind\" to \"follow\"",
            );
        }
        let stiffness = written.stiffness_n_per_mm;
        let damping = written.damping_n_s_per_mm.unwrap_or(USUAL_DAMPING_TIME * stiffness);
        if damping < DAMPING_TIME * stiffness {
            let message = format!("a spring of {stiffness} N/mm would shake with so little damping");
            let help = format!("at least {:.4}, or leave it out", DAMPING_TIME * stiffness);
            self.complain(&format!("{path}/damping_n_s_per_mm"), "unstable-spring", message, help);
        }
        let kind = match written.kind {
            file::FixtureKind::Tube => Kind::Tube,
            file::FixtureKind::Follow => {
                Kind::Follow { look_ahead: written.look_ahead_mm.unwrap_or(2.0), speed: written.speed_mm_s }
            }
        };
        Some(Fixture {
            path: Arc::new(self.measured(&written.file, &format!("{path}/file"), content::measured::path)?),
            kind,
            radius: written.radius_mm.unwrap_or(if is_tube { 0.5 } else { 0.0 }),
            stiffness,
            damping,
            max_force: written.max_force_n,
        })
    }

    fn forces(&mut self, written: &file::ForcesFile, path: &str) -> Option<Forces> {
        let rows = self.measured(&written.file, &format!("{path}/file"), content::measured::forces)?;
        let strongest = rows.iter().map(|row| row.force.length()).fold(0.0, f32::max) * written.scale;
        if strongest > content::measured::FORCE_MAX {
            let message = format!("scaled, the greatest force is {strongest:.1} N");
            let help = format!("at most {} N are played", content::measured::FORCE_MAX);
            self.complain(&format!("{path}/scale"), "out-of-range", message, help);
        }
        let space = match written.space {
            file::SpaceFile::World => Space::World,
            file::SpaceFile::Tooth => Space::Tooth,
        };
        Some(Forces { rows: rows.into(), repeat: written.repeat, scale: written.scale, space })
    }

    /// A table of measured numbers beside the scenario. A missing file is the scenario's mistake, a broken one the table's.
    fn measured<T>(
        &mut self,
        name: &str,
        path: &str,
        read: impl FnOnce(Arc<Source>) -> Result<T, Vec<Diagnostic>>,
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
