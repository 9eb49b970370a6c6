//! Working end of a second hand that assists instead of leading: of a suction tube, or of the syringe that irrigates.
//!
//! Takes the position of the second hand and the tissue as the first hand's bur has left it. Gives the allowed
//! position of the tip. Touches, never cuts; nothing in the first hand's session depends on it.

use typodont_core::frame::{Pose, Vec3};
use typodont_core::touch::{CollisionScene, Instrument, Materials, Proxy, WorkingEnd};

/// Radius of the rounded end of a saliva ejector, mm: tubes have an outer width of 6 mm, their ends 5 to 8.
pub(super) const SUCTION_RADIUS: f32 = 3.0;

/// Radius of the nozzle of a three-way syringe, mm.
pub(super) const NOZZLE_RADIUS: f32 = 1.5;

/// A tool in the second hand.
#[derive(Clone, Debug)]
pub(super) struct AssistantTip {
    instrument: Instrument,
    proxy: Proxy,
    /// The tip has been outside tissue since the hand was last lost.
    is_engaged: bool,
}

impl AssistantTip {
    /// Creates a tip with a rounded end, radius in mm, for the given scene. Allocates; all later calls do not.
    pub fn new(matter: &CollisionScene, radius: f32) -> AssistantTip {
        let instrument = Instrument::new(WorkingEnd::Ball { radius }, false);
        let proxy = Proxy::new(matter, std::slice::from_ref(&instrument), Vec3::ZERO);
        AssistantTip { instrument, proxy, is_engaged: false }
    }

    /// Returns the position of the tip while the hand is at `hand`; both in world space, mm.
    ///
    /// If the hand starts inside tissue, the tip follows it exactly, without force, until it has been outside.
    pub fn follow(
        &mut self,
        matter: &CollisionScene,
        materials: &Materials,
        world_from_tooth: &Pose,
        hand: Vec3,
    ) -> Vec3 {
        let hand_in_tooth = world_from_tooth.inverse() * Pose { position: hand, ..Pose::IDENTITY };
        if !self.is_engaged {
            self.is_engaged = Proxy::is_free_at(matter, &self.instrument, &hand_in_tooth);
            self.proxy.reset_to(hand_in_tooth.position);
            return hand;
        }
        self.proxy.follow(matter, &self.instrument, materials, &hand_in_tooth);
        *world_from_tooth * self.proxy.tip()
    }

    /// Releases the tip after its hand was lost.
    pub fn reset(&mut self) {
        self.is_engaged = false;
    }
}
