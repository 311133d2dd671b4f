//! Particles and ways as the graphics card takes them, sorted by floor.

use super::overlay::{Overlay, Pieces, Role};
use super::palette::{Palette, Rgb};
use super::scene::Scene;
use super::view::Layers;
use crate::particle::Particle;
use crate::window::gpu::RenderState;
use eframe::wgpu::{self, util::DeviceExt};
use std::ops::Range;
use std::sync::Arc;

/// Least and most opacity of a particle, by its weight.
const FAINTEST: f32 = 0.3;

/// A particle: place and colour, as bits.
type Dot = [u32; 4];
/// A piece of a way: both ends, colour and width, as bits.
type Stroke = [u32; 8];

fn vertex_buffer(render: &RenderState, label: &str, contents: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::VERTEX;
    render.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
}

fn packed([red, green, blue]: Rgb, opacity: f32) -> u32 {
    u32::from_le_bytes([red, green, blue, (opacity * 255.0) as u8])
}

/// A cloud of particles on the card.
#[derive(Debug)]
pub struct Cloud {
    particles: Arc<[Particle]>,
    colour: Rgb,
    buffer: wgpu::Buffer,
    floors: Vec<Range<u32>>,
}

impl Cloud {
    /// Sends a cloud; of more than `most` particles only every so many.
    pub fn new(render: &RenderState, particles: Arc<[Particle]>, colour: Rgb, floors: usize, most: usize) -> Self {
        let (dots, floors) = dots(&particles, most, colour, floors);
        let buffer = vertex_buffer(render, "particles", bytemuck::cast_slice(&dots));
        Self { particles, colour, buffer, floors }
    }

    /// Whether these are they.
    pub fn is_of(&self, particles: &Arc<[Particle]>, colour: Rgb) -> bool {
        Arc::ptr_eq(&self.particles, particles) && self.colour == colour
    }

    /// Draws those of a floor.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, floor: usize) {
        if let Some(range) = self.floors.get(floor).filter(|range| !range.is_empty()) {
            pass.set_vertex_buffer(0, self.buffer.slice(..));
            pass.draw(0..3, range.clone());
        }
    }
}

/// Particles by floor, at most so many, and where each floor begins and ends. One on a floor that is not there is left out.
fn dots(particles: &[Particle], most: usize, colour: Rgb, floors: usize) -> (Vec<Dot>, Vec<Range<u32>>) {
    // Neighbours in the cloud were copies of one; every so many are as good a picture of it.
    let step = particles.len().div_ceil(most.max(1)).max(1);
    let drawn = || particles.iter().step_by(step);
    let mut counts = vec![0_u32; floors + 1];
    let floor = |particle: &Particle| usize::from(particle.floor).min(floors);
    for particle in drawn() {
        counts[floor(particle)] += 1;
    }
    let mut next = 0;
    let ranges: Vec<Range<u32>> = counts.iter().map(|count| (next..next + count, next += count).0).collect();
    let mut free: Vec<u32> = ranges.iter().map(|range| range.start).collect();
    let mean = particles.iter().map(|particle| particle.weight).sum::<f32>() / particles.len().max(1) as f32;
    let mut dots = vec![[0; 4]; particles.len().div_ceil(step)];
    for particle in drawn() {
        let share = if mean > 0.0 { particle.weight / mean } else { 1.0 };
        let opacity = FAINTEST + (1.0 - FAINTEST) * share.sqrt().min(1.0);
        let place = &mut free[floor(particle)];
        let [x, y, z] = [particle.x, particle.y, particle.z].map(f32::to_bits);
        dots[*place as usize] = [x, y, z, packed(colour, opacity)];
        *place += 1;
    }
    (dots, ranges[..floors].to_vec())
}

/// Where the pieces of the ways of a floor begin and end.
type Ranges = Vec<(Role, Range<u32>)>;

/// Ways with their colours, from which pieces are made.
#[derive(Debug, Default)]
pub struct Source(Vec<(Role, Rgb, Pieces)>);

impl Source {
    /// The ways of an overlay, in the order in which they are drawn: the most important on top.
    pub fn of(overlay: &Overlay, palette: &Palette) -> Self {
        let track = |track: &super::overlay::Track| {
            (track.role, track.colour.unwrap_or(palette.role(track.role)), track.pieces.clone())
        };
        let mut tracks: Vec<_> = overlay.tracks.iter().map(track).collect();
        let order = [Role::Truth, Role::Free, Role::Other, Role::Corrected, Role::Estimate];
        tracks.sort_by_key(|(role, _, _)| order.iter().position(|other| other == role));
        Self(tracks)
    }
}

/// Ways on the card.
#[derive(Debug, Default)]
pub struct Strokes {
    source: Source,
    buffer: Option<wgpu::Buffer>,
    /// For each floor, in the order in which they are drawn.
    floors: Vec<Ranges>,
}

impl Strokes {
    /// Sends ways.
    pub fn new(render: &RenderState, source: Source, scene: &Scene) -> Self {
        let (strokes, floors) = strokes(&source, scene);
        let buffer = (!strokes.is_empty()).then(|| vertex_buffer(render, "ways", bytemuck::cast_slice(&strokes)));
        Self { source, buffer, floors }
    }

    /// Whether these are they.
    pub fn is_of(&self, source: &Source) -> bool {
        self.source.0.len() == source.0.len()
            && self.source.0.iter().zip(&source.0).all(|(a, b)| a.0 == b.0 && a.1 == b.1 && Arc::ptr_eq(&a.2, &b.2))
    }

    /// Draws those of a floor: around each way a casing first.
    pub fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        floor: usize,
        layers: Layers,
        pipelines: [&wgpu::RenderPipeline; 2],
    ) {
        let (Some(buffer), Some(ways)) = (&self.buffer, self.floors.get(floor)) else { return };
        for (_, range) in ways.iter().filter(|(role, _)| layers.shows(*role)) {
            pass.set_vertex_buffer(0, buffer.slice(..));
            for pipeline in pipelines {
                pass.set_pipeline(pipeline);
                pass.draw(0..4, range.clone());
            }
        }
    }
}

/// Width of a way. **Units:** points.
pub(super) fn width(role: Role) -> f32 {
    match role {
        Role::Truth => 4.0,
        Role::Free | Role::Other => 2.0,
        Role::Corrected | Role::Estimate => 2.6,
    }
}

fn strokes(source: &Source, scene: &Scene) -> (Vec<Stroke>, Vec<Ranges>) {
    let count = scene.storeys().len();
    let mut floors: Vec<Vec<(Role, Vec<Stroke>)>> = vec![Vec::new(); count];
    for (role, colour, pieces) in &source.0 {
        let mut here: Vec<Vec<Stroke>> = vec![Vec::new(); count];
        for pair in pieces.iter().flat_map(|piece| piece.windows(2)) {
            let [a, b] = [pair[0], pair[1]].map(|point| point.map(|value| (value as f32).to_bits()));
            // On stairs: where the lower end is.
            let floor = scene.storey_at(pair[0][2].min(pair[1][2]));
            if let Some(strokes) = here.get_mut(floor) {
                strokes.push([a[0], a[1], a[2], b[0], b[1], b[2], packed(*colour, 1.0), width(*role).to_bits()]);
            }
        }
        for (floor, strokes) in here.into_iter().enumerate().filter(|(_, strokes)| !strokes.is_empty()) {
            floors[floor].push((*role, strokes));
        }
    }
    let mut all = Vec::new();
    let ranges = floors
        .into_iter()
        .map(|ways| {
            let range = |(role, strokes): (Role, Vec<Stroke>)| {
                let start = all.len() as u32;
                all.extend(strokes);
                (role, start..all.len() as u32)
            };
            ways.into_iter().map(range).collect()
        })
        .collect();
    (all, ranges)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::map::overlay::Track;
    use crate::window::map::scene::tests::house;

    #[test]
    fn particles_are_sorted_by_floor_and_fainter_with_less_weight() {
        let particle = |floor, x, weight| Particle { x, floor, weight, ..Particle::default() };
        let particles = [particle(1, 1.0, 1.0), particle(0, 2.0, 0.01), particle(1, 3.0, 1.0), particle(7, 4.0, 1.0)];
        let (dots, floors) = dots(&particles, usize::MAX, [1, 2, 3], 2);
        assert_eq!(floors, [0..1, 1..3]);
        let places: Vec<f32> = dots.iter().map(|dot| f32::from_bits(dot[0])).collect();
        assert_eq!(places, [2.0, 1.0, 3.0, 4.0]);
        let opacity = |dot: &Dot| dot[3].to_le_bytes()[3];
        assert!(opacity(&dots[0]) < opacity(&dots[1]));
    }

    #[test]
    fn of_a_crowd_only_so_many_are_drawn_from_all_of_it() {
        let crowd: Vec<Particle> =
            (0..1_001).map(|index| Particle { x: index as f32, weight: 1.0, ..Particle::default() }).collect();
        for (most, count) in [(usize::MAX, 1_001), (1_001, 1_001), (1_000, 501), (10, 10), (1, 1), (0, 1)] {
            let (dots, floors) = dots(&crowd, most, [1, 2, 3], 1);
            assert_eq!((dots.len(), floors[0].end as usize), (count, count), "{most}");
        }
        let (dots, _) = dots(&crowd, 10, [1, 2, 3], 1);
        let farthest = dots.iter().map(|dot| f32::from_bits(dot[0])).fold(0.0, f32::max);
        assert!(farthest > 900.0);
    }

    #[test]
    fn a_way_belongs_to_the_floors_it_passes() {
        let scene = Scene::of(&house());
        let pieces: Arc<[Vec<[f64; 3]>]> =
            vec![vec![[1.0, 5.0, 0.0], [7.0, 3.5, 0.0], [7.0, 0.8, 1.6], [9.0, 3.5, 3.2], [9.0, 5.0, 3.2]]].into();
        let track = |role| Track { name: String::new(), role, colour: None, pieces: pieces.clone() };
        let overlay = Overlay { tracks: vec![track(Role::Estimate), track(Role::Truth)], ..Overlay::default() };
        let (strokes, floors) = strokes(&Source::of(&overlay, Palette::of(false)), &scene);
        assert_eq!(strokes.len(), 8);
        // The truth lies below; the last stretch is on the upper floor.
        assert_eq!(
            floors,
            [vec![(Role::Truth, 0..3), (Role::Estimate, 3..6)], vec![(Role::Truth, 6..7), (Role::Estimate, 7..8)]]
        );
    }
}
