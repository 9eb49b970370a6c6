//! The conversion of a scenario file into a scenario that can be run.
//!
//! All diagnostics are collected, so that an author sees every error at once.

mod guidance;
mod limits;
mod rubric;
mod scene;
mod stages;
mod texts;
mod dry_run;
mod zones;

use super::file::{self, ScenarioFile};
use super::{CasePicture, MeasureParams, OperatingField, Questionnaire, RECORDING_PARTS, Scenario};
use crate::catalog::{
    AgeBand, InstrumentEntry, InstrumentTable, ShapeEntry, TissueEntry, TissueTable, ToothShade, TouchFactorTable,
    WorkingEndEntry,
};
use crate::instrument_import;
use crate::local_text::LocalTexts;
use rubric::Capabilities;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::sync::Arc;
use typodont_core::touch::{
    CarvingParameters, CuttingLaw, Guidance, MaterialScale, MaterialScales, Vibration, WearRate,
};
use typodont_core::volume::Label;
use typodont_formats::diagnostic::{Diagnostic, SourceText, did_you_mean};
use typodont_formats::json::SourceMap;
use typodont_formats::{Library, json, picture, pointer};

/// Treatment of the teeth's shapes while a scenario is resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResolveMode {
    /// Scans are read, and the workpiece is made once to find errors that only the volume itself shows.
    MakeWorkpiece,
    /// As `MakeWorkpiece`, and exercises that can be performed but whose result would mean little are reported, too.
    Check,
    /// Scans are read, but no workpiece is made: errors that only the volume itself shows appear when a session begins.
    ReadScans,
    /// Scans are not read, since the volume is taken from a recording.
    FromRecording,
}

/// Reads a scenario's text and all files that it names.
///
/// `library` contains the tables and the files to which the scenario refers.
///
/// # Errors
/// Returns all diagnostics if the scenario or one of its files is missing or invalid.
pub fn resolve(source: Arc<SourceText>, library: &Library, mode: ResolveMode) -> Result<Scenario, Vec<Diagnostic>> {
    let read = match mode {
        ResolveMode::FromRecording => json::read_recorded::<ScenarioFile>(source.clone())?,
        ResolveMode::MakeWorkpiece | ResolveMode::Check | ResolveMode::ReadScans => {
            json::read::<ScenarioFile>(source.clone())?
        }
    };
    let mut found = Vec::new();
    let tissues = TissueTable::read(library).map_err(|mut complaints| found.append(&mut complaints));
    let instruments = InstrumentTable::read(library).map_err(|mut complaints| found.append(&mut complaints));
    let own = read.value.instrument_file.as_deref();
    // A missing file is reported in the scenario, an invalid file in the file itself.
    let at_instrument_file = |complaint: Diagnostic| match complaint.code {
        "missing-file" => {
            read.source_map.complain("/instrument_file", "missing-file", complaint.message, complaint.help)
        }
        _ => complaint,
    };
    let instruments = instruments.and_then(|table| match own {
        None => Ok(table),
        Some(name) => table
            .extended_with(library, name)
            .map_err(|complaints| found.extend(complaints.into_iter().map(at_instrument_file))),
    });
    let (Ok(tissues), Ok(instruments)) = (tissues, instruments) else { return Err(found) };
    let touch_factors = TouchFactorTable::read(library);
    let files = [TissueTable::NAME, InstrumentTable::NAME, TouchFactorTable::NAME].into_iter().chain(own);
    let files = files.filter_map(|name| Some((name.to_string(), library.bytes(name).ok()?))).collect();
    let touch_factors = touch_factors.unwrap_or_else(|mut complaints| {
        found.append(&mut complaints);
        None
    });
    let guidances = Vec::new();
    let mut resolver = Resolver {
        library,
        touch_factors,
        source_map: &read.source_map,
        mode,
        tissues,
        instruments,
        files,
        guidances,
        sites: read.value.stages.iter().flat_map(|s| &s.draw).flat_map(|d| d.one_of.iter().cloned()).collect(),
        found,
    };
    let scenario = resolver.scenario(&read.value, &source.text);
    let mut found = resolver.found;
    if found.is_empty()
        && let Some(scenario) = scenario
    {
        if matches!(mode, ResolveMode::MakeWorkpiece | ResolveMode::Check) {
            dry_run::check_workpiece(&scenario, &read.value, &read.source_map, &mut found);
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
        file::SceneFile::Jaw(jaw) => jaw.teeth().collect(),
        file::SceneFile::Pair(pair) => vec![&pair.left, &pair.right],
        file::SceneFile::DentalArch(arch) => arch.teeth.iter().collect(),
    }
}

fn tooth_path(scene: &file::SceneFile, tooth: usize) -> String {
    match scene {
        file::SceneFile::Tooth(_) => "/scene/tooth".into(),
        file::SceneFile::Jaw(_) if tooth == 0 => "/scene/jaw/tooth".into(),
        file::SceneFile::Jaw(jaw) => match &jaw.other_teeth {
            Some(others) if tooth <= others.teeth.len() => format!("/scene/jaw/other_teeth/teeth/{}", tooth - 1),
            _ => "/scene/jaw/other_teeth".into(),
        },
        file::SceneFile::Pair(_) => format!("/scene/pair/{}", ["left", "right"][tooth.min(1)]),
        file::SceneFile::DentalArch(arch) if tooth < arch.teeth.len() => format!("/scene/dental_arch/teeth/{tooth}"),
        // A tooth that is not listed.
        file::SceneFile::DentalArch(_) => "/scene/dental_arch/teeth".into(),
    }
}

struct Resolver<'a> {
    library: &'a Library,
    source_map: &'a SourceMap,
    mode: ResolveMode,
    tissues: TissueTable,
    instruments: InstrumentTable,
    /// Factors for tactile properties; `None` in recordings made before this table existed.
    touch_factors: Option<TouchFactorTable>,
    /// Files from which the scenario was made, without scans.
    files: BTreeMap<String, Arc<[u8]>>,
    /// Haptic guidances, in the order of the stages.
    guidances: Vec<Guidance>,
    /// Ids of all possible sites of the stages' draws.
    sites: Vec<String>,
    found: Vec<Diagnostic>,
}

impl Resolver<'_> {
    fn complain(&mut self, path: &str, code: &'static str, message: impl Into<String>, help: impl Into<String>) {
        let help = Some(help.into()).filter(|h| !h.is_empty());
        self.found.push(self.source_map.complain(path, code, message.into(), help));
    }

    /// Returns the scenario; `None` only if a necessary part is missing, after a diagnostic.
    fn scenario(&mut self, written: &ScenarioFile, text: &str) -> Option<Scenario> {
        self.change_tissues(written);
        self.colour_teeth(written);
        let age = self.age_shown(written);
        let scene = self.scene(&written.scene, age);
        let instruments = self.tray(&written.instruments);
        let zones = self.zones(&written.zones);
        let lesions: Vec<String> =
            scene.iter().flat_map(|s| &s.teeth).flat_map(|t| &t.decay).map(|d| d.id.clone()).collect();
        let stages = self.stages(written, &lesions);
        if self.mode == ResolveMode::Check {
            self.find_fixed_answers(written);
        }
        let capabilities = Capabilities::of(written, &stages);
        let rubric = written.rubric.as_ref().map(|r| self.rubric(r, &zones, capabilities));
        let questionnaire = written.questionnaire.as_ref().and_then(|name| self.questionnaire(name));
        let factors = self.factors(written, &instruments);
        let carving = self.carving(&written.carving);
        let limits = self.limits(written, &zones, carving.law);
        let operating_field = self.operating_field(written);
        let pictures = self.pictures(&written.pictures);
        self.refuse_names_of_recording_parts();
        Some(Scenario {
            id: written.id.clone(),
            title: written.title.to_string(),
            summary: written.summary.to_string(),
            pictures,
            text: Arc::from(text),
            sha256: hex(&Sha256::digest(text.as_bytes())),
            files: std::mem::take(&mut self.files),
            scene: scene?,
            substituted_fdi: None,
            tissues: self.tissues.clone(),
            carving,
            vibration: Vibration {
                frequency: written.vibration.frequency_hz,
                amplitude: written.vibration.amplitude_n,
                axis: typodont_core::frame::Vec3::Y,
            },
            operating_field,
            factors,
            zones,
            guidances: std::mem::take(&mut self.guidances),
            stages,
            measures: MeasureParams {
                pulp_proximity: written.measures.near_mm,
                leeway: written.measures.leeway_mm,
                tolerance: written.measures.tolerance_mm,
            },
            limits,
            rubric,
            texts: self.texts(written, &instruments, questionnaire.as_ref()),
            instruments,
            questionnaire,
            questionnaire_time: written.questionnaire_time.unwrap_or_default(),
        })
    }

    fn unique<'s>(&mut self, ids: impl Iterator<Item = (&'s str, String)>) {
        let mut seen: Vec<&str> = Vec::new();
        for (id, path) in ids {
            if seen.contains(&id) {
                self.complain(
                    &path,
                    "duplicate-id",
                    format!("\"{id}\" is used more than once; each must be different"),
                    "",
                );
            }
            seen.push(id);
        }
    }

    fn label(&mut self, name: &str, path: &str) -> Label {
        match self.tissues.by_name(name) {
            Some(entry) => entry.label(),
            None => {
                let help = did_you_mean(name, self.tissues.names());
                self.complain(path, "unknown-tissue", format!("there is no tissue \"{name}\""), help);
                Label::AIR
            }
        }
    }

    /// Gives all teeth the colours of the patient's shade.
    fn colour_teeth(&mut self, written: &ScenarioFile) {
        let Some(patient) = &written.patient else { return };
        let Some(shade) = patient.shade else { return };
        if shade == ToothShade::OfAge && patient.age_years.is_none() {
            let message = "the shade of an age requires the age";
            let help = "add \"age_years\", or name a shade such as \"A2\"";
            self.complain("/patient/shade", "missing-age", message, help);
            return;
        }
        let colours = shade.colours(patient.age_years.unwrap_or_default());
        let enamel = ["enamel", "neighbour"].map(|name| (name, colours.enamel.clone()));
        for (name, colour) in enamel.into_iter().chain([("dentine", colours.dentine)]) {
            if let Some(entry) = self.tissues.by_name_mut(name) {
                entry.color = colour;
            }
        }
    }

    fn change_tissues(&mut self, written: &ScenarioFile) {
        for (index, entry) in written.new_tissues.iter().enumerate() {
            self.tissues.add(entry.clone(), self.source_map, &format!("/new_tissues/{index}"), &mut self.found);
        }
        for (name, change) in &written.tissues {
            let path = pointer::child("/tissues", name);
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
                self.complain(
                    &path,
                    "duplicate-id",
                    format!("\"{id}\" is used more than once; each must be different"),
                    "",
                );
            }
            match self.instruments.by_id(id).cloned() {
                Some(mut entry) => {
                    if let WorkingEndEntry::Shape(shape) = &mut entry.end {
                        self.read_shape(shape, &path);
                    }
                    tray.push(entry);
                }
                None => {
                    let help = did_you_mean(id, self.instruments.ids());
                    self.complain(&path, "unknown-instrument", format!("there is no instrument \"{id}\""), help);
                }
            }
        }
        tray
    }

    /// Returns the pictures of the case, and keeps their bytes for the recording.
    fn pictures(&mut self, written: &[file::PictureFile]) -> Vec<CasePicture> {
        for (index, file::PictureFile { file, .. }) in written.iter().enumerate() {
            let path = format!("/pictures/{index}/file");
            let bytes = match self.library.bytes(file) {
                Ok(bytes) => bytes,
                Err(error) => {
                    self.complain(&path, error.code, error.message, error.help.unwrap_or_default());
                    continue;
                }
            };
            let wrong = match self.mode {
                // What a recording holds was a picture when it was made, and is none of what is scored.
                ResolveMode::FromRecording => None,
                ResolveMode::ReadScans => picture::recognise(&bytes).err(),
                ResolveMode::MakeWorkpiece | ResolveMode::Check => picture::check(&bytes).err(),
            };
            if let Some(error) = wrong {
                self.complain(&path, error.code(), error.to_string(), error.help());
            }
            self.files.insert(file.clone(), bytes);
        }
        let shown =
            |written: &file::PictureFile| CasePicture { title: written.title.to_string(), file: written.file.clone() };
        written.iter().map(shown).collect()
    }

    /// Complains of files that a recording could not keep beside its own parts.
    fn refuse_names_of_recording_parts(&mut self) {
        for name in RECORDING_PARTS {
            if self.files.contains_key(name) {
                let message =
                    format!("a file of an exercise cannot be called \"{name}\": a recording has a part of this name");
                self.complain("", "reserved-name", message, "rename the file, here and where it is named");
            }
        }
    }

    /// Reads the shape of an instrument and keeps the bytes of its files for the recording.
    fn read_shape(&mut self, shape: &mut ShapeEntry, path: &str) {
        match instrument_import::sampled_end(shape, self.library) {
            Ok(end) => {
                if self.mode != ResolveMode::FromRecording
                    && let Err(error) = instrument_import::check_tip(shape, &end)
                {
                    self.complain(path, error.code, error.message, error.help);
                }
                shape.sampled = Some(Arc::new(end));
                let bytes = |name: &str| Some((name.to_string(), self.library.bytes(name).ok()?));
                self.files.extend(shape.files().filter_map(bytes));
            }
            Err(error) => self.complain(path, error.code, error.message, error.help),
        }
    }

    /// Returns the factors by which each instrument of the tray and the patient's age change the tissues' tactile
    /// properties.
    fn factors(&mut self, written: &ScenarioFile, tray: &[InstrumentEntry]) -> Vec<MaterialScales> {
        let band = written.patient.as_ref().and_then(|patient| patient.age_years).map(AgeBand::of);
        let Some(touch_factors) = &self.touch_factors else {
            if band.is_some() || tray.iter().any(|i| i.kind.is_some()) {
                let message = "the table of the effects of age and instruments on tissues is missing";
                self.complain(
                    "/patient",
                    "missing-file",
                    message,
                    format!("expected file: {}", TouchFactorTable::NAME),
                );
            }
            return Vec::new();
        };
        tray.iter()
            .map(|instrument| {
                let grit = MaterialScale { hardness: 1.0 / instrument.grit.unwrap_or(1.0), ..MaterialScale::ONE };
                let all = self.tissues.entries().iter().map(|tissue| {
                    // The decay of a possible site has the factors of that decay.
                    let own = tissue.site_of.and_then(|decay| self.tissues.by_label(decay)).unwrap_or(tissue);
                    (tissue.label(), touch_factors.factor(&own.name, instrument.kind, band).combined_with(grit))
                });
                all.filter(|(_, factor)| *factor != MaterialScale::ONE)
                    .fold(MaterialScales::default(), |known, (label, factor)| known.with(label, factor))
            })
            .collect()
    }

    fn carving(&mut self, written: &file::CarvingFile) -> CarvingParameters {
        let &file::CarvingFile { dwell_s: dwell, dwell_share, max_feed_mm_s: max_feed, law } = written;
        let law = match law {
            file::CuttingLawFile::Threshold => CuttingLaw::Threshold,
            file::CuttingLawFile::Rate(file::RateFile { rpm, grit }) => {
                let has_none = |e: &&TissueEntry| e.cut_force_n.is_some() && e.hardness_hv.is_none();
                let soft: Vec<&str> = self.tissues.entries().iter().filter(has_none).map(|e| e.name.as_str()).collect();
                if !soft.is_empty() {
                    let message = format!("the rate law requires the hardness of {}", soft.join(", "));
                    self.complain("/carving/law/rate", "no-hardness", message, "add \"hardness_hv\" to each of them");
                }
                CuttingLaw::Rate(WearRate { rpm, grit })
            }
        };
        CarvingParameters { dwell, dwell_share, max_feed, law }
    }

    fn operating_field(&mut self, written: &ScenarioFile) -> OperatingField {
        let file::OperatingFieldFile { dust, water_spray, suction } = written.operating_field;
        let field = OperatingField { dust, water_spray, suction };
        if suction && !field.is_any() {
            let help = "set dust or water_spray in \"operating_field\", or remove \"suction\"";
            self.complain(
                "/operating_field/suction",
                "idle-suction",
                "the suction has no effect without dust or water \
            spray",
                help,
            );
        }
        if field.is_any() && !written.stages.iter().any(|stage| stage.cutting) {
            let help = "set \"cutting\": true in a stage, or remove \"operating_field\"";
            self.complain(
                "/operating_field",
                "nothing-drilled",
                "dust and water spray require a stage with cutting, \
            and there is none",
                help,
            );
        }
        field
    }

    /// Returns the texts by language, after complaints about those with two translations into the same language.
    fn texts(
        &mut self,
        written: &ScenarioFile,
        instruments: &[InstrumentEntry],
        questionnaire: Option<&Questionnaire>,
    ) -> LocalTexts {
        let tables = texts::Tables { tissues: &self.tissues, instruments, questionnaire };
        let (texts, conflicts) = texts::local_texts(written, &tables);
        for (path, code) in conflicts {
            let message = format!("the same text is translated differently elsewhere in the exercise, in \"{code}\"");
            self.complain(&path, "two-translations", message, "write the same translation at both places");
        }
        texts
    }

    fn questionnaire(&mut self, name: &str) -> Option<Questionnaire> {
        match Questionnaire::read(self.library, name) {
            Ok(questionnaire) => {
                let file = Questionnaire::file_name(name);
                self.files.extend(self.library.bytes(&file).ok().map(|bytes| (file, bytes)));
                Some(questionnaire)
            }
            Err(complaints) => {
                // A missing file is reported in the scenario, an invalid file in the questionnaire itself.
                for complaint in complaints {
                    match complaint.code {
                        "missing-file" => {
                            let message = format!("there is no questionnaire \"{name}\"");
                            let help = format!("expected file: {}", Questionnaire::file_name(name));
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

/// Returns bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
