//! How the author looks at the tooth: from where, in which way, and where it is cut.

use super::making::Made;
use crate::content::Role;
use crate::frame::Vec3;
use crate::render::{Orbit, Palette, Shown, Solid, TransferFunction};
use crate::scene;
use crate::volume::Label;
use eframe::egui;
use std::sync::Arc;

/// The way in which the tooth is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    #[default]
    Surface,
    /// Tissues like coloured glass.
    Glass,
    /// Decay alone.
    Decay,
}

impl Way {
    pub const ALL: [(Way, &str); 3] =
        [(Way::Surface, "author.surface"), (Way::Glass, "menu.clear"), (Way::Decay, "menu.decay")];
}

/// What a picture was drawn of: the same again needs no drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    pub orbit: Orbit,
    pub way: Way,
    pub has_around: bool,
    pub size: [u32; 2],
    pub generation: u64,
}

/// A cut as it was last drawn: of what, where along its axis, how large.
pub struct Cut {
    pub generation: u64,
    pub through: f32,
    pub size: [u32; 2],
    pub texture: egui::TextureHandle,
}

pub struct View {
    pub orbit: Orbit,
    pub way: Way,
    pub has_around: bool,
    /// Where the three cuts meet, tooth space, mm.
    pub cut: Vec3,
    /// Counts what was made.
    pub generation: u64,
    /// The adapter has not seen this matter yet.
    pub is_new: bool,
    pub drawn: Option<(Drawn, egui::TextureId)>,
    pub cuts: [Option<Cut>; 3],
    pub palette: Palette,
    pub around: Vec<Solid>,
    glass: Arc<TransferFunction>,
    decay: Arc<TransferFunction>,
    /// The teeth by their numbers: another one is looked at anew.
    teeth: Vec<u8>,
}

impl Default for View {
    fn default() -> View {
        let palette = Palette::of(|_| [0.85, 0.82, 0.75], 0.15);
        View {
            orbit: Orbit::around(Vec3::ZERO, 9.0),
            way: Way::Surface,
            has_around: false,
            cut: Vec3::ZERO,
            generation: 0,
            is_new: true,
            drawn: None,
            cuts: [None, None, None],
            glass: Arc::new(TransferFunction::tissue(&palette)),
            decay: Arc::new(TransferFunction::only(&[], &palette)),
            palette,
            around: Vec::new(),
            teeth: Vec::new(),
        }
    }
}

impl View {
    /// Looks at what was newly made; from the usual place where it is another tooth.
    pub fn take(&mut self, made: &Made) {
        let tissues = &made.scenario.tissues;
        self.palette = scene::palette(tissues, true);
        let decay: Vec<Label> = tissues.entries().iter().filter(|e| e.role == Role::Decay).map(|e| e.label()).collect();
        self.glass = Arc::new(TransferFunction::tissue(&self.palette));
        self.decay = Arc::new(TransferFunction::only(&decay, &self.palette));
        self.around = scene::around(&made.workpiece, tissues);
        let teeth: Vec<u8> = made.workpiece.teeth.iter().map(|tooth| tooth.fdi).collect();
        if teeth != self.teeth {
            self.orbit = scene::work_view(&made.workpiece).zoomed(0.8);
            let middle = made.workpiece.teeth.first().map(|tooth| 0.5 * (tooth.crown_low + tooth.crown_high));
            self.cut = made.workpiece.lesions.first().map(|lesion| lesion.centre).or(middle).unwrap_or_default();
            self.teeth = teeth;
        }
        self.generation += 1;
        self.forget_picture();
    }

    /// The adapter may have drawn something else since.
    pub fn forget_picture(&mut self) {
        self.is_new = true;
        self.drawn = None;
    }

    pub fn shown(&self) -> Shown {
        match self.way {
            Way::Surface => Shown::Surface,
            Way::Glass => Shown::Volume(self.glass.clone()),
            Way::Decay => Shown::Volume(self.decay.clone()),
        }
    }
}
