//! Periodontal probing and exploring around the tooth, down into the sulcus.

use crate::catalog::TissueRole;
use crate::scenario::ProbingSite;
use crate::session::operator::file::{ChartActionFile, ExploreFile};
use crate::session::operator::sulcus_path;
use crate::session::operator::sulcus_path::SulcusPath;
use crate::session::operator::{Operator, OperatorTask, TOUCH_SPEED};
use crate::session::{ChartInput, Input};
use typodont_core::device::Move;
use typodont_core::frame::Vec3;
use typodont_core::volume::Label;

impl Operator {
    /// Plans probing of the sulcus at each site, with a reading where the probe meets resistance.
    pub(super) fn chart(&mut self, chart: &ChartActionFile) {
        /// Distance of the centre of the probe's end from a root without calculus, mm: free between root and gingiva.
        const OFF: f32 = 0.42;
        for site in sulcus_path::sites(chart.sites.as_deref()) {
            let Some(sulcus) = self.sulcus_path(site, OFF) else { continue };
            let path: Vec<Vec3> = sulcus.down.iter().map(|p| self.in_world(*p)).collect();
            self.approach_margin(&sulcus);
            let (force, hold, speed) = (chart.press_n, chart.hold_s, chart.speed_mm_s);
            self.plan.push_back(OperatorTask::Move(Move::Slide { path, force, hold, speed }));
            self.plan.push_back(OperatorTask::Input(Input::Chart(ChartInput::Depth)));
            self.withdraw(&sulcus, speed);
        }
        self.lift_off();
    }

    /// Plans the exploring of each site, leaning on the root.
    pub(super) fn explore(&mut self, explore: &ExploreFile) {
        for site in sulcus_path::sites(explore.sites.as_deref()) {
            let Some(sulcus) = self.sulcus_path(site, -explore.lean_mm) else { continue };
            let path: Vec<Vec3> = sulcus.down.iter().map(|p| self.in_world(*p)).collect();
            self.approach_margin(&sulcus);
            self.plan.push_back(OperatorTask::StartTrail);
            let (force, speed) = (explore.press_n, explore.speed_mm_s);
            self.plan.push_back(OperatorTask::Move(Move::Slide { path, force, hold: 0.05, speed }));
            self.plan.push_back(OperatorTask::MarkCalculus(explore.notices_mm));
            self.withdraw(&sulcus, speed);
        }
        self.lift_off();
    }

    fn sulcus_path(&self, site: ProbingSite, off: f32) -> Option<SulcusPath> {
        let gum = self.workpiece.periodontium.as_ref()?;
        let deposits: Vec<Label> = self
            .scenario
            .tissues
            .entries()
            .iter()
            .filter(|e| e.role == TissueRole::Deposit)
            .map(|e| e.label())
            .collect();
        let lowest = self.workpiece.teeth.first()?.whole.low.z;
        SulcusPath::at(site, gum, &self.workpiece.volume, &deposits, lowest, off)
    }

    /// Plans moves from above, past the height of contour of the crown, to the gingival margin.
    fn approach_margin(&mut self, sulcus: &SulcusPath) {
        let speed = TOUCH_SPEED.min(self.file.hand.speed_mm_s);
        self.travel_to(sulcus.beside.with_z(self.top() + 1.0));
        for to in [sulcus.beside, sulcus.entry] {
            let to = self.in_world(to);
            self.plan.push_back(OperatorTask::Move(Move::Reach { to, speed }));
        }
    }

    /// Plans moves out of the sulcus along the same path and up.
    fn withdraw(&mut self, sulcus: &SulcusPath, speed: f32) {
        self.plan
            .push_back(OperatorTask::Withdraw { up: sulcus.up.iter().map(|p| self.in_world(*p)).collect(), speed });
        for to in [sulcus.entry, sulcus.beside, sulcus.beside.with_z(self.top() + 1.0)] {
            let (to, speed) = (self.in_world(to), self.file.hand.speed_mm_s.min(20.0));
            self.plan.push_back(OperatorTask::Move(Move::Reach { to, speed }));
        }
    }

    /// Records the tip's position (world space, mm) while it moves down a root.
    pub(super) fn follow_trail(&mut self, tip: Vec3) {
        let (Some(trail), Some(gum)) = (&mut self.trail, &self.workpiece.periodontium) else { return };
        let place = self.workpiece.world_from_tooth.inverse() * tip;
        let from_middle = (place - gum.middle()).with_z(0.0);
        trail.push([place.z, from_middle.length()]);
    }
}
