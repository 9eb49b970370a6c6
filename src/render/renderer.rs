//! Draws scenes on a device into whatever target it is given.

use super::brick_surfaces::BrickSurfaces;
use super::camera::Viewpoint;
use super::coarse::Coarse;
use super::eye::Eye;
use super::gpu::Error;
use super::mirror;
use super::mirror_pass::MirrorPass;
use super::passes::DEPTH;
use super::scene::{Background, Changes, Scene, Shown, Tooth};
use super::smooth_pass::SmoothPass;
use super::speck_pass::SpeckPass;
use super::stereo::Stereo;
use super::stereo_pass::StereoPass;
use super::surface_pass::SurfacePass;
use super::tooth::{ToothTextures, Uploads};
use super::view;
use super::volume_pass::VolumePass;
use super::{iso_pass, resources, sound};

/// All pipelines, and what it keeps on the device between pictures.
pub struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    format: wgpu::TextureFormat,
    tooth_layout: wgpu::BindGroupLayout,
    surface_pass: SurfacePass,
    iso_pass: wgpu::RenderPipeline,
    volume_pass: VolumePass,
    speck_pass: SpeckPass,
    smooth_pass: SmoothPass,
    stereo_pass: StereoPass,
    mirror_pass: MirrorPass,
    views: [ViewGroup; 2],
    /// What the mirror shows to each eye.
    mirrors: [Option<Reflected>; 2],
    view_layout: wgpu::BindGroupLayout,
    tooth: Option<ToothTextures>,
    /// In place of a volume that is larger than this adapter's textures.
    coarse: Option<Coarse>,
    surfaces: Option<BrickSurfaces>,
    canvases: [Option<Canvas>; 2],
}

/// Where a picture goes.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// Of the renderer's format, usable as a render attachment.
    pub view: &'a wgpu::TextureView,
    /// Width and height, pixels.
    pub size: [u32; 2],
}

struct ViewGroup {
    uniform: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// A mirror's picture, drawn before the eye's own.
struct Reflected {
    view: ViewGroup,
    canvas: Canvas,
    group: wgpu::BindGroup,
}

/// One eye's colours and depths.
struct Canvas {
    size: [u32; 2],
    colour: wgpu::TextureView,
    depth: wgpu::TextureView,
    depth_group: wgpu::BindGroup,
    /// Once a scene has asked for smooth edges.
    smooth: Option<Smoothed>,
}

/// A canvas's colours with edges smoothed.
struct Smoothed {
    /// The canvas, to be read.
    group: wgpu::BindGroup,
    colour: wgpu::TextureView,
}

impl Canvas {
    /// What an eye sees of a scene in the end.
    fn seen(&self, scene: &Scene) -> &wgpu::TextureView {
        self.smooth.as_ref().filter(|_| scene.is_smooth).map_or(&self.colour, |smooth| &smooth.colour)
    }
}

impl Renderer {
    /// Makes the pipelines for targets of a format: 8 bits per channel, sRGB or plain, as windows have them.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Renderer {
        let view_layout = resources::layout(device, "view", &[resources::uniform()]);
        let tooth_layout = ToothTextures::layout(device);
        let views = [0, 1].map(|_| ViewGroup::new(device, &view_layout));
        Renderer {
            surface_pass: SurfacePass::new(device, format, &view_layout, &tooth_layout),
            iso_pass: iso_pass::pipeline(device, format, &view_layout, &tooth_layout),
            volume_pass: VolumePass::new(device, format, &view_layout, &tooth_layout),
            speck_pass: SpeckPass::new(device, format, &view_layout),
            smooth_pass: SmoothPass::new(device, format),
            stereo_pass: StereoPass::new(device, format),
            mirror_pass: MirrorPass::new(device, format, &view_layout),
            mirrors: [None, None],
            device: device.clone(),
            queue: queue.clone(),
            format,
            tooth_layout,
            views,
            view_layout,
            tooth: None,
            coarse: None,
            surfaces: None,
            canvases: [None, None],
        }
    }

    /// Draws a scene over the whole target, as one eye sees it or as two do, and submits the work.
    ///
    /// Says what it had to bring to the device: after a cut, only the bricks that changed.
    pub fn draw(
        &mut self,
        scene: &Scene,
        viewpoint: &Viewpoint,
        stereo: Option<Stereo>,
        target: Target,
    ) -> Result<Uploads, Error> {
        let limit = self.device.limits().max_texture_dimension_2d;
        sound(scene, viewpoint, stereo, target.size, limit)?;
        let uploads = self.prepare(scene);
        let [width, height] = target.size;
        let ratio = width as f32 / height as f32;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        match stereo {
            None => {
                self.fit_canvas(0, target.size, scene);
                self.fit_mirror(0, scene);
                self.draw_eye(&mut encoder, scene, &viewpoint.eye(ratio), 0, Some(target.view));
            }
            Some(stereo) => {
                let size = stereo.layout.eye_size(target.size);
                for (side, eye) in stereo.eyes(viewpoint, ratio).iter().enumerate() {
                    // Two windows of one eye each would otherwise resize each other's canvases in every picture.
                    if stereo.layout.needs()[side] {
                        self.fit_canvas(side, size, scene);
                        self.fit_mirror(side, scene);
                        self.draw_eye(&mut encoder, scene, eye, side, None);
                    }
                }
                self.join(&mut encoder, scene, stereo, size, target.view);
            }
        }
        self.queue.submit([encoder.finish()]);
        Ok(uploads)
    }

    /// Brings to the device what the scene has new.
    fn prepare(&mut self, scene: &Scene) -> Uploads {
        self.surface_pass.prepare(&self.device, &self.queue, &scene.solids);
        self.speck_pass.prepare(&self.device, &self.queue, scene.grains, scene.drops);
        let Some(tooth) = &scene.tooth else { return Uploads::default() };
        let limit = self.device.limits().max_texture_dimension_3d;
        let joined = Coarse::needed(tooth.volume.grid().dims, limit);
        let mut uploads = match joined {
            1 => self.prepare_textures(tooth),
            _ => self.prepare_coarse(tooth, joined),
        };
        uploads.joined = joined;
        if uploads.whole {
            self.surfaces = None;
        }
        uploads.surfaces = self.prepare_surfaces(tooth);
        uploads
    }

    fn prepare_coarse(&mut self, tooth: &Tooth, joined: u32) -> Uploads {
        // Out of its place while the textures follow it.
        let known = self.coarse.take().filter(|coarse| coarse.is_of(tooth.volume, joined));
        let (coarse, changed) = match (known, tooth.changes) {
            (Some(mut coarse), Changes::Bricks(bricks)) => {
                let changed = coarse.update(tooth.volume, bricks);
                (coarse, Some(changed))
            }
            _ => (Coarse::of(tooth.volume, joined), None),
        };
        let changes = changed.as_deref().map_or(Changes::Anew, Changes::Bricks);
        let uploads = self.prepare_textures(&Tooth { volume: &coarse.volume, changes, ..tooth.clone() });
        self.coarse = Some(coarse);
        uploads
    }

    fn prepare_textures(&mut self, tooth: &Tooth) -> Uploads {
        let mut uploads = Uploads::default();
        match &mut self.tooth {
            Some(known) if known.fits(tooth) => {
                uploads.bricks = known.follow(&self.queue, tooth);
                known.pose(&self.queue, tooth);
            }
            known => {
                let made = known.insert(ToothTextures::new(&self.device, &self.queue, &self.tooth_layout, tooth));
                made.pose(&self.queue, tooth);
                uploads.whole = true;
            }
        }
        uploads
    }

    /// Follows with triangles only while they are shown: they are made anew when next wanted.
    fn prepare_surfaces(&mut self, tooth: &Tooth) -> usize {
        let Tooth { volume, palette, .. } = *tooth;
        if tooth.shown != Shown::Surface {
            if tooth.changes != Changes::Bricks(&[]) {
                self.surfaces = None;
            }
            return 0;
        }
        match (&mut self.surfaces, tooth.changes) {
            (Some(known), Changes::Bricks(changed)) if known.has(palette) => {
                known.update(&self.device, &self.queue, volume, changed)
            }
            _ => {
                self.surfaces = Some(BrickSurfaces::new(&self.device, &self.queue, volume, palette));
                0
            }
        }
    }

    fn fit_canvas(&mut self, side: usize, size: [u32; 2], scene: &Scene) {
        let known = self.canvases[side].take().filter(|canvas| canvas.size == size);
        let mut canvas = known.unwrap_or_else(|| self.canvas(size));
        if scene.is_smooth && canvas.smooth.is_none() {
            let group = self.smooth_pass.group(&self.device, &canvas.colour);
            canvas.smooth = Some(Smoothed { group, colour: self.plane("smooth", size, self.format) });
        }
        self.canvases[side] = Some(canvas);
    }

    fn canvas(&self, size: [u32; 2]) -> Canvas {
        let depth = self.plane("depth", size, DEPTH);
        let depth_group = self.volume_pass.group(&self.device, &depth);
        Canvas { size, colour: self.plane("eye", size, self.format), depth, depth_group, smooth: None }
    }

    fn plane(&self, label: &str, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
        let texture = resources::target_texture(&self.device, label, size, format);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Makes room for what the mirror shows, if the scene has one.
    fn fit_mirror(&mut self, side: usize, scene: &Scene) {
        let Some(mirror) = &scene.mirror else { return };
        self.mirror_pass.pose(&self.queue, mirror);
        if self.mirrors[side].is_none() {
            let canvas = self.canvas([mirror::PIXELS; 2]);
            let group = self.mirror_pass.group(&self.device, &canvas.colour);
            let view = ViewGroup::new(&self.device, &self.view_layout);
            self.mirrors[side] = Some(Reflected { view, canvas, group });
        }
    }

    /// One eye's picture, into `target` or into its own canvas.
    fn draw_eye(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &Scene,
        eye: &Eye,
        side: usize,
        target: Option<&wgpu::TextureView>,
    ) {
        let Some(canvas) = &self.canvases[side] else { return };
        let mut reflected = None;
        if let (Some(mirror), Some(Reflected { view, canvas, group })) = (&scene.mirror, &self.mirrors[side])
            && let Some(image) = mirror.image_of(eye)
        {
            self.draw_world(encoder, &mirror.lit(scene), (&image, view), canvas, &canvas.colour, None);
            reflected = Some(group);
        }
        let view = (eye, &self.views[side]);
        let Some(Smoothed { group, colour }) = canvas.smooth.as_ref().filter(|_| scene.is_smooth) else {
            return self.draw_world(encoder, scene, view, canvas, target.unwrap_or(&canvas.colour), reflected);
        };
        self.draw_world(encoder, scene, view, canvas, &canvas.colour, reflected);
        let clear = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = begin(encoder, target.unwrap_or(colour), clear, None);
        pass.set_pipeline(&self.smooth_pass.pipeline);
        pass.set_bind_group(2, group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Everything through one eye; the mirror with what it shows.
    fn draw_world(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &Scene,
        (eye, ViewGroup { uniform, group }): (&Eye, &ViewGroup),
        canvas: &Canvas,
        colour: &wgpu::TextureView,
        reflected: Option<&wgpu::BindGroup>,
    ) {
        let view = view::view(scene, eye, canvas.size, self.format.is_srgb());
        self.queue.write_buffer(uniform, 0, bytemuck::bytes_of(&view));
        let Background { top, bottom } = scene.background;
        let [r, g, b] = top.map(f64::from);
        let clear = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
        let mut pass = begin(encoder, colour, clear, Some((&canvas.depth, wgpu::LoadOp::Clear(1.0))));
        pass.set_bind_group(0, group, &[]);
        // One colour needs no pass; a target that takes linear light would get another.
        if top != bottom || self.format.is_srgb() {
            pass.set_pipeline(&self.surface_pass.background);
            pass.draw(0..3, 0..1);
        }
        self.surface_pass.draw_solids(&mut pass);
        self.speck_pass.draw_grains(&mut pass);
        if let Some(reflected) = reflected {
            pass.set_pipeline(&self.mirror_pass.pipeline);
            pass.set_bind_group(2, reflected, &[]);
            pass.draw(0..3, 0..1);
        }
        let shown = scene.tooth.as_ref().map(|tooth| &tooth.shown);
        match (shown, &self.tooth, &self.surfaces) {
            (Some(Shown::Surface), Some(textures), Some(surfaces)) => {
                pass.set_bind_group(1, &textures.group, &[]);
                pass.set_pipeline(&self.surface_pass.tooth);
                surfaces.draw(&mut pass);
            }
            (Some(Shown::Iso), Some(textures), _) => {
                pass.set_bind_group(1, &textures.group, &[]);
                pass.set_pipeline(&self.iso_pass);
                pass.draw(iso_pass::BOX, 0..1);
            }
            (Some(Shown::Volume(_)), Some(textures), _) => {
                drop(pass);
                let mut rays = begin(encoder, colour, wgpu::LoadOp::Load, None);
                rays.set_bind_group(0, group, &[]);
                rays.set_bind_group(1, &textures.group, &[]);
                rays.set_bind_group(2, &canvas.depth_group, &[]);
                rays.set_pipeline(&self.volume_pass.pipeline);
                rays.draw(iso_pass::BOX, 0..1);
                drop(rays);
                if scene.drops.is_empty() {
                    return;
                }
                pass = begin(encoder, colour, wgpu::LoadOp::Load, Some((&canvas.depth, wgpu::LoadOp::Load)));
                pass.set_bind_group(0, group, &[]);
            }
            _ => {}
        }
        self.speck_pass.draw_drops(&mut pass);
    }

    fn join(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &Scene,
        stereo: Stereo,
        size: [u32; 2],
        target: &wgpu::TextureView,
    ) {
        let [left, right] = &self.canvases;
        let (Some(left), Some(right)) = (match stereo.layout.needs() {
            [true, true] => (left, right),
            [_, false] => (left, left),
            [false, _] => (right, right),
        }) else {
            return;
        };
        let eyes = [left.seen(scene), right.seen(scene)];
        let group = self.stereo_pass.group(&self.device, &self.queue, eyes, stereo.layout, size);
        let mut pass = begin(encoder, target, wgpu::LoadOp::Clear(wgpu::Color::BLACK), None);
        pass.set_pipeline(&self.stereo_pass.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl ViewGroup {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> ViewGroup {
        let uniform = resources::uniform_buffer(device, "view", size_of::<view::gpu::View>());
        let group = resources::group(device, layout, [uniform.as_entire_binding()]);
        ViewGroup { uniform, group }
    }
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    colour: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
    depth: Option<(&wgpu::TextureView, wgpu::LoadOp<f32>)>,
) -> wgpu::RenderPass<'a> {
    let depth = depth.map(|(view, load)| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    });
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
