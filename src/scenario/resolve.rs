//! From a scenario as written to a scenario that can be run.
//!
//! Every complaint is collected: an author sees all that is wrong in one go.

use super::file::{self, ScenarioFile};
use super::workpiece::{Unmakeable, anatomy_tissues};
use super::{
    Decay, DecayPlace, Ends, Form, HardFail, Layout, Limit, Mask, Measures, Metric, Question, QuestionKind,
    Questionnaire, Region, Rubric, RubricItem, Scenario, Scene, Stage, StiffnessSteps, Tooth, Workpiece, Zone, metric,
};
use crate::anatomy;
use crate::content::json::{self, Places};
use crate::content::{self, InstrumentEntry, InstrumentTable, Library, TissueTable};
use crate::diagnostic::{Diagnostic, Source, did_you_mean};
use crate::frame::Vec3;
use crate::touch::{Carving, DAMPING_TIME, Fixture, Forces, Guidance, Kind, Space, Vibration};
use crate::volume::{Label, Volume};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Points of all rubric items together.
const POINTS: f64 = 100.0;

/// Damping of a fixture whose author leaves it open, as a share of its stiffness, s: somewhat more than it needs.
const USUAL_DAMPING_TIME: f32 = 1.25 * DAMPING_TIME;

/// A path further from the teeth than this leads nowhere, mm.
const PATH_AWAY: f32 = 10.0;

/// Whether the teeth's forms are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Forms {
    /// Scans are read and the workpiece is made once, for what only shows in the matter itself.
    Made,
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
    let (Ok(tissues), Ok(instruments)) = (tissues, instruments) else { return Err(found) };
    let files = [TissueTable::NAME, InstrumentTable::NAME];
    let files = files.iter().filter_map(|name| Some((name.to_string(), library.bytes(name).ok()?))).collect();
    let guidances = Vec::new();
    let mut resolver = Resolver { library, places: &read.places, forms, tissues, instruments, files, guidances, found };
    let scenario = resolver.scenario(&read.value, &source.text);
    let mut found = resolver.found;
    if found.is_empty()
        && let Some(scenario) = scenario
    {
        if forms == Forms::Made {
            try_to_make(&scenario, &read.value, &read.places, &mut found);
        }
        if found.is_empty() {
            return Ok(scenario);
        }
    }
    found.sort_by_key(|d| d.span.as_ref().map(|s| s.start));
    Err(found)
}

/// Makes the workpiece once: what only shows in the matter itself (a decay outside its tooth) is told to the author too.
fn try_to_make(scenario: &Scenario, written: &ScenarioFile, places: &Places, found: &mut Vec<Diagnostic>) {
    let problem = match Workpiece::make(scenario, 0) {
        Ok(workpiece) => {
            find_paths_away(scenario, &workpiece, places, found);
            return find_zones_outside(scenario, &workpiece, places, found);
        }
        Err(problem) => problem,
    };
    let (path, help) = match &problem {
        Unmakeable::DecayOutside { tooth, decay } => (
            format!("{}/decay/{decay}", tooth_path(&written.scene, *tooth)),
            "make it larger, move it toward the surface's middle, or change depth_mm",
        ),
        Unmakeable::NoEnamel { tooth } => {
            (format!("{}/form", tooth_path(&written.scene, *tooth)), "check which number or grey value is enamel")
        }
        Unmakeable::ZoneSize { zone, .. } => {
            (format!("/zones/{zone}/region/labels/file"), "draw the map on the very volume that the tooth is made from")
        }
        Unmakeable::UnequalSpacing => ("/scene".to_string(), "give both teeth the same spacing_mm"),
        Unmakeable::TooLarge { .. } | Unmakeable::OnlyRecorded => ("/scene".to_string(), "choose a larger spacing_mm"),
    };
    found.push(places.complain(&path, "impossible-scene", problem.to_string(), Some(help.into())));
}

/// A zone that no tooth reaches would never matter, and its author would never know.
fn find_zones_outside(scenario: &Scenario, workpiece: &Workpiece, places: &Places, found: &mut Vec<Diagnostic>) {
    let [low, high] = corners(workpiece);
    for (index, zone) in scenario.zones.iter().enumerate() {
        let is_outside = |[from, to]: [Vec3; 2]| from.cmpgt(high).any() || to.cmplt(low).any();
        if zone.region.extent().is_some_and(is_outside) {
            let message = format!("the zone \"{}\" lies outside the tooth", zone.id);
            let help = format!("the tooth reaches from {low:.1} to {high:.1} mm: buccal, distal, occlusal");
            found.push(places.complain(&format!("/zones/{index}/region"), "empty-region", message, Some(help)));
        }
    }
}

/// A path far from every tooth is one in another space or another unit.
fn find_paths_away(scenario: &Scenario, workpiece: &Workpiece, places: &Places, found: &mut Vec<Diagnostic>) {
    let [low, high] = corners(workpiece);
    let is_near = |p: &Vec3| p.distance(p.clamp(low, high)) <= PATH_AWAY;
    for (index, stage) in scenario.stages.iter().enumerate() {
        if let Some(Guidance::Path(fixture)) = stage.guidance.and_then(|g| scenario.guidances.get(g))
            && !fixture.path.points().iter().any(is_near)
        {
            let message = format!("the path stays more than {PATH_AWAY} mm away from the tooth");
            let help = format!("the tooth reaches from {low:.1} to {high:.1} mm: buccal, distal, occlusal");
            let path = format!("/stages/{index}/guidance/path/file");
            found.push(places.complain(&path, "wrong-place", message, Some(help)));
        }
    }
}

/// Corners of the box around all teeth, tooth space, mm.
fn corners(workpiece: &Workpiece) -> [Vec3; 2] {
    let low = workpiece.teeth.iter().map(|t| t.low).reduce(Vec3::min).unwrap_or_default();
    let high = workpiece.teeth.iter().map(|t| t.high).reduce(Vec3::max).unwrap_or_default();
    [low, high]
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
        let scene = self.scene(&written.scene);
        let instruments = self.tray(&written.instruments);
        let zones = self.zones(&written.zones);
        let lesions: Vec<String> =
            scene.iter().flat_map(|s| &s.teeth).flat_map(|t| &t.decay).map(|d| d.id.clone()).collect();
        let stages = self.stages(written, &lesions);
        let has_decay = written_teeth(&written.scene).iter().any(|t| !t.decay.is_empty());
        let rubric = written.rubric.as_ref().map(|r| self.rubric(r, &zones, has_decay));
        let questionnaire = written.questionnaire.as_ref().and_then(|name| self.questionnaire(name));
        let file::CarvingFile { dwell_s, dwell_share, max_feed_mm_s } = written.carving;
        Some(Scenario {
            id: written.id.clone(),
            title: written.title.clone(),
            summary: written.summary.clone(),
            text: Arc::from(text),
            sha256: hex(&Sha256::digest(text.as_bytes())),
            files: std::mem::take(&mut self.files),
            scene: scene?,
            tissues: self.tissues.clone(),
            carving: Carving { dwell: dwell_s, dwell_share, max_feed: max_feed_mm_s },
            vibration: Vibration {
                frequency: written.vibration.frequency_hz,
                amplitude: written.vibration.amplitude_n,
                axis: crate::frame::Vec3::Y,
            },
            instruments,
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
            let path = format!("/tissues/{}", name.replace('~', "~0").replace('/', "~1"));
            self.label(name, &path);
            if let Some(entry) = self.tissues.by_name_mut(name) {
                entry.stiffness = change.stiffness.unwrap_or(entry.stiffness);
                entry.damping = change.damping.unwrap_or(entry.damping);
                entry.static_friction = change.static_friction.unwrap_or(entry.static_friction);
                entry.dynamic_friction = change.dynamic_friction.unwrap_or(entry.dynamic_friction);
                entry.cut_force_n = change.cut_force_n.or(entry.cut_force_n);
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

    fn scene(&mut self, written: &file::SceneFile) -> Option<Scene> {
        let (layout, teeth) = match written {
            file::SceneFile::Tooth(tooth) => (Layout::Single, vec![tooth]),
            file::SceneFile::Pair(pair) => (Layout::Pair { gap: pair.gap_mm }, vec![&pair.left, &pair.right]),
            file::SceneFile::Jaw(jaw) => (Layout::Jaw, vec![&jaw.tooth]),
        };
        let paths: Vec<String> = (0..teeth.len()).map(|i| tooth_path(written, i)).collect();
        self.unique(teeth.iter().zip(&paths).map(|(t, p)| (t.id.as_str(), format!("{p}/id"))));
        let decay = teeth.iter().zip(&paths).flat_map(|(t, p)| t.decay.iter().enumerate().map(move |(i, d)| (d, p, i)));
        self.unique(decay.map(|(d, p, i)| (d.id.as_str(), format!("{p}/decay/{i}/id"))));
        let teeth: Vec<Option<Tooth>> = teeth.iter().zip(&paths).map(|(tooth, path)| self.tooth(tooth, path)).collect();
        Some(Scene { layout, teeth: teeth.into_iter().collect::<Option<_>>()? })
    }

    fn tooth(&mut self, written: &file::ToothFile, path: &str) -> Option<Tooth> {
        let (quadrant, position) = (written.fdi / 10, written.fdi % 10);
        if !(1..=4).contains(&quadrant) || !(1..=8).contains(&position) {
            let message = format!("there is no tooth {}", written.fdi);
            self.complain(
                &format!("{path}/fdi"),
                "unknown-tooth",
                message,
                "the first digit is 1–4 (quadrant), the second 1–8 (from the midline)",
            );
        }
        let form = self.form(&written.form, written.fdi, path);
        let decay =
            written.decay.iter().enumerate().map(|(i, d)| self.decay(d, &format!("{path}/decay/{i}"))).collect();
        Some(Tooth { id: written.id.clone(), fdi: written.fdi, form: form?, decay })
    }

    fn form(&mut self, written: &file::FormFile, fdi: u8, path: &str) -> Option<Form> {
        match written {
            _ if self.forms == Forms::Recorded => Some(Form::Recorded),
            file::FormFile::Procedural(made) => {
                if fdi != 36 {
                    let help = "for now the program makes 36; other teeth can be given as ct or labels";
                    self.complain(
                        &format!("{path}/fdi"),
                        "unknown-form",
                        format!("tooth {fdi} cannot be made procedurally"),
                        help,
                    );
                }
                Some(Form::Procedural { spacing: made.spacing_mm })
            }
            file::FormFile::Ct(scan) => {
                let path = format!("{path}/form/ct/file");
                let spacing = scan.spacing_mm.map(|s| s.map(|s| s.0));
                let volume = self.read_scan(&scan.file, &path, |image, tissues| {
                    content::scan::segmented(image, spacing, tissues).map_err(|e| e.to_string())
                })?;
                Some(Form::Given(Arc::new(volume)))
            }
            file::FormFile::Labels(map) => {
                let numbers = self.numbers(&map.tissues, &format!("{path}/form/labels/tissues"));
                let path = format!("{path}/form/labels/file");
                let spacing = map.spacing_mm.map(|s| s.map(|s| s.0));
                let volume = self.read_scan(&map.file, &path, |image, _| {
                    content::scan::labelled(image, spacing, &numbers).map_err(|e| e.to_string())
                })?;
                Some(Form::Given(Arc::new(volume)))
            }
        }
    }

    fn read_scan(
        &mut self,
        name: &str,
        path: &str,
        make: impl FnOnce(&content::nrrd::Image, &anatomy::Tissues) -> Result<Volume, String>,
    ) -> Option<Volume> {
        let image = self
            .library
            .bytes(name)
            .map_err(|e| (e.code, e.message, e.help))
            .and_then(|bytes| content::nrrd::parse(&bytes).map_err(|e| ("wrong-volume", e.to_string(), None)));
        let tissues = anatomy_tissues(&self.tissues);
        match image.and_then(|image| make(&image, &tissues).map_err(|e| ("wrong-volume", e, None))) {
            Ok(volume) => Some(volume),
            Err((code, message, help)) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }

    /// Numbers of a label map as labels.
    fn numbers(&mut self, written: &BTreeMap<String, String>, path: &str) -> BTreeMap<u8, Label> {
        let mut numbers = BTreeMap::new();
        for (number, tissue) in written {
            let at = format!("{path}/{}", number.replace('~', "~0").replace('/', "~1"));
            let label = self.label(tissue, &at);
            match number.parse::<u8>() {
                Ok(number) if number > 0 => {
                    numbers.insert(number, label);
                }
                _ => self.complain(
                    &at,
                    "wrong-number",
                    format!("\"{number}\" is not a number of a label map"),
                    "use \"1\" to \"255\"; 0 is air",
                ),
            }
        }
        if numbers.is_empty() {
            self.complain(
                path,
                "no-tissues",
                "no number is given a tissue",
                "{ \"1\": \"enamel\", \"2\": \"dentine\", \"3\": \"pulp\" }",
            );
        }
        numbers
    }

    fn decay(&mut self, written: &file::DecayFile, path: &str) -> Decay {
        let radii = match &written.shape {
            file::DecayShapeFile::Sphere(sphere) => [sphere.radius_mm; 3],
            file::DecayShapeFile::Ellipsoid(ellipsoid) => ellipsoid.radii_mm.map(|r| r.0),
        };
        let place = match written.at {
            file::DecayPlaceFile::Centre => DecayPlace::Centre,
            file::DecayPlaceFile::RandomQuadrant => DecayPlace::RandomQuadrant,
            file::DecayPlaceFile::Quadrant(quadrant) => DecayPlace::Quadrant(quadrant),
            file::DecayPlaceFile::OffsetMm(offset) => DecayPlace::Offset(offset.map(|o| o.0)),
        };
        let by_quadrant = matches!(place, DecayPlace::RandomQuadrant | DecayPlace::Quadrant(_));
        if by_quadrant && written.surface != file::SurfaceFile::O {
            let message = "quadrants are counted on the occlusal surface only";
            self.complain(
                &format!("{path}/at"),
                "wrong-place",
                message,
                "set surface to \"O\", or place it with offset_mm",
            );
        }
        let label = self.label(&written.tissue, &format!("{path}/tissue"));
        if self.tissues.role(label).is_some_and(|role| role != content::Role::Decay) {
            let decay: Vec<&str> = self
                .tissues
                .entries()
                .iter()
                .filter(|e| e.role == content::Role::Decay)
                .map(|e| e.name.as_str())
                .collect();
            let help = format!("tissues with the role \"decay\": {}", decay.join(", "));
            let message = format!("\"{}\" is not a kind of decay", written.tissue);
            self.complain(&format!("{path}/tissue"), "wrong-tissue", message, help);
        }
        Decay { id: written.id.clone(), label, radii, surface: written.surface, place, depth: written.depth_mm }
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

    fn zones(&mut self, written: &[file::ZoneFile]) -> Vec<Zone> {
        self.unique(written.iter().enumerate().map(|(i, z)| (z.id.as_str(), format!("/zones/{i}/id"))));
        let zone = |(i, z): (usize, &file::ZoneFile)| {
            let region = self.region(&z.region, &format!("/zones/{i}/region"))?;
            Some(Zone { id: z.id.clone(), title: z.title.clone(), role: z.role, region })
        };
        written.iter().enumerate().filter_map(zone).collect()
    }

    fn region(&mut self, written: &file::RegionFile, path: &str) -> Option<Region> {
        let point = |p: [file::CoordinateFile; 3]| p.map(|c| c.0);
        Some(match written {
            file::RegionFile::Tissue(name) => Region::Tissue(self.label(name, &format!("{path}/tissue"))),
            file::RegionFile::Around(around) => Region::Around {
                label: self.label(&around.tissue, &format!("{path}/around/tissue")),
                within: around.within_mm,
            },
            file::RegionFile::Sphere(sphere) => {
                Region::Sphere { centre: point(sphere.centre_mm), radius: sphere.radius_mm }
            }
            file::RegionFile::Box(corners) => {
                let (min, max) = (point(corners.min_mm), point(corners.max_mm));
                if (0..3).any(|a| min[a] >= max[a]) {
                    self.complain(
                        &format!("{path}/box"),
                        "empty-region",
                        "the box is empty",
                        "each of min_mm must be less than its max_mm",
                    );
                }
                Region::Box { min, max }
            }
            file::RegionFile::Cylinder(c) => {
                if point(c.from_mm) == point(c.to_mm) {
                    self.complain(
                        &format!("{path}/cylinder"),
                        "empty-region",
                        "the cylinder has no length",
                        "from_mm and to_mm must differ",
                    );
                }
                Region::Cylinder { from: point(c.from_mm), to: point(c.to_mm), radius: c.radius_mm }
            }
            file::RegionFile::Labels(labels) => {
                let path = format!("{path}/labels/file");
                let mask = self.library.bytes(&labels.file).map_err(|e| (e.code, e.message)).and_then(|bytes| {
                    self.files.insert(labels.file.clone(), bytes.clone());
                    let image = content::nrrd::parse(&bytes).map_err(|e| ("wrong-volume", e.to_string()))?;
                    let mask =
                        content::scan::mask(&image, labels.value).map_err(|e| ("wrong-volume", e.to_string()))?;
                    Ok(Mask { dims: image.geometry.dims, is_inside: mask })
                });
                match mask {
                    Ok(mask) => Region::Mask(Arc::new(mask)),
                    Err((code, message)) => {
                        self.complain(&path, code, format!("\"{}\": {message}", labels.file), "");
                        return None;
                    }
                }
            }
        })
    }

    fn stages(&mut self, written: &ScenarioFile, lesions: &[String]) -> Vec<Stage> {
        self.unique(written.stages.iter().enumerate().map(|(i, s)| (s.id.as_str(), format!("/stages/{i}/id"))));
        let questions = written.stages.iter().enumerate().flat_map(|(i, s)| {
            s.ask.iter().enumerate().map(move |(j, q)| (q.id.as_str(), format!("/stages/{i}/ask/{j}/id")))
        });
        self.unique(questions);
        written
            .stages
            .iter()
            .enumerate()
            .map(|(i, s)| self.stage(s, written, lesions, &format!("/stages/{i}")))
            .collect()
    }

    fn stage(&mut self, written: &file::StageFile, scenario: &ScenarioFile, lesions: &[String], path: &str) -> Stage {
        let all: Vec<usize> = (0..scenario.instruments.len()).collect();
        let instruments = match &written.instruments {
            None => all,
            Some(ids) => self.chosen(ids, &scenario.instruments, &format!("{path}/instruments")),
        };
        let mut ends = Ends::default();
        for (index, end) in written.ends_when.iter().enumerate() {
            let at = format!("{path}/ends_when/{index}");
            match *end {
                file::EndFile::Answered => {
                    ends.answered = true;
                    if written.ask.is_empty() {
                        self.complain(
                            &at,
                            "endless-stage",
                            "the stage asks nothing that could be answered",
                            "add a question under \"ask\"",
                        );
                    }
                }
                file::EndFile::Confirmed => ends.confirmed = true,
                file::EndFile::ClearedPct(percent) => {
                    ends.cleared = Some(percent);
                    if lesions.is_empty() || !written.cutting {
                        let message = "no decay can be cleared in this stage";
                        self.complain(
                            &at,
                            "endless-stage",
                            message,
                            "add decay to a tooth, and set \"cutting\" to true",
                        );
                    }
                }
            }
        }
        if written.time_limit_s.is_none() && written.ends_when.is_empty() && written.stiffness_steps.is_none() {
            let help =
                "set \"time_limit_s\", or \"ends_when\" to \"confirmed\", \"answered\" or { \"cleared_pct\": … }";
            self.complain(path, "endless-stage", "nothing can end this stage", help);
        }
        let cuts = |index: &usize| {
            scenario.instruments.get(*index).and_then(|id| self.instruments.by_id(id)).is_some_and(|e| e.cuts)
        };
        if written.cutting && !instruments.iter().any(cuts) {
            self.complain(
                &format!("{path}/cutting"),
                "nothing-cuts",
                "no instrument of this stage cuts",
                "add a bur to \"instruments\"",
            );
        }
        let steps = written.stiffness_steps.as_ref().map(|steps| StiffnessSteps {
            label: self.label(&steps.tissue, &format!("{path}/stiffness_steps/tissue")),
            coefficients: steps.coefficients.iter().map(|c| c.0).collect(),
            step_time: steps.step_time_s,
        });
        let guidance = written.guidance.as_ref().and_then(|g| self.guidance(g, &format!("{path}/guidance")));
        let ask = written
            .ask
            .iter()
            .enumerate()
            .map(|(i, q)| self.question(q, scenario, lesions, &format!("{path}/ask/{i}")))
            .collect();
        Stage {
            id: written.id.clone(),
            title: written.title.clone(),
            instruction: written.instruction.clone(),
            time_limit: written.time_limit_s,
            instruments,
            cutting: written.cutting,
            show_decay: written.show_decay,
            steps,
            guidance,
            ask,
            ends,
        }
    }

    /// Index of what leads the hand; `None` only when it was complained about.
    fn guidance(&mut self, written: &file::GuidanceFile, path: &str) -> Option<usize> {
        let guidance = match written {
            file::GuidanceFile::Path(fixture) => Guidance::Path(self.fixture(fixture, &format!("{path}/path"))?),
            file::GuidanceFile::Forces(forces) => Guidance::Forces(self.forces(forces, &format!("{path}/forces"))?),
        };
        self.guidances.push(guidance);
        Some(self.guidances.len() - 1)
    }

    fn fixture(&mut self, written: &file::FixtureFile, path: &str) -> Option<Fixture> {
        let is_tube = written.kind == file::FixtureKind::Tube;
        let of_follow =
            [("look_ahead_mm", written.look_ahead_mm.is_some()), ("speed_mm_s", written.speed_mm_s.is_some())];
        for (key, _) in of_follow.iter().filter(|(_, is_written)| *is_written && is_tube) {
            let message = format!("a tube has no {key}");
            self.complain(
                &format!("{path}/{key}"),
                "unused-key",
                message,
                "leave it out, or set \"kind\" to \"follow\"",
            );
        }
        let stiffness = written.stiffness_n_per_mm;
        let damping = written.damping_n_s_per_mm.unwrap_or(USUAL_DAMPING_TIME * stiffness);
        if damping < DAMPING_TIME * stiffness {
            let message = format!("a spring of {stiffness} N/mm would shake with so little damping");
            let help = format!("at least {:.4}, or leave it out", DAMPING_TIME * stiffness);
            self.complain(&format!("{path}/damping_n_s_per_mm"), "unstable-spring", message, help);
        }
        let kind = match written.kind {
            file::FixtureKind::Tube => Kind::Tube,
            file::FixtureKind::Follow => {
                Kind::Follow { look_ahead: written.look_ahead_mm.unwrap_or(2.0), speed: written.speed_mm_s }
            }
        };
        Some(Fixture {
            path: Arc::new(self.measured(&written.file, &format!("{path}/file"), content::measured::path)?),
            kind,
            radius: written.radius_mm.unwrap_or(if is_tube { 0.5 } else { 0.0 }),
            stiffness,
            damping,
            max_force: written.max_force_n,
        })
    }

    fn forces(&mut self, written: &file::ForcesFile, path: &str) -> Option<Forces> {
        let rows = self.measured(&written.file, &format!("{path}/file"), content::measured::forces)?;
        let strongest = rows.iter().map(|row| row.force.length()).fold(0.0, f32::max) * written.scale;
        if strongest > content::measured::FORCE_MAX {
            let message = format!("scaled, the greatest force is {strongest:.1} N");
            let help = format!("at most {} N are played", content::measured::FORCE_MAX);
            self.complain(&format!("{path}/scale"), "out-of-range", message, help);
        }
        let space = match written.space {
            file::SpaceFile::World => Space::World,
            file::SpaceFile::Tooth => Space::Tooth,
        };
        Some(Forces { rows: rows.into(), repeat: written.repeat, scale: written.scale, space })
    }

    /// A table of measured numbers beside the scenario. A missing file is the scenario's mistake, a broken one the table's.
    fn measured<T>(
        &mut self,
        name: &str,
        path: &str,
        read: impl FnOnce(Arc<Source>) -> Result<T, Vec<Diagnostic>>,
    ) -> Option<T> {
        let bytes = self.library.bytes(name).and_then(|bytes| Ok((bytes, self.library.text(name)?)));
        match bytes {
            Ok((bytes, text)) => {
                self.files.insert(name.to_string(), bytes);
                read(text).map_err(|mut complaints| self.found.append(&mut complaints)).ok()
            }
            Err(Diagnostic { code, message, help, .. }) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }

    /// Indices of instruments of the tray.
    fn chosen(&mut self, ids: &[String], tray: &[String], path: &str) -> Vec<usize> {
        let mut chosen = Vec::new();
        for (index, id) in ids.iter().enumerate() {
            match tray.iter().position(|t| t == id) {
                Some(place) if !chosen.contains(&place) => chosen.push(place),
                Some(_) => {}
                None => {
                    let help = did_you_mean(id, tray.iter().map(String::as_str));
                    let message = format!("\"{id}\" is not on the exercise's tray");
                    self.complain(&format!("{path}/{index}"), "unknown-instrument", message, help);
                }
            }
        }
        chosen
    }

    fn question(
        &mut self,
        written: &file::QuestionFile,
        scenario: &ScenarioFile,
        lesions: &[String],
        path: &str,
    ) -> Question {
        let kind = match &written.answer {
            file::AnswerFile::ToothWith(decay) => {
                self.lesion(decay, lesions, &format!("{path}/answer/tooth_with"));
                if !matches!(scenario.scene, file::SceneFile::Pair(_)) {
                    let message = "there is only one tooth to choose from";
                    self.complain(
                        &format!("{path}/answer"),
                        "no-choice",
                        message,
                        "use a scene of two teeth: { \"pair\": … }",
                    );
                }
                QuestionKind::ToothWith { decay: decay.clone() }
            }
            file::AnswerFile::QuadrantOf(decay) => {
                self.lesion(decay, lesions, &format!("{path}/answer/quadrant_of"));
                if self.is_between_quadrants(scenario, decay) {
                    let message = format!("\"{decay}\" lies in the middle, or not on the chewing surface");
                    let help =
                        "put it into a quadrant: \"at\": \"random_quadrant\" on surface O, or { \"quadrant\": 1 }";
                    self.complain(&format!("{path}/answer/quadrant_of"), "no-quadrant", message, help);
                }
                QuestionKind::QuadrantOf { decay: decay.clone() }
            }
            file::AnswerFile::Choice(choice) => {
                self.unique(
                    choice
                        .options
                        .iter()
                        .enumerate()
                        .map(|(i, o)| (o.id.as_str(), format!("{path}/answer/choice/options/{i}/id"))),
                );
                if let Some(correct) = choice.correct.as_ref().filter(|c| !choice.options.iter().any(|o| o.id == **c)) {
                    let help = did_you_mean(correct, choice.options.iter().map(|o| o.id.as_str()));
                    let message = format!("\"{correct}\" is not one of the options");
                    self.complain(&format!("{path}/answer/choice/correct"), "unknown-option", message, help);
                }
                let options = choice.options.iter().map(|o| (o.id.clone(), o.text.clone())).collect();
                QuestionKind::Choice { options, correct: choice.correct.clone() }
            }
            file::AnswerFile::YesNo(correct) => QuestionKind::YesNo { correct: *correct },
            file::AnswerFile::Number(number) => {
                QuestionKind::Number { unit: number.unit.clone(), correct: number.correct, tolerance: number.tolerance }
            }
            file::AnswerFile::Text => QuestionKind::Text,
        };
        Question { id: written.id.clone(), text: written.text.clone(), kind }
    }

    fn lesion(&mut self, name: &str, lesions: &[String], path: &str) {
        if !lesions.iter().any(|l| l == name) {
            let help = match lesions {
                [] => "no tooth has decay: add some under \"decay\"".to_string(),
                _ => did_you_mean(name, lesions.iter().map(String::as_str)),
            };
            self.complain(path, "unknown-decay", format!("no decay is named \"{name}\""), help);
        }
    }

    fn rubric(&mut self, written: &file::RubricFile, zones: &[Zone], has_decay: bool) -> Rubric {
        let sum: f64 = written.items.iter().map(|i| i.points).sum();
        if (sum - POINTS).abs() > 1e-6 {
            let help = "change the items' points so that together they make 100";
            self.complain("/rubric/items", "wrong-sum", format!("the points sum to {sum}, not 100"), help);
        }
        let mut items = Vec::new();
        for (index, item) in written.items.iter().enumerate() {
            let path = format!("/rubric/items/{index}");
            if item.full_at == item.zero_at {
                let message = "full_at and zero_at are equal";
                self.complain(
                    &path,
                    "no-range",
                    message,
                    "between the two values the points rise in proportion: they must differ",
                );
            }
            if let Some(metric) = self.metric(&item.metric, zones, &format!("{path}/metric")) {
                self.check_direction(&metric, item, &path);
                self.check_decay(&metric, has_decay, &format!("{path}/metric"));
                let &file::RubricItemFile { points, full_at, zero_at, .. } = item;
                items.push(RubricItem { title: item.title.clone(), metric, points, full_at, zero_at });
            }
        }
        let mut hard_fails = Vec::new();
        for (index, fail) in written.hard_fails.iter().enumerate() {
            let path = format!("/rubric/hard_fails/{index}/metric");
            if let Some(metric) = self.metric(&fail.metric, zones, &path) {
                self.check_decay(&metric, has_decay, &path);
                let when = match fail.when {
                    file::FailFile::Above(value) => Limit::Above(value),
                    file::FailFile::Below(value) => Limit::Below(value),
                };
                hard_fails.push(HardFail { title: fail.title.clone(), metric, when });
            }
        }
        Rubric { pass_points: written.pass_points, items, hard_fails }
    }

    /// A rubric that rewards the wrong end of a measure is a slip of the pen.
    fn check_direction(&mut self, metric: &Metric, item: &file::RubricItemFile, path: &str) {
        let (is_backward, word) = match metric.about.better {
            metric::Better::Higher => (item.full_at < item.zero_at, "higher"),
            metric::Better::Lower => (item.full_at > item.zero_at, "lower"),
            metric::Better::Neither => (false, ""),
        };
        if is_backward {
            let message = format!("the worse value of \"{}\" earns the points", metric.name());
            let help = format!("{word} is better: exchange full_at and zero_at");
            self.complain(&format!("{path}/full_at"), "backward-rubric", message, help);
        }
    }

    /// A measure of decay has no value where there is none.
    fn check_decay(&mut self, metric: &Metric, has_decay: bool, path: &str) {
        let needs_decay = ["decay_cleared_pct", "healthy_per_decay_pct", "efficiency_pct_s"];
        if needs_decay.contains(&metric.about.name) && !has_decay {
            let message = format!("\"{}\" needs decay, and no tooth has any", metric.name());
            let help = "give a tooth decay, or take a measure of the target zone such as recall";
            self.complain(path, "no-decay", message, help);
        }
    }

    fn metric(&mut self, name: &str, zones: &[Zone], path: &str) -> Option<Metric> {
        match Metric::parse(name) {
            Ok(metric) => {
                if let Some(metric::Argument::Zone(zone)) = &metric.argument
                    && !zones.iter().any(|z| z.id == *zone)
                {
                    let help = did_you_mean(zone, zones.iter().map(|z| z.id.as_str()));
                    self.complain(path, "unknown-zone", format!("no zone is named \"{zone}\""), help);
                    return None;
                }
                Some(metric)
            }
            Err(metric::Unknown::Name(name)) => {
                let help = did_you_mean(&name, metric::names());
                self.complain(path, "unknown-metric", format!("no measure is named \"{name}\""), help);
                None
            }
            Err(metric::Unknown::Argument(help)) => {
                self.complain(path, "unknown-metric", format!("\"{name}\" is not complete"), help);
                None
            }
        }
    }

    /// True when no quadrant is the right answer: a decay in the middle of a surface, or on a side of the tooth.
    fn is_between_quadrants(&self, scenario: &ScenarioFile, decay: &str) -> bool {
        let mut all = written_teeth(&scenario.scene).into_iter().flat_map(|t| &t.decay);
        all.any(|d| {
            d.id == decay && (d.surface != file::SurfaceFile::O || matches!(d.at, file::DecayPlaceFile::Centre))
        })
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
