//! Files across the border: SimpleITK and slicerio read what we write, and we read what they write.
//!
//! Needs a Python with both, named by the environment variable `TYPODONT_PYTHON`.

use crate::support::folder;

use folder::folder;
use glam::DVec3;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;
use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation;
use typodont_formats::nrrd::segmentation::{NamedSegment, Segmentation};
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};

/// A Python with the modules that the script imports; without one the test prints SKIPPED.
struct Python(std::ffi::OsString);

impl Python {
    fn find() -> Option<Python> {
        crate::support::tools::named_by("TYPODONT_PYTHON", "a Python with SimpleITK and slicerio").map(Python)
    }

    fn run(&self, arguments: &[&Path]) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_nrrd.py");
        let output = Command::new(&self.0).arg(script).args(arguments).output();
        let output = output.unwrap_or_else(|error| panic!("TYPODONT_PYTHON={} — {error}", self.0.display()));
        let [told, complained] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        assert!(output.status.success(), "{arguments:?}\n{told}{complained}");
    }
}

fn geometry(steps: [DVec3; 3]) -> Geometry {
    Geometry {
        dims: [7, 6, 5],
        steps,
        origin: DVec3::new(-12.5, 7.25, 1000.125),
        space: CoordinateSystem::LeftPosteriorSuperior,
    }
}

fn straight() -> Geometry {
    geometry([DVec3::X * 0.2, DVec3::Y * 0.25, DVec3::Z * 0.4])
}

fn turned() -> Geometry {
    geometry([DVec3::Y * -0.2, DVec3::Z * 0.25, DVec3::X * 0.4])
}

fn described(geometry: &Geometry) -> Value {
    let corners = [[0, 0, 0], [6, 0, 0], [0, 5, 0], [0, 0, 4], [6, 5, 4]];
    let positions: Vec<_> = corners.map(|voxel| json!([voxel, geometry.position(voxel).to_array()])).into();
    json!({
        "size": geometry.dims,
        "spacing": geometry.spacing().to_array(),
        "origin": geometry.origin.to_array(),
        "positions": positions,
    })
}

#[test]
fn simple_itk_reads_the_volumes_we_write() {
    let Some(python) = Python::find() else { return };
    let folder = folder("python_images");
    let count = straight().len() as u16;
    let samples = [
        ("uint8", Samples::U8((0..count).map(|i| i as u8).collect())),
        ("int16", Samples::I16((0..count).map(|i| (i as i16 - 105) * 300).collect())),
        ("uint16", Samples::U16((0..count).map(|i| i * 300).collect())),
        ("float", Samples::F32((0..count).map(|i| f32::from(i) * -0.125).collect())),
    ];
    for (name, samples) in samples {
        for (geometry, encoding) in [(straight(), Encoding::Raw), (turned(), Encoding::Gzip)] {
            let keys = vec![("remark".to_string(), "a \\ and\na line: b".to_string())];
            let image = VoxelImage { geometry, samples: samples.clone(), keys };
            let (file, expected) = (folder.join(format!("{name}_{encoding:?}.nrrd")), folder.join("expected.json"));
            std::fs::write(&file, nrrd::bytes(&image, encoding).unwrap()).unwrap();
            let mut told = described(&image.geometry);
            told["type"] = name.into();
            told["crc32"] = crc32(&image).into();
            told["keys"] = image
                .keys
                .iter()
                .cloned()
                .map(|(key, value)| (key, Value::from(value)))
                .collect::<serde_json::Map<_, _>>()
                .into();
            std::fs::write(&expected, told.to_string()).unwrap();
            python.run(&[Path::new("image"), &file, &expected]);
        }
    }
}

/// Of the samples in native order, as gzip and Python's zlib have it.
fn crc32(image: &VoxelImage) -> u32 {
    let bytes: Vec<u8> = match &image.samples {
        Samples::U8(samples) => samples.clone(),
        Samples::I16(samples) => samples.iter().flat_map(|v| v.to_ne_bytes()).collect(),
        Samples::U16(samples) => samples.iter().flat_map(|v| v.to_ne_bytes()).collect(),
        Samples::F32(samples) => samples.iter().flat_map(|v| v.to_ne_bytes()).collect(),
    };
    let mut crc = flate2::Crc::new();
    crc.update(&bytes);
    crc.sum()
}

#[test]
fn slicerio_reads_the_segmentations_we_write() {
    let Some(python) = Python::find() else { return };
    let folder = folder("python_segmentations");
    let segment = |id: &str, name: &str, label_value, color| NamedSegment {
        id: id.into(),
        name: name.into(),
        label_value,
        color,
    };
    let segments = vec![
        // The first is empty, and the second smaller than the third: Slicer would lose some if extents were each one's own.
        segment("caries", "Caries", 9, [0.3, 0.2, 0.1]),
        segment("pulp", "Pulp chamber: roof | floor", 200, [0.9, 0.3, 0.3]),
        segment("enamel", "Enamel", 1, [0.95, 0.95, 0.9]),
    ];
    for (name, geometry) in [("straight", straight()), ("turned", turned())] {
        let mut labels = vec![0; geometry.len()];
        labels[10..100].fill(1);
        labels[50..60].fill(200);
        let segmentation = Segmentation { geometry, labels, segments: segments.clone() };
        let (file, expected) = (folder.join(format!("{name}.seg.nrrd")), folder.join("expected.json"));
        std::fs::write(&file, segmentation::bytes(&segmentation).unwrap()).unwrap();
        let mut told = described(&segmentation.geometry);
        let table = segmentation.segments.iter().map(|NamedSegment { id, name, label_value, color }| {
            let voxels = segmentation.count(*label_value);
            json!({"id": id, "name": name, "label_value": label_value, "color": color, "voxels": voxels})
        });
        told["segments"] = table.collect();
        std::fs::write(&expected, told.to_string()).unwrap();
        python.run(&[Path::new("segmentation"), &file, &expected]);
    }
}

#[test]
fn we_read_what_simple_itk_and_slicerio_write() {
    let Some(python) = Python::find() else { return };
    let folder = folder("python_writes");
    python.run(&[Path::new("write"), &folder]);
    let index: Value = serde_json::from_slice(&std::fs::read(folder.join("index.json")).unwrap()).unwrap();
    let numbers = |value: &Value| value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<f64>>();
    let is_near = |position: DVec3, corner: &Value| position.distance(DVec3::from_slice(&numbers(corner))) < 1e-9;

    let images = index["images"].as_array().unwrap();
    assert!(images.len() >= 48);
    for told in images {
        let path = folder.join(told["file"].as_str().unwrap());
        let image = nrrd::read(&path).unwrap_or_else(|error| panic!("{error}"));
        let samples: Vec<f64> = match &image.samples {
            Samples::U8(samples) => samples.iter().map(|&v| v.into()).collect(),
            Samples::I16(samples) => samples.iter().map(|&v| v.into()).collect(),
            Samples::U16(samples) => samples.iter().map(|&v| v.into()).collect(),
            Samples::F32(samples) => samples.iter().map(|&v| v.into()).collect(),
        };
        assert_eq!(samples, numbers(&told["samples"]), "{}", path.display());
        assert!(is_near(image.geometry.position([4, 5, 6]), &told["corner"]), "{}", path.display());
        assert_eq!(image.key("scanner"), Some("cone beam\\CT"), "{}", path.display());
    }

    for told in index["segmentations"].as_array().unwrap() {
        let path = folder.join(told["file"].as_str().unwrap());
        let found = segmentation::read(&path).unwrap_or_else(|error| panic!("{error}"));
        assert!(is_near(found.geometry.position([6, 7, 8]), &told["corner"]), "{:?}", found.geometry);
        let counts: Vec<f64> = found.segments.iter().map(|s| found.count(s.label_value) as f64).collect();
        assert_eq!(counts, numbers(&told["counts"]));
        for (is, should) in found.segments.iter().zip(told["segments"].as_array().unwrap()) {
            assert_eq!(
                (is.id.as_str(), is.name.as_str()),
                (should["id"].as_str().unwrap(), should["name"].as_str().unwrap())
            );
            assert_eq!(is.color.map(|v| v.to_string()), [0, 1, 2].map(|i| should["color"][i].to_string()));
        }
    }
}
