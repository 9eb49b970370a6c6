//! Effect of the selected instrument on matter: cutting, packing, or neither.
//!
//! Takes the scene, an instrument and its load. Gives the edits of the tick. Never both cuts and packs in one tick.

use crate::touch::{
    Carver, CarvingParameters, CollisionScene, FillingMaterial, Instrument, Materials, Packer, ToolLoad,
};
use crate::volume::{Edit, Label};

/// State of cutting and packing, and the choices of the session that govern them.
#[derive(Clone, Debug)]
pub(super) struct Tooling {
    pub bur_runs: bool,
    carver: Carver,
    packer: Packer,
    fillings: Vec<FillingMaterial>,
    /// Index into `fillings` of the selected filling.
    filling: Option<usize>,
}

impl Tooling {
    /// Creates the state with the bur running and no filling selected.
    pub fn new(carving: CarvingParameters, fillings: Vec<FillingMaterial>) -> Tooling {
        Tooling { bur_runs: true, carver: Carver::new(carving), packer: Packer::new(), fillings, filling: None }
    }

    /// Selects the filling with a label; an unknown label selects none.
    pub fn select_filling(&mut self, label: Option<Label>) {
        self.filling = self.fillings.iter().position(|f| Some(f.label) == label);
    }

    /// Cuts or packs with an instrument under a load, as far as the instrument can; resets without a load.
    ///
    /// Returns true while matter is being cut.
    pub fn work(
        &mut self,
        scene: &mut CollisionScene,
        instrument: &Instrument,
        materials: &Materials,
        load: Option<&ToolLoad>,
    ) -> bool {
        match (load, &instrument.packing_tip) {
            (Some(load), _) if instrument.cuts && self.bur_runs => {
                self.packer.reset();
                self.carver.cut(&mut scene.volume, instrument, materials, load)
            }
            (Some(load), Some(packing_tip)) => {
                self.carver.reset();
                match self.filling {
                    Some(filling) => self.packer.pack(scene, instrument, packing_tip, &self.fillings[filling], load),
                    None => self.packer.reset(),
                }
                false
            }
            _ => {
                self.reset();
                false
            }
        }
    }

    /// Resets cutting and packing for a tick without contact.
    pub fn reset(&mut self) {
        self.carver.reset();
        self.packer.reset();
    }

    /// Returns true if the last tick laid or condensed a filling.
    pub fn has_packed(&self) -> bool {
        !self.packer.edits().is_empty()
    }

    /// Voxels changed by the last tick, in the order of their changes.
    pub fn edits(&self) -> &[Edit] {
        if self.has_packed() { self.packer.edits() } else { self.carver.edits() }
    }
}
