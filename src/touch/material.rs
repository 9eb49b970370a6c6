//! How each tissue answers a touch.

use crate::volume::Label;

/// A tissue's answer: the four coefficients of the thesis (Table 2.4), its carving threshold (5.3), its hardness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Spring stiffness as a share (0–1) of the stiffest the device can render.
    pub stiffness: f32,
    /// Damping as a share (0–1) of the most the device can render.
    pub damping: f32,
    /// Coulomb coefficient that must be exceeded to start sliding, 0–2.
    pub static_friction: f32,
    /// Coulomb coefficient while sliding, 0–2.
    pub dynamic_friction: f32,
    /// Spring force from which a rotating bur takes this tissue away, N; `None`: it cannot be cut.
    pub cut_force: Option<f32>,
    /// Vickers hardness, HV: what the rate law divides by; `None`: no work wears it away.
    pub hardness: Option<f32>,
}

impl Material {
    /// Feels like nothing.
    pub const NOTHING: Material = Material {
        stiffness: 0.0,
        damping: 0.0,
        static_friction: 0.0,
        dynamic_friction: 0.0,
        cut_force: None,
        hardness: None,
    };

    /// `None`: the tissue cannot be cut.
    pub fn coefficient(&self, which: Coefficient) -> Option<f32> {
        match which {
            Coefficient::Stiffness => Some(self.stiffness),
            Coefficient::Damping => Some(self.damping),
            Coefficient::StaticFriction => Some(self.static_friction),
            Coefficient::DynamicFriction => Some(self.dynamic_friction),
            Coefficient::CutForce => self.cut_force,
        }
    }

    /// The same tissue with one number changed, within what it may be.
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

    /// The same tissue as another tool or another patient makes it feel; within what coefficients may be.
    fn times(self, factor: &Factor) -> Material {
        Material {
            stiffness: (self.stiffness * factor.stiffness).clamp(0.0, 1.0),
            damping: (self.damping * factor.damping).clamp(0.0, 1.0),
            static_friction: (self.static_friction * factor.static_friction).clamp(0.0, FRICTION_MAX),
            dynamic_friction: (self.dynamic_friction * factor.dynamic_friction).clamp(0.0, FRICTION_MAX),
            cut_force: self.cut_force.map(|force| force * factor.cut_force).filter(|force| force.is_finite()),
            hardness: self.hardness.map(|hv| hv * factor.hardness),
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

/// One of the numbers by which a tissue feels as it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coefficient {
    Stiffness,
    Damping,
    StaticFriction,
    DynamicFriction,
    /// N
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

    /// Least and greatest that it may be, in its unit.
    pub fn range(self) -> (f32, f32) {
        match self {
            Coefficient::Stiffness | Coefficient::Damping => (0.0, 1.0),
            Coefficient::StaticFriction | Coefficient::DynamicFriction => (0.0, FRICTION_MAX),
            Coefficient::CutForce => (0.01, 50.0),
        }
    }
}

/// What a tool or a patient makes of a tissue, as multiples of its coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    pub stiffness: f32,
    pub damping: f32,
    pub static_friction: f32,
    pub dynamic_friction: f32,
    pub hardness: f32,
    /// Infinite where the tool cannot cut the tissue.
    pub cut_force: f32,
}

impl Factor {
    /// Changes nothing, to the last bit.
    pub const ONE: Factor = Factor {
        stiffness: 1.0,
        damping: 1.0,
        static_friction: 1.0,
        dynamic_friction: 1.0,
        hardness: 1.0,
        cut_force: 1.0,
    };

    /// What one number is multiplied by.
    pub fn of(&self, which: Coefficient) -> f32 {
        match which {
            Coefficient::Stiffness => self.stiffness,
            Coefficient::Damping => self.damping,
            Coefficient::StaticFriction => self.static_friction,
            Coefficient::DynamicFriction => self.dynamic_friction,
            Coefficient::CutForce => self.cut_force,
        }
    }

    /// Both together.
    pub fn times(self, other: Factor) -> Factor {
        Factor {
            stiffness: self.stiffness * other.stiffness,
            damping: self.damping * other.damping,
            static_friction: self.static_friction * other.static_friction,
            dynamic_friction: self.dynamic_friction * other.dynamic_friction,
            hardness: self.hardness * other.hardness,
            cut_force: self.cut_force * other.cut_force,
        }
    }
}

/// What the tissues' coefficients are multiplied by for one instrument; 1 where nothing is said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Factors(Vec<(Label, Factor)>);

impl Factors {
    pub fn get(&self, label: Label) -> Factor {
        self.0.iter().find(|(l, _)| *l == label).map_or(Factor::ONE, |(_, factor)| *factor)
    }

    /// Multiplies what is known of a tissue by one factor more.
    pub fn with(mut self, label: Label, factor: Factor) -> Factors {
        match self.0.iter_mut().find(|(l, _)| *l == label) {
            Some((_, known)) => *known = known.times(factor),
            None => self.0.push((label, factor)),
        }
        self
    }
}

/// A running weighted mean of materials. The carving threshold is not mixed: each voxel keeps its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blend {
    sum: Material,
    weight: f32,
}

impl Blend {
    pub fn none() -> Blend {
        Blend { sum: Material::NOTHING, weight: 0.0 }
    }

    pub fn add(&mut self, material: Material, weight: f32) {
        self.sum = self.sum.plus(material.weighted(weight));
        self.weight += weight;
    }

    /// The mean; `None` when nothing was added.
    pub fn mean(&self) -> Option<Material> {
        (self.weight > 1e-6).then(|| self.sum.weighted(1.0 / self.weight))
    }
}

/// The material of every label.
#[derive(Clone, Debug, PartialEq)]
pub struct Materials {
    of_label: [Material; 256],
    /// Labels that were given a material, in ascending order.
    known: Vec<Label>,
}

impl Materials {
    /// Every label feels like nothing until told otherwise.
    pub fn new() -> Materials {
        Materials { of_label: [Material::NOTHING; 256], known: Vec::new() }
    }

    #[inline]
    pub fn get(&self, label: Label) -> &Material {
        &self.of_label[usize::from(label.0)]
    }

    /// The labels that were given a material, with it.
    pub fn known(&self) -> impl Iterator<Item = (Label, &Material)> {
        self.known.iter().map(|&label| (label, self.get(label)))
    }

    /// Gives a label its material. Allocates only for a label not known before.
    pub fn set(&mut self, label: Label, material: Material) {
        self.of_label[usize::from(label.0)] = material;
        if let Err(place) = self.known.binary_search(&label) {
            self.known.insert(place, label);
        }
    }

    pub fn with(mut self, label: Label, material: Material) -> Materials {
        self.set(label, material);
        self
    }

    /// How the tissues answer an instrument.
    pub fn times(mut self, factors: &Factors) -> Materials {
        for &label in &self.known {
            let material = &mut self.of_label[usize::from(label.0)];
            *material = material.times(&factors.get(label));
        }
        self
    }
}

impl Default for Materials {
    fn default() -> Self {
        Materials::new()
    }
}
