//! A picture on the graphics card that the window shows.

use super::{Pane, RenderState};
use eframe::wgpu;

/// Colours are stored as they are shown, like the window's own.
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of the depth, and of the layer that is seen.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth24PlusStencil8;

/// How much is spent on a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Care {
    /// Samples a pixel: 1 or 4, which every adapter has.
    pub samples: u32,
    /// Of more particles in a cloud only some are drawn.
    pub particles: usize,
    /// Whether everything else is as fine as it can be: edges of the window's parts, rims around words, curves, and particles
    /// that shine through walls.
    pub fine: bool,
}

impl Care {
    /// For a picture that one has time for.
    pub const BEST: Self = Self { samples: 4, particles: usize::MAX, fine: true };
    /// Where there is no graphics card: edges have steps, and a crowd of particles looks the same with fewer of them.
    const SOFTWARE: Self = Self { samples: 1, particles: 2_000, fine: false };

    /// So that a window moves with ease.
    pub fn quick(render: &RenderState) -> Self {
        let software = render.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        if software { Self::SOFTWARE } else { Self::BEST }
    }
}

/// A picture of some size, and what is needed to draw it.
///
/// What lies below is drawn first, by [`Self::below`], and what lies on it by [`Self::above`].
#[derive(Debug)]
pub struct Target {
    size: [u32; 2],
    pane: Pane,
    /// What lies below is drawn here.
    below: wgpu::Texture,
    depth: wgpu::TextureView,
    picture: wgpu::Texture,
}

impl Target {
    /// A picture of `size` pixels with so many `samples`; `old` is the one that it takes the place of.
    pub fn new(render: &RenderState, size: [u32; 2], samples: u32, old: Option<&Self>) -> Self {
        let most = render.device.limits().max_texture_dimension_2d;
        let size = size.map(|pixels| pixels.clamp(1, most));
        let texture = |label, format, sample_count, usage| {
            render.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let copied = if samples > 1 { wgpu::TextureUsages::empty() } else { wgpu::TextureUsages::COPY_SRC };
        let shown = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let picture = texture("view", FORMAT, 1, shown);
        Self {
            size,
            pane: Pane::new(render, &view(&picture), old.map(Self::pane)),
            below: texture("below", FORMAT, samples, copied),
            depth: view(&texture("depth", DEPTH_FORMAT, samples, wgpu::TextureUsages::empty())),
            picture,
        }
    }

    /// **Units:** px.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What the window shows.
    pub fn pane(&self) -> &Pane {
        &self.pane
    }

    /// Whether what lies below is still there after something was drawn on it. Several samples a pixel are not kept: not every
    /// card can copy them, and those that have them draw quickly.
    pub fn keeps(&self) -> bool {
        self.below.sample_count() == 1
    }

    /// Begins to draw what lies below, on an even background: red, green, blue from 0 to 1.
    pub fn below<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, background: [f32; 3]) -> wgpu::RenderPass<'a> {
        let [r, g, b] = background.map(f64::from);
        let clear = wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 });
        let store = wgpu::StoreOp::Store;
        pass(encoder, &view(&self.below), None, wgpu::Operations { load: clear, store }, &self.depth, true)
    }

    /// Begins to draw on what lies below.
    pub fn above<'a>(&self, encoder: &'a mut wgpu::CommandEncoder) -> wgpu::RenderPass<'a> {
        let (load, picture) = (wgpu::LoadOp::Load, view(&self.picture));
        if self.keeps() {
            let (from, to) = (self.below.as_image_copy(), self.picture.as_image_copy());
            encoder.copy_texture_to_texture(from, to, self.picture.size());
            let colours = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            pass(encoder, &picture, None, colours, &self.depth, false)
        } else {
            let colours = wgpu::Operations { load, store: wgpu::StoreOp::Discard };
            pass(encoder, &view(&self.below), Some(&picture), colours, &self.depth, false)
        }
    }
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// `fresh`: depth and layers are cleared and kept; else they are as they were, and stay so.
fn pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    resolve_target: Option<&wgpu::TextureView>,
    ops: wgpu::Operations<wgpu::Color>,
    depth: &wgpu::TextureView,
    fresh: bool,
) -> wgpu::RenderPass<'a> {
    let store = wgpu::StoreOp::Store;
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("view"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment { view, resolve_target, ops, depth_slice: None })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: fresh.then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store }),
            stencil_ops: fresh.then_some(wgpu::Operations { load: wgpu::LoadOp::Clear(0), store }),
        }),
        ..Default::default()
    })
}
