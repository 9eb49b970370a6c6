//! What screens ask for, as sentences, and which screens there are.

use super::author::{Ask, Authoring};
use super::results::Results;
use super::settings::Settings;
use super::sitting::{Sitting, Way};
use super::transfer::Curves;
use super::views::View;
use crate::session::{Answer, Sign};
use crate::touch::Coefficient;
use crate::volume::Label;
use eframe::egui;
use std::path::PathBuf;

/// What a screen asks for.
#[derive(Clone, Debug)]
pub enum Command {
    /// An exercise of the shelf, by place.
    Choose(usize),
    /// The one so many places further down.
    ChooseNext(i32),
    /// The chosen one's instructions.
    Open,
    LookInto(PathBuf),
    ToShelf,
    /// The lesson.
    Begin,
    /// A new one, to be written.
    NewExercise,
    /// The chosen one, to be changed.
    EditExercise,
    /// At the author's screen.
    Author(Ask),
    Take(usize),
    Answer(String, Answer),
    /// Into the periodontal chart, where the instrument is.
    Chart(Sign),
    Confirm,
    Pause(bool),
    /// Asks whether to give up, or takes that back.
    GiveUp(bool),
    Abort,
    /// Another value for one of a tissue's coefficients.
    Adjust(Label, Coefficient, f32),
    Show(Way),
    /// A transfer function of one's own.
    Draw(Box<Curves>),
    /// The pointer becomes the hand, or is freed.
    HoldPointer(bool),
    /// Brings the pointer back to a place of the window, in points.
    CentrePointer(egui::Pos2),
    /// In pixels of the mouse.
    MoveHand {
        right: f32,
        down: f32,
    },
    /// In steps of the wheel.
    MoveDeeper(f32),
    PressHandle {
        bit: u32,
        is_down: bool,
    },
    /// The mouth opens by so many degrees.
    OpenMouth(f32),
    Look(View),
    /// The camera; rad.
    Turn {
        right: f32,
        up: f32,
    },
    /// By a factor of the distance.
    Nearer(f32),
    /// In shares of the picture's height.
    Shift {
        right: f32,
        up: f32,
    },
    Rate(String, u8),
    NextStatement(i32),
    /// Asks first while statements are open.
    HandIn,
    ShowReport,
    ShowKeys(bool),
    ShowSettings(bool),
    Set(Box<Settings>),
    /// The window is to be closed; asks first where something would be lost, or takes that back.
    Close(bool),
}

/// What is on the screen.
pub enum Screen {
    Shelf,
    Briefing,
    Author(Box<Authoring>),
    Lesson(Box<Sitting>),
    Results(Box<Results>),
    /// Why there is no lesson or no bundle.
    Failed(String),
}
