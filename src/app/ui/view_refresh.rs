//! Redrawing of the view: only when something in it has changed, and, where drawing is slow, at a lower resolution
//! while it changes.

use crate::lesson_scene::DisplayMode;
use crate::snapshot::InstrumentPose;
use typodont_devices::servo::AssistantTool;
use typodont_render::{Orbit, Stereo};

/// Frame time above which the resolution falls, and below which it rises again, s.
const SLOW_FRAME: f64 = 1.0 / 24.0;
const FAST_FRAME: f64 = 1.0 / 45.0;

/// Number of slow or fast frames in a row after which the resolution changes.
const FRAMES_TO_CHANGE: u32 = 4;

/// Number of frames over which the frame rate is smoothed.
const SMOOTHED_FRAMES: f64 = 8.0;

/// Shares of the view's width and height at which a changing view is drawn.
const RESOLUTIONS: [f32; 5] = [1.0, 0.8, 0.65, 0.55, 0.45];

/// Time without a change after which the view is drawn once more, at full resolution, s.
const SETTLING_TIME: f64 = 0.2;

/// Everything that the image of a lesson's view depends on.
#[derive(Clone, PartialEq)]
pub struct ViewInputs {
    pub size: [u32; 2],
    pub orbit: Orbit,
    pub mode: DisplayMode,
    /// Instrument in use.
    pub instrument: Option<InstrumentPose>,
    pub assistant: Option<AssistantTool>,
    /// Number of voxel edits, and of changes of colours, jaws and transfer functions.
    pub edit_count: u64,
    pub appearance_count: u64,
    pub stereo: [Option<Stereo>; 2],
    pub second_size: [u32; 2],
    pub is_smooth: bool,
    pub has_shadows: bool,
    pub has_relief: bool,
    pub has_depth_of_field: bool,
    pub is_left_handed: bool,
    /// Number of moving particles.
    pub particle_count: usize,
}

/// Decision about one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Redraw {
    /// The last image is still right.
    Keep,
    /// Draw at this share of the view's width and height.
    At(f32),
}

/// The last image of a view: its inputs and its resolution.
#[derive(Default)]
pub struct ViewRefresh {
    drawn: Option<ViewInputs>,
    /// Time of the last change, s.
    changed_at: f64,
    /// Time of the last frame if the view changed in it, s.
    last_changing_frame: Option<f64>,
    /// Index of the resolution of a changing view.
    resolution: usize,
    /// True once images have been so slow that the resolution fell.
    has_been_slow: bool,
    /// True if the last image has a lower resolution than the view.
    is_coarse: bool,
    slow_frames: u32,
    fast_frames: u32,
    /// Time between two frames of a changing view, smoothed, s.
    mean_frame_time: f64,
}

impl ViewRefresh {
    /// Decides about the frame at `now`, s.
    ///
    /// `is_moving`: something moves that the inputs do not describe, such as particles. `may_be_coarse`: false where each
    /// pixel has a meaning, as in interleaved stereo.
    pub fn plan(&mut self, inputs: ViewInputs, is_moving: bool, may_be_coarse: bool, now: f64) -> Redraw {
        let is_first = self.drawn.is_none();
        let has_changed = is_moving || self.drawn.as_ref() != Some(&inputs);
        if has_changed {
            self.adapt(now);
            self.changed_at = now;
            self.last_changing_frame = Some(now);
            self.drawn = Some(inputs);
            let share = if may_be_coarse && !is_first { RESOLUTIONS[self.resolution] } else { 1.0 };
            self.is_coarse = share < 1.0;
            return Redraw::At(share);
        }
        self.last_changing_frame = None;
        if self.is_coarse && self.is_settled(now) {
            self.is_coarse = false;
            return Redraw::At(1.0);
        }
        Redraw::Keep
    }

    /// True if the view has changed a moment ago, so that the next frame should come soon.
    pub fn is_active(&self, now: f64) -> bool {
        !self.is_settled(now) || self.is_coarse
    }

    fn is_settled(&self, now: f64) -> bool {
        now - self.changed_at >= SETTLING_TIME
    }

    /// True once images have been so slow that the resolution fell: from then on only the cheapest effects are drawn,
    /// and those that the user has chosen.
    pub fn has_been_slow(&self) -> bool {
        self.has_been_slow
    }

    /// Share of the view's width and height at which a changing view is drawn.
    pub fn share_while_changing(&self) -> f32 {
        RESOLUTIONS[self.resolution]
    }

    /// Number of frames per second of a changing view, smoothed.
    pub fn frames_per_second(&self) -> f64 {
        1.0 / self.mean_frame_time.max(1e-3)
    }

    /// Draws the next frame in any case, for instance after one has failed.
    pub fn invalidate(&mut self) {
        self.drawn = None;
    }

    /// Lowers or raises the resolution by the time between two frames of a changing view, and updates the mean of that
    /// time.
    fn adapt(&mut self, now: f64) {
        let Some(last) = self.last_changing_frame else { return };
        let frame_time = now - last;
        self.mean_frame_time += (frame_time - self.mean_frame_time) / SMOOTHED_FRAMES;
        self.slow_frames = if frame_time > SLOW_FRAME { self.slow_frames + 1 } else { 0 };
        self.fast_frames = if frame_time < FAST_FRAME { self.fast_frames + 1 } else { 0 };
        if self.slow_frames >= FRAMES_TO_CHANGE {
            self.resolution = (self.resolution + 1).min(RESOLUTIONS.len() - 1);
            self.slow_frames = 0;
            self.has_been_slow = true;
        } else if self.fast_frames >= FRAMES_TO_CHANGE {
            self.resolution = self.resolution.saturating_sub(1);
            self.fast_frames = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use typodont_core::frame::{Quat, Vec3};

    fn inputs(tip: Vec3) -> ViewInputs {
        ViewInputs {
            size: [720, 716],
            orbit: Orbit::around(Vec3::ZERO, 9.0),
            mode: DisplayMode::Surface,
            instrument: Some(InstrumentPose { index: 0, tip, orientation: Quat::IDENTITY }),
            assistant: None,
            edit_count: 0,
            appearance_count: 0,
            stereo: [None, None],
            second_size: [0, 0],
            is_smooth: false,
            has_shadows: false,
            has_relief: false,
            has_depth_of_field: false,
            is_left_handed: false,
            particle_count: 0,
        }
    }

    #[test]
    fn a_view_that_stays_the_same_is_drawn_once() {
        let mut refresh = ViewRefresh::default();
        assert_eq!(refresh.plan(inputs(Vec3::ZERO), false, true, 0.0), Redraw::At(1.0));
        for frame in 1..100 {
            // The hand's tremor of a micrometre cannot be seen.
            let tip = Vec3::splat(if frame % 2 == 0 { 1e-3 } else { 0.0 });
            assert_eq!(refresh.plan(inputs(tip), false, true, 0.016 * f64::from(frame)), Redraw::Keep);
        }
        assert!(!refresh.is_active(2.0));
        assert_ne!(refresh.plan(ViewInputs { edit_count: 1, ..inputs(Vec3::ZERO) }, false, true, 2.0), Redraw::Keep);
    }

    #[test]
    fn slow_frames_are_drawn_coarser_until_the_view_is_still() {
        let mut refresh = ViewRefresh::default();
        let mut now = 0.0;
        let mut share = 1.0;
        for frame in 0..60 {
            now += 0.06;
            let Redraw::At(at) = refresh.plan(inputs(Vec3::X * frame as f32), false, true, now) else { panic!() };
            assert!(at <= share);
            share = at;
        }
        assert_eq!(share, RESOLUTIONS[RESOLUTIONS.len() - 1]);
        assert_eq!(refresh.plan(inputs(Vec3::X * 59.0), false, true, now + 0.05), Redraw::Keep);
        assert!(refresh.is_active(now + 0.05), "the view is to be sharpened");
        assert_eq!(refresh.plan(inputs(Vec3::X * 59.0), false, true, now + 0.3), Redraw::At(1.0));
        assert!(!refresh.is_active(now + 0.3));
    }
}
