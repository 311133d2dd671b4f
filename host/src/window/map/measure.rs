//! How long a frame of the map takes.

use super::{Cloud, Map, Overlay, Role, Scene, Track, View};
use crate::building::{Building, Point};
use crate::particle::Particle;
use crate::window::gpu::offscreen::{Error, Sheet, Studio};
use std::sync::Arc;
use std::time::Instant;

/// Of each kind so many frames are drawn; the one in the middle counts.
const FRAMES: usize = 7;
/// Corners of the path that is drawn too.
const CORNERS: u32 = 2_000;

/// Times of one building with one number of particles. **Units:** ms.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name of the building.
    pub building: String,
    /// Number of its floors.
    pub floors: usize,
    /// Number of its walls.
    pub walls: usize,
    /// Number of particles.
    pub particles: usize,
    /// A frame after a step: other particles, and the map is drawn.
    pub stepping_ms: f64,
    /// A frame in which the map is turned, with the same particles.
    pub turning_ms: f64,
    /// A frame in which nothing changes.
    pub still_ms: f64,
}

/// Measures buildings with numbers of particles, on a map of some size.
///
/// # Errors
/// When the card does not answer.
pub fn measure(
    studio: &mut Studio,
    sheet: Sheet,
    buildings: &[&Building],
    counts: &[usize],
    mut told: impl FnMut(&Row),
) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    for building in buildings {
        let scene = Arc::new(Scene::of(building));
        for &count in counts {
            let mut bench = Bench::new(studio, sheet, scene.clone());
            let row = Row {
                building: building.name.clone(),
                floors: building.floors.len(),
                walls: building.floors.iter().map(|floor| floor.walls.len()).sum(),
                particles: count,
                stepping_ms: bench.stepping(count)?,
                turning_ms: bench.turning()?,
                still_ms: bench.still()?,
            };
            told(&row);
            rows.push(row);
        }
    }
    Ok(rows)
}

struct Bench<'a> {
    studio: &'a mut Studio,
    sheet: Sheet,
    map: Map,
    view: View,
    scene: Arc<Scene>,
    overlay: Overlay,
}

impl<'a> Bench<'a> {
    fn new(studio: &'a mut Studio, sheet: Sheet, scene: Arc<Scene>) -> Self {
        let map = Map::quick(studio.render());
        Self { studio, sheet, map, view: View::default(), scene, overlay: Overlay::default() }
    }

    fn frame(&mut self) -> Result<f64, Error> {
        let begun = Instant::now();
        self.studio.frame(self.sheet, |ui| drop(self.map.show(ui, &mut self.view, &self.scene, &self.overlay)))?;
        Ok(begun.elapsed().as_secs_f64() * 1e3)
    }

    fn stepping(&mut self, count: usize) -> Result<f64, Error> {
        self.overlay.tracks = vec![path(&self.scene)];
        let clouds: Vec<Arc<[Particle]>> = (0..2).map(|shift| particles(&self.scene, count, shift)).collect();
        let mut index = 0;
        median(FRAMES, || {
            index += 1;
            self.overlay.clouds = vec![Cloud { particles: clouds[index % 2].clone(), colour: None }];
            self.frame()
        })
    }

    fn turning(&mut self) -> Result<f64, Error> {
        median(FRAMES, || {
            if let Some(camera) = &mut self.view.camera {
                camera.bearing += 0.02;
            }
            self.frame()
        })
    }

    fn still(&mut self) -> Result<f64, Error> {
        median(FRAMES, || self.frame())
    }
}

fn median(count: usize, mut one: impl FnMut() -> Result<f64, Error>) -> Result<f64, Error> {
    // What is done for the first time takes longer.
    one()?;
    let mut times = (0..count).map(|_| one()).collect::<Result<Vec<f64>, Error>>()?;
    times.sort_by(f64::total_cmp);
    Ok(times[count / 2])
}

/// The fraction of the golden ratio and of its cousin in the plane: multiples of them cover evenly.
const EVEN: [f64; 3] = [0.618_033_988_749_895, 0.754_877_666_246_693, 0.569_840_290_998_053];

fn spread(index: usize, axis: usize) -> f64 {
    (0.5 + index as f64 * EVEN[axis]).fract()
}

/// Particles all over a building.
pub fn particles(scene: &Scene, count: usize, shift: usize) -> Arc<[Particle]> {
    let [low, high] = scene.bounds();
    let storeys = scene.storeys();
    let at = |index: usize, axis: usize| low[axis] + (high[axis] - low[axis]) * spread(index, axis + 1);
    (0..count)
        .map(|index| {
            let index = index + shift * count;
            let floor = (spread(index, 0) * storeys.len() as f64) as usize;
            let [x, y]: Point = [at(index, 0), at(index, 1)];
            let z = storeys.get(floor).map_or(0.0, |storey| storey.height_m);
            Particle { x: x as f32, y: y as f32, z: z as f32, weight: 1.0, floor: floor as u16, ..Particle::default() }
        })
        .collect()
}

/// A path around the ground floor, closer to the middle all the time.
fn path(scene: &Scene) -> Track {
    let [low, high] = scene.bounds();
    let middle = [0, 1].map(|axis| (low[axis] + high[axis]) / 2.0);
    let corner = |index: u32| {
        let part = f64::from(index) / f64::from(CORNERS);
        let (sin, cos) = (part * 40.0).sin_cos();
        let half = [0, 1].map(|axis| (high[axis] - low[axis]) / 2.0 * (1.0 - part));
        [middle[0] + half[0] * cos, middle[1] + half[1] * sin, scene.datum()]
    };
    let pieces = vec![(0..CORNERS).map(corner).collect()].into();
    Track { name: "estimated".into(), role: Role::Estimate, colour: None, pieces }
}
