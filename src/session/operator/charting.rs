//! A probe and an explorer round the tooth, down into the sulcus.

use super::file::{ChartActionFile, ExploreFile};
use super::sounding::{self, Sounding};
use super::{Operator, TOUCH_SPEED, Task};
use crate::content::Role;
use crate::device::Move;
use crate::frame::Vec3;
use crate::scenario::Site;
use crate::session::{Input, Sign};
use crate::volume::Label;

impl Operator {
    /// A probe into the sulcus at each site, read where it is held up.
    pub(super) fn chart(&mut self, chart: &ChartActionFile) {
        /// The middle of a probe's end runs so far off a root without calculus, mm: free between root and gum.
        const OFF: f32 = 0.42;
        for site in sounding::sites(chart.sites.as_deref()) {
            let Some(way) = self.sounding(site, OFF) else { continue };
            let path: Vec<Vec3> = way.down.iter().map(|p| self.in_world(*p)).collect();
            self.come_to(&way);
            let (force, hold, speed) = (chart.press_n, chart.hold_s, chart.speed_mm_s);
            self.plan.push_back(Task::Move(Move::Slide { path, force, hold, speed }));
            self.plan.push_back(Task::Input(Input::Chart(Sign::Depth)));
            self.leave(&way, speed);
        }
        self.lift_off();
    }

    /// An explorer down each root, leaning on it.
    pub(super) fn explore(&mut self, explore: &ExploreFile) {
        for site in sounding::sites(explore.sites.as_deref()) {
            let Some(way) = self.sounding(site, -explore.lean_mm) else { continue };
            let path: Vec<Vec3> = way.down.iter().map(|p| self.in_world(*p)).collect();
            self.come_to(&way);
            self.plan.push_back(Task::Trail);
            let (force, speed) = (explore.press_n, explore.speed_mm_s);
            self.plan.push_back(Task::Move(Move::Slide { path, force, hold: 0.05, speed }));
            self.plan.push_back(Task::Notice(explore.notices_mm));
            self.leave(&way, speed);
        }
        self.lift_off();
    }

    fn sounding(&self, site: Site, off: f32) -> Option<Sounding> {
        let gum = self.workpiece.periodontium.as_ref()?;
        let deposits: Vec<Label> =
            self.scenario.tissues.entries().iter().filter(|e| e.role == Role::Deposit).map(|e| e.label()).collect();
        let lowest = self.workpiece.teeth.first()?.low.z;
        Sounding::at(site, gum, &self.workpiece.volume, &deposits, lowest, off)
    }

    /// From above, past the crown's bulge, to the gum's margin.
    fn come_to(&mut self, way: &Sounding) {
        let speed = TOUCH_SPEED.min(self.file.hand.speed_mm_s);
        self.travel_to(way.beside.with_z(self.top() + 1.0));
        for to in [way.beside, way.entry] {
            let to = self.in_world(to);
            self.plan.push_back(Task::Move(Move::Reach { to, speed }));
        }
    }

    /// Up again the way it came.
    fn leave(&mut self, way: &Sounding, speed: f32) {
        self.plan.push_back(Task::Withdraw { up: way.up.iter().map(|p| self.in_world(*p)).collect(), speed });
        for to in [way.entry, way.beside, way.beside.with_z(self.top() + 1.0)] {
            let (to, speed) = (self.in_world(to), self.file.hand.speed_mm_s.min(20.0));
            self.plan.push_back(Task::Move(Move::Reach { to, speed }));
        }
    }

    /// Remembers where the tip is on its way down a root.
    pub(super) fn follow_trail(&mut self, tip: Vec3) {
        let (Some(trail), Some(gum)) = (&mut self.trail, &self.workpiece.periodontium) else { return };
        let place = self.workpiece.world_from_tooth.inverse() * tip;
        let from_middle = (place - gum.middle()).with_z(0.0);
        trail.push([place.z, from_middle.length()]);
    }
}
