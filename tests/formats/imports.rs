//! Scans and surfaces in the formats that schools use: read at their positions in space, voxel by voxel.

use crate::support::folder;
use crate::support::import_files;
use crate::support::shared_data;

use folder::folder;
use glam::DVec3;
use import_files::*;
use shared_data::find;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use typodont_anatomy::TissueLabels;
use typodont_core::frame::Vec3;
use typodont_core::volume::{Density, Label, Volume, Voxel};
use typodont_exercise::scenario::{self, ResolveMode, ToothSource};
use typodont_exercise::tooth_import;
use typodont_formats::Library;
use typodont_formats::diagnostic::SourceText;
use typodont_formats::imaging;
use typodont_formats::imaging::{ReadOptions, metaimage, nifti, raw};
use typodont_formats::import::voxelize;
use typodont_formats::import::voxelize::TissueSurface;
use typodont_formats::nrrd;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};
use typodont_formats::surfaces;

const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

fn values(image: &VoxelImage) -> Vec<f32> {
    match &image.samples {
        Samples::U8(all) => all.iter().map(|&v| v.into()).collect(),
        Samples::I16(all) => all.iter().map(|&v| v.into()).collect(),
        Samples::U16(all) => all.iter().map(|&v| v.into()).collect(),
        Samples::F32(all) => all.clone(),
    }
}

fn counted() -> Vec<f32> {
    (0..24).map(|n| n as f32).collect()
}

#[test]
fn nifti_is_read_as_it_lies_in_space() {
    // Aim: right-anterior-superior becomes left-posterior-superior, by `sform` or `qform`, whatever else the header holds.
    let check = |nifti: &Nifti, steps: [DVec3; 3], origin: DVec3| {
        for bytes in [nifti.bytes(), gzip(&nifti.bytes())] {
            let image = nifti::parse(&bytes).unwrap();
            assert_eq!(
                (image.geometry.dims, image.geometry.space),
                ([4, 3, 2], CoordinateSystem::LeftPosteriorSuperior)
            );
            for (found, expected) in image.geometry.steps.into_iter().zip(steps) {
                assert!(found.distance(expected) < 1e-6, "{found} for {expected}");
            }
            assert!(image.geometry.origin.distance(origin) < 1e-6);
            assert_eq!(values(&image), counted());
        }
    };
    let steps = [DVec3::X * 0.5, DVec3::Y * -0.25, DVec3::Z * 2.0];
    check(&Nifti::good(), steps, DVec3::new(1.0, 2.0, 3.0));
    // The same told by a quaternion: half a turn about y takes x and z around, and the array is left-handed.
    let mut turned = Nifti::good();
    turned.short(254, 0);
    turned.short(252, 1);
    turned.float(76, -1.0);
    [(256, 0.0), (260, 1.0), (264, 0.0), (268, -1.0), (272, -2.0), (276, 3.0)]
        .into_iter()
        .for_each(|(at, value)| turned.float(at, value));
    check(&turned, steps, DVec3::new(1.0, 2.0, 3.0));
    // In metres.
    let mut metres = Nifti::good();
    metres.header[123] = 1;
    for at in (280..328).step_by(4) {
        let value = f32::from_le_bytes(metres.header[at..at + 4].try_into().unwrap());
        metres.float(at, value / 1000.0);
    }
    check(&metres, steps, DVec3::new(1.0, 2.0, 3.0));
    let mut untold = Nifti::good();
    untold.short(254, 0);
    let image = nifti::parse(&untold.bytes()).unwrap();
    assert_eq!(image.geometry.space, CoordinateSystem::Unspecified);
    assert_eq!(image.geometry.steps, [DVec3::X * 0.5, DVec3::Y * 0.25, DVec3::Z * 2.0]);
}

#[test]
fn nifti_numbers_of_every_kind_and_scale_are_the_same_numbers() {
    let check = |kind: i16, data: Vec<u8>| {
        let mut nifti = Nifti::good();
        nifti.short(70, kind);
        nifti.data = data;
        assert_eq!(values(&nifti::parse(&nifti.bytes()).unwrap()), counted(), "{kind}");
    };
    check(256, (0..24).collect());
    check(4, (0..24i16).flat_map(i16::to_le_bytes).collect());
    check(512, (0..24u16).flat_map(u16::to_le_bytes).collect());
    check(8, (0..24i32).flat_map(i32::to_le_bytes).collect());
    check(768, (0..24u32).flat_map(u32::to_le_bytes).collect());
    check(1024, (0..24i64).flat_map(i64::to_le_bytes).collect());
    check(1280, (0..24u64).flat_map(u64::to_le_bytes).collect());
    check(16, (0..24).flat_map(|n| (n as f32).to_le_bytes()).collect());
    check(64, (0..24).flat_map(|n| f64::from(n).to_le_bytes()).collect());
    let mut scaled = Nifti::good();
    scaled.float(112, 2.0);
    scaled.float(116, -100.0);
    let found = values(&nifti::parse(&scaled.bytes()).unwrap());
    assert_eq!((found[0], found[23]), (-100.0, -54.0));
}

#[test]
fn meta_images_are_read_plain_compressed_and_in_two_files() {
    let data: Vec<u8> = (0..24).collect();
    let wide: Vec<u8> = (0..24i16).flat_map(i16::to_be_bytes).collect();
    let big = ["ElementType = MET_SHORT", "BinaryDataByteOrderMSB = True"];
    let check = |bytes: &[u8]| {
        let image = metaimage::parse(bytes).unwrap();
        assert_eq!(image.geometry.steps, [DVec3::X * 0.5, DVec3::Y * 0.25, DVec3::Z * 2.0]);
        assert_eq!((image.geometry.origin, image.geometry.dims), (DVec3::new(1.0, 2.0, 3.0), [4, 3, 2]));
        assert_eq!(values(&image), counted());
    };
    check(&meta_image(&[], &data));
    check(&meta_image(&["CompressedData = True"], &zlib(&data)));
    check(&meta_image(&big, &wide));
    check(&meta_image(&["HeaderSize = -1"], &[vec![9; 100], data.clone()].concat()));
    let turned = ["TransformMatrix = 0 0 1 -1 0 0 0 1 0"];
    let image = metaimage::parse(&meta_image(&turned, &data)).unwrap();
    assert_eq!(image.geometry.steps, [DVec3::Z * 0.5, DVec3::X * -0.25, DVec3::Y * 2.0]);
    let folder = folder("meta_images");
    std::fs::write(
        folder.join("tooth.mhd"),
        meta_image(&["ElementDataFile = tooth.zraw", "CompressedData = True"], &[]),
    )
    .unwrap();
    std::fs::write(folder.join("tooth.zraw"), zlib(&data)).unwrap();
    let read = imaging::read(&folder.join("tooth.mhd"), &ReadOptions::default()).unwrap();
    assert_eq!(values(&read.image), counted());
}

#[test]
fn plain_voxels_are_what_a_person_says_they_are() {
    let told = raw::RawLayout {
        size: [4, 3, 2],
        sample_type: raw::RawSampleType::Int16,
        is_big_endian: true,
        skip: 5,
        spacing: [0.5, 0.25, 2.0],
    };
    let bytes: Vec<u8> = [9; 5].into_iter().chain((0..24i16).flat_map(i16::to_be_bytes)).collect();
    let image = raw::parse(&bytes, &told).unwrap();
    assert_eq!(values(&image), counted());
    assert_eq!(image.geometry.steps, [DVec3::X * 0.5, DVec3::Y * 0.25, DVec3::Z * 2.0]);
    let refused = raw::parse(&bytes, &raw::RawLayout { skip: 0, ..told }).unwrap_err().to_string();
    assert!(refused.contains("has 53 bytes") && refused.contains("--skip-bytes 5"), "{refused}");
    let refused = raw::parse(&bytes[..40], &told).unwrap_err().to_string();
    assert!(refused.contains("has 40 bytes, but --size and --type require 53"), "{refused}");
}

#[test]
fn a_series_is_put_in_order_by_where_its_slices_lie() {
    // Aim: neither names nor numbers of files matter; Hounsfield units, spacings and places do. Method: a series in three
    // ways of writing, its names and numbers shuffled.
    for (name, syntax) in [("explicit", EXPLICIT), ("implicit", IMPLICIT), ("big", BIG)] {
        let folder = folder(&format!("series_{name}"));
        series(&folder, 6, |_, slice| slice.syntax = syntax);
        std::fs::write(folder.join("README.txt"), "exported on a Tuesday").unwrap();
        let read = imaging::read(&folder, &ReadOptions::default()).unwrap();
        let image = imaging::require_axis_aligned(read.image).unwrap();
        assert_eq!(image.geometry.dims, [5, 4, 6]);
        let expected = [DVec3::X * 0.3, DVec3::Y * 0.4, DVec3::Z * 0.5];
        for (found, expected) in image.geometry.steps.into_iter().zip(expected) {
            assert!(found.distance(expected) < 1e-9, "{found}");
        }
        assert_eq!(image.geometry.origin, DVec3::new(-10.0, 20.0, 7.0));
        let Samples::I16(found) = &image.samples else { panic!("whole numbers") };
        assert!(found.iter().copied().eq((0..120).map(|n| n - 1024)), "{name}: {found:?}");
        assert_eq!(read.notes, ["README.txt is not a DICOM file and was skipped"]);
    }
}

#[test]
fn slices_from_head_to_foot_turned_or_scaled_keep_their_places() {
    let image = |name: &str, vary: &dyn Fn(u16, &mut Slice)| {
        let folder = folder(&format!("series_{name}"));
        series(&folder, 4, vary);
        imaging::read(&folder, &ReadOptions::default()).unwrap().image
    };
    // Coronal slices: rows run left, columns down, slices toward the front or the back.
    let coronal = image("coronal", &|k, slice| {
        slice.orientation = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        slice.position = [1.0, -3.0 + 0.5 * f64::from(k), 2.0];
    });
    assert_eq!(coronal.geometry.steps, [DVec3::X * 0.3, DVec3::Z * -0.4, DVec3::Y * 0.5]);
    // The first in the array is the lowest along the slices' normal, whichever was written first.
    let downward = image("downward", &|k, slice| slice.position[2] = -0.5 * f64::from(k));
    assert_eq!(downward.geometry.origin.z, -1.5);
    assert_eq!(values(&downward)[0], 60.0 - 1024.0);
    let scaled = image("scaled", &|_, slice| (slice.slope, slice.intercept) = ("0.5", "10"));
    assert_eq!(values(&scaled)[..3], [10.0, 10.5, 11.0]);
    let signed = image("signed", &|_, slice| {
        slice.is_signed = true;
        slice.intercept = "0";
        // −1 in twelve bits, with an overlay's bits above it.
        slice.pixels[0] = 0xAFFF;
    });
    assert_eq!(values(&signed)[..2], [-1.0, 1.0]);
}

#[test]
fn run_lengths_are_unpacked() {
    // The bytes' high halves, then their low halves: a run of twenty zeros, then twenty bytes as they are.
    let packed = |first: u16| {
        let high: Vec<u8> = vec![237, (first >> 8) as u8];
        let low: Vec<u8> = std::iter::once(19).chain((first..first + 20).map(|n| n as u8)).chain([128]).collect();
        let mut stream: Vec<u8> = [2u32, 64, 64 + high.len() as u32].into_iter().flat_map(u32::to_le_bytes).collect();
        stream.resize(64, 0);
        [stream, high, low].concat()
    };
    let folder = folder("series_runs");
    series(&folder, 3, |k, slice| {
        slice.syntax = "1.2.840.10008.1.2.5";
        slice.fragments = Some(vec![packed(20 * k)]);
    });
    let found = values(&imaging::read(&folder, &ReadOptions::default()).unwrap().image);
    assert!(found.into_iter().eq((0..60).map(|n| n as f32 - 1024.0)));
}

#[test]
fn real_slices_load_or_are_refused_with_the_reason() {
    let Some(explicit) = find("dicom-ct/CT_Explicit_Little.dcm") else { return };
    let Some(headless) = find("dicom-ct/CT_Implicit_Little_Headless_Retired.dcm") else { return };
    let Some(jpeg) = find("dicom-ct/CT_JPEG70.dcm") else { return };
    // A slice and the same one higher up: the smallest series.
    let two = |name: &str, path: &Path, from: &[u8], to: &[u8]| {
        let folder = folder(name);
        let bytes = std::fs::read(path).unwrap();
        let at = bytes.windows(from.len()).position(|w| w == from).expect("its position");
        std::fs::write(folder.join("a.dcm"), &bytes).unwrap();
        std::fs::write(folder.join("b.dcm"), [&bytes[..at], to, &bytes[at + to.len()..]].concat()).unwrap();
        imaging::read(&folder, &ReadOptions::default()).unwrap().image
    };
    let image = two("real_explicit", &explicit, b"-2.800000e02", b"-2.700000e02");
    assert_eq!((image.geometry.dims, image.geometry.spacing()), ([512, 512, 2], DVec3::new(0.46875, 0.46875, 10.0)));
    // As pydicom decodes it.
    let found = &values(&image)[..512 * 512];
    let least_and_most = found.iter().fold([f32::MAX, f32::MIN], |[a, b], &v| [a.min(v), b.max(v)]);
    assert_eq!(least_and_most, [-1057.0, 1440.0]);
    assert_eq!(found.iter().map(|&v| f64::from(v)).sum::<f64>(), -142_408_444.0);
    let image = two("real_jpeg", &jpeg, b"0.0000000\\+50.00", b"1.0000000\\+50.00");
    assert_eq!((image.geometry.dims, image.geometry.spacing()), ([512, 400, 2], DVec3::ONE));
    let found = values(&image);
    assert_eq!(found[..512 * 400], found[512 * 400..]);
    let sure = found.iter().filter(|v| (-1100.0..3100.0).contains(*v)).count();
    assert!(sure * 100 > 99 * found.len(), "Hounsfield units: {sure} of {}", found.len());
    let one = |path: &Path| {
        let folder = folder("real_one");
        std::fs::copy(path, folder.join("a.dcm")).unwrap();
        imaging::read(&folder, &ReadOptions::default()).unwrap_err().to_string()
    };
    assert!(one(&explicit).contains("there is one slice"));
    assert!(one(&headless).contains("it has no orientation"), "{}", one(&headless));
    let all = imaging::read(jpeg.parent().unwrap(), &ReadOptions::default()).unwrap_err().to_string();
    assert!(all.contains("it has no orientation") && all.contains("Headless"), "{all}");
}

fn labelled(image: &VoxelImage) -> Volume {
    let names: BTreeMap<u8, Label> = (1..=3).map(|n| (n, Label(n))).collect();
    tooth_import::labelled(image, None, &names).unwrap()
}

#[test]
fn the_same_tooth_as_nifti_and_as_segmentation_agrees_voxel_for_voxel() {
    let Some(first) = find("openmandible/openmandible_FDI36_0.2mm.nii.gz") else { return };
    let Some(second) = find("openmandible/openmandible_FDI36_0.2mm.seg.nrrd") else { return };
    let [first, second] = [first, second].map(|path| imaging::read(&path, &ReadOptions::default()).unwrap().image);
    let [a, b] = [&first, &second].map(labelled);
    assert!(a.grid().dims == b.grid().dims && a.tissues().eq(b.tissues()));
    assert!(
        (a.grid().origin - b.grid().origin).length() < 1e-3 && (a.grid().spacing - b.grid().spacing).length() < 1e-6
    );
    assert_eq!([1, 2, 3].map(|n| a.count(Label(n))), [27720, 80924, 4222]);
}

fn parts(tooth: &str) -> Option<Vec<TissueSurface>> {
    let read = |(name, label): (&str, Label)| {
        let path = find(&format!("openmandible/Tooth_{tooth}_{name}.stl"))?;
        Some(voxelize::tissue_surface(label, &surfaces::read(&path).unwrap()).unwrap())
    };
    [("Enamel", TISSUES.enamel), ("Dentin", TISSUES.dentine), ("Pulp", TISSUES.pulp)].into_iter().map(read).collect()
}

#[test]
fn shells_of_real_teeth_keep_the_volumes_of_their_meshes() {
    for (tooth, mm3) in [("L6", [221.8, 647.5, 33.6]), ("R1", [55.1, 204.8, 10.7])] {
        let Some(parts) = parts(tooth) else { return };
        for (part, expected) in parts.iter().zip(mm3) {
            assert!(
                (part.volume_mm3 - expected).abs() < 0.06 && part.notes.is_empty(),
                "{tooth}: {} {:?}",
                part.volume_mm3,
                part.notes
            );
        }
        for spacing in [0.1, 0.2] {
            let shaped = voxelize::voxelize(&parts, spacing, None, &TISSUES).unwrap();
            let volume = shaped.volume;
            for part in &parts {
                let found = volume.count(part.label) as f64 * volume.grid().voxel_mm3();
                let off = 100.0 * (found / part.volume_mm3 - 1.0);
                println!(
                    "{tooth} at {spacing} mm, {:?}: {found:.3} of {:.3} mm³, {off:+.3} %",
                    part.label, part.volume_mm3
                );
                assert!(off.abs() < 1.0, "{tooth} at {spacing} mm, {:?}: {off} %", part.label);
            }
            let solid = || volume.grid().cells().zip(volume.tissues()).filter(|(_, l)| *l != Label::AIR);
            let top = solid().map(|(cell, _)| cell[2]).max().unwrap();
            let is_crown = solid().filter(|(cell, _)| cell[2] == top).all(|(_, label)| label == TISSUES.enamel);
            assert!(is_crown, "{tooth}: the crown is up");
        }
    }
}

#[test]
fn voxelised_shells_are_the_label_map_that_others_made_of_them() {
    let Some(parts) = parts("L6") else { return };
    let Some(path) = find("openmandible/openmandible_FDI36_0.2mm.seg.nrrd") else { return };
    let ours = voxelize::voxelize(&parts, 0.2, None, &TISSUES).unwrap().volume;
    let theirs = labelled(&nrrd::read(&path).unwrap());
    for label in [TISSUES.enamel, TISSUES.dentine, TISSUES.pulp] {
        let [a, b] = [&ours, &theirs].map(|v| v.count(label) as f64);
        assert!((a / b - 1.0).abs() < 0.01, "{label:?}: {a} and {b}");
    }
}

#[test]
fn every_kind_of_surface_file_gives_the_same_voxels() {
    let mut first: Option<Vec<Label>> = None;
    for (name, ending, bytes) in tetrahedra() {
        let triangles = surfaces::parse(&bytes, ending, |_| panic!("nothing else")).unwrap();
        let part = voxelize::tissue_surface(TISSUES.dentine, &triangles).unwrap();
        assert!((part.volume_mm3 - 512.0 / 6.0).abs() < 1e-3, "{name}");
        let volume = voxelize::voxelize(&[part], 0.25, None, &TISSUES).unwrap().volume;
        let found: Vec<Label> = volume.tissues().collect();
        assert_eq!(first.get_or_insert(found.clone()), &found, "{name}");
    }
}

#[test]
fn the_nerve_in_a_tooth_of_another_program_is_found() {
    // A molar with a nerve that leaves it at the roots' ends, in no unit anybody knows: a unit is asked for, not guessed.
    let Some(path) = find("chai3d/tooth.obj") else { return };
    let triangles = surfaces::read(&path).unwrap();
    let found = voxelize::tissue_surface(TISSUES.dentine, &triangles).unwrap_err().to_string();
    assert!(found.contains("longest side") || found.contains("hole"), "{found}");
}

/// Runs `typodont import`; returns its status, standard output and standard error.
fn import(arguments: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_typodont")).arg("import").args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

#[test]
fn one_tooth_is_cut_out_told_apart_and_drawn() {
    // Aim: from the command line to a label map and a picture. Method: a phantom of two teeth in a scan of 0.25 mm.
    let folder = folder("import_cut");
    let [scan, map, picture] = ["jaw.mha", "36.seg.nrrd", "36.png"].map(|name| folder.join(name));
    std::fs::write(&scan, jaw()).unwrap();
    let [scan, map, picture] = [&scan, &map, &picture].map(|path| path.to_str().unwrap());
    let (status, out, err) = import(&[scan, "--at", "-6,1,0", "--around", "8.5", "-o", map, "--preview", picture]);
    assert_eq!(status, 0, "{err}");
    assert!(out.contains("Enamel") && out.contains("Pulp"), "{out}");
    let drawn = nrrd::segmentation::read(Path::new(map)).unwrap();
    let mm3 = drawn.geometry.grid().unwrap().voxel_mm3();
    let sizes = [1, 2, 3].map(|label| drawn.count(label) as f64 * mm3);
    // The phantom's own: half a shell of 5 to 6 mm, a ball of 6 without it, a ball of 1.5.
    let ball = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r.powi(3);
    let enamel = 0.5 * (ball(6.0) - ball(5.0));
    for (found, expected) in sizes.into_iter().zip([enamel, ball(6.0) - enamel - ball(1.5), ball(1.5)]) {
        assert!((found / expected - 1.0).abs() < 0.12, "{sizes:?}");
    }
    assert!(std::fs::read(picture).unwrap().starts_with(b"\x89PNG"));
    let (status, out, err) = import(&[scan, "--crop", "-14,2,-8,9,-9,9", "--resample", "0.5", "-o", map]);
    assert_eq!(status, 0, "{err}");
    assert!(out.contains("12.") || out.contains("13."), "{out}");
    let (status, _, err) = import(&[scan, "--at", "90,1,0", "-o", map]);
    assert_eq!(status, 1);
    assert!(err.contains("wrong-volume") && err.contains("the scan extends from"), "{err}");
}

#[test]
fn the_grey_values_of_a_scan_go_with_its_label_map() {
    // Aim: an author who imports a scan, or corrects its label map by hand, keeps what the scanner measured. Method: the
    // phantom's tooth and its grey values, written by the command, read by an exercise; enamel, dentine and pulp have 3800,
    // 2800 and 1100 above the background.
    let folder = folder("import_grey_values");
    let [scan, map, grey] = ["jaw.mha", "36.seg.nrrd", "36.nrrd"].map(|name| folder.join(name));
    std::fs::write(&scan, jaw()).unwrap();
    let [scan, map, grey] = [&scan, &map, &grey].map(|path| path.to_str().unwrap());
    let (status, _, err) = import(&[scan, "--at", "-6,1,0", "--around", "8.5", "-o", map, "--grey-values", grey]);
    assert_eq!(status, 0, "{err}");
    let text = include_str!("../../scenarios/5-grinding.json");
    let mut exercise: serde_json::Value = serde_json::from_str(text).unwrap();
    let tissues = serde_json::json!({ "1": "enamel", "2": "dentine", "3": "pulp" });
    let tooth = &mut exercise["scene"]["jaw"]["tooth"];
    tooth["form"] = serde_json::json!({ "labels": { "file": "36.seg.nrrd", "tissues": tissues, "scan": "36.nrrd" } });
    let resolved = |exercise: &serde_json::Value| {
        let source = SourceText::new("exercise.json", exercise.to_string());
        scenario::resolve(source, &Library::shipped().with_folder(&folder), ResolveMode::MakeWorkpiece)
    };
    let scenario = resolved(&exercise).unwrap();
    let ToothSource::Given(tooth) = &scenario.scene.teeth[0].source else { panic!("a tooth from a file") };
    let values = tooth.grey_values.as_ref().unwrap().values();
    for (name, expected) in [("enamel", 160), ("dentine", 118), ("pulp", 46)] {
        let label = scenario.tissues.label_of(name).unwrap();
        let of_tissue = |index: &usize| tooth.volume.voxel(*index) == Voxel { density: Density::FULL, label };
        let mut found: Vec<u8> = (0..values.len()).filter(of_tissue).map(|index| values[index]).collect();
        found.sort_unstable();
        let median = found[found.len() / 2];
        assert!(median.abs_diff(expected) <= 2, "{name}: {median}, not {expected}");
    }
    // A scan of another size, and one that is darker where there is enamel.
    let image = nrrd::read(Path::new(grey)).unwrap();
    let Samples::U8(samples) = &image.samples else { panic!("8 bits") };
    let inverted = Samples::U8(samples.iter().map(|value| 255 - value).collect());
    let coarser = image.geometry.steps.map(|step| step * 1.5);
    for (image, said) in [
        (VoxelImage { geometry: Geometry { steps: coarser, ..image.geometry.clone() }, ..image.clone() }, "own grid"),
        (VoxelImage { samples: inverted, ..image.clone() }, "not brighter"),
    ] {
        std::fs::write(grey, nrrd::bytes(&image, Encoding::Gzip).unwrap()).unwrap();
        let complaints = resolved(&exercise).unwrap_err();
        let found = complaints.iter().find(|found| found.path == "/scene/jaw/tooth/form/labels/scan").unwrap();
        assert!(found.code == "wrong-volume" && found.message.contains(said), "{found:?}");
    }
    let (status, _, err) = import(&[map, "-o", folder.join("other.seg.nrrd").to_str().unwrap(), "--grey-values", grey]);
    assert_eq!(status, 2);
    assert!(err.contains("only a CT volume has grey values"), "{err}");
    let same = folder.join(".").join("36.seg.nrrd");
    let (status, _, err) = import(&[scan, "-o", map, "--grey-values", same.to_str().unwrap()]);
    assert!(status == 2 && err.contains("need two names"), "{err}");
    assert!(!folder.join("other.seg.nrrd").exists());
}

/// Two balls of 6 mm with caps of enamel, at (−6, 1, 0) and (7, 1, 0) mm, in CT values with some noise.
fn jaw() -> Vec<u8> {
    let [nx, ny, nz] = [110usize, 64, 64];
    let mut state = 1u32;
    let mut data = Vec::new();
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let place = Vec3::new(i as f32, j as f32, k as f32) * 0.25 - Vec3::new(13.5, 7.0, 8.0);
                let value = |middle: Vec3| {
                    let away = place - middle;
                    let share = |radius: f32| (0.5 + (radius - away.length()) / 0.25).clamp(0.0, 1.0);
                    let hard = if away.z > 0.0 { 1800.0 + 1000.0 * (1.0 - share(5.0)) } else { 1800.0 };
                    -1000.0 + (hard + 1000.0) * share(6.0) - (hard - 100.0) * share(1.5)
                };
                state = state.wrapping_mul(1664525).wrapping_add(1013904223);
                let noise = (state >> 24) as f32 * 0.2 - 25.0;
                let value = value(Vec3::new(-6.0, 1.0, 0.0)).max(value(Vec3::new(7.0, 1.0, 0.0))) + noise;
                data.extend((value as i16).to_le_bytes());
            }
        }
    }
    let lines = [
        "ElementType = MET_SHORT",
        "Offset = -13.5 -7 -8",
        "ElementSpacing = 0.25 0.25 0.25",
        "DimSize = 110 64 64",
        "CompressedData = True",
    ];
    meta_image(&lines, &zlib(&data))
}

#[test]
fn a_scan_without_a_tooth_says_so_and_what_to_try() {
    let folder = folder("import_nothing");
    let map = folder.join("o.seg.nrrd");
    let map = map.to_str().unwrap();
    let mut state = 1u32;
    let mut random = || {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 16) as i16
    };
    let voxels = 64 * 64 * 64;
    let check = |name: &str, values: Vec<i16>, said: &[&str]| {
        let path = folder.join(name);
        let data: Vec<u8> = values.into_iter().flat_map(i16::to_le_bytes).collect();
        let lines = ["ElementType = MET_SHORT", "ElementSpacing = 0.3 0.3 0.3", "DimSize = 64 64 64"];
        std::fs::write(&path, meta_image(&lines, &data)).unwrap();
        let (status, _, err) = import(&[path.to_str().unwrap(), "-o", map]);
        assert_eq!(status, 1, "{name}: {err}");
        said.iter().for_each(|part| assert!(err.contains(part), "{name}: {part} in: {err}"));
        assert!(!err.contains("panicked"));
    };
    let try_this = ["wrong-volume", "no tooth", "--at"];
    check("air.mha", vec![-1000; voxels], &["all values are the same", "no tooth"]);
    check("noise.mha", (0..voxels).map(|_| random() / 64).collect(), &try_this);
    let mut calm = || random() / 2048;
    check("calm_air.mha", (0..voxels).map(|_| -1000 + calm()).collect(), &try_this);
    // A beaker of water: one level, an inside, and no tooth.
    let beaker = |n: usize| {
        let [x, y, z] = [n % 64, n / 64 % 64, n / 4096].map(|v| v as f32 - 31.5);
        x * x + y * y < 400.0 && z.abs() < 20.0
    };
    check("water.mha", (0..voxels).map(|n| if beaker(n) { 0 } else { -1000 } + calm()).collect(), &try_this);
}

#[test]
fn label_maps_are_named_by_a_person_or_by_their_own_segments() {
    let folder = folder("import_labels");
    let [map, made] = ["map.nii.gz", "made.seg.nrrd"].map(|name| folder.join(name));
    let mut nifti = Nifti::good();
    // A block of 1 over a block of 2, with a border of air.
    let dims = [12i16, 12, 24];
    dims.into_iter().enumerate().for_each(|(n, dim)| nifti.short(42 + 2 * n, dim));
    let inside = |v: usize, n: usize| (2..n - 2).contains(&v);
    let label = |n: usize| match [n % 12, n / 12 % 12, n / 144] {
        [x, y, z] if inside(x, 12) && inside(y, 12) && inside(z, 24) => {
            if z > 15 {
                1
            } else {
                2
            }
        }
        _ => 0,
    };
    nifti.data = (0..12 * 12 * 24).map(label).collect();
    std::fs::write(&map, gzip(&nifti.bytes())).unwrap();
    let [map, made] = [&map, &made].map(|path| path.to_str().unwrap());
    let (status, _, err) = import(&[map, "-o", made]);
    assert!(status == 1 && err.contains("contains only the numbers 0, 1, 2") && err.contains("--labels"), "{err}");
    let (status, _, err) = import(&[map, "--labels", "enamel=1", "-o", made]);
    assert!(status == 1 && err.contains("no tissue is assigned to 2"), "{err}");
    let (status, out, err) = import(&[map, "--labels", "enamel=1,dentine=2", "-o", made]);
    assert_eq!(status, 0, "{err}");
    let (_, again, err) = import(&[made, "-o", folder.join("again.seg.nrrd").to_str().unwrap()]);
    assert_eq!(out, again, "{err}");
    let (status, _, err) = import(&[map, "--labels", "enamal=1", "-o", made]);
    assert!(status == 1 && err.contains("there is no tissue \"enamal\"; known: enamel, dentine"), "{err}");
    let (status, _, err) = import(&[map, "--labels", "enamel=1", "-o", map]);
    assert_eq!(status, 2, "{err}");
}

#[test]
fn surfaces_become_teeth_from_the_command_line() {
    let folder = folder("import_surfaces");
    let made = folder.join("made.seg.nrrd");
    let made = made.to_str().unwrap();
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        folder.join(name).to_str().unwrap().to_string()
    };
    let stl = write("dentine.stl", &tetrahedra().into_iter().find(|(name, ..)| *name == "stl binary").unwrap().2);
    let (status, out, err) = import(&["--tissue", &format!("dentine={stl}"), "--spacing-mm", "0.2", "-o", made]);
    assert!(status == 0 && out.contains("Dentine: 85."), "{out}{err}");
    let (status, _, err) = import(&[&stl, "-o", made]);
    assert!(status == 1 && err.contains("1 deep, and 3 tissues were named"), "{err}");
    let (status, out, err) = import(&[&stl, "--shells", "dentine", "-o", made]);
    assert!(status == 0 && out.contains("Dentine: 85."), "{out}{err}");
    let (status, _, err) = import(&[&stl, "--shells", "dentine", "--unit", "m", "-o", made]);
    assert!(status == 1 && err.contains("wrong-surface") && err.contains("--unit"), "{err}");
    let (status, _, err) = import(&["--tissue", &format!("enamel={}", folder.join("no.stl").display()), "-o", made]);
    assert!(status == 1 && err.contains("no.stl") && err.contains("cannot be read"), "{err}");
}

#[test]
fn the_largest_ordinary_scan_is_imported_in_little_memory() {
    // Aim: 85 million voxels, as many as 512×512×322 has, give the tissues of the scan they were made of. Method: the GE
    // tooth laid anew at a quarter of its spacing; the program's own peak of memory, as Linux tells it.
    let Some(path) = find("ge-tooth/tooth_u8_103x94x161.nrrd") else { return };
    let folder = folder("import_large");
    let [large, map] = ["large.mha", "large.seg.nrrd"].map(|name| folder.join(name));
    let mut image = nrrd::read(&path).unwrap();
    image.geometry.steps = image.geometry.steps.map(|step| step * 0.2);
    let fine = imaging::CropOptions { resample: Some(0.052), ..imaging::CropOptions::default() };
    let laid = imaging::crop_and_resample(image, &fine).unwrap();
    let Samples::U8(samples) = &laid.samples else { panic!("bytes") };
    assert!(samples.len() >= 512 * 512 * 322, "{}", samples.len());
    let [x, y, z] = laid.geometry.dims;
    let lines = [format!("DimSize = {x} {y} {z}"), "ElementSpacing = 0.052 0.052 0.052".to_string()];
    std::fs::write(&large, meta_image(&[&lines[0], &lines[1]], samples)).unwrap();
    let begun = std::time::Instant::now();
    let mut running = Command::new(env!("CARGO_BIN_EXE_typodont"))
        .args([Path::new("import"), &large, Path::new("-o"), &map])
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut peak_kib = 0u64;
    while running.try_wait().unwrap().is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", running.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak_kib = line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(peak_kib);
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    println!("{x}×{y}×{z} voxels: {:.1} s, {} MiB", begun.elapsed().as_secs_f64(), peak_kib >> 10);
    assert!(running.wait().unwrap().success());
    assert!(peak_kib < 1_500_000, "{peak_kib} KiB");
    let made = nrrd::segmentation::read(&map).unwrap();
    let mm3 = [1, 2, 3].map(|label| made.count(label) as f64 * 0.052f64.powi(3));
    // Volumes that the scan itself gives at 0.2 mm.
    for (found, expected) in mm3.into_iter().zip([845.8, 2174.5, 167.1]) {
        assert!((found / expected - 1.0).abs() < 0.06, "{mm3:?}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
