//! Scans that ITK and GDCM write are read where they lie.
//!
//! Needs a Python with SimpleITK, named by the environment variable `TYPODONT_PYTHON`.

mod folder;

use folder::folder;
use glam::DVec3;
use std::io::Write;
use std::path::Path;
use std::process::Command;
use typodont::content::imaging::{self, Told};
use typodont::content::nrrd::Samples;

#[test]
fn volumes_of_other_programs_lie_where_they_say() {
    let Some(python) = std::env::var_os("TYPODONT_PYTHON") else {
        // Straight to the terminal: the test harness would keep what a passing test prints to itself.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: no other program's scans are read; set TYPODONT_PYTHON to a Python with SimpleITK"
        );
        return;
    };
    let folder = folder("python_scans");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/write_scans.py");
    let output = Command::new(&python).arg(script).arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let kinds = [".nii", ".nii.gz", ".mha", ".mhd", "_zipped.mhd", "_plain", "_JPEG"];
    for (name, kind) in ["straight", "turned"].into_iter().flat_map(|name| kinds.map(|kind| (name, kind))) {
        let scan = imaging::read(&folder.join(format!("{name}{kind}")), &Told::default()).unwrap();
        let image = imaging::checked(scan.image).unwrap();
        assert_eq!(image.geometry.dims, [7, 6, 5], "{name}{kind}");
        let Samples::I16(values) = &image.samples else { panic!("{name}{kind}: whole numbers") };
        for (index, value) in (0u32..).zip(values) {
            let place = image.geometry.position([index % 7, index / 7 % 6, index / 42]);
            let expected = place.dot(DVec3::new(1.0, 10.0, 100.0));
            assert!((expected - f64::from(*value)).abs() < 0.51, "{name}{kind}, {place}: {value}");
        }
    }
    let refused = imaging::read(&folder.join("straight_JPEG2000"), &Told::default()).unwrap_err().to_string();
    assert!(refused.contains("JPEG 2000") && refused.contains("export the series uncompressed"), "{refused}");
}
