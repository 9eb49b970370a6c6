//! Packages of exercises for learning platforms: SCORM 1.2, SCORM 2004 (4th edition) and cmi5 (Quartz).
//!
//! Takes exercises and the files of the web page. Gives the files of one archive: the page, the exercises, the
//! standard's manifest, and a launch page that runs an exercise in a frame and reports its result to the platform.
//! Never reads a file.
//!
//! No manifest contains a mastery score: a platform would compare it with the points and could pass a session with a
//! critical error. The launch page reports the program's own judgement.

mod cmi5;
mod scorm;
mod xml;

use crate::gradebook::{AttemptPolicy, CriticalErrorPolicy};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;

/// Standard by which a learning platform and a package talk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PackageStandard {
    Scorm12,
    Scorm2004,
    Cmi5,
}

/// Course of one package.
#[derive(Clone, Debug)]
pub struct Course {
    pub title: String,
    pub exercises: Vec<CourseExercise>,
    pub critical: CriticalErrorPolicy,
    pub take: AttemptPolicy,
}

/// Exercise of a course.
#[derive(Clone, Debug)]
pub struct CourseExercise {
    pub id: String,
    /// Titles by language code; the first one stands where a standard takes one title only.
    pub titles: Vec<(String, String)>,
    pub summary: String,
    /// Name of the scenario file.
    pub name: String,
    /// The scenario file and the files that it names, by name.
    pub files: BTreeMap<String, Vec<u8>>,
    /// True if the exercise has a rubric, so that it can be passed or not.
    pub is_graded: bool,
}

impl CourseExercise {
    /// Path of the scenario file below the page.
    fn address(&self) -> String {
        format!("exercises/{}", self.name)
    }

    fn title(&self) -> &str {
        self.titles.first().map_or(self.id.as_str(), |(_, title)| title)
    }
}

/// Files that every package contains beside the page and the exercises.
const LAUNCH_FILES: &[(&str, &str)] = &[
    ("launch.html", include_str!("launch.html")),
    ("launch.css", include_str!("launch.css")),
    ("launch.js", include_str!("launch.js")),
    ("result.js", include_str!("result.js")),
    ("scorm.js", include_str!("scorm.js")),
    ("cmi5.js", include_str!("cmi5.js")),
];

/// Folder of the page within a package.
const PAGE_FOLDER: &str = "page";

impl Course {
    /// Files of the package, by name. `page` holds the files of the web page, by their path below its folder.
    ///
    /// # Errors
    ///
    /// When two exercises name different files alike.
    pub fn package(
        &self,
        standard: PackageStandard,
        page: &BTreeMap<String, Vec<u8>>,
    ) -> Result<BTreeMap<String, Vec<u8>>, String> {
        let mut files: BTreeMap<String, Vec<u8>> =
            LAUNCH_FILES.iter().map(|(name, text)| (name.to_string(), text.as_bytes().to_vec())).collect();
        files.extend(page.iter().map(|(name, bytes)| (format!("{PAGE_FOLDER}/{name}"), bytes.clone())));
        for exercise in &self.exercises {
            for (name, bytes) in &exercise.files {
                let path = format!("{PAGE_FOLDER}/exercises/{name}");
                if files.get(&path).is_some_and(|other| other != bytes) {
                    return Err(format!("two exercises have different files of the name \"{name}\""));
                }
                files.insert(path, bytes.clone());
            }
        }
        files.insert("course.json".into(), self.settings(standard).into_bytes());
        let names: Vec<String> = files.keys().cloned().collect();
        let (name, manifest) = match standard {
            PackageStandard::Scorm12 | PackageStandard::Scorm2004 => {
                ("imsmanifest.xml", scorm::manifest(self, standard, &names))
            }
            PackageStandard::Cmi5 => ("cmi5.xml", cmi5::course_structure(self)),
        };
        files.insert(name.into(), manifest.into_bytes());
        Ok(files)
    }

    /// Settings of the course, for the launch page.
    fn settings(&self, standard: PackageStandard) -> String {
        let standard = match standard {
            PackageStandard::Scorm12 => "1.2",
            PackageStandard::Scorm2004 => "2004",
            PackageStandard::Cmi5 => "cmi5",
        };
        let critical = match self.critical {
            CriticalErrorPolicy::Keep => "keep",
            CriticalErrorPolicy::Cap => "cap",
            CriticalErrorPolicy::Zero => "zero",
        };
        let take = match self.take {
            AttemptPolicy::Last => "last",
            AttemptPolicy::Best => "best",
            AttemptPolicy::First => "first",
        };
        let exercises: Vec<_> =
            self.exercises.iter().map(|e| json!({ "id": e.id, "title": e.title(), "file": e.address() })).collect();
        let settings =
            json!({ "version": 1, "standard": standard, "critical": critical, "take": take, "exercises": exercises });
        format!("{settings:#}\n")
    }

    /// Identifier that changes with the content of any exercise, hexadecimal.
    fn digest(&self) -> String {
        let mut hash = Sha256::new();
        for exercise in &self.exercises {
            for (name, bytes) in &exercise.files {
                hash.update((name.len() as u64).to_le_bytes());
                hash.update(name.as_bytes());
                hash.update((bytes.len() as u64).to_le_bytes());
                hash.update(bytes);
            }
        }
        hash.finalize().iter().take(16).fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
    }

    /// Address by which a platform launches an exercise, relative to the package.
    fn launch_address(index: usize) -> String {
        format!("launch.html?exercise={index}")
    }
}
