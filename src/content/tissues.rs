//! The table of tissues: names, colours and how each feels.

use super::Library;
use super::json::{self, Places};
use crate::diagnostic::Diagnostic;
use crate::touch::{Filling, Material, Materials};
use crate::volume::Label;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a tissue means to the score.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Healthy tooth: taking it away costs.
    Sound,
    /// To be taken away.
    Decay,
    /// Never to be touched by a bur.
    Vulnerable,
    /// Gum and the like: not carved, hurts when drilled.
    Soft,
    /// Another tooth than the one worked on.
    Neighbour,
    /// A filling.
    Material,
    /// What has settled on a tooth: calculus.
    Deposit,
}

/// One line of `content/tissues.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueEntry {
    /// Number of the tissue in label maps, 1 to 255; 0 is air.
    #[schemars(range(min = 1, max = 255))]
    pub id: u8,
    /// Name by which files refer to it, such as "enamel": small letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub name: String,
    /// Name shown to people.
    #[schemars(length(min = 1, max = 80))]
    pub title: String,
    /// What the tissue means to the score.
    pub role: Role,
    /// Colour for drawing, as "#rrggbb", for example "#6b4226".
    #[schemars(regex(pattern = r"^#[0-9a-fA-F]{6}$"))]
    pub color: String,
    /// Share of the device's greatest stiffness, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stiffness: f32,
    /// Share of the device's greatest damping, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub damping: f32,
    /// Coulomb coefficient to be overcome before sliding, 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub static_friction: f32,
    /// Coulomb coefficient while sliding, 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub dynamic_friction: f32,
    /// Spring force from which a bur takes the tissue away, N; null: it cannot be cut.
    #[schemars(range(min = 0.01, max = 50.0))]
    pub cut_force_n: Option<f32>,
    /// Vickers hardness, HV, for the rate law of carving; null: it is not worn away. Enamel 270 to 360, dentine 50 to 70
    /// (Gutiérrez-Salazar and Reyes-Gasga 2003), soft carious dentine 5 to 30 (Fusayama 1979), amalgam 100 to 120,
    /// composite 50 to 90.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 2000.0))]
    pub hardness_hv: Option<f32>,
    /// How it is laid and condensed, for what fills cavities.
    #[serde(default)]
    pub packing: Option<PackingEntry>,
}

/// How a filling is laid and condensed.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PackingEntry {
    /// Force from which it leaves its carrier and clings, N: 0.02 to 5.
    #[schemars(range(min = 0.02, max = 5.0))]
    pub least_force_n: f32,
    /// Force from which what is laid keeps no voids, and from which a condenser closes them, N: 0.05 to 10, and more than
    /// `least_force_n`.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub condense_force_n: f32,
    /// Share of its volume that voids take when it is laid with the least force, 0 to 0.25.
    #[schemars(range(min = 0.0, max = 0.25))]
    pub void_share: f32,
}

impl TissueEntry {
    pub fn label(&self) -> Label {
        Label(self.id)
    }

    /// How it is laid and condensed; `None` for what is not packed.
    pub fn filling(&self) -> Option<Filling> {
        let PackingEntry { least_force_n: least_force, condense_force_n: condense_force, void_share } = self.packing?;
        Some(Filling { label: self.label(), least_force, condense_force, void_share })
    }

    /// Colour as red, green, blue in 0–1.
    pub fn rgb(&self) -> [f32; 3] {
        parse_color(&self.color).unwrap_or([0.5; 3])
    }

    /// How it feels before any instrument or patient changes that.
    pub fn material(&self) -> Material {
        Material {
            stiffness: self.stiffness,
            damping: self.damping,
            static_friction: self.static_friction,
            dynamic_friction: self.dynamic_friction,
            cut_force: self.cut_force_n,
            hardness: self.hardness_hv,
        }
    }
}

/// "#rrggbb" as red, green, blue in 0–1.
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let channel = |i: usize| u8::from_str_radix(&digits[i..i + 2], 16).ok().map(|v| f32::from(v) / 255.0);
    Some([channel(0)?, channel(2)?, channel(4)?])
}

/// `content/tissues.json` as written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TissueFile {
    #[schemars(length(min = 1, max = 255))]
    tissues: Vec<TissueEntry>,
}

/// Every tissue a session knows.
#[derive(Clone, Debug)]
pub struct TissueTable {
    entries: Vec<TissueEntry>,
}

impl TissueTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/tissues.json";

    pub fn read(library: &Library) -> Result<TissueTable, Vec<Diagnostic>> {
        let source = library.text(Self::NAME).map_err(|e| vec![e])?;
        let read = json::read::<TissueFile>(source)?;
        let mut table = TissueTable { entries: Vec::new() };
        let mut found = Vec::new();
        for (index, entry) in read.value.tissues.into_iter().enumerate() {
            table.add(entry, &read.places, &format!("/tissues/{index}"), &mut found);
        }
        if found.is_empty() { Ok(table) } else { Err(found) }
    }

    /// Adds a tissue, with complaints if it clashes with one already there.
    pub fn add(&mut self, entry: TissueEntry, places: &Places, path: &str, found: &mut Vec<Diagnostic>) {
        let mut complain = |key: &str, code, message: String, help: String| {
            found.push(places.complain(&format!("{path}/{key}"), code, message, Some(help)));
        };
        if let Some(other) = self.entries.iter().find(|e| e.id == entry.id) {
            let message = format!("the number {} already belongs to \"{}\"", entry.id, other.name);
            complain("id", "duplicate-id", message, "give each tissue its own number".into());
        }
        if entry.packing.is_some_and(|p| p.condense_force_n <= p.least_force_n) {
            let message = format!("\"{}\" is condensed by no more than the force that lays it", entry.name);
            complain("packing", "no-range", message, "give condense_force_n more than least_force_n".into());
        }
        if self.entries.iter().any(|e| e.name == entry.name) {
            let message = format!("there is already a tissue named \"{}\"", entry.name);
            complain("name", "duplicate-id", message, "give each tissue its own name".into());
        }
        self.entries.push(entry);
    }

    pub fn entries(&self) -> &[TissueEntry] {
        &self.entries
    }

    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.entries.iter().map(|e| e.name.as_str())
    }

    /// The label of a tissue, or a complaint that lists those that there are.
    pub fn label_of(&self, name: &str) -> Result<Label, String> {
        self.by_name(name).map(TissueEntry::label).ok_or_else(|| {
            let known = self.names().collect::<Vec<_>>().join(", ");
            format!("no tissue is named \"{}\"; known: {known}", name.escape_debug())
        })
    }

    pub fn by_name(&self, name: &str) -> Option<&TissueEntry> {
        self.entries.iter().find(|e| e.name == name)
    }

    pub fn by_name_mut(&mut self, name: &str) -> Option<&mut TissueEntry> {
        self.entries.iter_mut().find(|e| e.name == name)
    }

    pub fn by_label(&self, label: Label) -> Option<&TissueEntry> {
        self.entries.iter().find(|e| e.label() == label)
    }

    /// What a label means to the score; `None` for air and unknown labels.
    pub fn role(&self, label: Label) -> Option<Role> {
        self.by_label(label).map(|e| e.role)
    }

    /// What can be laid and condensed.
    pub fn fillings(&self) -> Vec<Filling> {
        self.entries.iter().filter_map(TissueEntry::filling).collect()
    }

    /// How each tissue feels.
    pub fn materials(&self) -> Materials {
        self.entries.iter().fold(Materials::new(), |all, e| all.with(e.label(), e.material()))
    }
}
