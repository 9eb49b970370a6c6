//! A finished bundle holds pictures and surfaces that others can read.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Plays the fifth exercise and gives the bundle's folder.
fn bundle() -> PathBuf {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pictures");
    let _ = fs::remove_dir_all(&out);
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/5-grinding.json");
    let mut typodont = Command::new(env!("CARGO_BIN_EXE_typodont"));
    typodont.arg("run").arg(scenario).args(["--headless", "--device", "scripted", "--seed", "1", "--out"]).arg(&out);
    let played = typodont.output().unwrap();
    assert!(played.status.success(), "{}", String::from_utf8_lossy(&played.stderr));
    fs::read_dir(&out).unwrap().next().unwrap().unwrap().path()
}

#[test]
fn a_bundles_pictures_and_surfaces_show_what_was_done() {
    // Aim: 27 pictures of one size; a surface in metres whose cavity has the colour of what was rightly removed.
    let bundle = bundle();
    let views: Vec<PathBuf> = fs::read_dir(bundle.join("views")).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(views.len(), 27);
    for view in &views {
        assert_eq!(image::image_dimensions(view).unwrap(), (480, 480), "{}", view.display());
    }
    let blue = |name: &str| {
        let picture = image::open(bundle.join("views").join(name)).unwrap().to_rgb8();
        picture.pixels().filter(|p| p[2] > p[0].saturating_add(60)).count()
    };
    assert_eq!(blue("before-occlusal.png"), 0);
    assert!(blue("map-occlusal.png") > 4000, "{} pixels of the cavity", blue("map-occlusal.png"));
    assert!(blue("map-slice-buccolingual.png") > 2000);

    let (document, buffers, _) = gltf::import(bundle.join("performance.glb")).unwrap();
    let names: Vec<&str> = document.nodes().filter_map(|n| n.name()).collect();
    assert_eq!(names[0], "tooth");
    let tooth = document.meshes().next().unwrap();
    let primitive = tooth.primitives().next().unwrap();
    let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
    let count = reader.read_positions().unwrap().count();
    assert!(count > 10_000);
    let colors = reader.read_colors(0).unwrap().into_rgb_f32();
    // Sky blue (86, 180, 233) as linear light.
    let is_blue =
        |c: [f32; 3]| (c[0] - 0.093).abs() < 0.01 && (c[1] - 0.456).abs() < 0.01 && (c[2] - 0.815).abs() < 0.01;
    assert!(colors.filter(|c| is_blue(*c)).count() > 200);
    let most = reader.read_indices().unwrap().into_u32().max().unwrap();
    assert_eq!(most as usize, count - 1);
}
