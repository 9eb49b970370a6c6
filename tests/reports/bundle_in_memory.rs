//! Bundles in memory and as one ZIP file.

use crate::support::bundle::{complained, told, typodont};
use crate::support::coarse_exercise::coarse_text;
use crate::support::folder::folder;
use crate::support::tools;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use typodont_core::device::DeviceSpec;
use typodont_exercise::scenario;
use typodont_exercise::scenario::ResolveMode;
use typodont_exercise::session::OperatorFile;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_lesson::{SessionConfig, SessionSeed};
use typodont_report::bundle::{self, BundleFolder, VerificationOutcome};
use typodont_report::{SessionFile, Templates, VerificationStatus, Verifier};

/// A finished session of the careful operator; `out` is `None` for a bundle in memory. The exercise comes
/// from memory.
fn finished(out: Option<&Path>) -> BundleFolder {
    // Large voxels: what is compared does not depend on their size.
    let text = coarse_text("5-grinding", 0.2);
    let library = Library::shipped();
    let scenario =
        scenario::resolve(SourceText::new("5-grinding.json", &text), &library, ResolveMode::MakeWorkpiece).unwrap();
    let operator = OperatorFile::read(&library, "careful").unwrap();
    let config = SessionConfig {
        scenario: Arc::new(scenario),
        seed: SessionSeed::given(7),
        participant: "anna",
        out,
        digests: BTreeMap::new(),
        templates: Templates::shipped(),
        started: "2026-01-02T03:04:05Z".parse().unwrap(),
    };
    let workpiece = config.make_workpiece().unwrap();
    let prepared = config.prepare(workpiece, DeviceSpec::phantom_omni(), Some(&operator)).unwrap();
    prepared.run_script(operator).unwrap().complete(&mut |_| ()).unwrap()
}

fn outcome(bundle: &BundleFolder) -> VerificationOutcome {
    bundle::verify(bundle, &[Templates::shipped()]).unwrap().outcome()
}

#[test]
fn a_bundle_made_in_memory_is_the_one_made_on_disk() {
    // Aim: where there is no disk, as in a browser, a session gives the same proof. Method: one session twice, on disk and in
    // memory; the second as a ZIP file, verified as it is and unpacked by Python.
    let out = folder("bundle_in_memory");
    let (on_disk, in_memory) = (finished(Some(&out)), finished(None));
    assert!(matches!(&in_memory, BundleFolder::InMemory { .. }));
    assert_eq!((in_memory.name(), in_memory.names()), (on_disk.name(), on_disk.names()));
    for name in on_disk.names() {
        assert!(in_memory.read(&name) == on_disk.read(&name), "{name} differs");
    }
    assert_eq!(outcome(&in_memory), VerificationOutcome::Verified);
    let session =
        SessionFile::from_json(std::str::from_utf8(&in_memory.read("session.json").unwrap()).unwrap()).unwrap();
    assert_eq!(Verifier::new(&Templates::shipped()).verify(&in_memory, &session), VerificationStatus::Verified);

    let zip = out.join("handed-in.zip");
    fs::write(&zip, in_memory.to_zip().unwrap()).unwrap();
    let verified = typodont(&["verify", zip.to_str().unwrap()]);
    assert!(verified.status.success(), "{}", complained(&verified));
    assert!(told(&verified).contains("handed-in.zip: verified"), "{}", told(&verified));
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python") else { return };
    let unpacked = out.join("unpacked");
    let python = Command::new(python).args(["-m", "zipfile", "-e"]).args([&zip, &unpacked]).status().unwrap();
    assert!(python.success());
    assert_eq!(outcome(&BundleFolder::on_disk(unpacked.join(&*in_memory.name()))), VerificationOutcome::Verified);
}

#[test]
fn a_changed_bundle_in_memory_is_noticed() {
    type Files = BTreeMap<String, Vec<u8>>;
    let BundleFolder::InMemory { name, files } = finished(None) else { panic!("it is in memory") };
    let changed = |change: &dyn Fn(&mut Files)| {
        let mut files = files.clone();
        change(&mut files);
        let verification =
            bundle::verify(&BundleFolder::InMemory { name: name.clone(), files }, &[Templates::shipped()]);
        verification.unwrap().complaints.join("\n")
    };
    assert_eq!(changed(&|_| ()), "");
    let found = changed(&|files| files.get_mut("report.html").unwrap().push(b' '));
    assert!(found.contains("report.html: the file differs"), "{found}");
    let found = changed(&|files| drop(files.remove("views/front.png").or_else(|| files.remove("performance.glb"))));
    assert!(found.contains("there is no file of this name"), "{found}");
    let found = changed(&|files| drop(files.insert("views/mine.png".into(), Vec::new())));
    assert!(found.contains("views/mine.png: this file is not part of a bundle"), "{found}");
}

#[test]
fn a_zip_that_is_no_bundle_is_refused_with_a_reason() {
    let zip = folder("no_bundle_zip").join("notes.ZIP");
    fs::write(&zip, b"PK, but no archive").unwrap();
    let refused = typodont(&["verify", zip.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(1));
    assert!(complained(&refused).contains("notes.ZIP: wrong-zip: this is not a readable ZIP archive"));
}
