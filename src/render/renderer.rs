//! Renders scenes on a device into a given target.

use super::brick_surfaces::{BrickSurfaces, DrawnTooth};
use super::camera::Viewpoint;
use super::drawn_volume::DrawnVolume;
use super::error::RenderError;
use super::eye::Eye;
use super::fxaa_pass::FxaaPass;
use super::lens::LensView;
use super::lens_pass::{LensPass, LensTarget};
use super::mirror;
use super::mirror_pass::MirrorPass;
use super::particle_pass::ParticlePass;
use super::passes::{DEPTH, Detail};
use super::scene::{Background, Changes, RenderMode, RenderScene, VolumeInstance};
use super::shadow;
use super::shadow_pass::{ShadowMap, ShadowPass};
use super::stereo::Stereo;
use super::stereo_pass::StereoPass;
use super::surface_pass::SurfacePass;
use super::tooth::{ToothTextures, Uploads};
use super::view;
use super::volume_pass::VolumePass;
use super::{iso_pass, resources, validate};
use typodont_core::volume::Volume;

/// All pipelines, and the data kept on the device between frames.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    format: wgpu::TextureFormat,
    tooth_layout: wgpu::BindGroupLayout,
    surface_pass: SurfacePass,
    iso_pass: wgpu::RenderPipeline,
    volume_pass: VolumePass,
    particle_pass: ParticlePass,
    fxaa_pass: FxaaPass,
    /// Present once a scene has had a lens.
    lens_pass: Option<LensPass>,
    stereo_pass: StereoPass,
    mirror_pass: MirrorPass,
    /// Detail that the pipelines draw.
    detail: Detail,
    /// Present once a scene has had shadows.
    shadow_pass: Option<ShadowPass>,
    no_shadows: ShadowMap,
    lamp_view: ViewBindings,
    views: [ViewBindings; 2],
    /// Image of the mirror for each eye.
    mirror_targets: [Option<MirrorTarget>; 2],
    view_layout: wgpu::BindGroupLayout,
    tooth: Option<ToothTextures>,
    /// The volume as textures show it; triangles have its normals.
    drawn: Option<DrawnVolume>,
    surfaces: Option<BrickSurfaces>,
    eye_targets: [Option<EyeTarget>; 2],
}

/// Target of a rendered frame.
#[derive(Clone, Copy)]
pub struct RenderTarget<'a> {
    /// View of a texture in the renderer's format that is usable as a render attachment.
    pub view: &'a wgpu::TextureView,
    /// Width and height, pixels.
    pub size: [u32; 2],
}

struct ViewBindings {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Image of a mirror, drawn before the eye's own image.
struct MirrorTarget {
    view: ViewBindings,
    eye_target: EyeTarget,
    group: wgpu::BindGroup,
}

/// Colours and depths of one eye.
struct EyeTarget {
    size: [u32; 2],
    colour: wgpu::TextureView,
    depth: wgpu::TextureView,
    depth_group: wgpu::BindGroup,
    /// Present if the last scene had a lens.
    lens: Option<LensTarget>,
    /// Present once a scene has asked for antialiasing.
    fxaa: Option<FxaaTarget>,
}

/// Antialiased colours of an eye target.
struct FxaaTarget {
    /// Bind group that reads the eye target's colours, or those that the lens has blurred.
    group: wgpu::BindGroup,
    colour: wgpu::TextureView,
}

impl EyeTarget {
    /// Returns the finished colours of an eye, antialiased if the scene asks for it.
    fn final_colour(&self, scene: &RenderScene) -> &wgpu::TextureView {
        self.fxaa.as_ref().filter(|_| scene.is_antialiased).map_or(self.blurred(), |smooth| &smooth.colour)
    }

    /// Returns the colours of an eye, blurred if there is a lens.
    fn blurred(&self) -> &wgpu::TextureView {
        self.lens.as_ref().map_or(&self.colour, |lens| &lens.colour)
    }
}

impl Renderer {
    /// Creates the pipelines for targets of a format with 8 bits per channel, sRGB or not, as windows have them.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Renderer {
        let view_layout = ViewBindings::layout(device);
        let no_shadows = ShadowMap::none(device);
        let tooth_layout = ToothTextures::layout(device);
        let [lamp_view, left, right] = [0; 3].map(|_| ViewBindings::new(device, &view_layout, &no_shadows));
        let detail = Detail { is_srgb_target: format.is_srgb(), ..Detail::default() };
        Renderer {
            surface_pass: SurfacePass::new(device, format, &view_layout, &tooth_layout, detail),
            iso_pass: iso_pass::pipeline(device, format, &view_layout, &tooth_layout, detail),
            volume_pass: VolumePass::new(device, format, &view_layout, &tooth_layout, detail),
            particle_pass: ParticlePass::new(device, format, &view_layout, detail),
            fxaa_pass: FxaaPass::new(device, format),
            lens_pass: None,
            stereo_pass: StereoPass::new(device, format),
            mirror_pass: MirrorPass::new(device, format, &view_layout),
            mirror_targets: [None, None],
            device: device.clone(),
            queue: queue.clone(),
            format,
            tooth_layout,
            detail,
            shadow_pass: None,
            no_shadows,
            lamp_view,
            views: [left, right],
            view_layout,
            tooth: None,
            drawn: None,
            surfaces: None,
            eye_targets: [None, None],
        }
    }

    /// Draws a scene over the whole target, for one eye or for two, and submits the commands.
    ///
    /// Returns what was uploaded to the device: after a cut, only the bricks that changed.
    ///
    /// # Errors
    /// [`RenderError::Impossible`] if the scene, the viewpoint, the eye distance or the size is invalid.
    pub fn draw(
        &mut self,
        scene: &RenderScene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        target: RenderTarget,
    ) -> Result<Uploads, RenderError> {
        let limit = self.device.limits().max_texture_dimension_2d;
        validate(scene, viewpoint, stereo, target.size, limit)?;
        self.fit_detail(scene);
        let uploads = self.prepare(scene);
        let [width, height] = target.size;
        let aspect = width as f32 / height as f32;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.draw_shadows(&mut encoder, scene);
        match stereo {
            None => {
                self.fit_eye_target(0, target.size, scene);
                self.fit_mirror(0, scene);
                self.draw_eye(&mut encoder, scene, &viewpoint.eye(aspect), 0, Some(target.view));
            }
            Some(stereo) => {
                let size = stereo.layout.eye_size(target.size);
                for (side, eye) in stereo.eyes(viewpoint, aspect).iter().enumerate() {
                    // Otherwise two windows of one eye each would resize each other's targets in every frame.
                    if stereo.layout.visible_eyes()[side] {
                        self.fit_eye_target(side, size, scene);
                        self.fit_mirror(side, scene);
                        self.draw_eye(&mut encoder, scene, eye, side, None);
                    }
                }
                self.composite_stereo(&mut encoder, scene, stereo, size, target.view);
            }
        }
        self.queue.submit([encoder.finish()]);
        Ok(uploads)
    }

    /// Changes to the pipelines for a scene's detail, and creates the shadow map when it is first needed.
    fn fit_detail(&mut self, scene: &RenderScene) {
        let detail = Detail {
            has_shadows: shadow::chair_eye(scene).is_some(),
            has_relief: scene.relief_seed.is_some(),
            is_srgb_target: self.format.is_srgb(),
        };
        if detail == self.detail {
            return;
        }
        self.detail = detail;
        let (device, format, view, tooth) = (&self.device, self.format, &self.view_layout, &self.tooth_layout);
        self.surface_pass = SurfacePass::new(device, format, view, tooth, detail);
        self.iso_pass = iso_pass::pipeline(device, format, view, tooth, detail);
        self.volume_pass = VolumePass::new(device, format, view, tooth, detail);
        self.particle_pass = ParticlePass::new(device, format, view, detail);
        // Their bind groups are of the passes that are gone.
        (self.eye_targets, self.mirror_targets) = ([None, None], [None, None]);
        if detail.has_shadows && self.shadow_pass.is_none() {
            let pass = ShadowPass::new(device, view, tooth, &self.surface_pass.layout);
            self.views = [0; 2].map(|_| ViewBindings::new(device, view, &pass.map));
            self.shadow_pass = Some(pass);
        }
    }

    /// Draws what the lamp sees, so that the rest lies in shadow. A translucent tooth casts none.
    fn draw_shadows(&self, encoder: &mut wgpu::CommandEncoder, scene: &RenderScene) {
        let (Some(shadows), Some(lamp)) = (&self.shadow_pass, shadow::chair_eye(scene)) else { return };
        let ViewBindings { uniform, group } = &self.lamp_view;
        let view = view::view_uniform(scene, &lamp, [shadow::MAP_SIZE; 2], false);
        self.queue.write_buffer(uniform, 0, bytemuck::bytes_of(&view));
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadows"),
            depth_stencil_attachment: Some(depth_attachment(&shadows.map.depths, wgpu::LoadOp::Clear(1.0))),
            ..Default::default()
        });
        pass.set_bind_group(0, group, &[]);
        pass.set_pipeline(&shadows.solid);
        self.surface_pass.draw_shadows(&mut pass, &lamp);
        match (scene.tooth.as_ref().map(|tooth| &tooth.mode), &self.tooth, &self.surfaces) {
            (Some(RenderMode::Surface), Some(textures), Some(surfaces)) => {
                pass.set_bind_group(1, &textures.group, &[]);
                pass.set_pipeline(&shadows.tooth);
                surfaces.draw(&mut pass);
            }
            (Some(RenderMode::Iso), Some(textures), _) => {
                pass.set_bind_group(1, &textures.group, &[]);
                pass.set_pipeline(&shadows.iso);
                pass.draw(iso_pass::BOX_VERTICES, 0..1);
            }
            _ => {}
        }
    }

    /// Uploads what is new in the scene.
    fn prepare(&mut self, scene: &RenderScene) -> Uploads {
        self.surface_pass.prepare(&self.device, &self.queue, &scene.solids);
        self.particle_pass.prepare(&self.device, &self.queue, scene.opaque_particles, scene.translucent_particles);
        let Some(tooth) = &scene.tooth else { return Uploads::default() };
        let limit = self.device.limits().max_texture_dimension_3d;
        let factor = DrawnVolume::required_factor(tooth.volume.grid().dims, limit);
        // Moved out of `self` while textures and triangles are updated from it.
        let known = self.drawn.take().filter(|drawn| drawn.matches(tooth.volume, factor));
        let (drawn, changed) = match (known, tooth.changes) {
            (Some(mut drawn), Changes::Bricks(bricks)) => {
                let changed = drawn.update(tooth.volume, bricks);
                (drawn, Some(changed))
            }
            _ => (DrawnVolume::new(tooth.volume, factor), None),
        };
        let changes = changed.as_deref().map_or(Changes::All, Changes::Bricks);
        let drawn_tooth = VolumeInstance { volume: &drawn.volume, changes, ..tooth.clone() };
        let mut uploads = self.prepare_textures(&drawn_tooth);
        uploads.downsampling = factor;
        if uploads.is_full_volume {
            self.surfaces = None;
        }
        // Triangles keep the original's resolution and its edges.
        let smoothed = if factor == 1 { &drawn.volume } else { tooth.volume };
        uploads.surfaces = self.prepare_surfaces(tooth, smoothed);
        self.drawn = Some(drawn);
        uploads
    }

    fn prepare_textures(&mut self, tooth: &VolumeInstance) -> Uploads {
        let mut uploads = Uploads::default();
        match &mut self.tooth {
            Some(known) if known.fits(tooth) => {
                uploads.bricks = known.update(&self.queue, tooth);
                known.write_uniform(&self.queue, tooth);
            }
            known => {
                let made = known.insert(ToothTextures::new(&self.device, &self.queue, &self.tooth_layout, tooth));
                made.write_uniform(&self.queue, tooth);
                uploads.is_full_volume = true;
            }
        }
        uploads
    }

    /// Updates the triangles only while they are shown. After a change in another mode they are rebuilt when next
    /// shown.
    fn prepare_surfaces(&mut self, tooth: &VolumeInstance, smoothed: &Volume) -> usize {
        let drawn = DrawnTooth { volume: tooth.volume, smoothed };
        if tooth.mode != RenderMode::Surface {
            if tooth.changes != Changes::Bricks(&[]) {
                self.surfaces = None;
            }
            return 0;
        }
        match (&mut self.surfaces, tooth.changes) {
            (Some(known), Changes::Bricks(changed)) => known.update(&self.device, &self.queue, drawn, changed),
            _ => {
                self.surfaces = Some(BrickSurfaces::new(&self.device, &self.queue, drawn));
                0
            }
        }
    }

    fn fit_eye_target(&mut self, side: usize, size: [u32; 2], scene: &RenderScene) {
        let has_lens = scene.drawn_lens().is_some();
        let fits = |target: &EyeTarget| target.size == size && target.lens.is_some() == has_lens;
        let known = self.eye_targets[side].take().filter(fits);
        let mut eye_target = known.unwrap_or_else(|| self.new_eye_target(size));
        if has_lens && eye_target.lens.is_none() {
            let sharp = [&eye_target.colour, &eye_target.depth];
            let blurred = self.attachment("lens", size, self.format);
            let new_pass = || LensPass::new(&self.device, self.format, &self.view_layout);
            let pass = self.lens_pass.get_or_insert_with(new_pass);
            eye_target.lens = Some(pass.target(&self.device, sharp, blurred));
        }
        if scene.is_antialiased && eye_target.fxaa.is_none() {
            let group = self.fxaa_pass.group(&self.device, eye_target.blurred());
            eye_target.fxaa = Some(FxaaTarget { group, colour: self.attachment("fxaa", size, self.format) });
        }
        self.eye_targets[side] = Some(eye_target);
    }

    fn new_eye_target(&self, size: [u32; 2]) -> EyeTarget {
        let depth = self.attachment("depth", size, DEPTH);
        let depth_group = self.volume_pass.group(&self.device, &depth);
        let colour = self.attachment("eye", size, self.format);
        EyeTarget { size, colour, depth, depth_group, lens: None, fxaa: None }
    }

    fn attachment(&self, label: &str, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
        let texture = resources::target_texture(&self.device, label, size, format);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Creates the target for the mirror's image, if the scene has a mirror.
    fn fit_mirror(&mut self, side: usize, scene: &RenderScene) {
        let Some(mirror) = &scene.mirror else { return };
        self.mirror_pass.write_uniform(&self.queue, mirror);
        if self.mirror_targets[side].is_none() {
            let eye_target = self.new_eye_target([mirror::PICTURE_SIZE; 2]);
            let group = self.mirror_pass.group(&self.device, &eye_target.colour);
            let map = self.shadow_pass.as_ref().map_or(&self.no_shadows, |pass| &pass.map);
            let view = ViewBindings::new(&self.device, &self.view_layout, map);
            self.mirror_targets[side] = Some(MirrorTarget { view, eye_target, group });
        }
    }

    /// Draws the image of one eye into `target`, or into the eye's own target.
    fn draw_eye(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &RenderScene,
        eye: &Eye,
        side: usize,
        target: Option<&wgpu::TextureView>,
    ) {
        let Some(eye_target) = &self.eye_targets[side] else { return };
        let mut reflected = None;
        if let (Some(mirror), Some(MirrorTarget { view, eye_target: target, group })) =
            (&scene.mirror, &self.mirror_targets[side])
            && let Some(image) = mirror.reflected_eye(eye)
        {
            self.draw_scene(encoder, &mirror.with_reflected_light(scene), (&image, view), target, &target.colour, None);
            reflected = Some(group);
        }
        let view = (eye, &self.views[side]);
        let EyeTarget { colour, lens: blurred, fxaa, size, .. } = eye_target;
        let fxaa = fxaa.as_ref().filter(|_| scene.is_antialiased);
        // The last pass draws into the target itself.
        let sharp = target.filter(|_| blurred.is_none() && fxaa.is_none()).unwrap_or(colour);
        self.draw_scene(encoder, scene, view, eye_target, sharp, reflected);
        if let (Some(lens), Some(pass), Some(blurred)) = (scene.drawn_lens(), &self.lens_pass, blurred) {
            blurred.write_uniform(&self.queue, &LensView::new(lens, eye, *size));
            let to = target.filter(|_| fxaa.is_none()).unwrap_or(&blurred.colour);
            let groups = [(0, &self.views[side].group), (2, &blurred.group)];
            draw_over(encoder, to, &pass.pipeline, &groups);
        }
        if let Some(FxaaTarget { group, colour }) = fxaa {
            draw_over(encoder, target.unwrap_or(colour), &self.fxaa_pass.pipeline, &[(2, group)]);
        }
    }

    /// Draws the whole scene for one eye; `reflected` is the mirror's image.
    fn draw_scene(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &RenderScene,
        (eye, ViewBindings { uniform, group }): (&Eye, &ViewBindings),
        eye_target: &EyeTarget,
        colour: &wgpu::TextureView,
        reflected: Option<&wgpu::BindGroup>,
    ) {
        let view = view::view_uniform(scene, eye, eye_target.size, self.format.is_srgb());
        self.queue.write_buffer(uniform, 0, bytemuck::bytes_of(&view));
        let Background { middle, edge } = scene.background;
        let [r, g, b] = middle.map(f64::from);
        let clear = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
        let mut pass = begin_pass(encoder, colour, clear, Some((&eye_target.depth, wgpu::LoadOp::Clear(1.0))));
        pass.set_bind_group(0, group, &[]);
        // From near to far, as far as that is known: what is covered then need not be shaded.
        let shown = scene.tooth.as_ref().map(|tooth| &tooth.mode);
        if let Some(textures) = &self.tooth {
            pass.set_bind_group(1, &textures.group, &[]);
            match (shown, &self.surfaces) {
                (Some(RenderMode::Surface), Some(surfaces)) => {
                    pass.set_pipeline(&self.surface_pass.tooth);
                    surfaces.draw(&mut pass);
                }
                (Some(RenderMode::Iso), _) => {
                    pass.set_pipeline(&self.iso_pass);
                    pass.draw(iso_pass::BOX_VERTICES, 0..1);
                }
                _ => {}
            }
        }
        self.surface_pass.draw_solids(&mut pass, eye);
        self.particle_pass.draw_opaque(&mut pass);
        if let Some(reflected) = reflected {
            pass.set_pipeline(&self.mirror_pass.pipeline);
            pass.set_bind_group(2, reflected, &[]);
            pass.draw(0..3, 0..1);
        }
        // Clearing suffices for a single colour, except that an sRGB target takes the clear colour as linear light.
        if middle != edge || self.format.is_srgb() {
            pass.set_pipeline(&self.surface_pass.background);
            pass.draw(0..3, 0..1);
        }
        if let (Some(RenderMode::Volume(_)), Some(textures)) = (shown, &self.tooth) {
            drop(pass);
            let mut rays = begin_pass(encoder, colour, wgpu::LoadOp::Load, None);
            rays.set_bind_group(0, group, &[]);
            rays.set_bind_group(1, &textures.group, &[]);
            rays.set_bind_group(2, &eye_target.depth_group, &[]);
            rays.set_pipeline(&self.volume_pass.pipeline);
            rays.draw(iso_pass::BOX_VERTICES, 0..1);
            drop(rays);
            if scene.translucent_particles.is_empty() {
                return;
            }
            pass = begin_pass(encoder, colour, wgpu::LoadOp::Load, Some((&eye_target.depth, wgpu::LoadOp::Load)));
            pass.set_bind_group(0, group, &[]);
        }
        self.particle_pass.draw_translucent(&mut pass);
    }

    fn composite_stereo(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &RenderScene,
        stereo: Stereo,
        size: [u32; 2],
        target: &wgpu::TextureView,
    ) {
        let [left, right] = &self.eye_targets;
        let (Some(left), Some(right)) = (match stereo.layout.visible_eyes() {
            [true, true] => (left, right),
            [_, false] => (left, left),
            [false, _] => (right, right),
        }) else {
            return;
        };
        let eyes = [left.final_colour(scene), right.final_colour(scene)];
        let group = self.stereo_pass.group(&self.device, &self.queue, eyes, stereo.layout, size);
        let mut pass = begin_pass(encoder, target, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
        pass.set_pipeline(&self.stereo_pass.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl ViewBindings {
    fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
        let compared = resources::texture(wgpu::TextureSampleType::Depth, wgpu::TextureViewDimension::D2);
        let numbers = wgpu::TextureSampleType::Float { filterable: false };
        let read = resources::texture(numbers, wgpu::TextureViewDimension::D2);
        let [comparison, nearest] = [wgpu::SamplerBindingType::Comparison, wgpu::SamplerBindingType::NonFiltering]
            .map(wgpu::BindingType::Sampler);
        resources::layout(device, "view", &[resources::uniform(), compared, comparison, read, nearest])
    }

    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, map: &ShadowMap) -> ViewBindings {
        let uniform = resources::uniform_buffer(device, "view", size_of::<view::gpu::ViewUniform>());
        let [compare, nearest] = [&map.compare, &map.nearest].map(wgpu::BindingResource::Sampler);
        let [compared, read] = [&map.depths; 2].map(wgpu::BindingResource::TextureView);
        let group = resources::group(device, layout, [uniform.as_entire_binding(), compared, compare, read, nearest]);
        ViewBindings { uniform, group }
    }
}

fn depth_attachment(view: &wgpu::TextureView, load: wgpu::LoadOp<f32>) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
    wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
}

/// Draws a pass over a whole target. `groups`: its bind groups with their numbers.
fn draw_over(
    encoder: &mut wgpu::CommandEncoder,
    target: &wgpu::TextureView,
    pipeline: &wgpu::RenderPipeline,
    groups: &[(u32, &wgpu::BindGroup)],
) {
    let mut pass = begin_pass(encoder, target, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
    pass.set_pipeline(pipeline);
    for (number, group) in groups {
        pass.set_bind_group(*number, *group, &[]);
    }
    pass.draw(0..3, 0..1);
}

fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
) -> wgpu::RenderPass<'a> {
    let depth = depth.map(|(view, load)| depth_attachment(view, load));
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: colour,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: depth,
        ..Default::default()
    })
}
