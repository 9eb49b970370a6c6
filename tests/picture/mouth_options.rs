//! Additions to a mouth: a rubber dam, and the blood of an opened pulp.

use crate::fixed_scenes::{FIXED_VIEWS, FixedCase};
use crate::render::{adapter, is_close, keep};
use crate::scenes::carve;
use typodont_core::frame::Vec3;
use typodont_exercise::scenario::OperatingField;
use typodont_render::{Lights, OffscreenRenderer, Orbit, RenderMode, RenderScene, RgbaImage};
use typodont_scene::particles::{CollisionWorld, ParticleField, Tools, VisibleParticles};
use typodont_scene::work_view;

const SIZE: [u32; 2] = [800, 500];

/// Share of a picture's pixels of a kind.
fn share(image: &RgbaImage, is: impl Fn([i32; 3]) -> bool) -> f64 {
    let pixels = image.rgba.chunks(4).map(|p| [p[0], p[1], p[2]].map(i32::from));
    pixels.filter(|p| is(*p)).count() as f64 / f64::from(image.width * image.height)
}

#[test]
fn a_rubber_dam_covers_gums_and_lips_and_leaves_the_treated_tooth_free() {
    // Aim: what an exercise with a dam shows. Method: the amalgam exercise from the usual view and from the front; blue around the
    // teeth, no red gum, and adapter and twin alike.
    let Some((mut gpu, _turn)) = adapter() else { return };
    let case = FixedCase::new(14, "14-amalgam.json");
    let mut views = FIXED_VIEWS.into_iter().filter(|view| ["before", "mouth"].contains(&view.name));
    let [near, whole] = std::array::from_fn(|_| {
        let view = views.next().unwrap();
        let (scene, viewpoint) = case.scene(view, RenderMode::Iso, true);
        let twin = OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, SIZE).unwrap();
        let drawn = gpu.draw(&scene, &viewpoint, None, SIZE).unwrap();
        keep(&format!("dam-{}", view.name), &twin);
        assert!(is_close(&drawn, &twin), "{}", view.name);
        twin
    });
    let is_blue = |[r, _, b]: [i32; 3]| b > r + 25 && b > 60;
    let is_gum = |[r, g, _]: [i32; 3]| r > g + 45 && r > 120;
    println!(
        "near: {:.3} blue, {:.3} gum; whole: {:.3} blue",
        share(&near, is_blue),
        share(&near, is_gum),
        share(&whole, is_blue)
    );
    assert!(share(&near, is_blue) > 0.25 && share(&near, is_gum) < 0.002, "gum is seen beside the dam");
    assert!(share(&near, |[r, g, b]| r > 150 && g > 140 && b > 110) > 0.08, "the teeth stand out");
    assert!(share(&whole, is_blue) > 0.1);
}

#[test]
fn an_opened_pulp_is_wet_and_bleeds_in_the_picture() {
    // Aim: who opens the pulp sees it at once. Method: deep caries, a bur down to the pulp, and the field for a moment and for eight
    // seconds; red grows in the cavity. The same cut without a pulp that bleeds shows none beyond the pulp itself.
    let mut case = FixedCase::new(12, "12-deep-caries.json");
    let pulp = case.scenario.tissues.label_of("pulp").unwrap();
    let mut volume = std::mem::replace(&mut case.prepared, (*case.workpiece.volume).clone());
    let middle = case.workpiece.lesions[0].centre;
    let (mut edits, mut depth) = (Vec::new(), 0.0);
    while !edits.iter().any(|edit: &typodont_core::volume::Edit| edit.removes() && edit.before.label == pulp) {
        edits.extend(carve(&mut volume, middle - Vec3::Z * depth, 0.8));
        depth += 0.1;
        assert!(depth < 8.0, "no pulp under the caries");
    }
    case.prepared = volume;
    let view = FIXED_VIEWS[2];
    const NONE: OperatingField = OperatingField { dust: false, water_spray: false, suction: false };
    let red_after = |seconds: u32, bleeds| {
        let mut field = ParticleField::new(NONE, &[], None, bleeds);
        edits.iter().for_each(|edit| field.record_removal(edit, case.prepared.grid()));
        let world = CollisionWorld {
            volume: &case.prepared,
            world_from_tooth: case.workpiece.world_from_tooth,
            obstacles: &case.workpiece.surroundings,
        };
        (0..10 * seconds).for_each(|_| field.advance(0.1, Tools::default(), &world, &case.palette));
        // From above, into the cavity.
        let usual = work_view(&case.workpiece);
        let viewpoint = Orbit { elevation: 1.35, distance: 0.4 * usual.distance, ..usual }.viewpoint();
        let (scene, _) = case.scene(view, RenderMode::Iso, true);
        let mut particles = VisibleParticles::default();
        particles.update(&field, &viewpoint);
        let scene =
            RenderScene { translucent_particles: particles.translucent(), lights: Lights::along(&viewpoint), ..scene };
        let drawn = OffscreenRenderer::cpu().draw(&scene, &viewpoint, None, SIZE).unwrap();
        keep(&format!("bleeding-{seconds}-{}", bleeds.is_some()), &drawn);
        share(&drawn, |[r, g, _]| r > 3 * g && r > 60)
    };
    let [none, soon, later] = [red_after(8, None), red_after(1, Some(pulp)), red_after(8, Some(pulp))];
    println!("red: {none:.4} without blood, {soon:.4} after a second, {later:.4} after eight");
    assert!(soon > none + 0.0005 && later > soon + 0.001, "{none}, {soon}, {later}");
}
