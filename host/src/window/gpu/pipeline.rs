//! What is drawn how: the settings that the graphics card wants before anything is drawn.

use super::RenderState;
use super::target::{DEPTH_FORMAT, FORMAT};
use eframe::wgpu;
use std::num::NonZeroU64;

/// What happens to the depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Drawn where nothing is nearer, and hides what is farther.
    Solid,
    /// Drawn where nothing is nearer; hides nothing.
    Tested,
    /// Drawn where something is nearer; hides nothing.
    Behind,
    /// Drawn everywhere; hides nothing.
    Ignored,
}

/// What happens to the number of the layer that is seen at a pixel, which counts from 1, and is 0 where there is nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// It plays no part.
    Ignored,
    /// It becomes the one that is being drawn.
    Noted,
    /// Drawn where no higher layer is seen.
    NotAbove,
}

/// What happens to the colour that is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// It is replaced.
    Opaque,
    /// It shines through.
    Translucent,
}

/// A way of drawing.
#[derive(Clone, Copy, Debug)]
pub struct Kind<'a> {
    /// Of the shader's functions, the one for vertices.
    pub vertex: &'a str,
    /// Of the shader's functions, the one for pixels.
    pub fragment: &'a str,
    /// What a vertex or an instance is made of.
    pub attributes: &'a [wgpu::VertexAttribute],
    /// Bytes from one to the next; none when nothing is read.
    pub stride: u64,
    /// Whether the attributes are those of an instance, the corners of which are drawn as a strip.
    pub instanced: bool,
    /// What happens to the depth.
    pub depth: Depth,
    /// What happens to the layer.
    pub layer: Layer,
    /// What happens to the colour.
    pub blend: Blend,
}

/// The layouts that the ways of drawing of one shader share: two blocks of numbers, the second with a moving start.
#[derive(Debug)]
pub struct Pipelines<'a> {
    device: &'a wgpu::Device,
    module: wgpu::ShaderModule,
    group: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
    samples: u32,
}

impl<'a> Pipelines<'a> {
    /// Of a shader in WGSL, for pictures with so many `samples`. `second` is the size of the second block; nothing when there is none. **Units:** bytes.
    pub fn of(render: &'a RenderState, label: &str, source: &str, second: Option<NonZeroU64>, samples: u32) -> Self {
        let device = &render.device;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let entry = |binding, has_dynamic_offset, min_binding_size| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset,
                min_binding_size,
            },
            count: None,
        };
        let mut entries = vec![entry(0, false, None)];
        entries.extend(second.map(|size| entry(1, true, Some(size))));
        let group =
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts: &[Some(&group)],
            immediate_size: 0,
        });
        Self { device, module, group, layout, samples }
    }

    /// One way of drawing.
    pub fn pipeline(&self, kind: &Kind<'_>) -> wgpu::RenderPipeline {
        let step_mode = if kind.instanced { wgpu::VertexStepMode::Instance } else { wgpu::VertexStepMode::Vertex };
        let buffer = wgpu::VertexBufferLayout { array_stride: kind.stride, step_mode, attributes: kind.attributes };
        let buffers = if kind.stride == 0 { vec![] } else { vec![Some(buffer)] };
        let strip = kind.instanced || kind.stride == 0;
        let topology =
            if strip { wgpu::PrimitiveTopology::TriangleStrip } else { wgpu::PrimitiveTopology::TriangleList };
        let (write, compare) = match kind.depth {
            Depth::Solid => (true, wgpu::CompareFunction::LessEqual),
            Depth::Tested => (false, wgpu::CompareFunction::LessEqual),
            Depth::Behind => (false, wgpu::CompareFunction::Greater),
            Depth::Ignored => (false, wgpu::CompareFunction::Always),
        };
        let (compare_layer, pass_op) = match kind.layer {
            Layer::Ignored => (wgpu::CompareFunction::Always, wgpu::StencilOperation::Keep),
            Layer::Noted => (wgpu::CompareFunction::Always, wgpu::StencilOperation::Replace),
            Layer::NotAbove => (wgpu::CompareFunction::GreaterEqual, wgpu::StencilOperation::Keep),
        };
        let layer = wgpu::StencilFaceState { compare: compare_layer, pass_op, ..wgpu::StencilFaceState::IGNORE };
        let blend = match kind.blend {
            Blend::Opaque => None,
            Blend::Translucent => Some(wgpu::BlendState::ALPHA_BLENDING),
        };
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(kind.vertex),
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some(kind.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &buffers,
            },
            primitive: wgpu::PrimitiveState { topology, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(write),
                depth_compare: Some(compare),
                stencil: wgpu::StencilState {
                    front: layer,
                    back: layer,
                    read_mask: 0xff,
                    write_mask: if kind.layer == Layer::Noted { 0xff } else { 0 },
                },
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some(kind.fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState { format: FORMAT, blend, write_mask: wgpu::ColorWrites::ALL })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// Joins the blocks of numbers to what the shader reads.
    pub fn group(&self, first: &wgpu::Buffer, second: Option<(&wgpu::Buffer, NonZeroU64)>) -> wgpu::BindGroup {
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: first.as_entire_binding() }];
        entries.extend(second.map(|(buffer, size)| wgpu::BindGroupEntry {
            binding: 1,
            resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size: Some(size) }),
        }));
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.group,
            entries: &entries,
        })
    }
}

/// A block of numbers that are the same for all that is drawn. **Units:** bytes.
pub fn uniform(render: &RenderState, label: &str, size: u64) -> wgpu::Buffer {
    render.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
