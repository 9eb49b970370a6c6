//! Haptic and cutting properties of each tissue.

use crate::volume::Label;

/// Properties of a tissue: the four coefficients of the thesis (Table 2.4), its cutting threshold (5.3), and its
/// hardness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Spring stiffness as a fraction (0–1) of the greatest that the device can render.
    pub stiffness: f32,
    /// Damping as a fraction (0–1) of the greatest that the device can render.
    pub damping: f32,
    /// Static Coulomb coefficient, exceeded when sliding starts, 0–2.
    pub static_friction: f32,
    /// Dynamic Coulomb coefficient, while sliding, 0–2.
    pub dynamic_friction: f32,
    /// Spring force from which a rotating bur cuts this tissue, N; `None` if it cannot be cut.
    pub cut_force: Option<f32>,
    /// Vickers hardness, HV, by which the rate law divides; `None` if the tissue does not wear.
    pub hardness: Option<f32>,
}

impl Material {
    /// Material without any resistance.
    pub const ZERO: Material = Material {
        stiffness: 0.0,
        damping: 0.0,
        static_friction: 0.0,
        dynamic_friction: 0.0,
        cut_force: None,
        hardness: None,
    };

    /// Returns a coefficient; `None` only for the cutting force of a tissue that cannot be cut.
    pub fn coefficient(&self, which: Coefficient) -> Option<f32> {
        match which {
            Coefficient::Stiffness => Some(self.stiffness),
            Coefficient::Damping => Some(self.damping),
            Coefficient::StaticFriction => Some(self.static_friction),
            Coefficient::DynamicFriction => Some(self.dynamic_friction),
            Coefficient::CutForce => self.cut_force,
        }
    }

    /// Returns the material with one coefficient replaced, clamped to its range.
    pub fn with(mut self, which: Coefficient, value: f32) -> Material {
        let (least, most) = which.range();
        let value = value.clamp(least, most);
        match which {
            Coefficient::Stiffness => self.stiffness = value,
            Coefficient::Damping => self.damping = value,
            Coefficient::StaticFriction => self.static_friction = value,
            Coefficient::DynamicFriction => self.dynamic_friction = value,
            Coefficient::CutForce => self.cut_force = Some(value),
        }
        self
    }

    /// Returns the material as felt with another tool or in another patient, clamped to the ranges of the
    /// coefficients.
    fn scaled_by(self, scale: &MaterialScale) -> Material {
        Material {
            stiffness: (self.stiffness * scale.stiffness).clamp(0.0, 1.0),
            damping: (self.damping * scale.damping).clamp(0.0, 1.0),
            static_friction: (self.static_friction * scale.static_friction).clamp(0.0, FRICTION_MAX),
            dynamic_friction: (self.dynamic_friction * scale.dynamic_friction).clamp(0.0, FRICTION_MAX),
            cut_force: self.cut_force.map(|force| force * scale.cut_force).filter(|force| force.is_finite()),
            hardness: self.hardness.map(|hv| hv * scale.hardness),
        }
    }

    fn weighted(self, weight: f32) -> Material {
        Material {
            stiffness: self.stiffness * weight,
            damping: self.damping * weight,
            static_friction: self.static_friction * weight,
            dynamic_friction: self.dynamic_friction * weight,
            cut_force: None,
            hardness: None,
        }
    }

    fn plus(self, other: Material) -> Material {
        Material {
            stiffness: self.stiffness + other.stiffness,
            damping: self.damping + other.damping,
            static_friction: self.static_friction + other.static_friction,
            dynamic_friction: self.dynamic_friction + other.dynamic_friction,
            cut_force: None,
            hardness: None,
        }
    }
}

/// Greatest coefficient of friction: beyond it nothing slides.
const FRICTION_MAX: f32 = 2.0;

/// Coefficient of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coefficient {
    Stiffness,
    Damping,
    StaticFriction,
    DynamicFriction,
    /// Cutting threshold, N.
    CutForce,
}

impl Coefficient {
    pub const ALL: [Coefficient; 5] = [
        Coefficient::Stiffness,
        Coefficient::Damping,
        Coefficient::StaticFriction,
        Coefficient::DynamicFriction,
        Coefficient::CutForce,
    ];

    /// Least and greatest value, in the unit of the coefficient.
    pub fn range(self) -> (f32, f32) {
        match self {
            Coefficient::Stiffness | Coefficient::Damping => (0.0, 1.0),
            Coefficient::StaticFriction | Coefficient::DynamicFriction => (0.0, FRICTION_MAX),
            Coefficient::CutForce => (0.01, 50.0),
        }
    }
}

/// Factors by which a tool or a patient changes the coefficients of a tissue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialScale {
    pub stiffness: f32,
    pub damping: f32,
    pub static_friction: f32,
    pub dynamic_friction: f32,
    pub hardness: f32,
    /// Infinite if the tool cannot cut the tissue.
    pub cut_force: f32,
}

impl MaterialScale {
    /// Identity: leaves a material unchanged, to the last bit.
    pub const ONE: MaterialScale = MaterialScale {
        stiffness: 1.0,
        damping: 1.0,
        static_friction: 1.0,
        dynamic_friction: 1.0,
        hardness: 1.0,
        cut_force: 1.0,
    };

    /// Returns the factor of a coefficient.
    pub fn coefficient(&self, which: Coefficient) -> f32 {
        match which {
            Coefficient::Stiffness => self.stiffness,
            Coefficient::Damping => self.damping,
            Coefficient::StaticFriction => self.static_friction,
            Coefficient::DynamicFriction => self.dynamic_friction,
            Coefficient::CutForce => self.cut_force,
        }
    }

    /// Returns the product of both scales.
    pub fn combined_with(self, other: MaterialScale) -> MaterialScale {
        MaterialScale {
            stiffness: self.stiffness * other.stiffness,
            damping: self.damping * other.damping,
            static_friction: self.static_friction * other.static_friction,
            dynamic_friction: self.dynamic_friction * other.dynamic_friction,
            hardness: self.hardness * other.hardness,
            cut_force: self.cut_force * other.cut_force,
        }
    }
}

/// Scales of the tissues for one instrument; [`MaterialScale::ONE`] for tissues without an entry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MaterialScales(Vec<(Label, MaterialScale)>);

impl MaterialScales {
    pub fn get(&self, label: Label) -> MaterialScale {
        self.0.iter().find(|(l, _)| *l == label).map_or(MaterialScale::ONE, |(_, factor)| *factor)
    }

    /// Multiplies the scale of a tissue by another.
    pub fn with(mut self, label: Label, scale: MaterialScale) -> MaterialScales {
        match self.0.iter_mut().find(|(l, _)| *l == label) {
            Some((_, known)) => *known = known.combined_with(scale),
            None => self.0.push((label, scale)),
        }
        self
    }
}

/// Running weighted mean of materials. Cutting threshold and hardness are not averaged: each voxel keeps its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaterialMean {
    sum: Material,
    weight: f32,
}

impl MaterialMean {
    pub fn empty() -> MaterialMean {
        MaterialMean { sum: Material::ZERO, weight: 0.0 }
    }

    pub fn add(&mut self, material: Material, weight: f32) {
        self.sum = self.sum.plus(material.weighted(weight));
        self.weight += weight;
    }

    /// Returns the mean; `None` if nothing was added.
    pub fn mean(&self) -> Option<Material> {
        (self.weight > 1e-6).then(|| self.sum.weighted(1.0 / self.weight))
    }
}

/// Table of the materials of all labels.
#[derive(Clone, Debug, PartialEq)]
pub struct Materials {
    of_label: [Material; 256],
    /// Labels that have a material, in ascending order.
    labelled: Vec<Label>,
}

impl Materials {
    /// Creates a table in which no label has any resistance.
    pub fn new() -> Materials {
        Materials { of_label: [Material::ZERO; 256], labelled: Vec::new() }
    }

    #[inline]
    pub fn get(&self, label: Label) -> &Material {
        &self.of_label[usize::from(label.0)]
    }

    /// Labels that have a material, with their materials.
    pub fn labelled(&self) -> impl Iterator<Item = (Label, &Material)> {
        self.labelled.iter().map(|&label| (label, self.get(label)))
    }

    /// Sets the material of a label. Allocates only for a label that had none.
    pub fn set(&mut self, label: Label, material: Material) {
        self.of_label[usize::from(label.0)] = material;
        if let Err(place) = self.labelled.binary_search(&label) {
            self.labelled.insert(place, label);
        }
    }

    pub fn with(mut self, label: Label, material: Material) -> Materials {
        self.set(label, material);
        self
    }

    /// Returns the materials as felt with an instrument.
    pub fn scaled_by(mut self, scales: &MaterialScales) -> Materials {
        for &label in &self.labelled {
            let material = &mut self.of_label[usize::from(label.0)];
            *material = material.scaled_by(&scales.get(label));
        }
        self
    }
}

impl Default for Materials {
    fn default() -> Self {
        Materials::new()
    }
}
