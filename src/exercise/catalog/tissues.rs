//! The table of tissues: names, colours and tactile properties.

use crate::local_text::LocalText;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use typodont_core::touch::{FillingMaterial, Material, Materials};
use typodont_core::volume::Label;
use typodont_formats::Library;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::json;
use typodont_formats::json::SourceMap;

/// Role of a tissue in scoring.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TissueRole {
    /// Sound tooth tissue: its removal is penalized.
    Sound,
    /// Decayed tissue, which is to be removed.
    Decay,
    /// Vulnerable tissue, such as pulp, which must not be removed or exposed.
    Vulnerable,
    /// Gingiva and similar tissue: it is not cut, and must not be touched by a rotating bur.
    Soft,
    /// A tooth other than the one to be treated.
    Neighbour,
    /// Filling material.
    Material,
    /// A deposit on a tooth: calculus.
    Deposit,
}

/// A tissue of `content/tissues.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TissueEntry {
    /// Number of the tissue in label maps: 1 to 255; 0 is air.
    #[schemars(range(min = 1, max = 255))]
    pub id: u8,
    /// Name by which files refer to the tissue, such as "enamel": lower-case letters, digits, hyphens, underscores.
    #[schemars(length(min = 1, max = 40), regex(pattern = r"^[a-z0-9_-]+$"))]
    pub name: String,
    /// Name shown to users.
    #[schemars(length(min = 1, max = 80))]
    pub title: LocalText,
    /// Role of the tissue in scoring.
    pub role: TissueRole,
    /// Colour for display, as "#rrggbb", for example "#6b4226".
    #[schemars(regex(pattern = r"^#[0-9a-fA-F]{6}$"))]
    pub color: String,
    /// Stiffness, as a share of the device's maximum stiffness: 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub stiffness: f32,
    /// Damping, as a share of the device's maximum damping: 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub damping: f32,
    /// Coefficient of static friction (Coulomb): 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub static_friction: f32,
    /// Coefficient of dynamic friction (Coulomb): 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub dynamic_friction: f32,
    /// Spring force from which a bur cuts the tissue, N: 0.01 to 50; null for a tissue that cannot be cut.
    #[schemars(range(min = 0.01, max = 50.0))]
    pub cut_force_n: Option<f32>,
    /// Vickers hardness for the rate law of cutting, HV: 0.1 to 2000; null for a tissue that is not worn away. Enamel
    /// has 270 to 360, dentine 50 to 70 (Gutiérrez-Salazar and Reyes-Gasga 2003), soft carious dentine 5 to 30
    /// (Fusayama 1979), amalgam 100 to 120, composite 50 to 90.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 2000.0))]
    pub hardness_hv: Option<f32>,
    /// Properties for placing and condensing, for filling materials.
    #[serde(default)]
    pub packing: Option<PackingEntry>,
    /// Label of the decay that this tissue becomes in a trial in which its site is drawn; `None` for all tissues of the
    /// table, and for those that a scenario adds.
    #[serde(skip)]
    pub site_of: Option<Label>,
}

/// Properties of a filling material for placing and condensing.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PackingEntry {
    /// Force from which the material leaves its carrier and adheres, N: 0.02 to 5.
    #[schemars(range(min = 0.02, max = 5.0))]
    pub least_force_n: f32,
    /// Force from which the placed material contains no voids, and from which a condenser closes voids, N: 0.05 to 10,
    /// and more than `least_force_n`.
    #[schemars(range(min = 0.05, max = 10.0))]
    pub condense_force_n: f32,
    /// Share of voids in the volume of material placed with the least force: 0 to 0.25.
    #[schemars(range(min = 0.0, max = 0.25))]
    pub void_share: f32,
}

impl TissueEntry {
    pub fn label(&self) -> Label {
        Label(self.id)
    }

    /// Returns the properties for placing and condensing; `None` for a tissue that cannot be packed.
    pub fn filling(&self) -> Option<FillingMaterial> {
        let PackingEntry { least_force_n: least_force, condense_force_n: condense_force, void_share } = self.packing?;
        Some(FillingMaterial { label: self.label(), min_force: least_force, condense_force, void_share })
    }

    /// Returns the colour as red, green and blue, 0 to 1.
    pub fn rgb(&self) -> [f32; 3] {
        parse_color(&self.color).unwrap_or([0.5; 3])
    }

    /// Returns the tactile properties before any change by instrument or age.
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

/// Parses "#rrggbb" into red, green and blue, 0 to 1; `None` for any other text.
pub fn parse_color(text: &str) -> Option<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.is_ascii())?;
    let channel = |i: usize| u8::from_str_radix(&digits[i..i + 2], 16).ok().map(|v| f32::from(v) / 255.0);
    Some([channel(0)?, channel(2)?, channel(4)?])
}

/// File form of `content/tissues.json`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TissueFile {
    #[schemars(length(min = 1, max = 255))]
    tissues: Vec<TissueEntry>,
}

/// All tissues of a session.
#[derive(Clone, Debug)]
pub struct TissueTable {
    entries: Vec<TissueEntry>,
}

impl TissueTable {
    /// Name of the table in a [`Library`].
    pub const NAME: &str = "content/tissues.json";

    /// Reads the table of `content/tissues.json`.
    ///
    /// # Errors
    /// Returns diagnostics if the file is missing or invalid, or if entries clash.
    pub fn read(library: &Library) -> Result<TissueTable, Vec<Diagnostic>> {
        let source = library.text(Self::NAME).map_err(|e| vec![e])?;
        let read = json::read::<TissueFile>(source)?;
        let mut table = TissueTable { entries: Vec::new() };
        let mut found = Vec::new();
        for (index, entry) in read.value.tissues.into_iter().enumerate() {
            table.add(entry, &read.source_map, &format!("/tissues/{index}"), &mut found);
        }
        if found.is_empty() { Ok(table) } else { Err(found) }
    }

    /// Adds a tissue. Adds diagnostics to `found` if its number or name is already in use, or if its condensing force
    /// does not exceed its placing force.
    pub fn add(&mut self, entry: TissueEntry, source_map: &SourceMap, path: &str, found: &mut Vec<Diagnostic>) {
        let mut complain = |key: &str, code, message: String, help: String| {
            found.push(source_map.complain(&format!("{path}/{key}"), code, message, Some(help)));
        };
        if let Some(other) = self.entries.iter().find(|e| e.id == entry.id) {
            let message = format!("the number {} belongs to \"{}\" already", entry.id, other.name);
            complain("id", "duplicate-id", message, "give each tissue its own number".into());
        }
        if entry.packing.is_some_and(|p| p.condense_force_n <= p.least_force_n) {
            let message = format!("the condensing force of \"{}\" does not exceed its placing force", entry.name);
            complain("packing", "no-range", message, "condense_force_n must be greater than least_force_n".into());
        }
        if self.entries.iter().any(|e| e.name == entry.name) {
            let message = format!("the name \"{}\" belongs to another tissue already", entry.name);
            complain("name", "duplicate-id", message, "give each tissue its own name".into());
        }
        self.entries.push(entry);
    }

    /// Adds the tissue of a possible site of decay: the decay under a number of its own, so that each site can be given
    /// its properties separately. Returns its label; `None` if all 255 numbers are in use.
    pub fn add_site(&mut self, decay: Label, site: &str) -> Option<Label> {
        let id = (1..=255u8).rev().find(|id| self.by_label(Label(*id)).is_none())?;
        let own = self.by_label(decay)?;
        // A colon cannot occur in the name of another tissue.
        let (name, title) = (format!("{}:{site}", own.name), own.title.map(|title| format!("{title} ({site})")));
        let entry = TissueEntry { id, name, title, site_of: Some(decay), ..own.clone() };
        self.entries.push(entry);
        Some(Label(id))
    }

    pub fn entries(&self) -> &[TissueEntry] {
        &self.entries
    }

    pub fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.entries.iter().map(|e| e.name.as_str())
    }

    /// Returns the label of a tissue.
    ///
    /// # Errors
    /// Returns a message that lists the known tissues if there is no tissue of this name.
    pub fn label_of(&self, name: &str) -> Result<Label, String> {
        self.by_name(name).map(TissueEntry::label).ok_or_else(|| {
            let known = self.names().collect::<Vec<_>>().join(", ");
            format!("there is no tissue \"{}\"; known: {known}", name.escape_debug())
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

    /// Returns the role of a label in scoring; `None` for air and unknown labels.
    pub fn role(&self, label: Label) -> Option<TissueRole> {
        self.by_label(label).map(|e| e.role)
    }

    /// Returns all filling materials.
    pub fn fillings(&self) -> Vec<FillingMaterial> {
        self.entries.iter().filter_map(TissueEntry::filling).collect()
    }

    /// Returns the tactile properties of all tissues.
    pub fn materials(&self) -> Materials {
        self.entries.iter().fold(Materials::new(), |all, e| all.with(e.label(), e.material()))
    }
}
