//! Where the particles lie at first: around known places, or everywhere (Foot, 5.3).

use super::Error;
use super::cloud::Particle;
use super::map::Map;
use super::parameters::{Method, Parameters};
use super::random::{Purpose, Stream};
use std::f32::consts::{PI, TAU};

/// A place where the person may be at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPlace {
    /// Number of the floor.
    pub floor: i32,
    /// **Units:** m; **Frame:** building.
    pub place: [f32; 2],
    /// Standard deviation of each coordinate. **Units:** m.
    pub sigma_m: f32,
    /// Heading of the foot and its standard deviation, if it is known. **Units:** rad; **Frame:** building.
    pub heading: Option<(f32, f32)>,
}

impl StartPlace {
    /// A place known to the centimetre, with any heading.
    pub fn exactly(floor: i32, place: [f32; 2]) -> Self {
        Self { floor, place, sigma_m: 0.0, heading: None }
    }
}

/// What is known at the start.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// One of these places, all alike: one known place, or all entrances.
    At(Vec<StartPlace>),
    /// Anywhere in the building.
    Anywhere,
}

/// Particles, and the space that each stands for.
pub(super) struct Seeded {
    pub particles: Vec<Particle>,
    /// Half the distance to the next place. **Units:** m.
    pub half_spacing_m: f32,
    /// Half the angle to the next heading. **Units:** rad.
    pub half_sector: f32,
}

/// An area of a floor to sow in: within `radius` of a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patch {
    pub floor: usize,
    pub centre: [f32; 2],
    pub radius: f32,
}

/// Sows particles.
///
/// # Errors
/// A place that is not in the building.
pub(super) fn sow(map: &Map, start: &Start, parameters: &Parameters, seed: u64) -> Result<Seeded, Error> {
    match start {
        Start::Anywhere => Ok(everywhere(map, parameters, None, &mut Stream::new(seed, Purpose::Seed, 0, 0))),
        Start::At(places) => around(map, places, parameters, seed),
    }
}

fn around(map: &Map, places: &[StartPlace], parameters: &Parameters, seed: u64) -> Result<Seeded, Error> {
    if places.is_empty() {
        return Err(Error::NoStart);
    }
    let mut stream = Stream::new(seed, Purpose::Seed, 0, 0);
    // Headings need more than N0: as many as half a degree between two, if none is known.
    let each = match parameters.method {
        Method::Documented => parameters.least,
        Method::Covariance => parameters.least.max(720),
    };
    let each = each.min(parameters.most / places.len()).max(1);
    let mut particles = Vec::with_capacity(each * places.len());
    for start in places {
        let floor = map.floor(start.floor).ok_or_else(|| Error::StartFloor {
            floor: start.floor,
            floors: map.floors().map(|(number, _)| number.to_string()).collect::<Vec<_>>().join(", "),
        })?;
        let [x, y] = start.place;
        if !map.is_inside(floor, start.place) {
            let [low, high] = map.floors[floor].bounds();
            return Err(Error::StartOutside { floor: start.floor, x, y, low, high });
        }
        for i in 0..each {
            let heading = match start.heading {
                Some((heading, sigma)) => heading + sigma * stream.bell(),
                None => TAU * i as f32 / each as f32 - PI,
            };
            let place = [x + start.sigma_m * stream.bell(), y + start.sigma_m * stream.bell()];
            // What would lie behind a wall lies at the place itself.
            let place = if start.sigma_m > 0.0 && map.blocked(floor, start.place, place) { start.place } else { place };
            particles.push(particle(map, floor, place, heading, parameters, &mut stream));
        }
    }
    Ok(Seeded { particles, half_spacing_m: 0.0, half_sector: 0.0 })
}

/// A regular grid with regular headings on all floors, or in one patch. The document puts particles into its points, the
/// default anywhere within the cell of each, so that no direction and no line of places is left out.
pub(super) fn everywhere(map: &Map, parameters: &Parameters, patch: Option<Patch>, stream: &mut Stream) -> Seeded {
    let mut spacing = parameters.spacing_m;
    let mut places = places(map, spacing, patch);
    let headings = parameters.headings as usize;
    // A larger building gets a wider grid. The number of places falls with the square of the spacing, but for the border.
    while places.len() * headings > parameters.most && !places.is_empty() {
        spacing *= (places.len() as f32 * headings as f32 / parameters.most as f32).sqrt().max(1.02);
        places = self::places(map, spacing, patch);
    }
    let jitter = parameters.method == Method::Covariance;
    let (half_spacing_m, half_sector) = (spacing / 2.0, PI / headings as f32);
    let mut particles = Vec::with_capacity(places.len() * headings);
    for (floor, place) in places {
        for i in 0..headings {
            let mut heading = TAU * i as f32 / headings as f32 - PI;
            let mut at = place;
            if jitter {
                heading += half_sector * stream.symmetric();
                let moved = place.map(|value| value + half_spacing_m * stream.symmetric());
                if map.is_inside(floor, moved) && !map.blocked(floor, place, moved) {
                    at = moved;
                }
            }
            particles.push(particle(map, floor, at, heading, parameters, stream));
        }
    }
    if parameters.room_prior > 0.0 {
        favour_small_rooms(&mut particles, map, parameters.room_prior);
    }
    Seeded { particles, half_spacing_m, half_sector }
}

/// People are in rooms, not in square metres: lets the weight of a room grow less than its area.
fn favour_small_rooms(particles: &mut [Particle], map: &Map, exponent: f32) {
    let room = |particle: &Particle| {
        let floor = usize::from(particle.floor);
        map.room(floor, [particle.x, particle.y]).map(|room| (floor, usize::from(room)))
    };
    let mut counts: Vec<Vec<u32>> = map.floors.iter().map(|floor| vec![0; floor.rooms.outlines().len()]).collect();
    let rooms: Vec<_> = particles.iter().map(room).collect();
    for &(floor, room) in rooms.iter().flatten() {
        counts[floor][room] += 1;
    }
    let held: Vec<f32> = counts.iter().flatten().filter(|&&count| count > 0).map(|&count| count as f32).collect();
    let mean = held.iter().sum::<f32>() / held.len().max(1) as f32;
    for (particle, room) in particles.iter_mut().zip(rooms) {
        // What belongs to no room counts as one of middling size.
        particle.weight = room.map_or(1.0, |(floor, room)| (mean / counts[floor][room] as f32).powf(exponent));
    }
}

fn places(map: &Map, spacing: f32, patch: Option<Patch>) -> Vec<(usize, [f32; 2])> {
    let mut places = Vec::new();
    for (index, floor) in map.floors.iter().enumerate() {
        if patch.is_some_and(|patch| patch.floor != index) {
            continue;
        }
        let [low, high] = floor.bounds();
        let count = |axis: usize| ((high[axis] - low[axis]) / spacing).ceil() as usize;
        for row in 0..count(1) {
            for column in 0..count(0) {
                let place = [low[0] + (column as f32 + 0.5) * spacing, low[1] + (row as f32 + 0.5) * spacing];
                let near = patch
                    .is_none_or(|patch| (place[0] - patch.centre[0]).hypot(place[1] - patch.centre[1]) <= patch.radius);
                if near && floor.inside.at(place) {
                    places.push((index, place));
                }
            }
        }
    }
    places
}

fn particle(
    map: &Map,
    floor: usize,
    [x, y]: [f32; 2],
    heading: f32,
    parameters: &Parameters,
    stream: &mut Stream,
) -> Particle {
    Particle {
        x,
        y,
        z: map.floors[floor].height,
        heading,
        scale: 1.0 + parameters.scale_sigma * stream.bell(),
        weight: 1.0,
        // At most as many floors as fit, by construction of the map.
        floor: floor as u16,
        connector: map.connector(floor, [x, y]).unwrap_or(Particle::ON_FLOOR),
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::tests::small;
    use super::*;

    #[test]
    fn a_known_place_gets_all_directions() {
        let start = Start::At(vec![StartPlace::exactly(0, [3.0, 4.0])]);
        let seeded = sow(&small(), &start, &Parameters::documented(), 1).unwrap();
        assert_eq!(seeded.particles.len(), 501);
        assert!(seeded.particles.iter().all(|p| (p.x, p.y, p.z, p.floor, p.scale) == (3.0, 4.0, 0.0, 0, 1.0)));
        // 2 pi i / N - pi, where the document's slip covers a quarter only (SPEC section 8, 3).
        assert_eq!(seeded.particles[0].heading, -PI);
        assert!((seeded.particles[500].heading - (PI - TAU / 501.0)).abs() < 1e-5);
    }

    #[test]
    fn an_unknown_place_gets_the_documents_density_on_all_floors() {
        let seeded = sow(&small(), &Start::Anywhere, &Parameters::documented(), 1).unwrap();
        // 175 for each square metre of two floors of 200 m².
        let expected = 175.0 * 400.0;
        assert!((seeded.particles.len() as f32 / expected - 1.0).abs() < 0.1, "{}", seeded.particles.len());
        assert!(seeded.particles.iter().any(|p| p.floor == 1 && p.z == 3.6));
        assert!(seeded.particles.iter().any(Particle::is_in_connector));
    }

    #[test]
    fn a_large_building_gets_a_wider_grid() {
        let parameters = Parameters { most: 10_000, ..Parameters::default() };
        let seeded = sow(&small(), &Start::Anywhere, &parameters, 1).unwrap();
        assert!((8_000..=10_000).contains(&seeded.particles.len()), "{}", seeded.particles.len());
    }

    #[test]
    fn a_place_that_is_not_there_is_refused_by_name() {
        let at = |floor, place| {
            sow(&small(), &Start::At(vec![StartPlace::exactly(floor, place)]), &Parameters::default(), 1)
        };
        let message = |result: Result<Seeded, Error>| result.map(|_| ()).unwrap_err().to_string();
        assert!(message(at(3, [3.0, 4.0])).contains("no floor 3 to start on; it has 0, 1"));
        assert!(message(at(0, [30.0, 4.0])).contains("(30.00, 4.00) m on floor 0 is outside"));
        assert!(matches!(sow(&small(), &Start::At(Vec::new()), &Parameters::default(), 1), Err(Error::NoStart)));
    }
}
