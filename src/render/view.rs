//! Uniform of the view: the eye and the lamps, bound as the first group of each pass.

use super::eye::Eye;
use super::scene::{Lamp, RenderScene};
use super::shadow;

/// Layouts that match `view.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct LampUniform {
        pub position: [f32; 4],
        pub colour: [f32; 4],
    }

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct ShadowUniform {
        pub position: [f32; 4],
        pub right: [f32; 4],
        pub up: [f32; 4],
        pub ahead: [f32; 4],
    }

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct ViewUniform {
        pub clip_from_world: [[f32; 4]; 4],
        pub position: [f32; 4],
        pub right: [f32; 4],
        pub up: [f32; 4],
        pub ahead: [f32; 4],
        pub window: [f32; 4],
        pub size: [f32; 4],
        pub background_middle: [f32; 4],
        pub background_edge: [f32; 4],
        pub ambient: [f32; 4],
        pub lamps: [LampUniform; 2],
        pub shadow: ShadowUniform,
    }
}

pub const SOURCE: &str = include_str!("../../shaders/view.wgsl");

fn lamp_uniform(lamp: &Lamp) -> gpu::LampUniform {
    let Lamp { position, strength, colour, wrap, radius: _ } = *lamp;
    let [r, g, b] = colour.map(|c| c * strength);
    gpu::LampUniform { position: position.extend(wrap).to_array(), colour: [r, g, b, 0.0] }
}

/// The eye that casts shadows and the radius of its lamp, mm.
fn shadow_uniform(lamp: Option<Eye>, radius: f32) -> gpu::ShadowUniform {
    let Some(eye) = lamp else { return bytemuck::Zeroable::zeroed() };
    gpu::ShadowUniform {
        position: eye.position.extend(eye.near).to_array(),
        right: eye.right.extend(eye.far).to_array(),
        up: eye.up.extend(radius).to_array(),
        ahead: eye.forward.extend(eye.window.right).to_array(),
    }
}

/// Uniform for a scene and an eye, with the size of the target in pixels. `is_srgb`: the target converts linear light
/// to sRGB itself.
pub fn view_uniform(scene: &RenderScene, eye: &Eye, [width, height]: [u32; 2], is_srgb: bool) -> gpu::ViewUniform {
    let opaque = |[r, g, b]: [f32; 3]| [r, g, b, 1.0];
    gpu::ViewUniform {
        clip_from_world: eye.clip_from_world(),
        position: eye.position.extend(eye.near).to_array(),
        right: eye.right.extend(eye.far).to_array(),
        up: eye.up.extend(0.0).to_array(),
        ahead: eye.forward.extend(0.0).to_array(),
        window: [eye.window.left, eye.window.right, eye.window.bottom, eye.window.top],
        size: [
            width as f32,
            height as f32,
            if is_srgb { 1.0 } else { 0.0 },
            f32::from(scene.relief_seed.unwrap_or_default()),
        ],
        background_middle: opaque(scene.background.middle),
        background_edge: opaque(scene.background.edge),
        ambient: [scene.lights.ambient, 0.0, 0.0, 0.0],
        lamps: [lamp_uniform(&scene.lights.chair), lamp_uniform(&scene.lights.head)],
        shadow: shadow_uniform(shadow::chair_eye(scene), scene.lights.chair.radius),
    }
}
