//! The NRRD reader against anything at all. Runs as a test with a modest number of inputs, and as a fuzzer with
//! `cargo bolero test --test fuzz_nrrd any_bytes_are_read_whole_or_refused_in_words`.

use crate::support::volume_text;

use typodont_formats::nrrd;
use typodont_formats::nrrd::segmentation;
use typodont_formats::nrrd::segmentation::Segmentation;
use typodont_formats::nrrd::{Encoding, VoxelImage};
use volume_text::Text;

#[test]
fn any_bytes_are_read_whole_or_refused_in_words() {
    bolero::check!().with_iterations(20_000).with_max_len(2048).for_each(|input: &[u8]| {
        let Some((way, input)) = input.split_first() else { return };
        match way % 6 {
            0 => try_bytes(input),
            1 => try_bytes(&Text::good().with("encoding: gzip").data(input.to_vec()).bytes()),
            2 => try_bytes(&[b"NRRD0005\n", input].concat()),
            3 => try_bytes(&replaced(Text::good().adding("a:=b").bytes(), input)),
            4 => try_bytes(&replaced(Text::good().gzip().bytes(), input)),
            _ => try_detached(input),
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

fn try_bytes(bytes: &[u8]) {
    check(nrrd::parse(bytes));
    match segmentation::parse(bytes) {
        Ok(segmentation) => check_segmentation(&segmentation),
        Err(error) => assert!(!error.to_string().contains(char::is_control)),
    }
}

fn try_detached(input: &[u8]) {
    let header = Text::good().adding("data file: data.raw").adding("line skip: 1").header();
    check(nrrd::parse_detached(&header, &mut |name| {
        assert_eq!(name, "data.raw");
        Ok(input.to_vec())
    }));
}

fn check(outcome: Result<VoxelImage, nrrd::NrrdError>) {
    match outcome {
        Ok(image) => {
            assert_eq!(image.samples.len(), image.geometry.len());
            assert!(image.geometry.spacing().min_element() > 0.0);
            // An image that was read can be written, unless a key cannot be represented. Bytes are compared, since
            // NaN != NaN.
            if let Ok(bytes) = nrrd::bytes(&image, Encoding::Raw) {
                let again = nrrd::parse(&bytes).unwrap();
                assert_eq!(nrrd::bytes(&again, Encoding::Raw).unwrap(), bytes);
            }
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with("reading an NRRD volume — ") && !text.contains(char::is_control), "{text}");
        }
    }
}

fn check_segmentation(segmentation: &Segmentation) {
    let labels = segmentation.segments.iter().map(|segment| segment.label_value);
    let named: usize = labels.map(|label| segmentation.count(label)).sum();
    assert_eq!(named + segmentation.count(0), segmentation.labels.len());
}
