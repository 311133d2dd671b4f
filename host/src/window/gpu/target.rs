//! A picture on the graphics card that the window shows.

use super::RenderState;
use eframe::egui::TextureId;
use eframe::wgpu;

/// Colours are stored as they are shown, like the window's own.
pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of the depth.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// How much is spent on a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Care {
    /// Samples a pixel: 1 or 4, which every adapter has.
    pub samples: u32,
    /// Of more particles in a cloud only some are drawn.
    pub particles: usize,
}

impl Care {
    /// For a picture that one has time for.
    pub const BEST: Self = Self { samples: 4, particles: usize::MAX };
    /// Where there is no graphics card: edges have steps, and a crowd of particles looks the same with fewer of them.
    const SOFTWARE: Self = Self { samples: 1, particles: 4_000 };

    /// So that a window moves with ease.
    pub fn quick(render: &RenderState) -> Self {
        let software = render.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        if software { Self::SOFTWARE } else { Self::BEST }
    }
}

/// A picture of some size, and what is needed to draw it.
#[derive(Debug)]
pub struct Target {
    size: [u32; 2],
    id: TextureId,
    /// Where a pixel has several samples.
    samples: Option<wgpu::TextureView>,
    depth: wgpu::TextureView,
    resolved: wgpu::TextureView,
}

impl Target {
    /// A picture of `size` pixels with so many `samples`; `old` is the one that it takes the place of.
    pub fn new(render: &RenderState, size: [u32; 2], samples: u32, old: Option<&Self>) -> Self {
        let most = render.device.limits().max_texture_dimension_2d;
        let size = size.map(|pixels| pixels.clamp(1, most));
        let texture = |label, format, sample_count, usage| {
            let texture = render.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let resolved = texture("view", FORMAT, 1, drawn | wgpu::TextureUsages::TEXTURE_BINDING);
        let mut renderer = render.renderer.write();
        let filter = wgpu::FilterMode::Nearest;
        let id = match old {
            Some(old) => {
                renderer.update_egui_texture_from_wgpu_texture(&render.device, &resolved, filter, old.id);
                old.id
            }
            None => renderer.register_native_texture(&render.device, &resolved, filter),
        };
        Self {
            size,
            id,
            samples: (samples > 1).then(|| texture("samples", FORMAT, samples, drawn)),
            depth: texture("depth", DEPTH_FORMAT, samples, drawn),
            resolved,
        }
    }

    /// **Units:** px.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// What the window shows it by.
    pub fn id(&self) -> TextureId {
        self.id
    }

    /// Begins to draw on an even background: red, green, blue from 0 to 1.
    pub fn pass<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, background: [f32; 3]) -> wgpu::RenderPass<'a> {
        let [r, g, b] = background.map(f64::from);
        let (view, resolve_target, store) = match &self.samples {
            Some(samples) => (samples, Some(&self.resolved), wgpu::StoreOp::Discard),
            None => (&self.resolved, None, wgpu::StoreOp::Store),
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("view"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                resolve_target,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }), store },
                depth_slice: None,
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        })
    }
}
