//! From a scenario as written to a scenario that can be run.
//!
//! Every complaint is collected: an author sees all that is wrong in one go.

mod guidance;
mod rubric;
mod scene;
mod stages;
mod trial;
mod zones;

use super::file::{self, ScenarioFile};
use super::{Measures, OperatingField, Questionnaire, Scenario};
use crate::content::json::Places;
use crate::content::{
    AgeBand, FeelTable, InstrumentEntry, InstrumentTable, Library, TissueEntry, TissueTable, json, pointer,
};
use crate::diagnostic::{Diagnostic, Source, did_you_mean};
use crate::touch::{Carving, CuttingLaw, Factor, Factors, Guidance, Rate, Vibration};
use crate::volume::Label;
use rubric::Has;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Whether the teeth's forms are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forms {
    /// Scans are read and the workpiece is made once, for what only shows in the matter itself.
    Made,
    /// Scans are read, and nothing is made: what only shows in the matter shows when a lesson begins.
    Read,
    /// The volume comes from a recording: scans are not asked for.
    Recorded,
}

/// Reads a scenario's text and everything it names; otherwise every complaint.
///
/// `library` finds the tables and the files the scenario refers to.
pub fn resolve(source: Arc<Source>, library: &Library, forms: Forms) -> Result<Scenario, Vec<Diagnostic>> {
    let read = json::read::<ScenarioFile>(source.clone())?;
    let mut found = Vec::new();
    let tissues = TissueTable::read(library).map_err(|mut complaints| found.append(&mut complaints));
    let instruments = InstrumentTable::read(library).map_err(|mut complaints| found.append(&mut complaints));
    let own = read.value.instrument_file.as_deref();
    // A missing file is the scenario's mistake, a broken one the file's.
    let told = |complaint: Diagnostic| match complaint.code {
        "missing-file" => read.places.complain("/instrument_file", "missing-file", complaint.message, complaint.help),
        _ => complaint,
    };
    let instruments = instruments.and_then(|table| match own {
        None => Ok(table),
        Some(name) => table.and_of(library, name).map_err(|complaints| found.extend(complaints.into_iter().map(told))),
    });
    let (Ok(tissues), Ok(instruments)) = (tissues, instruments) else { return Err(found) };
    let feel = FeelTable::read(library);
    let files = [TissueTable::NAME, InstrumentTable::NAME, FeelTable::NAME].into_iter().chain(own);
    let files = files.filter_map(|name| Some((name.to_string(), library.bytes(name).ok()?))).collect();
    let feel = feel.unwrap_or_else(|mut complaints| {
        found.append(&mut complaints);
        None
    });
    let guidances = Vec::new();
    let mut resolver =
        Resolver { library, feel, places: &read.places, forms, tissues, instruments, files, guidances, found };
    let scenario = resolver.scenario(&read.value, &source.text);
    let mut found = resolver.found;
    if found.is_empty()
        && let Some(scenario) = scenario
    {
        if forms == Forms::Made {
            trial::try_to_make(&scenario, &read.value, &read.places, &mut found);
        }
        if found.is_empty() {
            return Ok(scenario);
        }
    }
    found.sort_by_key(|d| d.span.as_ref().map(|s| s.start));
    Err(found)
}

fn written_teeth(scene: &file::SceneFile) -> Vec<&file::ToothFile> {
    match scene {
        file::SceneFile::Tooth(tooth) => vec![tooth],
        file::SceneFile::Jaw(jaw) => vec![&jaw.tooth],
        file::SceneFile::Pair(pair) => vec![&pair.left, &pair.right],
    }
}

fn tooth_path(scene: &file::SceneFile, tooth: usize) -> String {
    match scene {
        file::SceneFile::Tooth(_) => "/scene/tooth".into(),
        file::SceneFile::Jaw(_) => "/scene/jaw/tooth".into(),
        file::SceneFile::Pair(_) => format!("/scene/pair/{}", ["left", "right"][tooth.min(1)]),
    }
}

struct Resolver<'a> {
    library: &'a Library,
    places: &'a Places,
    forms: Forms,
    tissues: TissueTable,
    instruments: InstrumentTable,
    /// `None` in recordings made before there was such a table.
    feel: Option<FeelTable>,
    /// Files that the scenario was made from, scans apart.
    files: BTreeMap<String, Arc<[u8]>>,
    /// What leads the hand, in the order of the stages.
    guidances: Vec<Guidance>,
    found: Vec<Diagnostic>,
}

impl Resolver<'_> {
    fn complain(&mut self, path: &str, code: &'static str, message: impl Into<String>, help: impl Into<String>) {
        let help = Some(help.into()).filter(|h| !h.is_empty());
        self.found.push(self.places.complain(path, code, message.into(), help));
    }

    /// Everything; `None` only when something needed is missing and was complained about.
    fn scenario(&mut self, written: &ScenarioFile, text: &str) -> Option<Scenario> {
        self.change_tissues(written);
        let age = self.age_shown(written);
        let scene = self.scene(&written.scene, age);
        let instruments = self.tray(&written.instruments);
        let zones = self.zones(&written.zones);
        let lesions: Vec<String> =
            scene.iter().flat_map(|s| &s.teeth).flat_map(|t| &t.decay).map(|d| d.id.clone()).collect();
        let stages = self.stages(written, &lesions);
        let has = Has::of(written, &stages);
        let rubric = written.rubric.as_ref().map(|r| self.rubric(r, &zones, has));
        let questionnaire = written.questionnaire.as_ref().and_then(|name| self.questionnaire(name));
        let factors = self.factors(written, &instruments);
        let carving = self.carving(&written.carving);
        let operating_field = self.operating_field(written);
        Some(Scenario {
            id: written.id.clone(),
            title: written.title.clone(),
            summary: written.summary.clone(),
            text: Arc::from(text),
            sha256: hex(&Sha256::digest(text.as_bytes())),
            files: std::mem::take(&mut self.files),
            scene: scene?,
            tissues: self.tissues.clone(),
            carving,
            vibration: Vibration {
                frequency: written.vibration.frequency_hz,
                amplitude: written.vibration.amplitude_n,
                axis: crate::frame::Vec3::Y,
            },
            operating_field,
            instruments,
            factors,
            zones,
            guidances: std::mem::take(&mut self.guidances),
            stages,
            measures: Measures {
                near: written.measures.near_mm,
                leeway: written.measures.leeway_mm,
                tolerance: written.measures.tolerance_mm,
            },
            rubric,
            questionnaire,
        })
    }

    fn unique<'s>(&mut self, ids: impl Iterator<Item = (&'s str, String)>) {
        let mut seen: Vec<&str> = Vec::new();
        for (id, path) in ids {
            if seen.contains(&id) {
                self.complain(&path, "duplicate-id", format!("\"{id}\" stands here for the second time"), "");
            }
            seen.push(id);
        }
    }

    fn label(&mut self, name: &str, path: &str) -> Label {
        match self.tissues.by_name(name) {
            Some(entry) => entry.label(),
            None => {
                let help = did_you_mean(name, self.tissues.names());
                self.complain(path, "unknown-tissue", format!("no tissue is named \"{name}\""), help);
                Label::AIR
            }
        }
    }

    fn change_tissues(&mut self, written: &ScenarioFile) {
        for (index, entry) in written.new_tissues.iter().enumerate() {
            self.tissues.add(entry.clone(), self.places, &format!("/new_tissues/{index}"), &mut self.found);
        }
        for (name, change) in &written.tissues {
            let path = pointer::under("/tissues", name);
            self.label(name, &path);
            if let Some(entry) = self.tissues.by_name_mut(name) {
                entry.stiffness = change.stiffness.unwrap_or(entry.stiffness);
                entry.damping = change.damping.unwrap_or(entry.damping);
                entry.static_friction = change.static_friction.unwrap_or(entry.static_friction);
                entry.dynamic_friction = change.dynamic_friction.unwrap_or(entry.dynamic_friction);
                entry.cut_force_n = change.cut_force_n.or(entry.cut_force_n);
                entry.hardness_hv = change.hardness_hv.or(entry.hardness_hv);
            }
        }
        if let Some(ratio) = &written.stiffness_ratio {
            self.label(&ratio.of, "/stiffness_ratio/of");
            self.label(&ratio.to, "/stiffness_ratio/to");
            let stiffer = self.tissues.by_name(&ratio.of).map(|e| e.stiffness);
            if let (Some(stiffer), Some(entry)) = (stiffer, self.tissues.by_name_mut(&ratio.to)) {
                entry.stiffness = stiffer / ratio.ratio;
            }
        }
    }

    fn tray(&mut self, written: &[String]) -> Vec<InstrumentEntry> {
        let mut tray: Vec<InstrumentEntry> = Vec::new();
        for (index, id) in written.iter().enumerate() {
            let path = format!("/instruments/{index}");
            if written[..index].contains(id) {
                self.complain(&path, "duplicate-id", format!("\"{id}\" stands here for the second time"), "");
            }
            match self.instruments.by_id(id) {
                Some(entry) => tray.push(entry.clone()),
                None => {
                    let help = did_you_mean(id, self.instruments.ids());
                    self.complain(&path, "unknown-instrument", format!("no instrument is named \"{id}\""), help);
                }
            }
        }
        tray
    }

    /// What each instrument of the tray and the patient's age make of the tissues.
    fn factors(&mut self, written: &ScenarioFile, tray: &[InstrumentEntry]) -> Vec<Factors> {
        let band = written.patient.as_ref().map(|p| AgeBand::of(p.age_years));
        let Some(feel) = &self.feel else {
            if band.is_some() || tray.iter().any(|i| i.kind.is_some()) {
                let message = "there is no table of what age and tools make of tissues";
                self.complain("/patient", "missing-file", message, format!("looked for {}", FeelTable::NAME));
            }
            return Vec::new();
        };
        tray.iter()
            .map(|instrument| {
                let grit = Factor { hardness: 1.0 / instrument.grit.unwrap_or(1.0), ..Factor::ONE };
                let all = self
                    .tissues
                    .entries()
                    .iter()
                    .map(|tissue| (tissue.label(), feel.factor(&tissue.name, instrument.kind, band).times(grit)));
                all.filter(|(_, factor)| *factor != Factor::ONE)
                    .fold(Factors::default(), |known, (label, factor)| known.with(label, factor))
            })
            .collect()
    }

    fn carving(&mut self, written: &file::CarvingFile) -> Carving {
        let &file::CarvingFile { dwell_s: dwell, dwell_share, max_feed_mm_s: max_feed, law } = written;
        let law = match law {
            file::CuttingLawFile::Threshold => CuttingLaw::Threshold,
            file::CuttingLawFile::Rate(file::RateFile { rpm, grit }) => {
                let has_none = |e: &&TissueEntry| e.cut_force_n.is_some() && e.hardness_hv.is_none();
                let soft: Vec<&str> = self.tissues.entries().iter().filter(has_none).map(|e| e.name.as_str()).collect();
                if !soft.is_empty() {
                    let message = format!("the rate law needs the hardness of {}", soft.join(", "));
                    self.complain("/carving/law/rate", "no-hardness", message, "give each of them \"hardness_hv\"");
                }
                CuttingLaw::Rate(Rate { rpm, grit })
            }
        };
        Carving { dwell, dwell_share, max_feed, law }
    }

    fn operating_field(&mut self, written: &ScenarioFile) -> OperatingField {
        let file::OperatingFieldFile { dust, water_spray, suction } = written.operating_field;
        let field = OperatingField { dust, water_spray, suction };
        if suction && !field.is_any() {
            let help = "give \"operating_field\" dust, water_spray or both, or leave \"suction\" out";
            self.complain("/operating_field/suction", "idle-suction", "there is nothing for the suction to take", help);
        }
        if field.is_any() && !written.stages.iter().any(|stage| stage.cutting) {
            let help = "give a stage \"cutting\": true, or leave \"operating_field\" out";
            self.complain("/operating_field", "nothing-drilled", "no stage lets a bur run", help);
        }
        field
    }

    fn questionnaire(&mut self, name: &str) -> Option<Questionnaire> {
        match Questionnaire::read(self.library, name) {
            Ok(questionnaire) => {
                let file = Questionnaire::file(name);
                self.files.extend(self.library.bytes(&file).ok().map(|bytes| (file, bytes)));
                Some(questionnaire)
            }
            Err(complaints) => {
                // A missing file is the scenario's mistake, a broken one the questionnaire's.
                for complaint in complaints {
                    match complaint.code {
                        "missing-file" => {
                            let message = format!("there is no questionnaire \"{name}\"");
                            let help = format!("looked for {}", Questionnaire::file(name));
                            self.complain("/questionnaire", "missing-file", message, help);
                        }
                        _ => self.found.push(complaint),
                    }
                }
                None
            }
        }
    }
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
