//! Scenes to be drawn twice.

use std::sync::Arc;
use typodont_anatomy::TissueLabels;
use typodont_core::frame::{Pose, Quat, Vec3};
use typodont_core::mesh::Mesh;
use typodont_core::volume::{Edit, Grid, Label, Volume, Voxel, surface};
use typodont_render::*;

pub const CARIES: Label = Label(4);

/// A molar with a lesion in its crown and a cut into it.
pub fn molar(dims: [u32; 3]) -> Volume {
    let tissues = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };
    let form = &typodont_anatomy::lower_first_molar::LOWER_FIRST;
    let mut volume = typodont_anatomy::grow(form, typodont_anatomy::grid_fitting(form, dims), &tissues);
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
pub fn carve(volume: &mut Volume, centre: Vec3, radius: f32) -> Vec<Edit> {
    let mut edits = Vec::new();
    let (grid, band) = (*volume.grid(), volume.half_band());
    let [xs, ys, zs] = grid.cells_within(centre - radius - 0.5, centre + radius + 0.5);
    for z in zs {
        for y in ys.clone() {
            for x in xs.clone() {
                let density =
                    typodont_core::volume::density_at_distance(radius - grid.centre([x, y, z]).distance(centre), band);
                let before = volume.voxel(grid.index([x, y, z]));
                if density < before.density {
                    edits.push(volume.set_cell([x, y, z], Voxel { density, label: before.label }));
                }
            }
        }
    }
    edits
}

pub fn palette() -> LabelPalette {
    let mut palette = LabelPalette::from_colours(
        |label| match label.0 {
            1 => [0.957, 0.941, 0.902],
            2 => [0.902, 0.812, 0.612],
            3 => [0.784, 0.314, 0.294],
            4 => [0.42, 0.26, 0.15],
            _ => [0.5; 3],
        },
        0.10,
    );
    palette.appearances[1].gloss = 0.22;
    palette.appearances[4].gloss = 0.02;
    palette.is_decay[4] = true;
    palette.translucent = Some(Label(1));
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
    pub scene: RenderScene<'a>,
    pub viewpoint: Viewpoint,
    pub stereo: Option<Stereo>,
    pub size: [u32; 2],
}

pub fn tooth<'a>(volume: &'a Volume, palette: &'a LabelPalette, shown: RenderMode) -> VolumeInstance<'a> {
    VolumeInstance {
        volume,
        changes: Changes::All,
        world_from_tooth: upright(),
        palette,
        unworked_tooth: None,
        mode: shown,
    }
}

pub fn tissue(palette: &LabelPalette) -> RenderMode {
    RenderMode::Volume(Arc::new(TransferFunction::tissue(palette)))
}

/// Dust on and about a tooth: balls, some hidden by it, some before it.
pub fn grains() -> Vec<Particle> {
    let grain = |i: usize| {
        let (turn, height) = (2.4 * i as f32, -6.0 + 16.0 * i as f32 / 300.0);
        let (sin, cos) = turn.sin_cos();
        let ring = 3.0 + 0.02 * i as f32;
        let colour = [0.95, 0.90, 0.60 + 0.001 * i as f32];
        let finish = Appearance { colour, gloss: 0.03 };
        let place = Vec3::new(ring * cos, height, ring * sin);
        Particle { position: place, radius: 0.08 + 0.0006 * i as f32, facing: None, appearance: finish, opacity: 1.0 }
    };
    (0..300).map(grain).collect()
}

/// Water before and behind a tooth: balls, and discs that face all ways.
pub fn drops() -> Vec<Particle> {
    let drop = |i: usize| {
        let (turn, height) = (1.7 * i as f32, 8.0 - 12.0 * i as f32 / 120.0);
        let (sin, cos) = turn.sin_cos();
        let place = Vec3::new(6.0 * cos, height, 6.0 * sin);
        let facing = i.is_multiple_of(2).then(|| Vec3::new(0.4 * cos, 1.0, 0.4 * sin).normalize());
        let finish = Appearance { colour: [0.80, 0.89, 0.95], gloss: 0.7 };
        Particle { position: place, radius: 0.2 + 0.006 * i as f32, facing, appearance: finish, opacity: 0.3 }
    };
    (0..120).map(drop).collect()
}

/// One of each kind, and some together.
pub fn stories<'a>(
    volume: &'a Volume,
    palette: &'a LabelPalette,
    grains: &'a [Particle],
    drops: &'a [Particle],
) -> Vec<Story<'a>> {
    let near = Orbit { middle: Vec3::new(0.0, 1.0, 0.0), azimuth: 0.5, elevation: 0.75, distance: 42.0 };
    let whole = Orbit { middle: Vec3::new(0.0, -4.0, 0.0), azimuth: -0.6, elevation: 0.2, distance: 62.0 };
    let steel = Appearance { colour: [0.62, 0.64, 0.66], gloss: 0.6 };
    let gum = Appearance { colour: [0.85, 0.53, 0.50], gloss: 0.15 };
    let solids = vec![
        MeshInstance::plain(ball(3.0), Pose::at(Vec3::new(4.0, 3.0, 2.0)), steel),
        MeshInstance {
            vertex_tints: Arc::new(vec![VertexTint { colour: [1.0, 0.9, 0.9], stippling: 1.0 }; 24]),
            ..MeshInstance::plain(block(Vec3::new(9.0, 3.0, 9.0)), Pose::at(Vec3::new(0.0, -7.0, 0.0)), gum)
        },
    ];
    let story = |name, shown: RenderMode, solids: &[MeshInstance], orbit: Orbit| Story {
        name,
        scene: RenderScene {
            tooth: Some(tooth(volume, palette, shown)),
            solids: solids.to_vec(),
            ..RenderScene::empty()
        },
        viewpoint: orbit.viewpoint(),
        stereo: None,
        size: [390, 345],
    };
    let with_stereo = |layout, story: Story<'a>| Story { stereo: Some(Stereo { layout, eye_distance: 4.0 }), ..story };
    let x_ray = || RenderMode::Volume(Arc::new(TransferFunction::x_ray()));
    let film = || {
        RenderMode::Volume(Arc::new(TransferFunction::radiograph(|label| {
            [0.0, 0.28, 0.17, 0.03, 0.09][usize::from(label.0.min(4))]
        })))
    };
    let decay = || RenderMode::Volume(Arc::new(TransferFunction::highlighting(&[CARIES], palette)));
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
        story.scene.mirror = Some(PlaneMirror { world_from_mirror, radius: 9.0, reflectance: 0.8 });
        story
    };
    let in_work = |mut story: Story<'a>| {
        (story.scene.opaque_particles, story.scene.translucent_particles) = (grains, drops);
        story
    };
    let smooth = |mut story: Story<'a>| {
        story.scene.is_antialiased = true;
        story
    };
    let blurred = |mut story: Story<'a>| {
        story.scene.lens = Some(Lens { focus: Vec3::new(0.0, 3.0, 0.0), aperture: 1.5 });
        story
    };
    vec![
        blurred(in_work(story("lens-surface", RenderMode::Surface, &solids, near))),
        smooth(blurred(mirrored(story("smooth-lens-iso", RenderMode::Iso, &solids, whole)))),
        smooth(blurred(with_stereo(
            StereoLayout::SideBySide,
            story("smooth-lens-side-by-side", RenderMode::Surface, &solids, near),
        ))),
        blurred(story("lens-volume", tissue(palette), &solids, near)),
        in_work(story("specks-surface", RenderMode::Surface, &solids, near)),
        head_lit(in_work(story("specks-iso", RenderMode::Iso, &solids, whole))),
        in_work(story("specks-volume", tissue(palette), &solids, near)),
        mirrored(in_work(story("specks-mirror", RenderMode::Iso, &solids, whole))),
        in_work(with_stereo(
            StereoLayout::SideBySide,
            story("specks-side-by-side", RenderMode::Surface, &solids, near),
        )),
        smooth(story("smooth-surface", RenderMode::Surface, &solids, whole)),
        smooth(in_work(story("smooth-specks-iso", RenderMode::Iso, &solids, near))),
        smooth(mirrored(with_stereo(
            StereoLayout::Anaglyph,
            story("smooth-mirror-anaglyph", RenderMode::Iso, &solids, whole),
        ))),
        smooth(story("smooth-volume", tissue(palette), &solids, near)),
        mirrored(story("mirror-iso", RenderMode::Iso, &solids, whole)),
        mirrored(with_stereo(
            StereoLayout::Anaglyph,
            story("mirror-surface-anaglyph", RenderMode::Surface, &solids, whole),
        )),
        head_lit(mirrored(story("mirror-volume", tissue(palette), &solids, near))),
        story("surface", RenderMode::Surface, &[], near),
        story("surface-in-scene", RenderMode::Surface, &solids, whole),
        story("iso", RenderMode::Iso, &[], near),
        head_lit(story("iso-in-scene", RenderMode::Iso, &solids, whole)),
        story("volume-tissue", tissue(palette), &[], near),
        story("volume-in-scene", tissue(palette), &solids, whole),
        story("volume-radiograph", film(), &solids[..1], whole),
        story("volume-x-ray", x_ray(), &solids[..1], whole),
        with_stereo(StereoLayout::SideBySide, story("volume-decay-side-by-side", decay(), &[], whole)),
        with_stereo(StereoLayout::Anaglyph, story("iso-anaglyph", RenderMode::Iso, &solids, near)),
        with_stereo(StereoLayout::Rows, story("surface-rows", RenderMode::Surface, &solids, near)),
    ]
}
