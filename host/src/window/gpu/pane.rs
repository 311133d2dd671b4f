//! Puts a picture into the window as it is, pixel by pixel.
//!
//! The window's own way reads a picture between its pixels, and blends it with what is below. Where there is no graphics card,
//! that is most of what the largest view of all costs.

use super::RenderState;
use eframe::egui::{PaintCallbackInfo, Painter, Rect};
use eframe::egui_wgpu::{Callback, CallbackResources, CallbackTrait};
use eframe::wgpu;

/// A picture that the window can show; a copy of it is the same picture.
#[derive(Clone, Debug)]
pub struct Pane {
    pipeline: wgpu::RenderPipeline,
    picture: wgpu::BindGroup,
}

impl Pane {
    /// Of a picture whose colours are stored as they are shown; `old` is the one that it takes the place of.
    pub fn new(render: &RenderState, picture: &wgpu::TextureView, old: Option<&Self>) -> Self {
        let pipeline = old.map_or_else(|| pipeline(render), |old| old.pipeline.clone());
        let picture = render.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("pane"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(picture) }],
        });
        Self { pipeline, picture }
    }

    /// Shows it. The room must have as many pixels as the picture, and begin with a whole one.
    pub fn show(&self, painter: &Painter, room: Rect) {
        painter.add(Callback::new_paint_callback(room, self.clone()));
    }
}

impl CallbackTrait for Pane {
    fn paint(&self, _: PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.picture, &[]);
        pass.draw(0..4, 0..1);
    }
}

fn pipeline(render: &RenderState) -> wgpu::RenderPipeline {
    let device = &render.device;
    let module = device.create_shader_module(wgpu::include_wgsl!("pane.wgsl"));
    let format = render.target_format;
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("pane"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs_pane"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(if format.is_srgb() { "fs_linear" } else { "fs_pane" }),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
