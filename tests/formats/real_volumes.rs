//! Volumes from other sources, compared with their known properties.
//!
//! They are in `$TYPODONT_DATA`, or in `../shared/data` beside the project; their licences do not allow them in the
//! repository.

use crate::support::shared_data;

use glam::DVec3;
use shared_data::find;
use std::path::Path;
use typodont_anatomy::TissueLabels;
use typodont_core::volume::Label;
use typodont_exercise::tooth_import;
use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation;
use typodont_formats::nrrd::segmentation::Segmentation;
use typodont_formats::nrrd::{CoordinateSystem, Encoding, Samples};

#[test]
fn the_ge_tooth_has_its_three_peaks() {
    let Some(path) = find("ge-tooth/tooth_u8_103x94x161.nrrd") else { return };
    let image = nrrd::read(&path).unwrap();
    assert_eq!(image.geometry.dims, [103, 94, 161]);
    assert_eq!((image.geometry.spacing(), image.geometry.space), (DVec3::ONE, CoordinateSystem::LeftPosteriorSuperior));
    let Samples::U8(samples) = &image.samples else { panic!("uint8") };
    let mut histogram = [0; 256];
    samples.iter().for_each(|&sample| histogram[usize::from(sample)] += 1);
    for (what, peak) in [("air and mount", 77), ("dentine", 163), ("enamel", 234)] {
        let around = peak - 15..=peak + 15;
        assert_eq!(around.max_by_key(|&value| histogram[value]), Some(peak), "{what}");
    }
    for encoding in [Encoding::Raw, Encoding::Gzip] {
        let bytes = nrrd::bytes(&image, encoding).unwrap();
        assert_eq!(nrrd::parse(&bytes).unwrap(), image, "{encoding:?}");
    }
}

#[test]
fn the_ge_tooth_becomes_enamel_over_dentine_over_pulp() {
    // Aim: no plane, no skin of dentine on the crown, canals filled. Method: counts, and the surface of the upper crown.
    let Some(path) = find("ge-tooth/tooth_u8_103x94x161.nrrd") else { return };
    let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let image = nrrd::read(&path).unwrap();
    let tooth = tooth_import::segmented(&image, Some([0.2; 3]), &tissues).unwrap().volume;
    let shares = [tissues.enamel, tissues.dentine, tissues.pulp].map(|tissue| tooth.count(tissue));
    for (found, expected) in shares.into_iter().zip([106_000, 272_000, 21_000]) {
        assert!(found.abs_diff(expected) * 10 < expected, "{shares:?}");
    }
    let grid = tooth.grid();
    let [mut enamel, mut other] = [0, 0];
    for (index, cell) in grid.cells().enumerate() {
        let is_surface = || grid.neighbours(index).any(|n| tooth.tissue(n) == Label::AIR);
        if grid.centre(cell).z > 4.0 && tooth.tissue(index) != Label::AIR && is_surface() {
            *(if tooth.tissue(index) == tissues.enamel { &mut enamel } else { &mut other }) += 1;
        }
    }
    assert!(enamel > 8000 && other == 0, "{enamel} of enamel, {other} not");
    assert!(tooth_import::segmented(&image, None, &tissues).unwrap_err().contains("give the voxel spacing"));
}

#[test]
fn a_drawn_tooth_keeps_every_voxel() {
    let Some(path) = find("openmandible/openmandible_FDI36_0.2mm.seg.nrrd") else { return };
    let image = nrrd::read(&path).unwrap();
    let names = (1..=3).map(|number| (number, Label(number + 3))).collect();
    let tooth = tooth_import::labelled(&image, None, &names).unwrap();
    let drawn = segmentation::read(&path).unwrap();
    assert_eq!([4, 5, 6].map(|n| tooth.count(Label(n))), [1, 2, 3].map(|n| drawn.count(n)));
}

#[test]
fn the_ge_tooth_is_labelled_as_its_thresholds_say() {
    let Some(scan) = find("ge-tooth/tooth_u8_103x94x161.nrrd") else { return };
    let Some(path) = find("ge-tooth/ge_tooth_threshold_labels.seg.nrrd") else { return };
    let Samples::U8(samples) = nrrd::read(&scan).unwrap().samples else { panic!("uint8") };
    let tooth = check(&path, ["enamel", "dentine", "pulp"]);
    assert_eq!([1, 2, 3].map(|label| tooth.count(label)), [93_851, 298_759, 17_441]);
    for (label, sample) in tooth.labels.iter().zip(samples) {
        match label {
            1 => assert!(sample >= 200),
            2 => assert!((120..200).contains(&sample)),
            _ => assert!(sample < 200),
        }
    }
}

#[test]
fn the_openmandible_teeth_have_the_volumes_of_their_meshes() {
    let teeth = [
        // Held against the label map's own figures, and those of the meshes.
        ("openmandible/openmandible_FDI36_0.2mm.seg.nrrd", [70, 66, 106], 0.2, [221.76, 647.39, 33.78], 0.005),
        ("openmandible/openmandible_FDI41_0.1mm.seg.nrrd", [65, 71, 238], 0.1, [55.1, 204.8, 10.7], 0.2),
    ];
    for (name, dims, spacing, mm3, tolerance) in teeth {
        let Some(path) = find(name) else { continue };
        let tooth = check(&path, ["enamel", "dentine", "pulp"]);
        assert_eq!(tooth.geometry.dims, dims);
        assert!((tooth.geometry.spacing() - DVec3::splat(spacing)).length() < 1e-12);
        let grid = tooth.geometry.grid().unwrap();
        for (label, expected) in (1..).zip(mm3) {
            let found = tooth.count(label) as f64 * grid.voxel_mm3();
            assert!((found - expected).abs() < tolerance, "{name}: label {label} {found} mm³, not {expected}");
        }
    }
}

/// Reads a segmentation of these names, and writes and reads it again.
fn check(path: &Path, names: [&str; 3]) -> Segmentation {
    let tooth = segmentation::read(path).unwrap_or_else(|error| panic!("{error}"));
    let found: Vec<&str> = tooth.segments.iter().map(|segment| segment.name.as_str()).collect();
    assert_eq!(found, names);
    assert_eq!(tooth.segments[0].color, [0.95, 0.95, 0.9]);
    let again = segmentation::parse(&segmentation::bytes(&tooth).unwrap()).unwrap();
    assert_eq!(again, tooth);
    tooth
}
