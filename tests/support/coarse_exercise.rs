//! Shipped exercises with larger voxels, for tests to which the size of a voxel does not matter.

use super::folder::folder;
use std::path::Path;

/// Text of a shipped exercise with voxels of this size, mm.
pub fn coarse_text(id: &str, spacing_mm: f32) -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(format!("{id}.json"));
    let text = std::fs::read_to_string(shipped).unwrap();
    assert!(text.contains("\"spacing_mm\": 0.1"), "{id}");
    let text = text.replace("\"spacing_mm\": 0.1", &format!("\"spacing_mm\": {spacing_mm}"));
    text.replace(r#""$schema": "scenario.schema.json","#, "")
}

/// Path of such an exercise, in a folder of one test: tests run at the same time.
pub fn coarse_exercise(id: &str, spacing_mm: f32, test: &str) -> String {
    let file = folder(&format!("coarse_{test}_{id}")).join(format!("{id}.json"));
    std::fs::write(&file, coarse_text(id, spacing_mm)).unwrap();
    file.to_str().unwrap().to_string()
}
