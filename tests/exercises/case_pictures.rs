//! Photographs and radiographs of a case.

use crate::support::bundle;
use crate::support::folder;

use bundle::{complained, program, told};
use folder::folder;
use image::{DynamicImage, ImageFormat, RgbImage};
use serde_json::{Value, json};
use std::io::Cursor;
use std::path::Path;
use std::process::Command;
use typodont_exercise::record::Recording;
use typodont_exercise::scenario::{self, ResolveMode};
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;

/// Exercise 5 in coarse voxels, with pictures.
fn exercise(pictures: Value) -> String {
    let text = std::fs::read_to_string("scenarios/5-grinding.json").unwrap();
    let mut exercise: Value =
        serde_json::from_str(&text.replace("\"spacing_mm\": 0.1", "\"spacing_mm\": 0.25")).unwrap();
    exercise.as_object_mut().unwrap().remove("$schema");
    exercise["pictures"] = pictures;
    exercise.to_string()
}

fn encoded(format: ImageFormat) -> Vec<u8> {
    let picture = DynamicImage::from(RgbImage::from_fn(320, 200, |x, y| image::Rgb([x as u8, y as u8, 128])));
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

#[test]
fn a_file_that_is_no_picture_gets_one_complaint() {
    let cut = |format| encoded(format)[..300].to_vec();
    let cases = [
        ("bitewing.jpg", encoded(ImageFormat::Jpeg), None),
        ("bitewing.tif", encoded(ImageFormat::Tiff), None),
        ("bitewing.png", encoded(ImageFormat::Png), None),
        ("notes.jpg", b"A caries in 36".to_vec(), Some("unknown-format")),
        ("cut.jpg", cut(ImageFormat::Jpeg), Some("damaged-picture")),
        ("cut.png", cut(ImageFormat::Png), Some("damaged-picture")),
        ("huge.tif", vec![0; 13 << 20], Some("too-large")),
        ("../bitewing.jpg", Vec::new(), Some("outside-folder")),
        ("missing.jpg", Vec::new(), Some("missing-file")),
        ("scenario.json", encoded(ImageFormat::Png), Some("reserved-name")),
    ];
    for (name, bytes, code) in cases {
        let mut library = Library::shipped();
        if !bytes.is_empty() {
            library.insert(name, bytes);
        }
        let text = exercise(json!([{ "file": name, "title": "Bite-wing" }]));
        let resolved = scenario::resolve(SourceText::new("exercise.json", text), &library, ResolveMode::MakeWorkpiece);
        let complaints: Vec<_> = resolved.err().unwrap_or_default().into_iter().map(|found| found.code).collect();
        assert_eq!(complaints, Vec::from_iter(code), "{name}");
    }
}

#[test]
fn a_picture_is_part_of_the_recording() {
    // Aim: a session is proved without the folder of its exercise, pictures included, and the picture takes no part in it.
    let out = folder("case_pictures");
    std::fs::write(out.join("bitewing.jpg"), encoded(ImageFormat::Jpeg)).unwrap();
    let title = json!({ "en": "Bite-wing of 36", "tr": "36 numaralı dişin bite-wing grafisi" });
    let pictures = json!([{ "file": "bitewing.jpg", "title": title }]);
    for (name, pictures) in [("with.json", pictures), ("without.json", json!([]))] {
        std::fs::write(out.join(name), exercise(pictures)).unwrap();
    }
    let run = |name: &str, out: &Path| {
        let mut command = Command::new(program());
        command.args([
            "run",
            name,
            "--headless",
            "--operator",
            "hasty",
            "--seed",
            "1",
            "--out",
            name.trim_end_matches(".json"),
        ]);
        let output = command.current_dir(out).output().unwrap();
        assert!(output.status.success(), "{}", complained(&output));
        out.join(told(&output).lines().last().unwrap())
    };
    let [with, without] = ["with.json", "without.json"].map(|name| run(name, &out));
    std::fs::remove_file(out.join("bitewing.jpg")).unwrap();
    let verified = Command::new(program()).arg("verify").arg(&with).output().unwrap();
    assert!(verified.status.success(), "{}{}", told(&verified), complained(&verified));
    let recording = Recording::read(&with.join("recording.mcap")).unwrap();
    assert_eq!(recording.scenario.pictures[0].title, "Bite-wing of 36");
    assert_eq!(recording.scenario.files["bitewing.jpg"][..], encoded(ImageFormat::Jpeg));
    let points = |bundle: &Path| -> Value {
        let session: Value = serde_json::from_slice(&std::fs::read(bundle.join("session.json")).unwrap()).unwrap();
        session["score"].clone()
    };
    assert_eq!(points(&with), points(&without));
}
