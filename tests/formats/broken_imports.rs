//! Scans and surfaces that are broken: refused in words, without a panic, and without taking memory for what is not there.

use crate::support::folder;
use crate::support::import_files;

use folder::folder;
use import_files::*;
use std::path::Path;
use typodont_formats::imaging;
use typodont_formats::imaging::{ImportedScan, ReadOptions, ScanError, metaimage, nifti};
use typodont_formats::surfaces;

/// Maximum memory for reading a file of a few hundred bytes, bytes.
const MEMORY_MAX: u64 = 4 << 20;

/// Error text for a damaged file, read within the memory limit; `None` if it can be read.
fn told<T>(name: &str, read: impl FnOnce() -> Result<T, ScanError>) -> Option<String> {
    let mut outcome = None;
    let counted = allocation_counter::measure(|| outcome = Some(read().map(drop)));
    assert!(counted.bytes_max < MEMORY_MAX, "{name}: {} bytes", counted.bytes_max);
    let told = outcome.unwrap().err().map(|unread| unread.to_string())?;
    assert!(told.matches(" — ").count() >= 2 && !told.contains(['\n', '\r', '\x1b']), "{name}: {told:?}");
    Some(told)
}

fn check<T>(name: &str, said: &[&str], read: impl FnOnce() -> Result<T, ScanError>) {
    let told = told(name, read).unwrap_or_else(|| panic!("{name} was read"));
    said.iter().for_each(|part| assert!(told.contains(part), "{name}: {part:?} in: {told}"));
}

/// Every shorter file, and every file with one bit changed: what comes of them, as words or a volume.
fn damage<T>(name: &str, good: &[u8], must_refuse_cuts: bool, read: impl Fn(&[u8]) -> Result<T, ScanError>) {
    assert!(told(name, || read(good)).is_none(), "{name}: the good one is read");
    for end in 0..good.len() {
        let found = told(name, || read(&good[..end]));
        assert!(found.is_some() || !must_refuse_cuts, "{name}: cut at {end} of {}", good.len());
    }
    for bit in 0..8 * good.len() {
        let mut bytes = good.to_vec();
        bytes[bit / 8] ^= 1 << (bit % 8);
        told(name, || read(&bytes));
    }
}

#[test]
fn damaged_niftis_and_meta_images_are_refused_or_read_within_bounds() {
    damage("nifti", &Nifti::good().bytes(), true, nifti::parse);
    damage("nifti.gz", &gzip(&Nifti::good().bytes()), true, nifti::parse);
    let data: Vec<u8> = (0..24).collect();
    damage("mha", &meta_image(&[], &data), true, metaimage::parse);
    damage("zlib mha", &meta_image(&["CompressedData = True"], &zlib(&data)), true, metaimage::parse);
}

#[test]
fn damaged_surfaces_are_refused_or_read_within_bounds() {
    for (name, ending, bytes) in tetrahedra() {
        // A text cut within its last number or line, and an OBJ without its last faces, are still whole files.
        let must_refuse = matches!(name, "stl binary" | "ply little" | "ply big");
        damage(name, &bytes, must_refuse, |bytes| {
            surfaces::parse(bytes, ending, |_| {
                Err(typodont_formats::diagnostic::Diagnostic::about_file("", "no", "none", None))
            })
        });
    }
}

/// The series of a folder with one of its files changed.
fn damaged_series(folder: &Path, bytes: &[u8]) -> Result<ImportedScan, ScanError> {
    write_anew(&folder.join("b.dcm"), bytes);
    imaging::read(folder, &ReadOptions::default())
}

/// A file's new content. Written over the old one, some file systems would wait for the disk each time.
fn write_anew(path: &Path, bytes: &[u8]) {
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn damaged_slices_are_refused_or_read_within_bounds() {
    for (name, syntax) in [("explicit", EXPLICIT), ("implicit", IMPLICIT)] {
        let folder = folder(&format!("damaged_{name}"));
        let slice = |z: f64| Slice { syntax, ..Slice::at(z, 100) };
        slice(1.0).write(&folder.join("a.dcm"));
        slice(2.0).write(&folder.join("b.dcm"));
        let good = std::fs::read(folder.join("b.dcm")).unwrap();
        // A file cut off so early that it cannot be recognised as a slice is refused by its name.
        damage(name, &good, true, |bytes| damaged_series(&folder, bytes));
    }
}

#[test]
fn damaged_lossless_pixels_never_bring_the_program_down() {
    // A JPEG Lossless stream of 4×2 pixels of 8 bits, predicted from the left, made by hand after ITU-T T.81.
    let stream = lossless();
    let folder = folder("damaged_jpeg");
    let slice = |z: f64, stream: Vec<u8>| Slice {
        syntax: "1.2.840.10008.1.2.4.70",
        columns: 4,
        rows: 2,
        bits: 16,
        fragments: Some(vec![stream]),
        ..Slice::at(z, 0)
    };
    slice(1.0, stream.clone()).write(&folder.join("a.dcm"));
    for bit in 0..8 * stream.len() {
        let mut broken = stream.clone();
        broken[bit / 8] ^= 1 << (bit % 8);
        write_anew(&folder.join("b.dcm"), &slice(2.0, broken).bytes());
        let _ = imaging::read(&folder, &ReadOptions::default());
    }
    for end in (0..stream.len()).step_by(2) {
        write_anew(&folder.join("b.dcm"), &slice(2.0, stream[..end].to_vec()).bytes());
        let told = imaging::read(&folder, &ReadOptions::default());
        assert!(told.is_err() || end + 4 >= stream.len(), "cut at {end}");
    }
}

/// Every difference is 0: eight pixels of 2^15.
fn lossless() -> Vec<u8> {
    let mut stream = vec![0xFF, 0xD8];
    // Frame: lossless, 16 bits, 2 rows of 4, one component.
    stream.extend([0xFF, 0xC3, 0, 11, 16, 0, 2, 0, 4, 1, 1, 0x11, 0]);
    // One code, of one bit, for the category 0.
    stream.extend([0xFF, 0xC4, 0, 20, 0, 1]);
    stream.extend([0; 15]);
    stream.push(0);
    // Scan: predictor 1.
    stream.extend([0xFF, 0xDA, 0, 8, 1, 1, 0, 1, 0, 0]);
    stream.extend([0x00, 0xFF, 0xD9]);
    stream
}

#[test]
fn headers_that_promise_too_much_are_refused_before_any_memory_is_taken() {
    let huge = |n: i16| {
        let mut nifti = Nifti::good();
        [42, 44, 46].into_iter().for_each(|at| nifti.short(at, n));
        nifti
    };
    check("huge nifti", &["declares more"], || nifti::parse(&huge(400).bytes()));
    check("huge nifti.gz", &["declares more"], || nifti::parse(&gzip(&huge(500).bytes())));
    check("vast nifti", &["voxels are more than", "crop"], || nifti::parse(&huge(4000).bytes()));
    check("wide nifti", &["along axis 1 are more than 4096"], || nifti::parse(&huge(4097).bytes()));
    let big = ["DimSize = 600 600 600"];
    check("huge mha", &["declares more"], || metaimage::parse(&meta_image(&big, &[0; 24])));
    let zipped = ["DimSize = 600 600 600", "CompressedData = True"];
    check("huge zlib mha", &["declares more"], || metaimage::parse(&meta_image(&zipped, &zlib(&[0; 24]))));
    let ply = b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0123456789ab";
    let parse = |bytes: &[u8], ending| surfaces::parse(bytes, ending, |_| panic!("nothing else"));
    let listed =
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_indices\nend_header\n0 1 1\n3 0 0 0\n";
    check("a list for a number", &["its corners have no x, y and z"], || parse(listed, "ply"));
    check("huge ply", &["declares 4000000000 entries of \"vertex\", but has space for 1"], || parse(ply, "ply"));
    let stl = [&[0u8; 80][..], &u32::MAX.to_le_bytes(), &[0; 50]].concat();
    check("huge stl", &["declares 4294967295 triangles"], || parse(&stl, "stl"));
}

#[test]
fn what_is_not_read_is_refused_by_name_and_with_a_way_out() {
    let nifti = |change: &dyn Fn(&mut Nifti)| {
        let mut nifti = Nifti::good();
        change(&mut nifti);
        nifti.bytes()
    };
    let refuse = |name: &str, said: &[&str], bytes: Vec<u8>| check(name, said, || nifti::parse(&bytes));
    refuse("colours", &["colour values (datatype 128)", "per voxel"], nifti(&|n| n.short(70, 128)));
    refuse("complex", &["complex numbers"], nifti(&|n| n.short(70, 32)));
    refuse(
        "a series in time",
        &["contains 9 volumes", "single volume"],
        nifti(&|n| {
            n.short(40, 4);
            n.short(48, 9);
        }),
    );
    refuse("flat", &["it has 2 axes", "stack"], nifti(&|n| n.short(40, 2)));
    refuse("two files", &[".hdr and .img", ".nii"], nifti(&|n| n.header[344..348].copy_from_slice(b"ni1\0")));
    refuse("analyze", &["Analyze 7.5"], nifti(&|n| n.header[344] = 0));
    refuse("nifti 2", &["NIfTI-2"], nifti(&|n| n.header[0..4].copy_from_slice(&540i32.to_le_bytes())));
    refuse("offset", &["cannot begin at byte"], nifti(&|n| n.float(108, f32::NAN)));
    refuse("noise", &["does not begin like a NIfTI file"], vec![7; 400]);
    refuse("empty", &["empty"], Vec::new());
    let meta = |name: &str, line: &str, said: &[&str]| {
        check(name, said, || metaimage::parse(&meta_image(&[line], &[0; 24])));
    };
    meta("channels", "ElementNumberOfChannels = 3", &["3 values per voxel"]);
    meta("flat", "NDims = 2", &["2 axes"]);
    meta("list", "ElementDataFile = LIST", &["several files", "one .mha"]);
    meta("elsewhere", "ElementDataFile = ../../etc/passwd", &["not in the header's folder"]);
    meta("absolute", "ElementDataFile = /etc/passwd", &["not in the header's folder"]);
    meta("type", "ElementType = MET_FLOAT_ARRAY", &["MET_FLOAT_ARRAY", "MET_SHORT"]);
    meta("sizes", "DimSize = 4 3 0", &["`DimSize`", "above 0"]);
    meta("prose", "once upon a time", &["is not `Key = value`"]);
    meta("escape", "Dim\u{1b}Size = 4\nDim\u{1b}Size = 4", &["`Dim·Size` is present twice"]);
}

#[test]
fn a_folder_that_is_not_one_whole_even_series_is_refused_with_the_file_at_fault() {
    let refuse = |name: &str, said: &[&str], vary: &dyn Fn(u16, &mut Slice), after: &dyn Fn(&Path)| {
        let folder = folder(&format!("refused_{}", name.replace(' ', "_")));
        series(&folder, 6, vary);
        after(&folder);
        check(name, said, || imaging::read(&folder, &ReadOptions::default()));
    };
    let nothing = |_: &Path| {};
    let two = "1.2.3.4.77";
    refuse(
        "two series",
        &["contains 2 series: number 5 \"Jaw\" of 4 slices", "number 77", "--series"],
        &|k, s| s.series = if k > 3 { two } else { "1.2.3.4.5" },
        &nothing,
    );
    let other_size = |k: u16, s: &mut Slice| {
        if k == 2 {
            (s.columns, s.rows) = (4, 5);
        }
    };
    refuse("another size", &["has 4×5 pixels, IM", "has 5×4", "IM013.dcm"], &other_size, &nothing);
    let finer = |k: u16, s: &mut Slice| s.spacing[0] = if k == 2 { 0.2 } else { 0.4 };
    refuse("another spacing", &["0.3×0.2 mm apart", "IM013.dcm"], &finer, &nothing);
    let scout = |k: u16, s: &mut Slice| {
        if k == 2 {
            s.orientation = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
        }
    };
    refuse("a scout view", &["orientation of this slice differs", "localizer", "IM013.dcm"], &scout, &nothing);
    refuse(
        "a missing slice",
        &["between IM001.dcm and IM011.dcm 1 slices are missing", "again"],
        &|_, _| {},
        &|folder| {
            std::fs::remove_file(folder.join("IM006.dcm")).unwrap();
        },
    );
    refuse(
        "a doubled slice",
        &["IM006.dcm and copy.dcm are at the same position", "present twice"],
        &|_, _| {},
        &|folder| {
            std::fs::copy(folder.join("IM006.dcm"), folder.join("copy.dcm")).map(drop).unwrap();
        },
    );
    let uneven = |k: u16, s: &mut Slice| s.position[2] += if k == 3 { 0.1 } else { 0.0 };
    refuse("uneven slices", &["are 0.600 mm apart, the others 0.500 mm", "even slices"], &uneven, &nothing);
    let tilted = |k: u16, s: &mut Slice| s.position[1] += 0.1 * f64::from(k);
    refuse("a tilted gantry", &["tilted by 11.3°", "gantry tilt"], &tilted, &nothing);
    let jpeg_2000 = |_: u16, s: &mut Slice| {
        s.syntax = "1.2.840.10008.1.2.4.90";
        s.fragments = Some(vec![vec![0; 10]]);
    };
    refuse("compressed", &["JPEG 2000 Lossless (1.2.840.10008.1.2.4.90)", "uncompressed"], &jpeg_2000, &nothing);
    refuse("many frames", &["40 frames", "single slices"], &|_, s| s.frames = Some("40"), &nothing);
    refuse("colours", &["in colour (\"RGB\")"], &|_, s| s.photometric = "RGB", &nothing);
    refuse("inverted", &["MONOCHROME1"], &|_, s| s.photometric = "MONOCHROME1", &nothing);
    let cut = |folder: &Path| {
        let path = folder.join("IM006.dcm");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(path, &bytes[..bytes.len() - 7]).unwrap();
    };
    refuse("a cut slice", &["ends within an element", "IM006.dcm"], &|_, _| {}, &cut);
    let empty = folder("refused_empty");
    check("an empty folder", &["no DICOM slice in this folder"], || imaging::read(&empty, &ReadOptions::default()));
    std::fs::create_dir(empty.join("CT")).unwrap();
    check("folders in it", &["contains 1 folders"], || imaging::read(&empty, &ReadOptions::default()));
    let one = folder("refused_one");
    series(&one, 1, |_, _| {});
    check("one slice", &["there is one slice"], || imaging::read(&one, &ReadOptions::default()));
    check("a slice by itself", &["a single DICOM file", "name the folder"], || {
        imaging::read(&one.join("IM003.dcm"), &ReadOptions::default())
    });
}

#[test]
fn one_of_two_series_is_read_by_its_number_or_its_uid() {
    let folder = folder("chosen_series");
    series(&folder, 6, |k, slice| {
        if k > 2 {
            slice.series = "1.2.3.4.77";
        }
    });
    let read = |series: &str| imaging::read(&folder, &ReadOptions { series: Some(series.into()), raw: None });
    assert_eq!(read("77").unwrap().image.geometry.origin.z, 8.5);
    assert_eq!(read("3.4.5").unwrap().image.geometry.origin.z, 7.0);
    check("no such series", &["no series \"8\"", "number 77"], || read("8"));
}
