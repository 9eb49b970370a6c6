//! The user's settings, kept where the platform keeps them: in a file, or in the page's own storage.

use crate::hand_registration::HandRegistration;
use crate::i18n::{self, Translations};
use crate::platform;
use crate::user_folder::UserFolder;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use typodont_core::sim::HandFrame;
use typodont_render::{Stereo, StereoLayout};

/// Default distance between the eyes for a mouth on a screen, mm: a tenth of the natural distance, because the scene is
/// enlarged by that much.
const EYE_DISTANCE: f32 = 6.0;

/// Default volume, share of full scale: low enough for a teacher to be heard.
const VOLUME: f32 = 0.6;

/// Text sizes that fit the window, as multiples of the default size.
pub const FONT_SIZES: std::ops::RangeInclusive<f32> = 0.8..=1.6;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Code of the language file.
    pub language: String,
    /// Input device: `mouse`, or a device as in `--device`.
    pub device: String,
    /// True if the hand of an arm follows the view.
    pub hand_follows_view: bool,
    /// Distance at the tooth per distance of an arm's hand.
    pub hand_scale: f32,
    /// True if the handpiece of a mouse leads to the left.
    pub left_handed: bool,
    /// Place of the picture in the space of the arm, if the hand is seen through a half-mirror.
    pub hand_registration: Option<HandRegistration>,
    pub mirrored: MirroredWindow,
    pub stereo: StereoMode,
    pub eye_distance_mm: f32,
    /// True to smooth edges; without a value edges are smoothed if a graphics processor draws.
    pub smooth_edges: Option<bool>,
    /// True if the lamp casts shadows; without a value, if a graphics processor draws and is quick enough.
    pub shadows: Option<bool>,
    /// True to blur what is nearer or farther than the middle of the view.
    pub depth_of_field: bool,
    /// Share of full scale, 0 to 1.
    pub volume: f32,
    pub high_contrast: bool,
    pub font_size: f32,
    /// True if the first shipped exercise must be passed before the others open. It is set in the file only.
    pub introduction_first: bool,
    /// A further folder with exercises; empty for none.
    pub exercises: PathBuf,
}

/// Stereoscopic display of the tooth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StereoMode {
    #[default]
    Off,
    SideBySide,
    TopBottom,
    Rows,
    Anaglyph,
    /// The left eye in this window, the right one in a window of its own, for two projectors.
    TwoWindows,
    /// The eyes by turns, frame after frame, for shutter glasses.
    FrameSequential,
}

/// Flip of the window for those who see it in a mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MirroredWindow {
    #[default]
    No,
    LeftRight,
    TopBottom,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            language: crate::i18n::system_language(),
            device: "mouse".into(),
            hand_follows_view: true,
            hand_scale: 1.0,
            left_handed: false,
            hand_registration: None,
            mirrored: MirroredWindow::No,
            stereo: StereoMode::Off,
            eye_distance_mm: EYE_DISTANCE,
            smooth_edges: None,
            shadows: None,
            depth_of_field: false,
            volume: VOLUME,
            high_contrast: false,
            font_size: 1.0,
            introduction_first: true,
            exercises: PathBuf::new(),
        }
    }
}

/// Reads the settings, and the languages that the program and the user's folder have, with complaints about both.
pub fn load_with_languages(folder: &UserFolder) -> (Settings, Vec<Translations>, Vec<String>) {
    let (settings, complaint) = Settings::load(folder);
    let (languages, mut complaints) = i18n::load_all(folder.languages().as_deref());
    complaints.extend(complaint);
    (settings, languages, complaints)
}

impl Settings {
    /// Reads the kept settings; the defaults, with a complaint, if it cannot be read.
    pub fn load(folder: &UserFolder) -> (Settings, Option<String>) {
        let Some(text) = platform::read_settings(folder) else { return (Settings::default(), None) };
        match serde_json::from_str::<Settings>(&text) {
            Ok(settings) => (settings.in_range(), None),
            Err(error) => {
                let place = platform::settings_place(folder);
                let what = format!("{place}: wrong-settings: {error}; the default settings are used");
                (Settings::default(), Some(what))
            }
        }
    }

    /// Keeps the settings; returns a complaint if that fails.
    pub fn save(&self, folder: &UserFolder) -> Option<String> {
        let text = serde_json::to_string_pretty(self).ok()?;
        platform::write_settings(folder, &(text + "\n")).map(|why| {
            let place = platform::settings_place(folder);
            format!("{place}: unwritable-file: {why}; the settings will be lost when the window is closed")
        })
    }

    /// Limits values, which may have been edited in the file, to their valid ranges.
    fn in_range(mut self) -> Settings {
        let [least, most] = HandFrame::SCALES;
        self.hand_scale = self.hand_scale.clamp(least, most);
        self.eye_distance_mm = self.eye_distance_mm.clamp(0.0, 80.0);
        self.hand_registration = self.hand_registration.filter(HandRegistration::is_valid);
        self.volume = self.volume.clamp(0.0, 1.0);
        self.font_size = self.font_size.clamp(*FONT_SIZES.start(), *FONT_SIZES.end());
        self
    }

    pub fn stereo(&self) -> Option<Stereo> {
        let layout = match self.stereo {
            StereoMode::Off => return None,
            StereoMode::SideBySide => StereoLayout::SideBySide,
            StereoMode::TopBottom => StereoLayout::TopBottom,
            StereoMode::Rows => StereoLayout::Rows,
            StereoMode::Anaglyph => StereoLayout::Anaglyph,
            StereoMode::TwoWindows | StereoMode::FrameSequential => StereoLayout::Left,
        };
        // Where the mirror exchanges the eyes' parts of the picture, they are exchanged before.
        let exchanges = matches!(
            (self.mirrored, layout),
            (MirroredWindow::LeftRight, StereoLayout::SideBySide)
                | (MirroredWindow::TopBottom, StereoLayout::TopBottom | StereoLayout::Rows)
        );
        let eye_distance = if exchanges { -self.eye_distance_mm } else { self.eye_distance_mm };
        Some(Stereo { layout, eye_distance })
    }

    /// True if edges are smoothed. Without a choice of the user they are smoothed only if a graphics processor draws;
    /// in software, smoothing takes too large a part of each frame.
    pub fn is_smooth(&self, has_graphics: bool) -> bool {
        self.smooth_edges.unwrap_or(has_graphics)
    }

    /// True if the lamp casts shadows. `is_quick`: a graphics processor draws, and has not been too slow.
    pub fn has_shadows(&self, is_quick: bool) -> bool {
        self.shadows.unwrap_or(is_quick)
    }

    /// Stereo view of the right eye, if it has a picture of its own.
    pub fn second_eye(&self) -> Option<Stereo> {
        let has_two = self.has_second_window() || self.is_frame_sequential();
        has_two.then_some(Stereo { layout: StereoLayout::Right, eye_distance: self.eye_distance_mm })
    }

    /// True if the right eye's picture has a window of its own.
    pub fn has_second_window(&self) -> bool {
        self.stereo == StereoMode::TwoWindows
    }

    /// True if the eyes are shown by turns.
    pub fn is_frame_sequential(&self) -> bool {
        self.stereo == StereoMode::FrameSequential
    }
}
