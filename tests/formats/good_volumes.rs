//! Volumes as different programs write them, all to be read, and written so that they are read again.

use crate::support::folder;
use crate::support::volume_text;

use folder::folder;
use glam::DVec3;
use proptest::prelude::*;
use typodont_formats::nrrd;
use typodont_formats::nrrd::{Axis, CoordinateSystem, Encoding, Geometry, Samples, VoxelImage};
use volume_text::{Text, gzip};

fn check(text: Text) -> VoxelImage {
    let bytes = text.bytes();
    nrrd::parse(&bytes).unwrap_or_else(|error| panic!("{error}\n{}", String::from_utf8_lossy(&bytes)))
}

/// 0, 1, … as the samples of a type, in its file's bytes.
fn counting<const WIDTH: usize>(bytes: impl Fn(u8) -> [u8; WIDTH]) -> Vec<u8> {
    (0..24).flat_map(bytes).collect()
}

#[test]
fn every_type_in_every_guise_is_read() {
    // Aim: each alias of each type, raw and gzip, little and big endian, attached and detached, gives the same numbers.
    let i16s = |bytes: fn(i16) -> [u8; 2]| counting(move |i| bytes(i16::from(i) - 300));
    let u16s = |bytes: fn(u16) -> [u8; 2]| counting(move |i| bytes(u16::from(i) + 40_000));
    let f32s = |bytes: fn(f32) -> [u8; 4]| counting(move |i| bytes(f32::from(i) * -1.5));
    let f64s = |bytes: fn(f64) -> [u8; 8]| counting(move |i| bytes(f64::from(i) * -1.5));
    let [u8le, i8le] = [counting(|i| [i + 200]), counting(|i| [(i as i8 - 100) as u8])];
    let negative = Samples::F32((0..24u8).map(|i| f32::from(i) * -1.5).collect());
    type Row<'a> = (&'a [&'a str], [Vec<u8>; 2], Samples);
    let table: [Row; 6] = [
        (&["uchar", "unsigned char", "uint8", "uint8_t"], [u8le.clone(), u8le], Samples::U8((200..224).collect())),
        (&["signed char", "int8", "int8_t"], [i8le.clone(), i8le], Samples::I16((-100..-76).collect())),
        (
            &["short", "short int", "signed short", "signed short int", "int16", "int16_t"],
            [i16s(i16::to_le_bytes), i16s(i16::to_be_bytes)],
            Samples::I16((-300..-276).collect()),
        ),
        (
            &["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t", "UINT16"],
            [u16s(u16::to_le_bytes), u16s(u16::to_be_bytes)],
            Samples::U16((40_000..40_024).collect()),
        ),
        (&["float", "Float"], [f32s(f32::to_le_bytes), f32s(f32::to_be_bytes)], negative.clone()),
        (&["double"], [f64s(f64::to_le_bytes), f64s(f64::to_be_bytes)], negative),
    ];
    let mut read = 0;
    for (names, data, samples) in table {
        for (name, (endian, data)) in
            names.iter().flat_map(|name| ["little", "big"].into_iter().zip(&data).map(move |d| (name, d)))
        {
            for (encoding, data) in [("raw", data.clone()), ("gzip", gzip(data)), ("GZ", gzip(data))] {
                let text = Text::good()
                    .with(&format!("type: {name}"))
                    .with(&format!("endian: {endian}"))
                    .with(&format!("encoding: {encoding}"))
                    .data(data.clone());
                assert_eq!(check(text.clone()).samples, samples, "{name} {endian} {encoding}");
                let header = text.with("data file: ct.bin").data(Vec::new()).header();
                let detached = nrrd::parse_detached(&header, &mut |name| {
                    assert_eq!(name, "ct.bin");
                    Ok(data.clone())
                });
                assert_eq!(detached.unwrap().samples, samples, "{name} {endian} {encoding}, detached");
                read += 2;
            }
        }
    }
    assert!(read > 250, "{read} files");
}

#[test]
fn every_version_line_end_and_spelling_is_read() {
    let good = check(Text::good());
    for version in 1..=5 {
        assert_eq!(check(Text { magic: format!("NRRD000{version}"), ..Text::good() }), good);
    }
    assert_eq!(check(Text { line_end: "\r\n", ..Text::good() }), good);
    let shouted = ["TYPE: UChar", "Dimension:  3 ", "SizeS: 4\t3 2", "Encoding: RAW", "SpaceOrigin: ( 1 , 2 , 3 )"];
    let without_origin = Text::good().without("space origin");
    assert_eq!(check(shouted.iter().fold(without_origin, |text, line| text.with(line))), good);
    let remarks =
        ["# a comment", "#", "content: a tooth", "sample units: HU", "number: 24", "old min: 0", "content2:=x"];
    let remarked = remarks.iter().fold(Text::good(), |text, line| text.adding(line));
    assert_eq!(check(remarked).samples, good.samples);
    // Comments in the encodings of old scanners, and units in UTF-8.
    let mut latin = Text::good().header();
    latin.extend(b"# M\xfcller\nspace units: \"mm\" \"mm\" \"\"\nlabels: \"\xc2\xb5\" \"y\" \"z\"\n\n");
    latin.extend(0..24);
    assert_eq!(nrrd::parse(&latin).unwrap(), good);
}

#[test]
fn keys_come_back_in_order_and_unescaped() {
    let text = Text::good()
        .adding(r"b:=two\nlines and a \\ and a \t")
        .adding("a:=")
        .adding("time: of day:=12:30")
        .adding("URL:=http://x/?q:=1");
    let image = check(text.adding("a:="));
    let keys =
        [("b", "two\nlines and a \\ and a \\t"), ("a", ""), ("time: of day", "12:30"), ("URL", "http://x/?q:=1")];
    assert_eq!(image.keys, keys.map(|(key, value)| (key.to_string(), value.to_string())));
    assert_eq!(image.key("time: of day"), Some("12:30"));
    assert_eq!(image.key("c"), None);
}

#[test]
fn positions_agree_whatever_the_space_is_called() {
    // Aim: the same point of the patient, told in three spaces and seven spellings.
    let lps = check(Text::good()).geometry;
    assert_eq!(lps.position([2, 2, 1]), DVec3::new(2.0, 2.5, 5.0));
    assert_eq!((lps.spacing(), lps.space), (DVec3::new(0.5, 0.25, 2.0), CoordinateSystem::LeftPosteriorSuperior));
    assert!(lps.grid().is_some());
    for ras in ["right-anterior-superior", "RAS", "right anterior superior", "RightAnteriorSuperior"] {
        let text = Text::good()
            .with(&format!("space: {ras}"))
            .with("space directions: (-0.5,0,0) (0,-0.25,0) (0,0,2)")
            .with("space origin: (-1,-2,3)");
        assert_eq!(check(text).geometry, lps, "{ras}");
    }
    for las in ["left-anterior-superior", "las"] {
        let text = Text::good()
            .with(&format!("space: {las}"))
            .with("space directions: (0.5,0,0) (0,-0.25,0) (0,0,2)")
            .with("space origin: (1,-2,3)");
        assert_eq!(check(text).geometry, lps, "{las}");
    }
    assert_eq!(check(Text::good().with("space: LPS")).geometry, lps);
    for (name, space) in [
        ("scanner-xyz", CoordinateSystem::ScannerXyz),
        ("3D-right-handed", CoordinateSystem::RightHanded),
        ("3D left handed", CoordinateSystem::LeftHanded),
    ] {
        assert_eq!(check(Text::good().with(&format!("space: {name}"))).geometry, Geometry { space, ..lps.clone() });
    }
    let untold = Text::good().without("space").with("space dimension: 3");
    assert_eq!(check(untold).geometry, Geometry { space: CoordinateSystem::Unspecified, ..lps.clone() });
}

#[test]
fn spacings_alone_make_an_upright_grid_nowhere_in_particular() {
    let bare = Text::good().without("space").without("space directions").without("space origin");
    let geometry = check(bare.with("spacings: 0.5 0.25 2")).geometry;
    assert_eq!((geometry.spacing(), geometry.origin), (DVec3::new(0.5, 0.25, 2.0), DVec3::ZERO));
    assert_eq!(geometry.space, CoordinateSystem::Unspecified);
    // Beside directions, spacings are tolerated if they are the same or untold.
    assert_eq!(check(Text::good().with("spacings: 0.5 nan 2.0001")).geometry, check(Text::good()).geometry);
}

#[test]
fn a_turned_array_is_accepted_as_it_stands() {
    let turned = check(Text::good().with("space directions: (0,0,-0.5) (0.25,0.001,0) (0,2,0)")).geometry;
    let axis = |along, is_reversed| Axis { along, is_reversed };
    assert_eq!(turned.axes(), [axis(2, true), axis(0, false), axis(1, false)]);
    assert_eq!(turned.grid(), None);
}

#[test]
fn one_leading_axis_of_one_entry_is_no_hindrance() {
    let four = Text::good()
        .with("dimension: 4")
        .with("sizes: 1 4 3 2")
        .with("kinds: list domain domain domain")
        .with("space directions: none (0.5,0,0) (0,0.25,0) (0,0,2)");
    assert_eq!(check(four.clone()), check(Text::good()));
    let unknown =
        four.with("kinds: ??? space space space").with("space directions: (nan,nan,nan) (0.5,0,0) (0,0.25,0) (0,0,2)");
    assert_eq!(check(unknown), check(Text::good()));
}

#[test]
fn skips_lead_to_the_data() {
    let good = check(Text::good());
    let data: Vec<u8> = (0..24).collect();
    let behind = |front: &[u8]| [front, &data].concat();
    let lines = behind(b"P5\n4 6\n255\n");
    assert_eq!(check(Text::good().with("line skip: 3").data(lines.clone())), good);
    assert_eq!(check(Text::good().with("lineskip: 2").with("byteskip: 4").data(lines.clone())), good);
    assert_eq!(check(Text::good().with("byte skip: -1").data(lines)), good);
    assert_eq!(check(Text::good().with("byte skip: 7").data(behind(b"1234567"))), good);
    // Compressed: lines are skipped before, bytes after inflating.
    let gzipped = [b"# a line\n".to_vec(), gzip(&behind(b"1234567"))].concat();
    let text = Text::good().with("encoding: gzip").with("line skip: 1").with("byte skip: 7");
    assert_eq!(check(text.data(gzipped)), good);
}

#[test]
fn a_line_break_after_the_data_and_streams_in_pieces_are_tolerated() {
    let good = check(Text::good());
    let data: Vec<u8> = (0..24).collect();
    assert_eq!(check(Text::good().data([&data[..], b"\r\n"].concat())), good);
    let members = [gzip(&data[..5]), gzip(&[]), gzip(&data[5..]), b"\n".to_vec()].concat();
    assert_eq!(check(Text::good().with("encoding: gzip").data(members)), good);
}

#[test]
fn a_data_file_is_found_beside_its_header_and_below() {
    let folder = folder("data_file_beside");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    std::fs::create_dir(folder.join("ct scans")).unwrap();
    let data: Vec<u8> = (0..24).collect();
    write("tooth 50%.raw", &data);
    write("ct scans/tooth.raw.gz", &gzip(&data));
    // A detached header may end where its lines end, blank line or not.
    let header = |line: &str| Text::good().adding(line).header();
    write("beside.nhdr", &header("data file: tooth 50%.raw"));
    write("dot.nhdr", &[header("datafile: ./tooth 50%.raw"), b"\n".to_vec()].concat());
    let below = Text::good().with("encoding: gzip").adding("data file: ct scans/tooth.raw.gz").header();
    write("below.nhdr", &below);
    for name in ["beside.nhdr", "dot.nhdr", "below.nhdr"] {
        let image = nrrd::read(&folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(image, check(Text::good()), "{name}");
    }
}

#[test]
fn writing_is_deterministic_and_says_what_slicer_expects() {
    let image = check(Text::good().adding("patient:=typodont"));
    let bytes = nrrd::bytes(&image, Encoding::Gzip).unwrap();
    assert_eq!(bytes, nrrd::bytes(&image, Encoding::Gzip).unwrap());
    let end = bytes.windows(2).position(|pair| pair == b"\n\n").unwrap();
    let expected = "NRRD0004\n# Complete NRRD file format specification at:\n\
                    # http://teem.sourceforge.net/nrrd/format.html\ntype: uint8\ndimension: 3\n\
                    space: left-posterior-superior\nsizes: 4 3 2\nspace directions: (0.5,0,0) (0,0.25,0) (0,0,2)\n\
                    kinds: domain domain domain\nendian: little\nencoding: gzip\nspace origin: (1,2,3)\n\
                    patient:=typodont";
    assert_eq!(std::str::from_utf8(&bytes[..end]).unwrap(), expected);
    // RFC 1952: magic, deflate, no flags, no time, level, operating system unknown.
    assert_eq!(bytes[end + 2..][..8], [0x1f, 0x8b, 8, 0, 0, 0, 0, 0]);
    assert_eq!(bytes[end + 2 + 9], 255);
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let good = check(Text::good());
    let refused = |change: &dyn Fn(&mut VoxelImage), complaint: &str| {
        let mut image = good.clone();
        change(&mut image);
        let mut out = Vec::new();
        let error = nrrd::write(&image, Encoding::Raw, &mut out).unwrap_err().to_string();
        assert!(error.starts_with("writing an NRRD volume — ") && error.contains(complaint), "{error}");
        assert!(out.is_empty(), "nothing written");
    };
    refused(&|image| image.samples = Samples::U8(vec![0; 23]), "23 samples do not fill 4×3×2 voxels");
    refused(&|image| (image.geometry.dims, image.samples) = ([0, 3, 2], Samples::U8(vec![])), "0 samples");
    refused(&|image| image.geometry.dims = [5000, 1, 1], "5000 voxels along axis 1");
    refused(&|image| image.geometry.steps[1] = DVec3::ZERO, "the spacing along axis 2 is 0 mm");
    refused(&|image| image.geometry.steps[2] = DVec3::new(0.0, 0.5, 1.0), "axis 3 is oblique");
    refused(&|image| image.geometry.origin.x = f64::NAN, "the space origin");
    for (key, value, complaint) in [
        ("", "x", "is empty"),
        ("#a", "x", "would be read as a comment"),
        ("a:=b", "x", "that ends a key"),
        ("Sizes: a", "x", "would be read as a field"),
        ("a", "x\ry", "carriage return"),
        ("a\0", "x", "a zero"),
    ] {
        let keys = vec![(key.to_string(), value.to_string())];
        refused(&|image| image.keys = keys.clone(), complaint);
    }
    let twice = vec![("a".to_string(), String::new()); 2];
    refused(&|image| image.keys = twice.clone(), "is present twice");
    let many: Vec<_> = (0..20_000).map(|i| (i.to_string(), String::new())).collect();
    refused(&|image| image.keys = many.clone(), "more keys than fit into a header");
}

/// Any volume that can be written.
fn images() -> impl Strategy<Value = VoxelImage> {
    let dims = [1u32..7, 1u32..7, 1u32..7];
    let spacing = prop::array::uniform3(1e-3f64..10.0);
    let order = prop::sample::select(vec![[0usize, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]]);
    let origin = prop::array::uniform3(-1e4f64..1e4);
    let lean = prop::array::uniform3(-0.005f64..0.005);
    let space = prop::sample::select(vec![
        CoordinateSystem::LeftPosteriorSuperior,
        CoordinateSystem::ScannerXyz,
        CoordinateSystem::RightHanded,
        CoordinateSystem::LeftHanded,
        CoordinateSystem::Unspecified,
    ]);
    let geometry = (dims, spacing, order, prop::array::uniform3(any::<bool>()), lean, origin, space).prop_map(
        |(dims, spacing, order, is_reversed, lean, origin, space)| {
            let step = |i: usize| {
                let length = if is_reversed[i] { -spacing[i] } else { spacing[i] };
                let mut step = DVec3::splat(lean[i] * length);
                step[order[i]] = length;
                step
            };
            Geometry { dims, steps: [step(0), step(1), step(2)], origin: DVec3::from_array(origin), space }
        },
    );
    let keys = prop::collection::btree_map("[^\r\0#:][^\r\0:]{0,8}:?", "[^\r\0]{0,12}", 0..5);
    (geometry, keys).prop_flat_map(|(geometry, keys)| {
        let len = geometry.len();
        let samples = prop_oneof![
            prop::collection::vec(any::<u8>(), len).prop_map(Samples::U8),
            prop::collection::vec(any::<i16>(), len).prop_map(Samples::I16),
            prop::collection::vec(any::<u16>(), len).prop_map(Samples::U16),
            prop::collection::vec(-1e30f32..1e30, len).prop_map(Samples::F32),
        ];
        let keys: Vec<(String, String)> = keys.into_iter().collect();
        samples.prop_map(move |samples| VoxelImage { geometry: geometry.clone(), samples, keys: keys.clone() })
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_back_bit_for_bit(image in images()) {
        for encoding in [Encoding::Raw, Encoding::Gzip] {
            let bytes = nrrd::bytes(&image, encoding).unwrap();
            prop_assert_eq!(nrrd::parse(&bytes).unwrap(), image.clone());
        }
    }

    #[test]
    fn a_mutated_file_is_read_whole_or_refused_in_words(
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0usize..6, any::<Vec<u8>>()), 1..6),
        is_gzip in any::<bool>(),
    ) {
        // Aim: no header makes the reader panic. Method: replace bytes of good files by others.
        let good = Text::good().adding("spacings: 0.5 0.25 2").adding("byte skip: 0").adding("a key:=a value");
        let mut bytes = if is_gzip { good.gzip().bytes() } else { good.bytes() };
        for (at, removed, put) in cuts {
            let at = at.index(bytes.len());
            let end = (at + removed).min(bytes.len());
            bytes.splice(at..end, put.into_iter().take(8));
        }
        match nrrd::parse(&bytes) {
            Ok(image) => prop_assert_eq!(image.samples.len(), image.geometry.len()),
            Err(error) => prop_assert!(error.to_string().starts_with("reading an NRRD volume — ")),
        }
    }

    #[test]
    fn a_field_may_say_anything(field in 0usize..12, text in "[-+0-9a-zA-Z.,()\" %\u{b5}]{0,30}") {
        // Aim: no text of any field makes the reader panic. Method: nonsense in one field of a good file.
        let fields = ["type", "dimension", "sizes", "encoding", "endian", "space", "space directions", "space origin",
                      "spacings", "space units", "kinds", "data file"];
        let bytes = Text::good().with(&format!("{}: {text}", fields[field])).bytes();
        if let Ok(image) = nrrd::parse(&bytes) {
            prop_assert_eq!(image.samples.len(), image.geometry.len());
        }
    }
}
