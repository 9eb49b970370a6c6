//! Volumes that are broken, cut short, mislabelled or hostile: each refused with a complaint that says what is wrong,
//! where, and what to do, quickly and without taking more memory than an honest file of its size.

use crate::support::folder;
use crate::support::volume_text;

use flate2::{Compress, Compression, FlushCompress};
use folder::folder;
use std::path::Path;
use std::time::{Duration, Instant};
use typodont_formats::nrrd;
use volume_text::{Text, gzip};

/// A broken file and what its complaint has to mention.
struct Case {
    name: &'static str,
    bytes: Vec<u8>,
    complaint: &'static [&'static str],
}

fn case(name: &'static str, bytes: impl Into<Vec<u8>>, complaint: &'static [&'static str]) -> Case {
    Case { name, bytes: bytes.into(), complaint }
}

/// A good file with one line replaced or added.
fn line(name: &'static str, line: &str, complaint: &'static [&'static str]) -> Case {
    case(name, Text::good().with(line).bytes(), complaint)
}

/// A good file without a field.
fn lacking(field: &'static str, complaint: &'static [&'static str]) -> Case {
    case(field, Text::good().without(field).bytes(), complaint)
}

/// A good header that names a data file.
fn detached(name: &'static str, data_file: &str, complaint: &'static [&'static str]) -> Case {
    case(name, Text::good().with(&format!("data file: {data_file}")).header(), complaint)
}

/// A good header and these compressed data, on byte 191 and after.
fn gzipped(name: &'static str, data: Vec<u8>, complaint: &'static [&'static str]) -> Case {
    case(name, Text::good().with("encoding: gzip").data(data).bytes(), complaint)
}

/// A gzip stream of `mebibytes` MiB of zeros in about as many KiB: one deflate block, over and over.
fn bomb(mebibytes: usize) -> Vec<u8> {
    let mut deflate = Compress::new(Compression::best(), false);
    let mut block = Vec::with_capacity(1 << 16);
    deflate.compress_vec(&[0; 1 << 20], &mut block, FlushCompress::Full).unwrap();
    let header = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    [header.to_vec(), block.repeat(mebibytes)].concat()
}

fn noise(len: usize) -> Vec<u8> {
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1664525).wrapping_add(1013904223);
        (state >> 24) as u8
    };
    (0..len).map(|_| next()).collect()
}

fn good_gzip() -> Vec<u8> {
    gzip(&(0..24).collect::<Vec<u8>>())
}

/// The good compressed data with one byte changed, counted from the end if negative.
fn flipped(at: isize) -> Vec<u8> {
    let mut data = good_gzip();
    let at = at.rem_euclid(data.len() as isize) as usize;
    data[at] ^= 0x55;
    data
}

const MISSING: &str = "add the line with the true value of this volume";
const AGAIN: &str = "copy or export the file again";

fn whole_file() -> Vec<Case> {
    let named = |magic: &str| Text { magic: magic.to_string(), ..Text::good() }.bytes();
    vec![
        case("empty", [], &["the file is empty", AGAIN]),
        case("three_bytes", *b"NRR", &["byte 0", "does not begin with NRRD0001", "export the volume as NRRD"]),
        case("noise", noise(1 << 16), &["byte 0", "does not begin with NRRD0001", "export the volume as NRRD"]),
        case("png", *b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", &["byte 0", "does not begin", "export the volume as NRRD"]),
        case(
            "byte_order_mark",
            [b"\xef\xbb\xbf".to_vec(), Text::good().bytes()].concat(),
            &["byte 0", "does not begin"],
        ),
        case(
            "noise_after_magic",
            [b"NRRD".to_vec(), noise(1 << 16)].concat(),
            &["line 1", "is not a known version", "re-save"],
        ),
        case("future_version", named("NRRD0006"), &["line 1", "\"NRRD0006\" is not a known version", "NRRD0005"]),
        case("wrong_magic", named("NRRD4"), &["line 1", "\"NRRD4\"", "re-save it as NRRD0005"]),
        case("magic_alone", *b"NRRD0004", &["line 2", "before the blank line", AGAIN]),
        case("header_cut_off", Text::good().header(), &["line 10", "before the blank line", AGAIN]),
    ]
}

fn header_as_text() -> Vec<Case> {
    let million_keys: String = (0..1_000_000).map(|i| format!("k{i}:=v\n")).collect();
    let after_good = |text: &[u8]| [&Text::good().header(), text].concat();
    vec![
        case("bare_returns", Text { line_end: "\r", ..Text::good() }.bytes(), &["line 1", "CR alone", "LF or CR LF"]),
        case(
            "comments_of_2_mb",
            after_good(&b"# nothing\n".repeat(200_000)),
            &["line 16384", "more than 16384 lines", "remove unused comments"],
        ),
        case(
            "long_lines_of_2_mb",
            after_good(&[b'#'; 1000].map(|_| [&[b'#'; 2000][..], b"\n"].concat()).concat()),
            &["the header is longer than 1048576 bytes", "remove unused comments"],
        ),
        case(
            "one_line_of_2_mb",
            after_good(&[b'x'; 2 << 20]),
            &["line 10", "longer than 1048576 bytes", "remove unused comments"],
        ),
        case(
            "million_keys",
            after_good(million_keys.as_bytes()),
            &["line 16384", "more than 16384 lines", "remove unused comments"],
        ),
        case(
            "latin_1_field",
            after_good(b"content: M\xfcller\n\n"),
            &["line 10", "column 11 is not UTF-8", "re-save the header as UTF-8"],
        ),
        case(
            "latin_1_key",
            after_good(b"name:=M\xfcller\n\n"),
            &["line 10", "column 8 is not UTF-8", "re-save the header"],
        ),
        line(
            "prose",
            "once upon a time",
            &["line 10", "\"once upon a time\" is neither a field nor a key", "begin the line with #"],
        ),
        line("no_space_after_colon", "line skip:3", &["line 10", "\"line skip:3\" is neither", "write `field: text`"]),
        line("control_characters", "\u{1b}[2J\u{202e}gone", &["line 10", "\"\\u{1b}[2J\\u{202e}gone\" is neither"]),
        line("misspelt_field", "tpye: uint8", &["line 10", "no field \"tpye\"", "did you mean `type`?"]),
        line("foreign_field", "acquisition date: today", &["line 10", "no field \"acquisition date\"", "`key:=value`"]),
        case(
            "type_twice",
            Text::good().adding("type: float").bytes(),
            &["line 10", "`type` is already present on line 2", "keep only the correct one"],
        ),
        case(
            "sizes_twice",
            Text::good().adding("sizes: 4 3 2").bytes(),
            &["line 10", "`sizes` is already present on line 5", "keep only"],
        ),
        case(
            "key_twice",
            Text::good().adding("a:=1").adding("a:=2").bytes(),
            &["line 11", "`a` is already present on line 10", "keep only"],
        ),
        case(
            "data_file_twice",
            Text::good().adding("data file: a.raw").adding("datafile: b.raw").bytes(),
            &["line 11", "`data file` is already present on line 10", "keep only"],
        ),
    ]
}

fn fields() -> Vec<Case> {
    vec![
        lacking("type", &["no `type`", MISSING, "type: uint8"]),
        lacking("dimension", &["no `dimension`", MISSING, "dimension: 3"]),
        lacking("sizes", &["no `sizes`", MISSING, "sizes: "]),
        lacking("encoding", &["no `encoding`", MISSING, "encoding: raw"]),
        lacking("space directions", &["no `space directions`", MISSING]),
        lacking("space", &["no `space`", MISSING, "space: left-posterior-superior"]),
        case(
            "no_spacing_at_all",
            Text::good().without("space").without("space directions").bytes(),
            &["no `spacings`", MISSING, "spacings: 0.2"],
        ),
        case(
            "origin_in_no_space",
            Text::good().without("space").without("space directions").with("spacings: 1 1 1").bytes(),
            &["no `space`", MISSING],
        ),
        case(
            "endian_missing",
            Text::good().with("type: uint16").data(vec![0; 48]).bytes(),
            &["no `endian`", "endian: little"],
        ),
        line("endian_unknown", "endian: middle", &["line 10", "`endian` cannot be \"middle\"", "`little` or `big`"]),
        line("type_int32", "type: int32", &["line 2", "`type: int32` is not supported", "save it as uint8"]),
        line("type_block", "type: block", &["line 2", "`type: block` is not supported", "save it as uint8"]),
        line("type_char", "type: char", &["line 2", "`type: char`", "save it as uint8"]),
        line("type_empty", "type: ", &["line 2", "`type: `", "save it as uint8"]),
        line(
            "encoding_ascii",
            "encoding: ascii",
            &["line 8", "`encoding: ascii` is not supported", "`encoding: gzip`"],
        ),
        line("encoding_hex", "encoding: hex", &["line 8", "`encoding: hex`", "re-save it with `encoding: gzip`"]),
        line("encoding_bzip2", "encoding: bzip2", &["line 8", "`encoding: bzip2`", "re-save it with `encoding: gzip`"]),
        line(
            "flat_image",
            "dimension: 2",
            &["line 3", "`dimension: 2` is not supported", "a flat image is not a volume"],
        ),
        line("five_axes", "dimension: 5", &["line 3", "`dimension: 5`", "a single volume of three axes"]),
        line(
            "dimension_in_words",
            "dimension: three",
            &["line 3", "`dimension` cannot be \"three\"", "the number of axes, 3"],
        ),
        case(
            "overlapping_segments",
            Text::good()
                .with("dimension: 4")
                .with("sizes: 2 4 3 1")
                .with("kinds: list domain domain domain")
                .with("space directions: none (0.5,0,0) (0,0.25,0) (0,0,2)")
                .bytes(),
            &["line 5", "2 values per voxel", "export a single volume"],
        ),
        line("colours", "kinds: RGB-color domain domain", &["line 7", "RGB-color", "export a single volume"]),
        case(
            "four_axes_of_space",
            Text::good().with("dimension: 4").with("sizes: 1 4 3 2").with("kinds: space space space space").bytes(),
            &["line 7", "export a single volume"],
        ),
        line("two_sizes", "sizes: 12 2", &["line 5", "`sizes` has 2 entries, but the volume has 3 axes", "give 3"]),
        line("four_sizes", "sizes: 4 3 2 1", &["line 5", "`sizes` has 4 entries", "give 3, one per axis"]),
        case(
            "half_a_million_sizes",
            Text::good().with(&format!("sizes: {}", "4 ".repeat(500_000))).bytes(),
            &["line 5", "`sizes` has 500000 entries", "give 3"],
        ),
        line("size_zero", "sizes: 4 0 2", &["line 5", "`sizes` cannot be \"0\"", "above 0"]),
        line("size_negative", "sizes: 4 3 -2", &["line 5", "`sizes` cannot be \"-2\"", "above 0"]),
        line("size_with_sign", "sizes: +4 3 2", &["line 5", "`sizes` cannot be \"+4\"", "a whole number"]),
        line("size_in_fractions", "sizes: 4.5 3 2", &["line 5", "`sizes` cannot be \"4.5\"", "a whole number"]),
        line(
            "size_huge",
            "sizes: 5000 3 2",
            &["line 5", "5000 voxels along axis 1 are more than 4096", "crop the volume"],
        ),
        line(
            "size_beyond_64_bits",
            "sizes: 4 99999999999999999999 2",
            &["line 5", "`sizes` cannot be \"99999999999999999999\"", "up to 4096"],
        ),
        line(
            "product_huge",
            "sizes: 4096 4096 4096",
            &["line 5", "68719476736 voxels are more than 268435456", "crop the volume"],
        ),
        line(
            "product_overflows",
            "sizes: 4294967296 4294967296 4294967297",
            &["line 5", "4294967296 voxels along axis 1", "crop the volume"],
        ),
    ]
}

fn space() -> Vec<Case> {
    let spaced = |spacings: &str| {
        let bare = Text::good().without("space").without("space directions").without("space origin");
        bare.with(&format!("spacings: {spacings}")).bytes()
    };
    vec![
        case("spacing_nan", spaced("1 nan 1"), &["line 7", "the spacing along axis 2 is NaN mm", "0.0001 to 1000 mm"]),
        case(
            "spacing_infinite",
            spaced("inf 1 1"),
            &["line 7", "the spacing along axis 1 is inf mm", "0.0001 to 1000 mm"],
        ),
        case("spacing_zero", spaced("1 1 0"), &["line 7", "the spacing along axis 3 is 0 mm", "0.0001 to 1000 mm"]),
        case(
            "spacing_negative",
            spaced("1 -1 1"),
            &["line 7", "the spacing along axis 2 is -1 mm", "0.0001 to 1000 mm"],
        ),
        case(
            "spacing_in_metres",
            spaced("2e-9 2e-9 2e-9"),
            &["line 7", "along axis 1 is 0.000000002 mm", "0.0001 to 1000 mm"],
        ),
        case("spacing_in_words", spaced("1 one 1"), &["line 7", "`spacings` cannot be \"one\"", "a distance in mm"]),
        case("two_spacings", spaced("1 1"), &["line 7", "`spacings` has 2 entries", "give 3"]),
        line(
            "spacings_disagree",
            "spacings: 0.5 0.5 2",
            &[
                "line 10",
                "along axis 2 the spacing is 0.5 mm, but the direction is 0.25 mm long",
                "remove the `spacings` line",
            ],
        ),
        line(
            "directions_zero",
            "space directions: (0,0,0) (0,0,0) (0,0,0)",
            &["line 6", "along axis 1 is 0 mm", "0.0001 to 1000 mm"],
        ),
        line("one_direction_zero", "space directions: (1,0,0) (0,1,0) (0,0,0)", &["line 6", "along axis 3 is 0 mm"]),
        line("direction_nan", "space directions: (1,0,0) (0,nan,0) (0,0,1)", &["line 6", "along axis 2 is NaN mm"]),
        line(
            "direction_infinite",
            "space directions: (1,0,0) (0,1,0) (0,0,inf)",
            &["line 6", "along axis 3 is inf mm"],
        ),
        line(
            "direction_overflows",
            "space directions: (1e200,1e200,0) (0,1,0) (0,0,1)",
            &["line 6", "along axis 1 is inf mm"],
        ),
        line(
            "oblique",
            "space directions: (0.7,0.7,0) (-0.7,0.7,0) (0,0,1)",
            &["line 6", "axis 1 is oblique: 70.7 %", "resample it along the axes"],
        ),
        line(
            "slightly_oblique",
            "space directions: (1,0,0) (0,1,0.02) (0,0,1)",
            &["line 6", "axis 2 is oblique: 2.0 %", "resample"],
        ),
        line(
            "parallel",
            "space directions: (1,0,0) (0,1,0) (0,-1,0)",
            &["line 6", "axes 2 and 3 of the array run along the same", "a different direction"],
        ),
        line(
            "direction_none",
            "space directions: none (0,1,0) (0,0,1)",
            &["line 6", "none", "three axes must be spatial"],
        ),
        line(
            "two_directions",
            "space directions: (1,0,0) (0,1,0)",
            &["line 6", "`space directions` has 2 entries", "give 3"],
        ),
        case(
            "many_directions",
            Text::good().with(&format!("space directions: {}", "(1,0,0)".repeat(100_000))).bytes(),
            &["line 6", "`space directions` has 100000 entries", "give 3"],
        ),
        line(
            "direction_of_two",
            "space directions: (1,0) (0,1) (0,0)",
            &["line 6", "`space directions` cannot be \"1,0\"", "a vector for each axis"],
        ),
        line(
            "direction_of_four",
            "space directions: (1,0,0,0) (0,1,0,0) (0,0,1,0)",
            &["line 6", "cannot be \"1,0,0,0\"", "a vector for each axis"],
        ),
        line(
            "direction_open",
            "space directions: (1,0,0) (0,1,0) (0,0,1",
            &["line 6", "cannot be", "a vector for each axis"],
        ),
        line("origin_nan", "space origin: (0,nan,0)", &["line 9", "not a position within one kilometre", "(0,0,0)"]),
        line("origin_on_the_moon", "space origin: (0,0,3.8e11)", &["line 9", "not a position within one kilometre"]),
        line(
            "origin_of_two",
            "space origin: (0,0)",
            &["line 9", "`space origin` cannot be \"0,0\"", "a position in mm"],
        ),
        line(
            "two_origins",
            "space origin: (0,0,0) (1,1,1)",
            &["line 9", "`space origin` cannot be \"(0,0,0) (1,1,1)\""],
        ),
        line("space_unknown", "space: outer", &["line 4", "`space: outer`", "left-posterior-superior"]),
        line("space_with_time", "space: LPST", &["line 4", "`space: LPST`", "left-posterior-superior"]),
        line("space_of_two", "space dimension: 2", &["line 10", "`space dimension: 2`", "three dimensions"]),
        line(
            "micrometres",
            "space units: \"um\" \"um\" \"um\"",
            &["line 10", "`space units: um`", "convert the spacing and the origin to mm"],
        ),
        line("pixels", "units: \"pixel\" \"pixel\" \"pixel\"", &["line 10", "`units: pixel`", "mm"]),
        line("units_unquoted", "space units: mm mm mm", &["line 10", "`space units` cannot be", "in double quotes"]),
        case(
            "many_units",
            Text::good().with(&format!("space units: {}", "\"mm\"".repeat(100_000))).bytes(),
            &["line 10", "`space units` has 100000 entries", "give 3"],
        ),
        line(
            "units_open",
            "space units: \"mm\" \"mm\" \"mm",
            &["line 10", "`space units` cannot be", "in double quotes"],
        ),
    ]
}

fn data() -> Vec<Case> {
    let good = Text::good();
    let short = |len: usize| good.clone().data(vec![0; len]).bytes();
    let claims = |sizes: &str, data: Vec<u8>| good.clone().with("encoding: gzip").with(sizes).data(data).bytes();
    let cut = |len: usize| good_gzip()[..len].to_vec();
    let end = good_gzip().len();
    vec![
        case("no_data", short(0), &["byte 190", "after 0 of 24 bytes: 24 missing", AGAIN]),
        case("truncated", short(10), &["byte 200", "after 10 of 24 bytes: 14 missing", AGAIN]),
        case("one_byte_short", short(23), &["byte 213", "after 23 of 24 bytes: 1 missing", AGAIN]),
        case("trailing_noise", short(124), &["byte 214", "100 bytes too many after the 24", "correct `sizes`"]),
        line("sizes_too_small", "sizes: 4 2 1", &["byte 198", "16 bytes too many after the 8", "correct `sizes`"]),
        line("sizes_too_large", "sizes: 4 3 4", &["24 of 48 bytes", "correct `sizes`"]),
        line("claims_much_holds_little", "sizes: 4096 4096 16", &["24 of 268435456 bytes", "268435432 missing", AGAIN]),
        case(
            "float_claims_much",
            good.clone().with("type: double").with("endian: big").with("sizes: 4096 4096 16").bytes(),
            &["24 of 2147483648 bytes"],
        ),
        case(
            "gzip_claims_much",
            claims("sizes: 4096 4096 16", good_gzip()),
            &["byte 198", "cannot contain the 268435456", AGAIN],
        ),
        gzipped("gzip_missing", Vec::new(), &["byte 191", "0 compressed bytes cannot contain the 24", AGAIN]),
        gzipped("gzip_truncated", cut(20), &["of 24 bytes", AGAIN]),
        case(
            "gzip_cut_in_the_middle",
            claims("sizes: 100 100 10", gzip(&noise(100_000))[..50_000].to_vec()),
            &["byte 50196", "of 100000 bytes", "missing", AGAIN],
        ),
        case(
            "gzip_claims_much_holds_some",
            claims("sizes: 4096 4096 16", gzip(&noise(1 << 20))),
            &["after 1048576 of 268435456 bytes", "missing", AGAIN],
        ),
        gzipped("gzip_without_checksum", cut(end - 8), &["the checksum is truncated", AGAIN]),
        gzipped("gzip_wrong_checksum", flipped(-6), &["the compressed data are damaged", "checksum", AGAIN]),
        gzipped("gzip_wrong_length", flipped(-2), &["the compressed data are damaged", AGAIN]),
        gzipped("gzip_damaged", flipped(10), &["the compressed data are damaged", AGAIN]),
        gzipped("gzip_is_none", (0..24).collect(), &["damaged", "write `encoding: raw`"]),
        gzipped("gzip_too_much", gzip(&[0; 25]), &["inflate to more than the 24 bytes", "correct `sizes`"]),
        gzipped(
            "gzip_then_noise",
            [good_gzip(), noise(50)].concat(),
            &["50 bytes too many after the 24", "correct `sizes`"],
        ),
        gzipped("gzip_then_broken_member", [good_gzip(), vec![0x1f; 3]].concat(), &["compressed data", AGAIN]),
        gzipped("bomb_of_300_mib", bomb(300), &["inflate to more than the 24 bytes", "correct `sizes`"]),
        gzipped("bomb_of_3_gib", bomb(3 << 10), &["inflate to more than the 24 bytes", "correct `sizes`"]),
        case(
            "bomb_that_claims_floats",
            good.clone()
                .with("type: float")
                .with("endian: little")
                .with("encoding: gzip")
                .with("sizes: 4096 4096 16")
                .data(bomb(300))
                .bytes(),
            &["cannot contain the 1073741824", AGAIN],
        ),
        case(
            "bomb_behind_a_skip",
            good.clone().gzip().with("byte skip: 1048576").data(bomb(300)).bytes(),
            &["inflate to more than the 24 bytes"],
        ),
        case(
            "bomb_of_empty_members",
            good.clone().gzip().data(gzip(&[]).repeat(50_000)).bytes(),
            &["0 of 24 bytes", AGAIN],
        ),
        case(
            "bomb_of_more_empty_members",
            good.clone().gzip().data(gzip(&[]).repeat(200_000)).bytes(),
            &["compressed data are damaged (the stream has too many members)", AGAIN],
        ),
        case(
            "gzip_skip_too_long",
            good.clone().gzip().with("byte skip: 1048577").bytes(),
            &["line 10", "`byte skip: 1048577`", "save the volume without"],
        ),
        case(
            "gzip_skip_from_the_end",
            good.clone().gzip().with("byte skip: -1").bytes(),
            &["line 10", "`byte skip: -1`", "only raw data"],
        ),
        line("byte_skip_negative", "byte skip: -2", &["line 10", "`byte skip` cannot be \"-2\"", "a number of bytes"]),
        line("byte_skip_too_long", "byte skip: 9223372036854775807", &["0 of 24 bytes", AGAIN]),
        line(
            "byte_skip_in_words",
            "byte skip: many",
            &["line 10", "`byte skip` cannot be \"many\"", "a number of bytes"],
        ),
        line("line_skip_negative", "line skip: -1", &["line 10", "`line skip` cannot be \"-1\"", "a number of lines"]),
        line("line_skip_too_long", "line skip: 18446744073709551615", &["0 of 24 bytes", AGAIN]),
    ]
}

/// Files that the detached headers name; `folder` holds them and the headers.
fn put_data_files(folder: &Path) {
    std::fs::write(folder.join("short.raw"), [0; 20]).unwrap();
    std::fs::write(folder.join("long.raw"), [0; 40]).unwrap();
    std::fs::create_dir(folder.join("folder.raw")).unwrap();
    let above = folder.parent().unwrap().join("above_broken_volumes.raw");
    std::fs::write(&above, [0; 24]).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&above, folder.join("link.raw")).unwrap();
        let made = std::process::Command::new("mkfifo").arg(folder.join("pipe.raw")).status();
        assert!(made.unwrap().success());
    }
}

fn data_files() -> Vec<Case> {
    const BESIDE: &str = "put the single data file beside the header";
    let mut cases = vec![
        detached("file_missing", "nowhere.raw", &["line 10", "\"nowhere.raw\" cannot be read", BESIDE]),
        detached("file_is_a_folder", "folder.raw", &["line 10", "\"folder.raw\" is a folder or a device", BESIDE]),
        detached("file_is_the_header", "file_is_the_header.nrrd", &["line 10", "is the header itself", BESIDE]),
        detached("file_above", "../above_broken_volumes.raw", &["line 10", "is outside the header's folder", BESIDE]),
        detached("file_below_and_above", "folder.raw/../../x.raw", &["line 10", "is outside", BESIDE]),
        detached("file_absolute", "/etc/passwd", &["line 10", "\"/etc/passwd\" is named by an absolute path", BESIDE]),
        detached("file_on_a_server", r"\\server\scan.raw", &["line 10", "is named by an absolute path", BESIDE]),
        detached("file_without_name", "", &["line 10", "has no name", BESIDE]),
        detached("file_with_zero", "a\0b.raw", &["line 10", "has an invalid name", BESIDE]),
        detached("file_in_colour", "\u{1b}[31m.raw", &["line 10", "\"\\u{1b}[31m.raw\" cannot be read", BESIDE]),
        detached(
            "file_list",
            "LIST",
            &["line 10", "`data file: LIST` is not supported", "join the slices into one file"],
        ),
        detached("file_list_of_slices", "LIST 2", &["line 10", "LIST 2", "join the slices into one file"]),
        detached(
            "file_pattern",
            "slice%03d.raw 1 100 1",
            &["line 10", "slice%03d.raw", "join the slices into one file"],
        ),
        detached("file_too_short", "short.raw", &["byte 20", "20 of 24 bytes: 4 missing", "/short.raw"]),
        detached("file_too_long", "long.raw", &["byte 24", "16 bytes too many after the 24", "/long.raw"]),
    ];
    if cfg!(unix) {
        cases.push(detached("file_linked_outside", "link.raw", &["line 10", "is outside the header's folder", BESIDE]));
        cases.push(detached(
            "file_is_a_pipe",
            "pipe.raw",
            &["line 10", "\"pipe.raw\" is a folder or a device", BESIDE],
        ));
    }
    cases
}

#[test]
fn every_broken_volume_is_refused_in_words_in_time_and_in_memory() {
    // Aim: an `Err` that names what, where and the remedy; soon, even on a busy machine; without memory. Method: the files
    // are put on disk and read twice, here for the words and the time, and by a process of its own for the memory.
    const TIME_MAX: Duration = Duration::from_secs(5);

    let folder = folder("broken_volumes");
    put_data_files(&folder);
    let groups = [whole_file(), header_as_text(), fields(), space(), data(), data_files()];
    let (mut count, mut slowest) = (0, Duration::ZERO);
    for Case { name, bytes, complaint } in groups.into_iter().flatten() {
        let path = folder.join(format!("{}.nrrd", name.replace(' ', "_")));
        assert!(!path.exists(), "{name} twice");
        std::fs::write(&path, bytes).unwrap();

        let start = Instant::now();
        let outcome = nrrd::read(&path);
        let took = start.elapsed();
        let error = outcome.map(|_| ()).expect_err(name).to_string();
        println!("{name}: {error}");
        assert!(error.starts_with("reading an NRRD volume — "), "{name} says what we were doing: {error}");
        assert!(error.matches(" — ").count() >= 3, "{name} says what, what to do and which file: {error}");
        assert!(error.contains(folder.to_str().unwrap()), "{name} names the file: {error}");
        assert!(!error.contains(char::is_control) && error.len() < 600, "{name} is fit for a terminal: {error}");
        for part in complaint {
            assert!(error.contains(part), "{name} mentions {part:?}: {error}");
        }
        assert!(took < TIME_MAX, "{name} took {took:?}");
        slowest = slowest.max(took);
        count += 1;
    }
    assert!(count > 100, "{count} cases");
    println!("{count} cases, the slowest {slowest:?}");

    for (path, what) in [(folder.clone(), "a folder or a device"), (folder.join("none.nrrd"), "cannot be read")] {
        let error = nrrd::read(&path).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(what) && error.ends_with(path.to_str().unwrap()), "{error}");
    }

    let reader = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "broken_volumes::the_corpus_is_read_in_next_to_no_memory", "--ignored", "--nocapture"])
        .env(CORPUS, &folder)
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&reader.stdout);
    println!("{told}");
    if let Some(why) = told.lines().find_map(|line| line.strip_prefix("SKIPPED: ")) {
        crate::support::tools::skip(why);
    }
    assert!(reader.status.success(), "{}", String::from_utf8_lossy(&reader.stderr));
}

/// Tells the reading process where the files are.
const CORPUS: &str = "TYPODONT_BROKEN_VOLUMES";

#[test]
#[ignore = "started by the test above, in a process of its own"]
fn the_corpus_is_read_in_next_to_no_memory() {
    /// Memory for a header of 16384 keys, and for the megabyte of samples that one file really contains, KiB.
    const RESIDENT_MAX_KIB: u64 = 6 << 10;
    /// Limit for the address space, KiB, which also includes memory that is reserved and never used.
    const RESERVED_MAX_KIB: u64 = 8 << 10;

    let Some(folder) = std::env::var_os(CORPUS) else { return println!("SKIPPED: no {CORPUS}") };
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "nrrd"));
    paths.sort();
    let (mut most, mut greediest) = (0, None);
    for path in &paths {
        let before = memory_kib();
        assert!(nrrd::read(path).is_err());
        let (Some(before), Some(after)) = (before, memory_kib()) else {
            return println!("SKIPPED: this system does not tell how much memory a process takes");
        };
        let reserved = after.size_peak.saturating_sub(before.size_peak.max(before.size));
        let taken = after.resident_peak.saturating_sub(before.resident);
        assert!(reserved < RESERVED_MAX_KIB, "{} reserves {reserved} KiB", path.display());
        assert!(taken < RESIDENT_MAX_KIB, "{} takes {taken} KiB", path.display());
        if taken > most {
            (most, greediest) = (taken, path.file_stem());
        }
    }
    println!("{} files, the most memory {most} KiB ({greediest:?})", paths.len());

    // The gauge itself: memory that is taken is seen.
    let before = memory_kib().unwrap();
    drop(std::hint::black_box(vec![1u8; 32 << 20]));
    let after = memory_kib().unwrap();
    assert!(after.resident_peak - before.resident > 30 << 10 && after.size_peak - before.size > 30 << 10);
}

/// Memory of this process as reported by Linux, KiB.
struct Memory {
    size: u64,
    /// Peak since the start of the process.
    size_peak: u64,
    resident: u64,
    /// Peak since the last call.
    resident_peak: u64,
}

/// Reads the memory use; `None` if the file does not exist, or the peak may not be reset.
fn memory_kib() -> Option<Memory> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let figure = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse().ok()
    };
    let memory = Memory {
        size: figure("VmSize:")?,
        size_peak: figure("VmPeak:")?,
        resident: figure("VmRSS:")?,
        resident_peak: figure("VmHWM:")?,
    };
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(memory)
}
