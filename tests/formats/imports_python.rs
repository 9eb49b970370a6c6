//! Scans written by ITK and GDCM are read at their positions in space.
//!
//! Needs a Python with SimpleITK, named by the environment variable `TYPODONT_PYTHON`.

use crate::support::folder;
use crate::support::tools;

use folder::folder;
use glam::DVec3;
use std::path::Path;
use std::process::Command;
use typodont_formats::imaging;
use typodont_formats::imaging::ReadOptions;
use typodont_formats::nrrd::Samples;

#[test]
fn volumes_of_other_programs_lie_where_they_say() {
    let Some(python) = tools::named_by("TYPODONT_PYTHON", "a Python with SimpleITK") else { return };
    let folder = folder("python_scans");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/write_scans.py");
    let output = Command::new(&python).arg(script).arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let kinds = [".nii", ".nii.gz", ".mha", ".mhd", "_zipped.mhd", "_plain", "_JPEG"];
    for (name, kind) in ["straight", "turned"].into_iter().flat_map(|name| kinds.map(|kind| (name, kind))) {
        let scan = imaging::read(&folder.join(format!("{name}{kind}")), &ReadOptions::default()).unwrap();
        let image = imaging::require_axis_aligned(scan.image).unwrap();
        assert_eq!(image.geometry.dims, [7, 6, 5], "{name}{kind}");
        let Samples::I16(values) = &image.samples else { panic!("{name}{kind}: whole numbers") };
        for (index, value) in (0u32..).zip(values) {
            let place = image.geometry.position([index % 7, index / 7 % 6, index / 42]);
            let expected = place.dot(DVec3::new(1.0, 10.0, 100.0));
            assert!((expected - f64::from(*value)).abs() < 0.51, "{name}{kind}, {place}: {value}");
        }
    }
    let refused = imaging::read(&folder.join("straight_JPEG2000"), &ReadOptions::default()).unwrap_err().to_string();
    assert!(refused.contains("JPEG 2000") && refused.contains("export the series uncompressed"), "{refused}");
}
