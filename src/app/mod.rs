//! The desktop program: the window at which a trainee sits.
//!
//! Takes the pointer, the keys and what is chosen. Gives lessons on a thread of their own, and pictures of how they go.
//! Never scores, never carves: every number that counts comes from below, and no session waits for the picture.

mod author;
mod briefing;
mod chair;
mod command;
mod desk;
mod diary;
mod keys;
mod language;
mod look;
mod menu;
mod pointer;
mod practice;
mod questionnaire;
mod questions;
mod chart;
mod results;
mod seen;
mod settings;
mod shelf;
mod sitting;
mod sound;
mod told;
mod transfer;
mod viewport;
mod views;

pub use author::Watch;

use crate::lesson::{Scan, second};
use crate::report::Templates;
use crate::sim::Role;
use desk::Desk;
use eframe::egui;
use std::path::PathBuf;
use std::time::Duration;

/// What the window opens with.
pub struct Options {
    /// The exercise to begin with; without one the shelf.
    pub exercise: Option<PathBuf>,
    /// A scan to work on instead of that exercise's own teeth.
    pub tooth: Option<Scan>,
    /// Another hand that may join every lesson, and as what.
    pub second: Option<(second::From, Role)>,
    /// Begins that exercise at once, without its instructions.
    pub begins: bool,
    /// Opens that exercise at the author's screen instead, to be edited or only to be looked at while an editor changes it.
    pub author: Option<Watch>,
    /// What is in the hand, as `--device` takes it; without it as the settings say.
    pub device: Option<String>,
    /// Decides what exercises leave to chance; without one the clock does.
    pub seed: Option<u64>,
    /// A code for the trainee; never a name.
    pub participant: String,
    /// Folder in which bundles are made.
    pub out: PathBuf,
    pub templates: Templates,
    /// Draws a picture only this often: for a test that the session does not wait for it.
    pub slow_picture: Option<Duration>,
}

impl Options {
    /// The shelf, for whoever sits down.
    pub fn at_shelf(out: impl Into<PathBuf>, templates: Templates) -> Options {
        let (exercise, seed, slow_picture) = (None, None, None);
        Options {
            exercise,
            tooth: None,
            second: None,
            begins: false,
            author: None,
            device: None,
            seed,
            participant: String::new(),
            out: out.into(),
            templates,
            slow_picture,
        }
    }
}

/// Width and height of a new window, points: fits a small laptop's screen.
const SIZE: [f32; 2] = [1280.0, 780.0];

/// Below this something would be cut off.
const SIZE_LEAST: [f32; 2] = [960.0, 640.0];

/// Opens the window; returns when it is closed. `Err` says why there is none, and what to do.
pub fn open(options: Options) -> Result<(), String> {
    let viewport = egui::ViewportBuilder::default()
        .with_title("Typodont")
        .with_app_id("typodont")
        .with_inner_size(SIZE)
        .with_min_inner_size(SIZE_LEAST);
    // Where a processor draws, dithering is much of what a page costs, and pages are of few flat colours.
    let native = eframe::NativeOptions { viewport, dithering: false, ..Default::default() };
    let made = Box::new(|context: &eframe::CreationContext| -> Result<Box<dyn eframe::App>, _> {
        Ok(Box::new(Desk::new(context, options)))
    });
    eframe::run_native("typodont", native, made).map_err(|error| {
        let said = error.to_string();
        // winit begins with a line of its own source, which tells a person nothing.
        let after_place = said.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
        let why = after_place.map_or(said.as_str(), |(_, why)| why).trim_end_matches('.');
        format!(
            "no-window: {why}; a window needs a display and a graphics driver (Debian: mesa-vulkan-drivers). Without \
             one, `typodont run SCENARIO --headless` works at the terminal"
        )
    })
}
