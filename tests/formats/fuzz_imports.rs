//! The readers of other programs' scans and surfaces against anything at all. Runs as a test with a modest number of inputs,
//! and as a fuzzer with `cargo bolero test --test fuzz_imports any_bytes_are_read_whole_or_refused_in_words`.

use crate::support::import_files;

use import_files::*;
use typodont_core::volume::Label;
use typodont_formats::diagnostic::Diagnostic;
use typodont_formats::imaging;
use typodont_formats::imaging::{CropOptions, ScanError, metaimage, nifti};
use typodont_formats::import::voxelize;
use typodont_formats::nrrd::VoxelImage;
use typodont_formats::surfaces;

#[test]
fn any_bytes_are_read_whole_or_refused_in_words() {
    let surfaces = tetrahedra();
    bolero::check!().with_iterations(10_000).with_max_len(1024).for_each(|input: &[u8]| {
        let Some((way, input)) = input.split_first() else { return };
        let data: Vec<u8> = (0..24).collect();
        match way % 8 {
            0 => check(nifti::parse(input)),
            1 => check(nifti::parse(&replaced(Nifti::good().bytes(), input))),
            2 => check(nifti::parse(&gzip(&replaced(Nifti::good().bytes(), input)))),
            3 => check(metaimage::parse(&replaced(meta_image(&[], &data), input))),
            4 => check(metaimage::parse(&meta_image(&["CompressedData = True"], input))),
            _ => {
                let (_, ending, good) = &surfaces[usize::from(*way) / 8 % surfaces.len()];
                check_surface(&replaced(good.clone(), input), ending);
            }
        }
    });
}

/// A file with some of its bytes replaced, as the input says: where (two bytes), by what (one byte), again and again.
fn replaced(mut bytes: Vec<u8>, input: &[u8]) -> Vec<u8> {
    for edit in input.chunks_exact(3) {
        let at = usize::from(u16::from_le_bytes([edit[0], edit[1]])) % bytes.len();
        bytes[at] = edit[2];
    }
    bytes
}

fn in_words(unread: &ScanError) {
    let text = unread.to_string();
    assert!(text.starts_with("reading ") && !text.contains(char::is_control), "{text:?}");
}

fn check(outcome: Result<VoxelImage, ScanError>) {
    match outcome {
        Ok(image) => {
            assert_eq!(image.samples.len(), image.geometry.len());
            // Laid anew or refused, however its axes lie.
            let wanted = CropOptions { resample: Some(0.5), ..CropOptions::default() };
            if image.geometry.spacing().max_element() < 10.0
                && imaging::crop_and_resample(image.clone(), &wanted).is_ok()
            {
                assert!(!image.samples.is_empty());
            }
            let _ = imaging::require_axis_aligned(image);
        }
        Err(unread) => in_words(&unread),
    }
}

fn check_surface(bytes: &[u8], ending: &str) {
    let away = |_: &str| Err(Diagnostic::about_file("", "no", "none", None));
    match surfaces::parse(bytes, ending, away) {
        Ok(triangles) => {
            if let Err(unsound) = voxelize::tissue_surface(Label(1), &triangles) {
                assert!(unsound.to_string().contains(" — "), "{unsound}");
            }
        }
        Err(unread) => in_words(&unread),
    }
}
