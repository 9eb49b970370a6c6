//! What every shader knows of an eye and the lamps: the first group of each pass.

use super::eye::Eye;
use super::scene::{Lamp, Scene};

/// In step with `view.wgsl`.
pub mod gpu {
    use bytemuck::{Pod, Zeroable};

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct Lamp {
        pub position: [f32; 4],
        pub colour: [f32; 4],
    }

    #[derive(Clone, Copy, Pod, Zeroable)]
    #[repr(C)]
    pub struct View {
        pub clip_from_world: [[f32; 4]; 4],
        pub position: [f32; 4],
        pub right: [f32; 4],
        pub up: [f32; 4],
        pub ahead: [f32; 4],
        pub window: [f32; 4],
        pub size: [f32; 4],
        pub background_top: [f32; 4],
        pub background_bottom: [f32; 4],
        pub ambient: [f32; 4],
        pub lamps: [Lamp; 2],
    }
}

pub const SOURCE: &str = include_str!("../../shaders/view.wgsl");

fn lamp(lamp: &Lamp) -> gpu::Lamp {
    let Lamp { position, strength, colour, wrap } = *lamp;
    let [r, g, b] = colour.map(|c| c * strength);
    gpu::Lamp { position: position.extend(wrap).to_array(), colour: [r, g, b, 0.0] }
}

/// What a scene looks like to an eye; `is_srgb`: the target turns linear light into a screen's colours by itself.
pub fn view(scene: &Scene, eye: &Eye, [width, height]: [u32; 2], is_srgb: bool) -> gpu::View {
    let opaque = |[r, g, b]: [f32; 3]| [r, g, b, 1.0];
    gpu::View {
        clip_from_world: eye.clip_from_world(),
        position: eye.position.extend(eye.near).to_array(),
        right: eye.right.extend(eye.far).to_array(),
        up: eye.up.extend(0.0).to_array(),
        ahead: eye.ahead.extend(0.0).to_array(),
        window: [eye.window.left, eye.window.right, eye.window.bottom, eye.window.top],
        size: [width as f32, height as f32, if is_srgb { 1.0 } else { 0.0 }, 0.0],
        background_top: opaque(scene.background.top),
        background_bottom: opaque(scene.background.bottom),
        ambient: [scene.lights.ambient, 0.0, 0.0, 0.0],
        lamps: [lamp(&scene.lights.chair), lamp(&scene.lights.head)],
    }
}
