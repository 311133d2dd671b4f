//! Draws the map on the graphics card: what is the same as before is neither sent nor drawn again.
//!
//! First all surfaces of the building, from the highest floor to the lowest, so that what is hidden is not drawn at all; then
//! particles and ways on them. Where someone looks from the same place as before only the latter are drawn.

use super::camera::{Projection, Sight};
use super::marks::{self, Cloud, Strokes};
use super::overlay::Overlay;
use super::palette::{Palette, shares};
use super::scene::{Scene, Storey};
use super::view::Layers;
use crate::window::gpu::{Blend, Care, Depth, Kind, Layer, Pane, Pipelines, RenderState, Target, uniform};
use eframe::wgpu::{self, util::DeviceExt};
use std::num::NonZeroU64;
use std::ops::Range;
use std::sync::Arc;

/// Floats of the block that is the same for everything; see the shader.
const GLOBALS: usize = 16 + 4 * 5 + 4 * super::palette::MATERIALS;
/// Which of them is the opacity of particles.
const OPACITY: usize = 16 + 4 * 2 + 1;
/// Blocks of floors begin at multiples of this; every adapter can do that. **Units:** bytes.
const STEP: u32 = 256;
/// Of the numbers of a floor. **Units:** bytes.
const STOREY: NonZeroU64 = NonZeroU64::new(16).expect("16 is not zero");
/// With more particles each of them is fainter.
const MANY: f32 = 12_000.0;
/// Below the lowest floor. **Units:** m.
const GROUND_M: f64 = 0.3;

/// How a floor is drawn: opacities from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Opacity {
    /// Of the floor itself; drawn as solid at 1.
    pub ground: f32,
    /// Of its walls.
    pub walls: f32,
    /// Of particles and ways.
    pub marks: f32,
}

/// Everything that decides what the picture looks like, besides the scene and the overlay.
#[derive(Clone, Copy, Debug)]
pub struct Look<'a> {
    /// What is seen where.
    pub sight: &'a Sight,
    /// Pixels a point.
    pub pixels_per_point: f32,
    /// Colours.
    pub palette: &'a Palette,
    /// How far apart floors stand.
    pub spread: f64,
    /// Of walls. **Units:** m.
    pub wall_height_m: f32,
    /// Of each floor.
    pub opacities: &'a [Opacity],
    /// What is drawn.
    pub layers: Layers,
}

/// What decides what the surfaces look like.
#[derive(Clone, Debug, PartialEq)]
struct Surfaces {
    globals: Vec<f32>,
    storeys: Vec<f32>,
    /// Which scene it was.
    scene: u64,
}

/// What decides what is drawn on them.
#[derive(Clone, Debug, PartialEq)]
struct Marks {
    layers: Layers,
    /// Of particles.
    opacity: f32,
    change: u64,
}

struct SceneBuffers {
    scene: Arc<Scene>,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
}

/// The painter of one map.
pub struct Painter {
    render: RenderState,
    care: Care,
    globals: wgpu::Buffer,
    storeys: Option<(usize, wgpu::Buffer, wgpu::BindGroup)>,
    ways: Ways,
    scene: Option<SceneBuffers>,
    clouds: Vec<Cloud>,
    strokes: Strokes,
    target: Option<Target>,
    surfaces: Option<Surfaces>,
    marks: Option<Marks>,
    /// Count what was sent, so that a picture with the same numbers but other contents is drawn.
    scenes: u64,
    change: u64,
}

/// The ways of drawing.
struct Ways {
    ground: wgpu::RenderPipeline,
    solid: wgpu::RenderPipeline,
    glass: wgpu::RenderPipeline,
    dots: wgpu::RenderPipeline,
    dots_behind: wgpu::RenderPipeline,
    casing: wgpu::RenderPipeline,
    line: wgpu::RenderPipeline,
}

impl std::fmt::Debug for Painter {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Painter").field("target", &self.target).finish_non_exhaustive()
    }
}

fn pipelines(render: &RenderState, care: Care) -> Pipelines<'_> {
    Pipelines::of(render, "map", include_str!("map.wgsl"), Some(STOREY), care.samples)
}

impl Ways {
    fn of(pipelines: &Pipelines<'_>) -> Self {
        let surface = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x2, 2 => Float32x3, 3 => Uint32];
        let dot = wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4];
        let line = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4, 3 => Float32];
        let kind = |vertex: &str, fragment: &str, attributes: &[wgpu::VertexAttribute], stride, depth, blend| {
            let instanced = stride != 36;
            let layer = match depth {
                Depth::Solid => Layer::Noted,
                _ if instanced => Layer::NotAbove,
                _ => Layer::Ignored,
            };
            pipelines.pipeline(&Kind { vertex, fragment, attributes, stride, instanced, depth, layer, blend })
        };
        let over = Blend::Translucent;
        Self {
            ground: kind("vs_ground", "fs_ground", &[], 0, Depth::Tested, over),
            solid: kind("vs_surface", "fs_surface", &surface, 36, Depth::Solid, Blend::Opaque),
            glass: kind("vs_surface", "fs_surface", &surface, 36, Depth::Tested, over),
            dots: kind("vs_dot", "fs_dot", &dot, 16, Depth::Tested, over),
            dots_behind: kind("vs_dot_behind", "fs_dot", &dot, 16, Depth::Behind, over),
            casing: kind("vs_casing", "fs_line", &line, 32, Depth::Ignored, over),
            line: kind("vs_line", "fs_line", &line, 32, Depth::Ignored, over),
        }
    }
}

impl Painter {
    /// A painter with nothing to draw yet.
    pub fn new(render: &RenderState, care: Care) -> Self {
        Self {
            render: render.clone(),
            care,
            globals: uniform(render, "map", (GLOBALS * 4) as u64),
            storeys: None,
            ways: Ways::of(&pipelines(render, care)),
            scene: None,
            clouds: Vec::new(),
            strokes: Strokes::default(),
            target: None,
            surfaces: None,
            marks: None,
            scenes: 0,
            change: 0,
        }
    }

    /// What it draws with.
    pub fn render(&self) -> &RenderState {
        &self.render
    }

    /// How much is spent on a picture.
    pub fn care(&self) -> Care {
        self.care
    }

    /// The picture; drawn only if something is not as it was.
    pub fn paint(&mut self, scene: &Arc<Scene>, overlay: &Overlay, look: &Look<'_>) -> Pane {
        let size = (look.sight.rect().size() * look.pixels_per_point).round();
        let size = [size.x as u32, size.y as u32];
        let target = match self.target.take() {
            Some(target) if target.size() == size => target,
            old => {
                self.surfaces = None;
                Target::new(&self.render, size, self.care.samples, old.as_ref())
            }
        };
        self.send(scene, overlay, look.palette);
        let surfaces = Surfaces {
            globals: globals(scene, look, target.size()),
            storeys: storeys(scene, look),
            scene: self.scenes,
        };
        let particles = overlay.clouds.iter().map(|cloud| cloud.particles.len().min(self.care.particles)).sum();
        let marks = Marks { layers: look.layers, opacity: opacity(particles), change: self.change };
        let moved = self.surfaces.as_ref() != Some(&surfaces);
        if moved || self.marks.as_ref() != Some(&marks) {
            self.draw(&target, &surfaces, &marks, look, moved);
            (self.surfaces, self.marks) = (Some(surfaces), Some(marks));
        }
        let pane = target.pane().clone();
        self.target = Some(target);
        pane
    }

    /// Sends what is new to the card.
    fn send(&mut self, scene: &Arc<Scene>, overlay: &Overlay, palette: &Palette) {
        let buffer = |label, contents: &[u8], usage| {
            self.render.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let fresh = !self.scene.as_ref().is_some_and(|known| Arc::ptr_eq(&known.scene, scene));
        if fresh {
            let mesh = scene.mesh();
            let vertices = buffer("vertices", bytemuck::cast_slice(&mesh.vertices), wgpu::BufferUsages::VERTEX);
            let indices = buffer("indices", bytemuck::cast_slice(&mesh.indices), wgpu::BufferUsages::INDEX);
            self.scene = Some(SceneBuffers { scene: scene.clone(), vertices, indices });
            let count = scene.storeys().len().max(1);
            let blocks = uniform(&self.render, "storeys", u64::from(STEP) * count as u64);
            let group = pipelines(&self.render, self.care).group(&self.globals, Some((&blocks, STOREY)));
            self.storeys = Some((count, blocks, group));
            self.scenes += 1;
        }
        let mut changed = fresh;
        self.clouds.truncate(overlay.clouds.len());
        for (index, cloud) in overlay.clouds.iter().enumerate() {
            let colour = cloud.colour.unwrap_or(palette.particles);
            if self.clouds.get(index).is_some_and(|known| !fresh && known.is_of(&cloud.particles, colour)) {
                continue;
            }
            let floors = scene.storeys().len();
            let sent = Cloud::new(&self.render, cloud.particles.clone(), colour, floors, self.care.particles);
            if index < self.clouds.len() {
                self.clouds[index] = sent
            } else {
                self.clouds.push(sent)
            }
            changed = true;
        }
        let wanted = marks::Source::of(overlay, palette);
        if fresh || !self.strokes.is_of(&wanted) {
            self.strokes = Strokes::new(&self.render, wanted, scene);
            changed = true;
        }
        self.change += u64::from(changed);
    }

    /// `moved`: the surfaces are not where they were.
    fn draw(&self, target: &Target, surfaces: &Surfaces, marks: &Marks, look: &Look<'_>, moved: bool) {
        let (Some(scene), Some((_, blocks, group))) = (&self.scene, &self.storeys) else { return };
        let queue = &self.render.queue;
        let mut globals = surfaces.globals.clone();
        globals[OPACITY] = marks.opacity;
        queue.write_buffer(&self.globals, 0, bytemuck::cast_slice(&globals));
        queue.write_buffer(blocks, 0, bytemuck::cast_slice(&surfaces.storeys));
        let mut encoder = self.render.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        if moved || !target.keeps() {
            self.building(&mut target.below(&mut encoder, shares(look.palette.background)), scene, group, look);
        }
        let mut pass = target.above(&mut encoder);
        let storeys = look.opacities.iter().enumerate().take(scene.scene.storeys().len());
        for (index, _) in storeys.filter(|(_, opacity)| opacity.marks > 0.0) {
            pass.set_bind_group(0, group, &[index as u32 * STEP]);
            pass.set_stencil_reference(layer(index));
            if marks.layers.particles {
                let behind = self.care.fine.then_some(&self.ways.dots_behind);
                for pipeline in behind.into_iter().chain([&self.ways.dots]) {
                    pass.set_pipeline(pipeline);
                    for cloud in &self.clouds {
                        cloud.draw(&mut pass, index);
                    }
                }
            }
            self.strokes.draw(&mut pass, index, marks.layers, [&self.ways.casing, &self.ways.line]);
        }
        drop(pass);
        queue.submit([encoder.finish()]);
    }

    /// Draws all that particles and ways lie on.
    fn building(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &SceneBuffers,
        group: &wgpu::BindGroup,
        look: &Look<'_>,
    ) {
        let storeys = || scene.scene.storeys().iter().zip(look.opacities).enumerate();
        let draw = |pass: &mut wgpu::RenderPass<'_>, index: usize, parts: Vec<Range<u32>>| {
            pass.set_bind_group(0, group, &[index as u32 * STEP]);
            pass.set_stencil_reference(layer(index));
            for part in parts {
                pass.set_vertex_buffer(0, scene.vertices.slice(..));
                pass.set_index_buffer(scene.indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(part, 0, 0..1);
            }
        };
        pass.set_pipeline(&self.ways.solid);
        for (index, (storey, opacity)) in storeys().rev() {
            draw(pass, index, parts(storey, *opacity, |part| part >= 1.0));
        }
        // The ground is below all of it: drawn where there is nothing.
        pass.set_pipeline(&self.ways.ground);
        pass.set_stencil_reference(0);
        pass.set_bind_group(0, group, &[0]);
        pass.draw(0..4, 0..1);
        pass.set_pipeline(&self.ways.glass);
        for (index, (storey, opacity)) in storeys() {
            draw(pass, index, parts(storey, *opacity, |part| part > 0.0 && part < 1.0));
        }
    }
}

/// The triangles of a floor whose opacity is such.
fn parts(storey: &Storey, opacity: Opacity, such: impl Fn(f32) -> bool) -> Vec<Range<u32>> {
    let parts = [(opacity.ground, &storey.ground), (opacity.walls, &storey.walls)];
    parts.into_iter().filter(|(part, range)| such(*part) && !range.is_empty()).map(|(_, range)| range.clone()).collect()
}

/// The layer of a floor; of more than can be counted the last ones are one.
fn layer(storey: usize) -> u32 {
    storey.saturating_add(1).min(0xff) as u32
}

/// Of that many particles: where there are many, the plan below them is to be seen too.
fn opacity(particles: usize) -> f32 {
    0.85 * (MANY / particles.max(1) as f32).sqrt().clamp(0.25, 1.0)
}

/// The block that is the same for everything.
fn globals(scene: &Scene, look: &Look<'_>, size: [u32; 2]) -> Vec<f32> {
    let [low, high] = scene.bounds();
    let middle = [(low[0] + high[0]) / 2.0, (low[1] + high[1]) / 2.0];
    let camera = look.sight.camera();
    let flat = look.sight.projection() == Projection::Flat;
    let radius = (3.0 * scene.reach(1.0)).max(2.0 * camera.distance_m);
    let off = (0..2).map(|axis| (camera.target[axis] - middle[axis]).abs()).fold(0.0, f64::max);
    let reach = 2.0 * radius + off + camera.target[2].abs();
    let spacing = 10.0_f64.powf((camera.distance_m / 60.0).log10().floor().max(0.0));
    let mut numbers: Vec<f32> = look.sight.matrix(reach).iter().map(|&value| value as f32).collect();
    let [width, height] = size.map(|pixels| pixels as f32);
    numbers.extend([width, height, look.pixels_per_point, look.spread as f32]);
    let ground = scene.datum() - GROUND_M;
    let per_pixel = look.sight.metres_per_pixel(size[1]) as f32;
    numbers.extend([scene.datum() as f32, ground as f32, per_pixel, f32::from(u8::from(flat))]);
    numbers.extend([look.wall_height_m, 0.0, spacing as f32, radius as f32]);
    numbers.extend([middle[0] as f32, middle[1] as f32, 0.0, 0.0]);
    let opaque = |rgb| {
        let [red, green, blue] = shares(rgb);
        [red, green, blue, 1.0]
    };
    numbers.extend(opaque(look.palette.casing));
    numbers.extend(look.palette.materials.into_iter().flat_map(opaque));
    numbers
}

/// The blocks of the floors.
fn storeys(scene: &Scene, look: &Look<'_>) -> Vec<f32> {
    let step = STEP as usize / size_of::<f32>();
    let mut numbers = vec![0.0; step * scene.storeys().len().max(1)];
    for (index, (storey, opacity)) in scene.storeys().iter().zip(look.opacities).enumerate() {
        let [_, _, height] = scene.shown([0.0, 0.0, storey.height_m], look.spread);
        let block = [height as f32, opacity.ground, opacity.walls, opacity.marks];
        numbers[index * step..index * step + 4].copy_from_slice(&block);
    }
    numbers
}
