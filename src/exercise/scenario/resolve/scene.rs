//! The teeth of a scene with their shapes and decay, and their surroundings.

use super::{ResolveMode, Resolver, tooth_path, written_teeth};

use crate::scenario::file;
use crate::scenario::soft_neighbours::soft_neighbour_tissue;
use crate::scenario::tooth_bounds::anatomy_tissues;
use crate::scenario::{
    ArchForm, Calculus, Decay, DecayOrigin, DecayPlace, DecayShape, DentalArches, GrownDecay, OldFilling, Pockets,
    PreparedCavity, ProximalBox, Scene, SceneLayout, ToothSource, ToothSpec,
};
use crate::tooth_import;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use typodont_anatomy::age;
use typodont_anatomy::caries::LesionDepth;
use typodont_anatomy::cheek_and_tongue::SoftNeighbour;
use typodont_anatomy::jaw::Jaw;
use typodont_core::frame::{Pose, Vec3, rotation_about_axes};
use typodont_core::touch;
use typodont_core::touch::{ClosedMesh, Collider};
use typodont_core::volume::Label;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::import::ImportedTooth;
use typodont_formats::pointer;
use typodont_formats::solid_mesh::{self, SolidMeshError};

/// Minimum half-width of a cavity's opening, mm, so that a carrier can place material through it.
const NARROWEST: f32 = 0.25;

impl Resolver<'_> {
    /// Returns the age that the anatomy is to show, years; `None` for no age.
    pub(super) fn age_shown(&mut self, written: &file::ScenarioFile) -> Option<f32> {
        let patient = written.patient.as_ref().filter(|patient| patient.shows_age)?;
        let Some(age) = patient.age_years else {
            let message = "the anatomy cannot show an age that is not given";
            self.complain("/patient/shows_age", "missing-age", message, "add \"age_years\"");
            return None;
        };
        if !(age::MIN_AGE..=age::MAX_AGE).contains(&age) {
            let message =
                format!("the anatomy cannot show an age of {age} years: expected {} to {}", age::MIN_AGE, age::MAX_AGE);
            let help = "remove \"shows_age\": the age then changes only the tactile properties of the tissues";
            self.complain("/patient/age_years", "out-of-range", message, help);
        }
        Some(age)
    }

    pub(super) fn scene(&mut self, scene: &file::SceneFile, age: Option<f32>) -> Option<Scene> {
        let layout = match scene {
            file::SceneFile::Tooth(_) => SceneLayout::Single,
            file::SceneFile::Pair(pair) => SceneLayout::Pair { gap: pair.gap_mm },
            file::SceneFile::Jaw(file::JawFile { other_teeth: Some(others), .. }) => {
                SceneLayout::Mouth { spacing: others.spacing_mm }
            }
            file::SceneFile::Jaw(_) => SceneLayout::Jaw,
            file::SceneFile::DentalArch(arch) => SceneLayout::Arch { spacing: arch.spacing_mm },
        };
        let teeth = written_teeth(scene);
        let paths: Vec<String> = (0..teeth.len()).map(|i| tooth_path(scene, i)).collect();
        self.unique(teeth.iter().zip(&paths).map(|(t, p)| (t.id.as_str(), format!("{p}/id"))));
        let decay = teeth.iter().zip(&paths).flat_map(|(t, p)| t.decay.iter().enumerate().map(move |(i, d)| (d, p, i)));
        let decay = decay.map(|(d, p, i)| (d.id.as_str(), format!("{p}/decay/{i}/id")));
        let stains =
            teeth.iter().zip(&paths).flat_map(|(t, p)| t.stains.iter().enumerate().map(move |(i, s)| (s, p, i)));
        let stains = stains.map(|(s, p, i)| (s.id.as_str(), format!("{p}/stains/{i}/id")));
        let deposits =
            teeth.iter().zip(&paths).flat_map(|(t, p)| t.calculus.iter().enumerate().map(move |(i, c)| (c, p, i)));
        let deposits = deposits.map(|(c, p, i)| (c.id.as_str(), format!("{p}/calculus/{i}/id")));
        let fillings =
            teeth.iter().zip(&paths).flat_map(|(t, p)| t.old_fillings.iter().enumerate().map(move |(i, f)| (f, p, i)));
        let fillings = fillings.map(|(f, p, i)| (f.id.as_str(), format!("{p}/old_fillings/{i}/id")));
        self.unique(decay.chain(stains).chain(deposits).chain(fillings));
        let mut teeth: Vec<Option<ToothSpec>> =
            teeth.iter().zip(&paths).map(|(tooth, path)| self.tooth(tooth, path, age)).collect();
        let around = match scene {
            file::SceneFile::Jaw(jaw) => jaw.around.as_ref().map(|around| self.obstacles(around)),
            _ => None,
        };
        let pockets = match scene {
            file::SceneFile::Jaw(jaw) => jaw.periodontium.as_ref().map(|gum| pockets(gum, age)),
            _ => None,
        };
        let own_jaw = matches!(scene, file::SceneFile::Jaw(jaw) if jaw.own_jaw);
        if pockets.is_some() && around.is_some() && !own_jaw {
            let help = "remove \"around\": a jaw with \"periodontium\" has its own adjacent teeth; or set \"own_jaw\" to true if \
                        \"around\" has a whole jaw";
            let message = "gingiva with pockets cannot be combined with meshes in \"around\"";
            self.complain("/scene/jaw/periodontium", "two-gums", message, help);
        }
        let has_surfaces = |jaw: &file::JawFile| jaw.around.as_ref().is_some_and(|around| !around.is_empty());
        if matches!(scene, file::SceneFile::Jaw(jaw) if jaw.own_jaw && !has_surfaces(jaw)) {
            let help = "list the surfaces of the jaw in \"around\", or remove \"own_jaw\"";
            self.complain("/scene/jaw/own_jaw", "no-own-jaw", "a jaw of one's own has no surfaces", help);
        }
        let arch = match scene {
            file::SceneFile::Jaw(jaw) => {
                // A listed tooth can be rotated, but not be missing.
                let own =
                    |fdi, is_missing| fdi == jaw.tooth.fdi || is_missing && jaw.teeth().any(|tooth| tooth.fdi == fdi);
                if let Some(others) = &jaw.other_teeth {
                    self.check_other_teeth(scene, jaw, others);
                    // They are generated for each session and each replay: a recording has the treated tooth only.
                    let source = ToothSource::Procedural { spacing: others.spacing_mm, age };
                    teeth.iter_mut().skip(1).flatten().for_each(|tooth| tooth.source = source.clone());
                    let listed: BTreeSet<u8> = jaw.teeth().map(|tooth| tooth.fdi).collect();
                    let numbers = Jaw::BOTH.into_iter().flat_map(Jaw::teeth_of_adult);
                    let numbers = numbers.filter(|fdi| !listed.contains(fdi) && !jaw.arch.missing.contains(fdi));
                    teeth.extend(self.sound_teeth(scene, numbers, source));
                }
                self.arch(&jaw.arch, "/scene/jaw/arch", own, Some(jaw.tooth.fdi), age)
            }
            file::SceneFile::DentalArch(written) => {
                // A listed tooth can be rotated, but not be missing.
                let own = |fdi, is_missing| is_missing && written.teeth.iter().any(|tooth| tooth.fdi == fdi);
                let arch = self.arch(&written.arch, "/scene/dental_arch/arch", own, None, age);
                teeth.extend(self.unlisted_teeth(scene, written, age));
                arch
            }
            file::SceneFile::Tooth(_) | file::SceneFile::Pair(_) => DentalArches { age, ..DentalArches::default() },
        };
        let with_calculus = teeth.iter().position(|tooth| tooth.as_ref().is_some_and(|t| !t.calculus.is_empty()));
        if let Some(tooth) = with_calculus.filter(|_| pockets.is_none()) {
            let help = "put the tooth into a \"jaw\" with \"periodontium\": {}";
            let message = "calculus is placed in relation to the gingival margin, but there is no gingiva";
            self.complain(&format!("{}/calculus", tooth_path(scene, tooth)), "no-gum", message, help);
        }
        let soft_neighbours = match scene {
            file::SceneFile::Jaw(jaw) => self.soft_neighbours(jaw),
            _ => Vec::new(),
        };
        let rubber_dam = matches!(scene, file::SceneFile::Jaw(jaw) if self.has_rubber_dam(jaw));
        let retractors = matches!(scene, file::SceneFile::Jaw(jaw) if self.has_retractors(jaw));
        let teeth = teeth.into_iter().collect::<Option<_>>()?;
        Some(Scene {
            layout,
            teeth,
            surroundings: around,
            own_jaw,
            rubber_dam,
            retractors,
            pockets,
            arch,
            soft_neighbours,
        })
    }

    /// Returns true if a jaw has a rubber dam, and reports what cannot be under one.
    fn has_rubber_dam(&mut self, jaw: &file::JawFile) -> bool {
        let hidden = [
            (jaw.cheek, "cheek", "it is touched"),
            (jaw.tongue, "tongue", "it is touched"),
            (jaw.other_teeth.is_some(), "other_teeth", "they are examined"),
            (jaw.around.is_some(), "around", "it is touched"),
            (jaw.retractors, "retractors", "they would be seen"),
        ];
        for (_, name, why) in hidden.into_iter().filter(|(is_there, ..)| jaw.rubber_dam && *is_there) {
            let message = format!("a rubber dam would hide \"{name}\", although {why}");
            let help = format!("remove \"rubber_dam\" or \"{name}\"");
            self.complain("/scene/jaw/rubber_dam", "hidden-by-dam", message, &help);
        }
        jaw.rubber_dam
    }

    /// Returns true if a jaw has retractors, and reports them where there are no lips.
    fn has_retractors(&mut self, jaw: &file::JawFile) -> bool {
        if jaw.retractors && jaw.own_jaw {
            let message = "retractors hold lips, and none are drawn around a jaw of one's own";
            self.complain("/scene/jaw/retractors", "no-lips", message, "remove \"retractors\" or \"own_jaw\"");
        }
        jaw.retractors
    }

    /// Returns the cheek and the tongue of a jaw, and reports those that are not beside the tooth or have no tissue.
    fn soft_neighbours(&mut self, jaw: &file::JawFile) -> Vec<SoftNeighbour> {
        let mut found = Vec::new();
        let is_front_tooth = jaw.tooth.fdi % 10 <= 3;
        let is_upper = Jaw::of(jaw.tooth.fdi) == Jaw::Upper;
        let kinds = [
            (jaw.cheek, SoftNeighbour::Cheek, is_front_tooth),
            (jaw.tongue, SoftNeighbour::Tongue, is_front_tooth || is_upper),
        ];
        for (_, kind, is_elsewhere) in kinds.into_iter().filter(|(is_wanted, ..)| *is_wanted) {
            let name = soft_neighbour_tissue(kind);
            let path = format!("/scene/jaw/{name}");
            if is_elsewhere {
                let message = format!("the {name} is not beside tooth {}", jaw.tooth.fdi);
                let help =
                    "the cheek is beside premolars and molars, the tongue beside lower premolars and molars; remove it";
                self.complain(&path, "no-neighbour", message, help);
            }
            if self.tissues.by_name(name).is_none() {
                let message = format!("there is no tissue \"{name}\" in the table of tissues");
                self.complain(&path, "unknown-tissue", message, "add it to the table, with the role \"soft\"");
            }
            found.push(kind);
        }
        found
    }

    /// Returns the sound teeth of an arch that the author did not list, and reports teeth that cannot stand in one arch.
    fn unlisted_teeth(
        &mut self,
        scene: &file::SceneFile,
        written: &file::DentalArchFile,
        age: Option<f32>,
    ) -> Vec<Option<ToothSpec>> {
        let jaw = written.teeth.first().map_or(Jaw::Lower, |tooth| Jaw::of(tooth.fdi));
        let listed: BTreeSet<u8> = written.teeth.iter().map(|tooth| tooth.fdi).collect();
        self.check_listed_teeth(scene, &written.teeth, written.spacing_mm);
        for (index, _) in written.teeth.iter().enumerate().filter(|(_, tooth)| Jaw::of(tooth.fdi) != jaw) {
            let message = "the teeth belong to both jaws";
            let help = "list teeth of one jaw: 11–28 or 31–48";
            self.complain(&format!("{}/fdi", tooth_path(scene, index)), "two-jaws", message, help);
        }
        let numbers = jaw.teeth_of_adult().filter(|fdi| !listed.contains(fdi) && !written.arch.missing.contains(fdi));
        let source = match self.mode {
            ResolveMode::FromRecording => ToothSource::Recorded,
            _ => ToothSource::Procedural { spacing: written.spacing_mm, age },
        };
        self.sound_teeth(scene, numbers, source)
    }

    /// Reports teeth that are listed twice, and generated ones among `made_alike` that have voxels of another size, mm.
    fn check_listed_teeth(&mut self, scene: &file::SceneFile, made_alike: &[file::ToothFile], spacing: f32) {
        let mut listed = BTreeSet::new();
        let teeth = written_teeth(scene);
        let first_alike = teeth.len() - made_alike.len();
        for (index, tooth) in teeth.into_iter().enumerate() {
            let path = tooth_path(scene, index);
            if !listed.insert(tooth.fdi) {
                let message = format!("tooth {} is listed more than once", tooth.fdi);
                self.complain(&format!("{path}/fdi"), "duplicate-tooth", message, "list each tooth once");
            }
            if let file::ToothSourceFile::Procedural(made) = &tooth.form
                && made.spacing_mm != spacing
                && index >= first_alike
            {
                let message =
                    format!("the tooth has voxels of {} mm, the other teeth of {spacing} mm", made.spacing_mm);
                let help = "set both spacing_mm to the same value";
                self.complain(&format!("{path}/form/procedural"), "unequal-spacing", message, help);
            }
        }
    }

    /// Reports what the other teeth of a mouth cannot have, and what a jaw cannot have together with them.
    fn check_other_teeth(&mut self, scene: &file::SceneFile, jaw: &file::JawFile, others: &file::OtherTeethFile) {
        self.check_listed_teeth(scene, &others.teeth, others.spacing_mm);
        let excluded = [("periodontium", jaw.periodontium.is_some()), ("around", jaw.around.is_some())];
        for (key, _) in excluded.into_iter().filter(|(_, is_given)| *is_given) {
            let message = format!("\"{key}\" cannot be combined with \"other_teeth\", which have their own gingiva");
            self.complain(&format!("/scene/jaw/{key}"), "two-gums", message, "remove one of the two");
        }
        for (index, tooth) in others.teeth.iter().enumerate() {
            let path = format!("/scene/jaw/other_teeth/teeth/{index}");
            let parts = [
                ("stains", !tooth.stains.is_empty()),
                ("cavity", tooth.cavity.is_some()),
                ("calculus", !tooth.calculus.is_empty()),
                ("old_fillings", !tooth.old_fillings.is_empty()),
            ];
            for (key, _) in parts.into_iter().filter(|(_, is_given)| *is_given) {
                let message = format!("only the treated tooth can have \"{key}\": the other teeth are examined");
                self.complain(&format!("{path}/{key}"), "only-examined", message, "move it to the treated tooth");
            }
            if !matches!(tooth.form, file::ToothSourceFile::Procedural(_)) {
                let message = "only the treated tooth can come from a scan";
                let help = "use { \"procedural\": { \"spacing_mm\": … } } with the voxel size of the other teeth";
                self.complain(&format!("{path}/form"), "only-examined", message, help);
            }
        }
    }

    /// Returns sound teeth of these numbers, and reports listed ones that have the name of one of them.
    fn sound_teeth(
        &mut self,
        scene: &file::SceneFile,
        numbers: impl Iterator<Item = u8>,
        source: ToothSource,
    ) -> Vec<Option<ToothSpec>> {
        let sound = |fdi: u8| ToothSpec {
            id: fdi.to_string(),
            fdi,
            source: source.clone(),
            decay: Vec::new(),
            stains: Vec::new(),
            cavity: None,
            calculus: Vec::new(),
            fillings: Vec::new(),
        };
        let teeth: Vec<ToothSpec> = numbers.map(sound).collect();
        for (index, tooth) in written_teeth(scene).into_iter().enumerate() {
            if teeth.iter().any(|sound| sound.id == tooth.id) {
                let message = format!("\"{}\" is the name of a tooth that is not listed", tooth.id);
                let path = format!("{}/id", tooth_path(scene, index));
                self.complain(&path, "duplicate-id", message, "name the tooth by its own FDI number");
            }
        }
        teeth.into_iter().map(Some).collect()
    }

    /// `is_own` tells of a number, and of whether it is listed as missing, that it is a tooth of the exercise; `treated`: the number of
    /// the one tooth that is treated.
    fn arch(
        &mut self,
        written: &file::ArchFile,
        place: &str,
        is_own: impl Fn(u8, bool) -> bool,
        treated: Option<u8>,
        age: Option<f32>,
    ) -> DentalArches {
        let missing = written.missing.iter().enumerate();
        let missing = missing.map(|(i, fdi)| (*fdi, true, format!("{place}/missing/{i}")));
        let rotated = written.rotated.iter().enumerate();
        let rotated = rotated.map(|(i, r)| (r.fdi, false, format!("{place}/rotated/{i}/fdi")));
        let mut named = BTreeSet::new();
        for (fdi, is_missing, path) in missing.chain(rotated) {
            if !named.insert(fdi) {
                let help = "list each tooth once, either as missing or as rotated";
                self.complain(&path, "duplicate-tooth", format!("tooth {fdi} is listed more than once"), help);
            } else if typodont_anatomy::teeth::tooth(fdi).is_none() {
                let help = "the FDI number must be one of 11–18, 21–28, 31–38 or 41–48";
                self.complain(&path, "unknown-tooth", format!("there is no tooth {fdi}"), help);
            } else if is_own(fdi, is_missing) {
                let (message, help) = match Some(fdi) != treated {
                    true => ("is listed under \"teeth\" and cannot be missing", "remove it from one of the two lists"),
                    false => ("is the tooth of the exercise", "give one of the surrounding teeth"),
                };
                self.complain(&path, "wrong-tooth", format!("tooth {fdi} {message}"), help);
            }
        }
        let form = |f: file::ArchFormFile| ArchForm { width: f.width_mm, depth: f.depth_mm };
        DentalArches {
            upper: form(written.upper),
            lower: form(written.lower),
            angle_class: written.angle_class,
            missing: written.missing.clone(),
            rotated: written.rotated.iter().map(|r| (r.fdi, r.degrees)).collect(),
            age,
        }
    }

    /// Returns the objects around a tooth. An object that cannot be read is reported and omitted.
    fn obstacles(&mut self, written: &[file::ObstacleFile]) -> Vec<Collider> {
        let mut shapes = Vec::new();
        for (index, obstacle) in written.iter().enumerate() {
            let path = format!("/scene/jaw/around/{index}");
            let label = self.label(&obstacle.tissue, &format!("{path}/tissue"));
            let Some(form) = self.mesh(&obstacle.mesh, &format!("{path}/mesh")) else { continue };
            let position = Vec3::from(obstacle.position_mm.map(|c| c.0));
            let orientation = rotation_about_axes(obstacle.orientation_deg.map(|angle| angle.0));
            shapes.push(Collider { label, tooth_from_collider: Pose { position, orientation }, geometry: form });
        }
        shapes
    }

    /// Reads a mesh and keeps its bytes for the recording.
    fn mesh(&mut self, name: &str, path: &str) -> Option<touch::ColliderGeometry> {
        let open_mesh_error = SolidMeshError::Open { edges: 0 };
        let ending = name.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
        // A recording has the files that the exercise names; a glTF file that names others would lack them.
        let alone = |other: &str| {
            let what =
                format!("its data are in \"{other}\": export it as one file (.glb, or .gltf with embedded data)");
            Err(Diagnostic::about_file(other, "not-embedded", what, None))
        };
        let read = self.library.bytes(name).map_err(|e| (e.code, e.message, e.help)).and_then(|bytes| {
            let mesh = solid_mesh::parse(&bytes, &ending, alone).map_err(describe)?;
            let obstacle = ClosedMesh::new(&mesh).ok_or_else(|| describe(open_mesh_error))?;
            Ok((bytes, obstacle))
        });
        fn describe(error: SolidMeshError) -> (&'static str, String, Option<String>) {
            (error.code(), error.to_string(), Some(error.help().into()))
        }
        match read {
            Ok((bytes, obstacle)) => {
                self.files.insert(name.to_string(), bytes);
                Some(touch::ColliderGeometry::Mesh(Arc::new(obstacle)))
            }
            Err((code, message, help)) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }

    fn tooth(&mut self, written: &file::ToothFile, path: &str, age: Option<f32>) -> Option<ToothSpec> {
        if typodont_anatomy::teeth::tooth(written.fdi).is_none() {
            let message = format!("there is no tooth {}", written.fdi);
            self.complain(
                &format!("{path}/fdi"),
                "unknown-tooth",
                message,
                "the FDI number must be one of 11–18, 21–28, 31–38 or 41–48",
            );
        }
        let form = self.form(&written.form, path, age);
        let decay =
            written.decay.iter().enumerate().map(|(i, d)| self.decay(d, &format!("{path}/decay/{i}"))).collect();
        let stains =
            written.stains.iter().enumerate().map(|(i, s)| self.stain(s, &format!("{path}/stains/{i}"))).collect();
        let cavity = written.cavity.as_ref().map(|c| self.cavity(c, &format!("{path}/cavity")));
        let calculus = written.calculus.iter().enumerate();
        let calculus = calculus.map(|(i, c)| self.calculus(c, &format!("{path}/calculus/{i}"))).collect();
        let fillings = written.old_fillings.iter().enumerate();
        let fillings = fillings.map(|(i, f)| self.old_filling(f, &format!("{path}/old_fillings/{i}"))).collect();
        Some(ToothSpec {
            id: written.id.clone(),
            fdi: written.fdi,
            source: form?,
            decay,
            stains,
            cavity,
            calculus,
            fillings,
        })
    }

    fn form(&mut self, written: &file::ToothSourceFile, path: &str, age: Option<f32>) -> Option<ToothSource> {
        match written {
            _ if self.mode == ResolveMode::FromRecording => Some(ToothSource::Recorded),
            file::ToothSourceFile::Procedural(made) => Some(ToothSource::Procedural { spacing: made.spacing_mm, age }),
            file::ToothSourceFile::Ct(scan) => {
                let path = format!("{path}/form/ct/file");
                let spacing = scan.spacing_mm.map(|s| s.map(|s| s.0));
                let tooth = self
                    .read_scan(&scan.file, &path, |image, tissues| tooth_import::segmented(image, spacing, tissues))?;
                Some(ToothSource::Given(Arc::new(tooth)))
            }
            file::ToothSourceFile::Labels(map) => {
                let numbers = self.numbers(&map.tissues, &format!("{path}/form/labels/tissues"));
                let spacing = map.spacing_mm.map(|s| s.map(|s| s.0));
                let (volume, place) = self.read_scan(&map.file, &format!("{path}/form/labels/file"), |image, _| {
                    Ok((tooth_import::labelled(image, spacing, &numbers)?, image.geometry.clone()))
                })?;
                let grey_values = match &map.scan {
                    Some(scan) => {
                        Some(self.read_scan(scan, &format!("{path}/form/labels/scan"), |image, tissues| {
                            tooth_import::grey_values_of(image, &place, spacing, &volume, tissues.enamel)
                        })?)
                    }
                    None => None,
                };
                Some(ToothSource::Given(Arc::new(ImportedTooth { volume, grey_values })))
            }
        }
    }

    fn read_scan<T>(
        &mut self,
        name: &str,
        path: &str,
        make: impl FnOnce(&typodont_formats::nrrd::VoxelImage, &typodont_anatomy::TissueLabels) -> Result<T, String>,
    ) -> Option<T> {
        let image =
            self.library.bytes(name).map_err(|e| (e.code, e.message, e.help)).and_then(|bytes| {
                typodont_formats::nrrd::parse(&bytes).map_err(|e| ("wrong-volume", e.to_string(), None))
            });
        let tissues = anatomy_tissues(&self.tissues);
        match image.and_then(|image| make(&image, &tissues).map_err(|e| ("wrong-volume", e, None))) {
            Ok(made) => Some(made),
            Err((code, message, help)) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }

    /// Returns the label for each number of a label map.
    fn numbers(&mut self, written: &BTreeMap<String, String>, path: &str) -> BTreeMap<u8, Label> {
        let mut numbers = BTreeMap::new();
        for (number, tissue) in written {
            let at = pointer::child(path, number);
            let label = self.label(tissue, &at);
            match number.parse::<u8>() {
                Ok(number) if number > 0 => {
                    numbers.insert(number, label);
                }
                _ => self.complain(
                    &at,
                    "wrong-number",
                    format!("\"{number}\" is not a valid number of a label map"),
                    "use \"1\" to \"255\"; 0 is air",
                ),
            }
        }
        if numbers.is_empty() {
            self.complain(
                path,
                "no-tissues",
                "no tissue is assigned to any number",
                "{ \"1\": \"enamel\", \"2\": \"dentine\", \"3\": \"pulp\" }",
            );
        }
        numbers
    }

    fn decay(&mut self, written: &file::DecayFile, path: &str) -> Decay {
        let patch =
            WrittenPatch { shape: &written.shape, surface: written.surface, at: written.at, depth: written.depth_mm };
        let place = self.patch_place(&patch, path);
        let mut label = self.tissue_with(&written.tissue, crate::catalog::TissueRole::Decay, &format!("{path}/tissue"));
        let mut shape = self.patch_shape(&patch, path);
        if self.sites.contains(&written.id) {
            label = self.site(written, label, place, &shape, path);
        }
        match (&mut shape, &written.rim) {
            (_, None) => {}
            (DecayShape::Grown(grown), Some(rim)) => {
                let label =
                    self.tissue_with(&rim.tissue, crate::catalog::TissueRole::Decay, &format!("{path}/rim/tissue"));
                grown.rim = Some((label, rim.share));
            }
            (DecayShape::Ellipsoid { .. }, Some(_)) => {
                let message = "a sphere or an ellipsoid cannot have a rim";
                let help = "use \"fissure\" or \"smooth\", or two decay entries, the inner one first";
                self.complain(&format!("{path}/rim"), "no-rim", message, help);
            }
        }
        Decay { id: written.id.clone(), label, shape, surface: written.surface, place }
    }

    /// Returns the label of a possible site of a draw, and reports a site that would give away the draw or that cannot
    /// feel like sound enamel.
    fn site(
        &mut self,
        written: &file::DecayFile,
        decay: Label,
        place: DecayPlace,
        shape: &DecayShape,
        path: &str,
    ) -> Label {
        let is_fixed = !matches!(place, DecayPlace::Random | DecayPlace::RandomQuadrant);
        let has_one_depth = !matches!(shape, DecayShape::Grown(grown) if grown.depths.len() > 1);
        if !is_fixed || !has_one_depth {
            let message = "a possible site of a draw must have a fixed position and depth";
            let help = "give each site its own position, such as { \"quadrant\": 1 }; the draw chooses among the sites";
            self.complain(&format!("{path}/at"), "wrong-place", message, help);
        }
        if written.rim.is_some() {
            let message = "a possible site of a draw cannot have a rim";
            self.complain(&format!("{path}/rim"), "no-rim", message, "remove the rim");
        }
        self.tissues.add_site(decay, &written.id).unwrap_or_else(|| {
            let message = "there are too many possible sites: every number of a tissue is in use";
            self.complain(path, "too-many-sites", message, "remove some of the sites");
            decay
        })
    }

    fn stain(&mut self, written: &file::StainFile, path: &str) -> Decay {
        let patch =
            WrittenPatch { shape: &written.shape, surface: written.surface, at: written.at, depth: written.depth_mm };
        let place = self.patch_place(&patch, path);
        let label = self.tissue_with(&written.tissue, crate::catalog::TissueRole::Sound, &format!("{path}/tissue"));
        let shape = self.patch_shape(&patch, path);
        Decay { id: written.id.clone(), label, shape, surface: written.surface, place }
    }

    fn cavity(&mut self, written: &file::CavityFile, path: &str) -> PreparedCavity {
        let shape = file::DecayShapeFile::Sphere(file::SphereFile { radius_mm: 1.0 });
        let patch = WrittenPatch { shape: &shape, surface: file::SurfaceFile::O, at: written.at, depth: 0.0 };
        let place = self.patch_place(&patch, path);
        if let Some(proximal) = &written.proximal
            && proximal.depth_mm < written.depth_mm
        {
            let message = "the gingival floor of the box is above the floor of the cavity";
            let help = "set depth_mm of the proximal box to at least that of the cavity";
            self.complain(&format!("{path}/proximal/depth_mm"), "shallow-box", message, help);
        }
        let mouth =
            0.5 * written.width_mm.min(written.length_mm) + written.depth_mm * written.walls_deg.to_radians().tan();
        if mouth < NARROWEST {
            let message = "the walls converge so far that the cavity has no opening";
            let help = "make the cavity wider or shallower, or reduce the inclination of the walls (walls_deg)";
            self.complain(&format!("{path}/walls_deg"), "closed-cavity", message, help);
        }
        let proximal = written.proximal.as_ref().map(|p| ProximalBox {
            is_distal: p.side == file::ProximalSide::D,
            width: p.width_mm,
            axial: p.axial_mm,
            depth: p.depth_mm,
        });
        PreparedCavity {
            place,
            length: written.length_mm,
            width: written.width_mm,
            depth: written.depth_mm,
            taper: written.walls_deg.to_radians(),
            corner: written.corner_mm,
            proximal,
        }
    }

    fn calculus(&mut self, written: &file::CalculusFile, path: &str) -> Calculus {
        Calculus {
            id: written.id.clone(),
            label: self.tissue_with(&written.tissue, crate::catalog::TissueRole::Deposit, &format!("{path}/tissue")),
            site: written.site.into(),
            below_margin: written.below_margin_mm,
            thickness: written.thickness_mm,
            width: written.width_mm,
            height: written.height_mm,
        }
    }

    fn old_filling(&mut self, written: &file::FillingFile, path: &str) -> OldFilling {
        OldFilling {
            id: written.id.clone(),
            label: self.tissue_with(&written.tissue, crate::catalog::TissueRole::Material, &format!("{path}/tissue")),
            offset: written.offset_mm.map(|o| o.0),
            size: written.size_mm.map(|s| s.0),
            depth: written.depth_mm,
        }
    }

    fn patch_place(&mut self, patch: &WrittenPatch, path: &str) -> DecayPlace {
        let place = match patch.at {
            file::DecayPlaceFile::Centre => DecayPlace::Centre,
            file::DecayPlaceFile::RandomQuadrant => DecayPlace::RandomQuadrant,
            file::DecayPlaceFile::Random => DecayPlace::Random,
            file::DecayPlaceFile::Quadrant(quadrant) => DecayPlace::Quadrant(quadrant),
            file::DecayPlaceFile::OffsetMm(offset) => DecayPlace::Offset(offset.map(|o| o.0)),
        };
        let by_quadrant = matches!(place, DecayPlace::RandomQuadrant | DecayPlace::Quadrant(_));
        if by_quadrant && patch.surface != file::SurfaceFile::O {
            let message = "quadrants are defined on the occlusal surface only";
            let help = "set \"surface\" to \"O\", or give the position as offset_mm";
            self.complain(&format!("{path}/at"), "wrong-place", message, help);
        }
        place
    }

    fn patch_shape(&mut self, patch: &WrittenPatch, path: &str) -> DecayShape {
        let (entry, reaches, spread) = match patch.shape {
            file::DecayShapeFile::Sphere(sphere) => {
                return DecayShape::Ellipsoid { radii: [sphere.radius_mm; 3], depth: patch.depth };
            }
            file::DecayShapeFile::Ellipsoid(ellipsoid) => {
                return DecayShape::Ellipsoid { radii: ellipsoid.radii_mm.map(|r| r.0), depth: patch.depth };
            }
            file::DecayShapeFile::Fissure(fissure) => {
                if patch.surface != file::SurfaceFile::O {
                    let message = "\"fissure\" is possible on the occlusal surface only";
                    let help = "set \"surface\" to \"O\", or use \"smooth\" for another surface";
                    self.complain(&format!("{path}/surface"), "wrong-place", message, help);
                }
                (DecayOrigin::Fissure { length: fissure.length_mm }, &fissure.reaches, fissure.spread_mm)
            }
            file::DecayShapeFile::Smooth(smooth) => {
                let half = [0.5 * smooth.width_mm, 0.5 * smooth.height_mm];
                (DecayOrigin::Smooth { half }, &smooth.reaches, smooth.spread_mm)
            }
        };
        if patch.depth != 0.0 {
            let help = "remove it: \"reaches\" gives the depth of this shape";
            self.complain(
                &format!("{path}/depth_mm"),
                "two-depths",
                "this shape begins at the surface and does not \
            use depth_mm",
                help,
            );
        }
        let reaches = reaches.iter().copied().map(lesion_depth).collect();
        DecayShape::Grown(GrownDecay { origin: entry, depths: reaches, spread, rim: None })
    }

    /// Returns the label of a tissue, which must have the given role in scoring.
    fn tissue_with(&mut self, name: &str, role: crate::catalog::TissueRole, path: &str) -> Label {
        let label = self.label(name, path);
        if self.tissues.role(label).is_some_and(|own| own != role) {
            let fits = |e: &&crate::catalog::TissueEntry| e.role == role;
            let names: Vec<&str> = self.tissues.entries().iter().filter(fits).map(|e| e.name.as_str()).collect();
            let (role, kind) = match role {
                crate::catalog::TissueRole::Decay => ("decay", "a carious tissue"),
                crate::catalog::TissueRole::Deposit => ("deposit", "a deposit"),
                crate::catalog::TissueRole::Material => ("material", "a filling material"),
                _ => ("sound", "a sound tissue"),
            };
            let help = format!("tissues with the role \"{role}\": {}", names.join(", "));
            self.complain(path, "wrong-tissue", format!("\"{name}\" is not {kind}"), help);
        }
        label
    }
}

/// Returns the pockets as written; omitted sites are healthy for the age (years).
fn pockets(written: &file::PeriodontiumFile, age: Option<f32>) -> Pockets {
    let healthy = age::healthy_pockets(age);
    let filled = |written: [Option<f32>; 6], healthy: [f32; 6]| {
        std::array::from_fn(|site| written[site].unwrap_or(healthy[site]))
    };
    Pockets {
        depth: filled(written.pocket_mm.at_sites(), healthy.depth),
        recession: filled(written.recession_mm.at_sites(), healthy.recession),
    }
}

/// The keys that decay and stains have in common.
struct WrittenPatch<'a> {
    shape: &'a file::DecayShapeFile,
    surface: file::SurfaceFile,
    at: file::DecayPlaceFile,
    depth: f32,
}

fn lesion_depth(written: file::LesionDepthFile) -> LesionDepth {
    match written {
        file::LesionDepthFile::OuterEnamel => LesionDepth::OuterEnamel,
        file::LesionDepthFile::InnerEnamel => LesionDepth::InnerEnamel,
        file::LesionDepthFile::OuterDentine => LesionDepth::OuterDentine,
        file::LesionDepthFile::MiddleDentine => LesionDepth::MiddleDentine,
        file::LesionDepthFile::InnerDentine => LesionDepth::InnerDentine,
    }
}
