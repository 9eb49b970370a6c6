//! The teeth of a scene, their forms and their decay, and what stands around them.

use super::{Forms, Resolver, tooth_path};
use crate::anatomy;
use crate::anatomy::age;
use crate::anatomy::caries::Reach;
use crate::content::{self, pointer};
use crate::frame::{Pose, Quat, Vec3};
use crate::scenario::file;
use crate::scenario::workpiece::anatomy_tissues;
use crate::scenario::{
    Arch, ArchForm, Calculus, Cavity, Decay, DecayPlace, DecayShape, Filling, Form, Grown, GrownEntry, Layout, Pockets,
    Proximal, Scene, Tooth,
};
use crate::touch::{self, Obstacle, Shape};
use crate::volume::{Label, Volume};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Half of the narrowest mouth of a cavity, mm: a carrier brings material in through it.
const NARROWEST: f32 = 0.25;

impl Resolver<'_> {
    /// The age that the mouth is to look, years.
    pub(super) fn age_shown(&mut self, written: &file::ScenarioFile) -> Option<f32> {
        let age = written.patient.as_ref().filter(|patient| patient.shows_age)?.age_years;
        if !(age::LEAST..=age::MOST).contains(&age) {
            let message =
                format!("{age} years is an age that no mouth can be made to look: {} to {}", age::LEAST, age::MOST);
            let help = "leave \"shows_age\" out: the age then only changes how tissues feel";
            self.complain("/patient/age_years", "out-of-range", message, help);
        }
        Some(age)
    }

    pub(super) fn scene(&mut self, written: &file::SceneFile, age: Option<f32>) -> Option<Scene> {
        let (layout, teeth) = match written {
            file::SceneFile::Tooth(tooth) => (Layout::Single, vec![tooth]),
            file::SceneFile::Pair(pair) => (Layout::Pair { gap: pair.gap_mm }, vec![&pair.left, &pair.right]),
            file::SceneFile::Jaw(jaw) => (Layout::Jaw, vec![&jaw.tooth]),
        };
        let paths: Vec<String> = (0..teeth.len()).map(|i| tooth_path(written, i)).collect();
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
        let teeth: Vec<Option<Tooth>> =
            teeth.iter().zip(&paths).map(|(tooth, path)| self.tooth(tooth, path, age)).collect();
        let around = match written {
            file::SceneFile::Jaw(jaw) => jaw.around.as_ref().map(|around| self.obstacles(around)),
            file::SceneFile::Tooth(_) | file::SceneFile::Pair(_) => None,
        };
        let pockets = match written {
            file::SceneFile::Jaw(jaw) => jaw.periodontium.as_ref().map(|gum| pockets(gum, age)),
            file::SceneFile::Tooth(_) | file::SceneFile::Pair(_) => None,
        };
        if pockets.is_some() && around.is_some() {
            let help = "leave \"around\" out: gum with pockets brings its neighbours along";
            let message = "meshes of one's own have no pockets";
            self.complain("/scene/jaw/periodontium", "two-gums", message, help);
        }
        let arch = match written {
            file::SceneFile::Jaw(jaw) => self.arch(&jaw.arch, jaw.tooth.fdi, age),
            file::SceneFile::Tooth(_) | file::SceneFile::Pair(_) => Arch { age, ..Arch::default() },
        };
        let with_calculus = teeth.iter().position(|tooth| tooth.as_ref().is_some_and(|t| !t.calculus.is_empty()));
        if let Some(tooth) = with_calculus.filter(|_| pockets.is_none()) {
            let help = "put the tooth into a \"jaw\" and give that \"periodontium\": {}";
            let message = "calculus is placed by the gum's margin, and there is none";
            self.complain(&format!("{}/calculus", tooth_path(written, tooth)), "no-gum", message, help);
        }
        Some(Scene { layout, teeth: teeth.into_iter().collect::<Option<_>>()?, around, pockets, arch })
    }

    fn arch(&mut self, written: &file::ArchFile, own: u8, age: Option<f32>) -> Arch {
        let missing = written.missing.iter().enumerate().map(|(i, fdi)| (*fdi, format!("/scene/jaw/arch/missing/{i}")));
        let rotated = written.rotated.iter().enumerate();
        let rotated = rotated.map(|(i, r)| (r.fdi, format!("/scene/jaw/arch/rotated/{i}/fdi")));
        let mut named = BTreeSet::new();
        for (fdi, path) in missing.chain(rotated) {
            if !named.insert(fdi) {
                let help = "name each tooth once: it is missing, or it is turned";
                self.complain(&path, "duplicate-tooth", format!("{fdi} was named before"), help);
            } else if anatomy::teeth::tooth(fdi).is_none() {
                let help = "FDI numbers run 11–18, 21–28, 31–38, 41–48";
                self.complain(&path, "unknown-tooth", format!("there is no tooth {fdi}"), help);
            } else if fdi == own {
                let message = format!("{fdi} is the tooth that is worked on");
                self.complain(&path, "wrong-tooth", message, "name one of the teeth around it");
            }
        }
        let form = |f: file::ArchFormFile| ArchForm { width: f.width_mm, depth: f.depth_mm };
        Arch {
            upper: form(written.upper),
            lower: form(written.lower),
            angle_class: written.angle_class,
            missing: written.missing.clone(),
            rotated: written.rotated.iter().map(|r| (r.fdi, r.degrees)).collect(),
            age,
        }
    }

    /// What stands around a tooth; an obstacle that cannot be read is complained about and left out.
    fn obstacles(&mut self, written: &[file::ObstacleFile]) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for (index, obstacle) in written.iter().enumerate() {
            let path = format!("/scene/jaw/around/{index}");
            let label = self.label(&obstacle.tissue, &format!("{path}/tissue"));
            let Some(form) = self.mesh(&obstacle.mesh, &format!("{path}/mesh")) else { continue };
            let position = Vec3::from(obstacle.position_mm.map(|c| c.0));
            let [x, y, z] = obstacle.orientation_deg.map(|a| a.0.to_radians());
            let orientation = Quat::from_rotation_z(z) * Quat::from_rotation_y(y) * Quat::from_rotation_x(x);
            shapes.push(Shape { label, tooth_from_shape: Pose { position, orientation }, form });
        }
        shapes
    }

    /// Reads a mesh, and keeps its bytes for the recording.
    fn mesh(&mut self, name: &str, path: &str) -> Option<touch::Form> {
        let unclosed = content::obj::Unusable::Open { edges: 0 };
        let read = self.library.bytes(name).map_err(|e| (e.code, e.message, e.help)).and_then(|bytes| {
            let mesh = content::obj::parse(&bytes).map_err(told)?;
            let obstacle = Obstacle::new(&mesh).ok_or_else(|| told(unclosed))?;
            Ok((bytes, obstacle))
        });
        fn told(unusable: content::obj::Unusable) -> (&'static str, String, Option<String>) {
            (unusable.code(), unusable.to_string(), Some(unusable.help().into()))
        }
        match read {
            Ok((bytes, obstacle)) => {
                self.files.insert(name.to_string(), bytes);
                Some(touch::Form::Mesh(Arc::new(obstacle)))
            }
            Err((code, message, help)) => {
                self.complain(path, code, format!("\"{name}\": {message}"), help.unwrap_or_default());
                None
            }
        }
    }

    fn tooth(&mut self, written: &file::ToothFile, path: &str, age: Option<f32>) -> Option<Tooth> {
        if anatomy::teeth::tooth(written.fdi).is_none() {
            let message = format!("there is no tooth {}", written.fdi);
            self.complain(
                &format!("{path}/fdi"),
                "unknown-tooth",
                message,
                "FDI numbers run 11–18, 21–28, 31–38, 41–48",
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
        Some(Tooth { id: written.id.clone(), fdi: written.fdi, form: form?, decay, stains, cavity, calculus, fillings })
    }

    fn form(&mut self, written: &file::FormFile, path: &str, age: Option<f32>) -> Option<Form> {
        match written {
            _ if self.forms == Forms::Recorded => Some(Form::Recorded),
            file::FormFile::Procedural(made) => Some(Form::Procedural { spacing: made.spacing_mm, age }),
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
            let at = pointer::under(path, number);
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
        let patch = Patch { shape: &written.shape, surface: written.surface, at: written.at, depth: written.depth_mm };
        let place = self.patch_place(&patch, path);
        let label = self.tissue_with(&written.tissue, content::Role::Decay, &format!("{path}/tissue"));
        let mut shape = self.patch_shape(&patch, path);
        match (&mut shape, &written.rim) {
            (_, None) => {}
            (DecayShape::Grown(grown), Some(rim)) => {
                let label = self.tissue_with(&rim.tissue, content::Role::Decay, &format!("{path}/rim/tissue"));
                grown.rim = Some((label, rim.share));
            }
            (DecayShape::Ellipsoid { .. }, Some(_)) => {
                let message = "a sphere or an ellipsoid has no rim of its own";
                let help = "take \"fissure\" or \"smooth\", or write two decays, the inner one first";
                self.complain(&format!("{path}/rim"), "no-rim", message, help);
            }
        }
        Decay { id: written.id.clone(), label, shape, surface: written.surface, place }
    }

    fn stain(&mut self, written: &file::StainFile, path: &str) -> Decay {
        let patch = Patch { shape: &written.shape, surface: written.surface, at: written.at, depth: written.depth_mm };
        let place = self.patch_place(&patch, path);
        let label = self.tissue_with(&written.tissue, content::Role::Sound, &format!("{path}/tissue"));
        let shape = self.patch_shape(&patch, path);
        Decay { id: written.id.clone(), label, shape, surface: written.surface, place }
    }

    fn cavity(&mut self, written: &file::CavityFile, path: &str) -> Cavity {
        let shape = file::DecayShapeFile::Sphere(file::SphereFile { radius_mm: 1.0 });
        let patch = Patch { shape: &shape, surface: file::SurfaceFile::O, at: written.at, depth: 0.0 };
        let place = self.patch_place(&patch, path);
        if let Some(proximal) = &written.proximal
            && proximal.depth_mm < written.depth_mm
        {
            let message = "the gingival floor lies above the cavity's own";
            let help = "give the proximal box more depth_mm than the cavity has";
            self.complain(&format!("{path}/proximal/depth_mm"), "shallow-box", message, help);
        }
        let mouth =
            0.5 * written.width_mm.min(written.length_mm) + written.depth_mm * written.walls_deg.to_radians().tan();
        if mouth < NARROWEST {
            let message = "the walls lean together so far that the cavity has no mouth";
            let help = "make it wider or less deep, or let the walls lean less (walls_deg)";
            self.complain(&format!("{path}/walls_deg"), "closed-cavity", message, help);
        }
        let proximal = written.proximal.as_ref().map(|p| Proximal {
            is_distal: p.side == file::ProximalSide::D,
            width: p.width_mm,
            axial: p.axial_mm,
            depth: p.depth_mm,
        });
        Cavity {
            place,
            length: written.length_mm,
            width: written.width_mm,
            depth: written.depth_mm,
            lean: written.walls_deg.to_radians(),
            corner: written.corner_mm,
            proximal,
        }
    }

    fn calculus(&mut self, written: &file::CalculusFile, path: &str) -> Calculus {
        Calculus {
            id: written.id.clone(),
            label: self.tissue_with(&written.tissue, content::Role::Deposit, &format!("{path}/tissue")),
            site: written.site.into(),
            below_margin: written.below_margin_mm,
            thickness: written.thickness_mm,
            width: written.width_mm,
            height: written.height_mm,
        }
    }

    fn old_filling(&mut self, written: &file::FillingFile, path: &str) -> Filling {
        Filling {
            id: written.id.clone(),
            label: self.tissue_with(&written.tissue, content::Role::Material, &format!("{path}/tissue")),
            offset: written.offset_mm.map(|o| o.0),
            size: written.size_mm.map(|s| s.0),
            depth: written.depth_mm,
        }
    }

    fn patch_place(&mut self, patch: &Patch, path: &str) -> DecayPlace {
        let place = match patch.at {
            file::DecayPlaceFile::Centre => DecayPlace::Centre,
            file::DecayPlaceFile::RandomQuadrant => DecayPlace::RandomQuadrant,
            file::DecayPlaceFile::Random => DecayPlace::Random,
            file::DecayPlaceFile::Quadrant(quadrant) => DecayPlace::Quadrant(quadrant),
            file::DecayPlaceFile::OffsetMm(offset) => DecayPlace::Offset(offset.map(|o| o.0)),
        };
        let by_quadrant = matches!(place, DecayPlace::RandomQuadrant | DecayPlace::Quadrant(_));
        if by_quadrant && patch.surface != file::SurfaceFile::O {
            let message = "quadrants are counted on the occlusal surface only";
            let help = "set surface to \"O\", or place it with offset_mm";
            self.complain(&format!("{path}/at"), "wrong-place", message, help);
        }
        place
    }

    fn patch_shape(&mut self, patch: &Patch, path: &str) -> DecayShape {
        let (entry, reaches, spread) = match patch.shape {
            file::DecayShapeFile::Sphere(sphere) => {
                return DecayShape::Ellipsoid { radii: [sphere.radius_mm; 3], depth: patch.depth };
            }
            file::DecayShapeFile::Ellipsoid(ellipsoid) => {
                return DecayShape::Ellipsoid { radii: ellipsoid.radii_mm.map(|r| r.0), depth: patch.depth };
            }
            file::DecayShapeFile::Fissure(fissure) => {
                if patch.surface != file::SurfaceFile::O {
                    let message = "grooves are looked for in the chewing surface only";
                    let help = "set surface to \"O\", or take \"smooth\" for another surface";
                    self.complain(&format!("{path}/surface"), "wrong-place", message, help);
                }
                (GrownEntry::Fissure { length: fissure.length_mm }, &fissure.reaches, fissure.spread_mm)
            }
            file::DecayShapeFile::Smooth(smooth) => {
                let half = [0.5 * smooth.width_mm, 0.5 * smooth.height_mm];
                (GrownEntry::Smooth { half }, &smooth.reaches, smooth.spread_mm)
            }
        };
        if patch.depth != 0.0 {
            let help = "leave it out: \"reaches\" says how deep it has come";
            self.complain(&format!("{path}/depth_mm"), "two-depths", "this shape begins at the surface", help);
        }
        let reaches = reaches.iter().copied().map(reach_of).collect();
        DecayShape::Grown(Grown { entry, reaches, spread, rim: None })
    }

    /// The label of a tissue that must mean something to the score.
    fn tissue_with(&mut self, name: &str, role: content::Role, path: &str) -> Label {
        let label = self.label(name, path);
        if self.tissues.role(label).is_some_and(|own| own != role) {
            let fits = |e: &&content::TissueEntry| e.role == role;
            let names: Vec<&str> = self.tissues.entries().iter().filter(fits).map(|e| e.name.as_str()).collect();
            let (role, kind) = match role {
                content::Role::Decay => ("decay", "a kind of decay"),
                content::Role::Deposit => ("deposit", "a deposit"),
                content::Role::Material => ("material", "a filling material"),
                _ => ("sound", "a sound tissue"),
            };
            let help = format!("tissues with the role \"{role}\": {}", names.join(", "));
            self.complain(path, "wrong-tissue", format!("\"{name}\" is not {kind}"), help);
        }
        label
    }
}

/// Gum as it is written; what is left out is healthy, at an age in years.
fn pockets(written: &file::PeriodontiumFile, age: Option<f32>) -> Pockets {
    let healthy = age::healthy(age);
    let filled = |written: [Option<f32>; 6], healthy: [f32; 6]| {
        std::array::from_fn(|site| written[site].unwrap_or(healthy[site]))
    };
    Pockets {
        depth: filled(written.pocket_mm.at_sites(), healthy.depth),
        recession: filled(written.recession_mm.at_sites(), healthy.recession),
    }
}

/// What decay and stains have in common.
struct Patch<'a> {
    shape: &'a file::DecayShapeFile,
    surface: file::SurfaceFile,
    at: file::DecayPlaceFile,
    depth: f32,
}

fn reach_of(written: file::ReachFile) -> Reach {
    match written {
        file::ReachFile::OuterEnamel => Reach::OuterEnamel,
        file::ReachFile::InnerEnamel => Reach::InnerEnamel,
        file::ReachFile::OuterDentine => Reach::OuterDentine,
        file::ReachFile::MiddleDentine => Reach::MiddleDentine,
        file::ReachFile::InnerDentine => Reach::InnerDentine,
    }
}
