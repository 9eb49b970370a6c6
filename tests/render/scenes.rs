//! Scenes to be drawn twice.

use std::sync::Arc;
use typodont::anatomy::{self, Tissues};
use typodont::frame::{Pose, Quat, Vec3};
use typodont::mesh::Mesh;
use typodont::render::*;
use typodont::volume::{Grid, Label, Volume, Voxel, surface};

pub const CARIES: Label = Label(4);

/// A molar with a lesion in its crown and a cut into it.
pub fn molar(dims: [u32; 3]) -> Volume {
    let tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let form = &anatomy::molar::LOWER_FIRST;
    let mut volume = anatomy::grow(form, anatomy::grid_fitting(form, dims), &tissues);
    let grid = *volume.grid();
    let top =
        (0..grid.len()).rev().find(|&i| volume.tissue(i) != Label::AIR).map(|i| grid.centre(grid.cell(i))).unwrap();
    let lesion = top - Vec3::new(0.0, 0.0, 1.8);
    volume.relabel(|i, label| if grid.centre(grid.cell(i)).distance(lesion) < 1.6 { CARIES } else { label });
    carve(&mut volume, top, 1.3);
    volume.take_dirty();
    volume
}

/// Takes a ball of matter away, as a bur does: with a surface as wide as any.
pub fn carve(volume: &mut Volume, centre: Vec3, radius: f32) {
    let (grid, band) = (*volume.grid(), volume.band());
    let [xs, ys, zs] = grid.cells_within(centre - radius - 0.5, centre + radius + 0.5);
    for z in zs {
        for y in ys.clone() {
            for x in xs.clone() {
                let density = typodont::volume::ramp(radius - grid.centre([x, y, z]).distance(centre), band);
                let before = volume.voxel(grid.index([x, y, z]));
                if density < before.density {
                    volume.set_cell([x, y, z], Voxel { density, label: before.label });
                }
            }
        }
    }
}

pub fn palette() -> Palette {
    let mut palette = Palette::of(
        |label| match label.0 {
            1 => [0.957, 0.941, 0.902],
            2 => [0.902, 0.812, 0.612],
            3 => [0.784, 0.314, 0.294],
            4 => [0.42, 0.26, 0.15],
            _ => [0.5; 3],
        },
        0.10,
    );
    palette.0[1].gloss = 0.22;
    palette.0[4].gloss = 0.02;
    palette
}

/// A ball of triangles.
pub fn ball(radius: f32) -> Arc<Mesh> {
    let grid = Grid::centred([48; 3], Vec3::splat(radius / 20.0));
    let volume = Volume::from_distance(grid, radius / 12.0, |p| (p.length() - radius, Label(1)));
    Arc::new(surface::extract(&volume))
}

/// A box of triangles with flat sides.
pub fn block(half: Vec3) -> Arc<Mesh> {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let out = Vec3::AXES[axis] * side;
            let (a, b) = (Vec3::AXES[(axis + 1) % 3] * side, Vec3::AXES[(axis + 2) % 3]);
            let first = mesh.positions.len() as u32;
            for (s, t) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                mesh.positions.push((out + a * s + b * t) * half);
                mesh.normals.push(out);
            }
            mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }
    Arc::new(mesh)
}

/// Stands the tooth up in the world: its occlusal side (+z) is up (+y).
pub fn upright() -> Pose {
    Pose { position: Vec3::ZERO, orientation: Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2) }
}

pub struct Story<'a> {
    pub name: &'static str,
    pub scene: Scene<'a>,
    pub viewpoint: Viewpoint,
    pub stereo: Option<Stereo>,
    pub size: [u32; 2],
}

pub fn tooth<'a>(volume: &'a Volume, palette: &'a Palette, shown: Shown) -> Tooth<'a> {
    Tooth { volume, changes: Changes::Anew, world_from_tooth: upright(), palette, shown }
}

pub fn tissue(palette: &Palette) -> Shown {
    Shown::Volume(Arc::new(TransferFunction::tissue(palette)))
}

/// Dust on and about a tooth: balls, some hidden by it, some before it.
pub fn grains() -> Vec<Speck> {
    let grain = |i: usize| {
        let (turn, height) = (2.4 * i as f32, -6.0 + 16.0 * i as f32 / 300.0);
        let (sin, cos) = turn.sin_cos();
        let ring = 3.0 + 0.02 * i as f32;
        let colour = [0.95, 0.90, 0.60 + 0.001 * i as f32];
        let finish = Finish { colour, gloss: 0.03 };
        let place = Vec3::new(ring * cos, height, ring * sin);
        Speck { place, radius: 0.08 + 0.0006 * i as f32, facing: None, finish, opacity: 1.0 }
    };
    (0..300).map(grain).collect()
}

/// Water before and behind a tooth: balls, and discs that face all ways.
pub fn drops() -> Vec<Speck> {
    let drop = |i: usize| {
        let (turn, height) = (1.7 * i as f32, 8.0 - 12.0 * i as f32 / 120.0);
        let (sin, cos) = turn.sin_cos();
        let place = Vec3::new(6.0 * cos, height, 6.0 * sin);
        let facing = i.is_multiple_of(2).then(|| Vec3::new(0.4 * cos, 1.0, 0.4 * sin).normalize());
        let finish = Finish { colour: [0.80, 0.89, 0.95], gloss: 0.7 };
        Speck { place, radius: 0.2 + 0.006 * i as f32, facing, finish, opacity: 0.3 }
    };
    (0..120).map(drop).collect()
}

/// One of each kind, and some together.
pub fn stories<'a>(
    volume: &'a Volume,
    palette: &'a Palette,
    grains: &'a [Speck],
    drops: &'a [Speck],
) -> Vec<Story<'a>> {
    let near = Orbit { middle: Vec3::new(0.0, 1.0, 0.0), turn: 0.5, tilt: 0.75, distance: 42.0 };
    let whole = Orbit { middle: Vec3::new(0.0, -4.0, 0.0), turn: -0.6, tilt: 0.2, distance: 62.0 };
    let steel = Finish { colour: [0.62, 0.64, 0.66], gloss: 0.6 };
    let gum = Finish { colour: [0.85, 0.53, 0.50], gloss: 0.15 };
    let solids = vec![
        Solid::plain(ball(3.0), Pose::at(Vec3::new(4.0, 3.0, 2.0)), steel),
        Solid {
            tints: Arc::new(vec![[1.0, 0.9, 0.9]; 24]),
            ..Solid::plain(block(Vec3::new(9.0, 3.0, 9.0)), Pose::at(Vec3::new(0.0, -7.0, 0.0)), gum)
        },
    ];
    let story = |name, shown: Shown, solids: &[Solid], orbit: Orbit| Story {
        name,
        scene: Scene { tooth: Some(tooth(volume, palette, shown)), solids: solids.to_vec(), ..Scene::empty() },
        viewpoint: orbit.viewpoint(),
        stereo: None,
        size: [390, 345],
    };
    let with_stereo = |layout, story: Story<'a>| Story { stereo: Some(Stereo { layout, eye_distance: 4.0 }), ..story };
    let x_ray = || Shown::Volume(Arc::new(TransferFunction::x_ray()));
    let decay = || Shown::Volume(Arc::new(TransferFunction::only(&[CARIES], palette)));
    let head_lit = |mut story: Story<'a>| {
        story.scene.lights.head = Lamp::head(story.viewpoint.position);
        story
    };
    // Beside the tooth, turned so that its far side is seen.
    let mirrored = |mut story: Story<'a>| {
        let to_eye = (story.viewpoint.position - Vec3::new(-13.0, 2.0, -6.0)).normalize();
        let to_tooth = (Vec3::new(-1.0, 2.0, -4.0) - Vec3::new(-13.0, 2.0, -6.0)).normalize();
        let orientation = Quat::from_rotation_arc(Vec3::Z, (to_eye + to_tooth).normalize());
        let world_from_mirror = Pose { position: Vec3::new(-13.0, 2.0, -6.0), orientation };
        story.scene.mirror = Some(Mirror { world_from_mirror, radius: 9.0, shine: 0.8 });
        story
    };
    let in_work = |mut story: Story<'a>| {
        (story.scene.grains, story.scene.drops) = (grains, drops);
        story
    };
    let smooth = |mut story: Story<'a>| {
        story.scene.is_smooth = true;
        story
    };
    vec![
        in_work(story("specks-surface", Shown::Surface, &solids, near)),
        head_lit(in_work(story("specks-iso", Shown::Iso, &solids, whole))),
        in_work(story("specks-volume", tissue(palette), &solids, near)),
        mirrored(in_work(story("specks-mirror", Shown::Iso, &solids, whole))),
        in_work(with_stereo(Layout::SideBySide, story("specks-side-by-side", Shown::Surface, &solids, near))),
        smooth(story("smooth-surface", Shown::Surface, &solids, whole)),
        smooth(in_work(story("smooth-specks-iso", Shown::Iso, &solids, near))),
        smooth(mirrored(with_stereo(Layout::Anaglyph, story("smooth-mirror-anaglyph", Shown::Iso, &solids, whole)))),
        smooth(story("smooth-volume", tissue(palette), &solids, near)),
        mirrored(story("mirror-iso", Shown::Iso, &solids, whole)),
        mirrored(with_stereo(Layout::Anaglyph, story("mirror-surface-anaglyph", Shown::Surface, &solids, whole))),
        head_lit(mirrored(story("mirror-volume", tissue(palette), &solids, near))),
        story("surface", Shown::Surface, &[], near),
        story("surface-in-scene", Shown::Surface, &solids, whole),
        story("iso", Shown::Iso, &[], near),
        head_lit(story("iso-in-scene", Shown::Iso, &solids, whole)),
        story("volume-tissue", tissue(palette), &[], near),
        story("volume-in-scene", tissue(palette), &solids, whole),
        story("volume-x-ray", x_ray(), &solids[..1], whole),
        with_stereo(Layout::SideBySide, story("volume-decay-side-by-side", decay(), &[], whole)),
        with_stereo(Layout::Anaglyph, story("iso-anaglyph", Shown::Iso, &solids, near)),
        with_stereo(Layout::Rows, story("surface-rows", Shown::Surface, &solids, near)),
    ]
}
