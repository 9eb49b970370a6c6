//! What a second hand holds that assists instead of leading: a suction tip, which also carries off the irrigation.
//!
//! Takes where the second hand is and the matter as the first hand's bur has left it. Gives how far the tip may go there.
//! It touches, never cuts, and nothing of the first hand's session depends on it.

use crate::frame::{Pose, Vec3};
use crate::touch::{Instrument, Materials, Matter, Proxy, WorkingEnd};

/// Radius of a saliva ejector's rounded end, mm: tubes are 6 mm wide outside, their ends 5 to 8.
const TIP_RADIUS: f32 = 3.0;

/// A suction tip in the second hand.
#[derive(Clone, Debug)]
pub(super) struct Attendant {
    instrument: Instrument,
    proxy: Proxy,
    /// It has been out of matter since it was lost.
    is_out: bool,
}

impl Attendant {
    /// `matter` is what it will meet. This allocates; what follows does not.
    pub fn new(matter: &Matter) -> Attendant {
        let instrument = Instrument::new(WorkingEnd::Ball { radius: TIP_RADIUS }, false);
        let proxy = Proxy::new(matter, std::slice::from_ref(&instrument), Vec3::ZERO);
        Attendant { instrument, proxy, is_out: false }
    }

    /// Where the tip is while the hand is at a place; both in world space, mm.
    ///
    /// A hand that comes in inside matter is reached exactly, and so not pushed, until it has been out.
    pub fn follow(&mut self, matter: &Matter, materials: &Materials, world_from_tooth: &Pose, hand: Vec3) -> Vec3 {
        let held = world_from_tooth.inverse() * Pose { position: hand, ..Pose::IDENTITY };
        if !self.is_out {
            self.is_out = Proxy::is_free_at(matter, &self.instrument, &held);
            self.proxy.let_go(held.position);
            return hand;
        }
        self.proxy.follow(matter, &self.instrument, materials, &held);
        *world_from_tooth * self.proxy.tip()
    }

    /// Its hand was lost.
    pub fn forget(&mut self) {
        self.is_out = false;
    }
}
