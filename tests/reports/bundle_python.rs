//! Other programs derive the same numbers from a bundle: SimpleITK, slicerio, mcap, and the Khronos validator.
//!
//! Needs `TYPODONT_PYTHON` and `TYPODONT_GLTF_VALIDATOR`, as `scripts/test` sets them.

use crate::support::bundle;
use crate::support::folder;

use bundle::*;
use folder::folder;
use std::path::{Path, PathBuf};
use std::process::Command;

/// External program that a test needs; without it the test prints SKIPPED.
fn needed(name: &str) -> Option<PathBuf> {
    crate::support::tools::named_by(name, "a program that reads our bundles").map(PathBuf::from)
}

#[test]
fn python_derives_the_same_numbers() {
    let Some(python) = needed("TYPODONT_PYTHON") else { return };
    for (scenario, operator) in [("scenarios/5-grinding.json", "hasty"), ("scenarios/5-grinding.json", "timid")] {
        let bundle = run(scenario, operator, &folder(&format!("python_{operator}")), &[]);
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_bundle.py");
        let output = Command::new(&python).arg(script).arg(&bundle).output().unwrap();
        assert!(output.status.success(), "{operator}: {}{}", told(&output), complained(&output));
        println!("{operator}: {}", complained(&output));
    }
}

#[test]
fn the_khronos_validator_accepts_the_performance_map() {
    let Some(validator) = needed("TYPODONT_GLTF_VALIDATOR") else { return };
    let bundle = run("scenarios/5-grinding.json", "hasty", &folder("gltf"), &[]);
    let script = "
        const [validator, file] = process.argv.slice(1);
        require(validator).validateBytes(new Uint8Array(require('fs').readFileSync(file))).then(report => {
            console.log(JSON.stringify(report));
            process.exit(report.issues.numErrors + report.issues.numWarnings > 0 ? 1 : 0);
        });
    ";
    let output =
        Command::new("node").args(["-e", script]).arg(&validator).arg(bundle.join("performance.glb")).output().unwrap();
    assert!(output.status.success(), "{}{}", told(&output), complained(&output));
    let report: serde_json::Value = serde_json::from_str(&told(&output)).unwrap();
    assert!(report["info"]["totalTriangleCount"].as_u64() > Some(1000), "{report}");
}
