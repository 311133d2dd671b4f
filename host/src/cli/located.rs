//! What `replay` and `demo` do with a building: the particle filter follows the steps through it.

use super::table::Table;
use super::{Error, print, progress};
use crate::building::open::{Options, open};
use crate::building::picture::{Dots, Trace, draw_with};
use crate::building::{Building, geometry};
use crate::export::{file, png};
use crate::particle::{Cluster, Estimate, Map, Parameters, ParticleFilter, PastPlace, Start, StartPlace};
use crate::toml_file;
use crate::track::Track;
use sohle_shared::time::Micros;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The estimate after each step, a JSON object to a line.
const STREAM: &str = "places.jsonl";
/// Colours of the document's map (Foot, 6.2.1): particles green, the path red; the corrected one blue.
const PARTICLES: &str = "#3a9b57";
const LIVE: &str = "#c8322d";
const CORRECTED: &str = "#2456b4";
/// More particles are not drawn.
const MOST_DRAWN: usize = 20_000;
/// How well somebody knows a place whose coordinates were given (standard deviation). **Units:** m.
const GIVEN_SIGMA_M: f32 = 0.3;
/// And a heading. **Units:** rad.
const GIVEN_HEADING_SIGMA: f32 = 0.2;

/// The building to follow the steps in.
#[derive(Debug, clap::Args)]
pub struct InBuilding {
    /// Follows the steps through this building: any format that 'sohle building show' takes
    #[arg(long, value_name = "FILE|DIR")]
    building: Option<PathBuf>,
    /// Where the walk begins: anywhere, entrances, a room, or FLOOR,X,Y or FLOOR,X,Y,HEADING_DEG
    ///
    /// X east and Y north in metres of the building, the heading counter-clockwise from east.
    #[arg(long, value_name = "WHERE", default_value = "anywhere", requires = "building", allow_hyphen_values = true)]
    start: String,
    /// Settings of the particle filter; others keep their default
    #[arg(long, value_name = "FILE.toml", requires = "building")]
    particle: Option<PathBuf>,
    /// All that is random in the particle filter follows from it
    #[arg(long, value_name = "N", default_value_t = 1, requires = "building")]
    particle_seed: u64,
}

impl InBuilding {
    /// Reads the building and the start, if a building is asked for; the filter has the settings `default` unless a file
    /// says otherwise.
    pub fn prepare(&self, default: Parameters) -> Result<Option<Follower>, Error> {
        let Some(path) = &self.building else { return Ok(None) };
        let building = open(path, &Options::default())?;
        let parameters = match &self.particle {
            Some(path) => toml_file::read("settings of the particle filter", path)?,
            None => default,
        };
        let start = start(&building, &self.start)?;
        let map = Arc::new(Map::of(&building)?);
        let filter = ParticleFilter::new(map, &parameters, &start, self.particle_seed)?;
        Ok(Some(Follower { building, filter }))
    }
}

/// What `--start` means in a building.
fn start(building: &Building, text: &str) -> Result<Start, Error> {
    match text.trim() {
        "anywhere" => return Ok(Start::Anywhere),
        "entrances" => {
            let place = |entrance: &crate::building::Entrance| StartPlace {
                sigma_m: 1.0,
                ..StartPlace::exactly(entrance.floor, entrance.place.map(|value| value as f32))
            };
            let places: Vec<_> = building.entrances.iter().map(place).collect();
            return if places.is_empty() {
                Err(Error::new("the building has no entrances"))
            } else {
                Ok(Start::At(places))
            };
        }
        _ => {}
    }
    if let Some((floor, room)) = building.room(text.trim()) {
        let area = geometry::area(&room.outline).abs();
        let middle = geometry::centre(&room.outline).map(|value| value as f32);
        // An even distribution over a square has 0.29 of its side as standard deviation.
        let sigma_m = 0.29 * area.sqrt() as f32;
        return Ok(Start::At(vec![StartPlace { sigma_m, ..StartPlace::exactly(floor.number, middle) }]));
    }
    let wrong = || {
        Error::new(format!(
            "--start '{text}': expected anywhere, entrances, the name of a room, or FLOOR,X,Y[,HEADING_DEG] in numbers"
        ))
    };
    let mut words = text.split(',').map(str::trim);
    let floor = words.next().and_then(|word| word.parse().ok()).ok_or_else(wrong)?;
    let numbers: Vec<f32> = words.map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    let (place, heading) = match numbers[..] {
        [x, y] => ([x, y], None),
        [x, y, heading] if heading.is_finite() => ([x, y], Some((heading.to_radians(), GIVEN_HEADING_SIGMA))),
        _ => return Err(wrong()),
    };
    Ok(Start::At(vec![StartPlace { floor, place, sigma_m: GIVEN_SIGMA_M, heading }]))
}

/// A building and the filter that is to follow a walk in it.
pub struct Follower {
    building: Building,
    filter: ParticleFilter,
}

impl Follower {
    /// Follows the steps of a track; writes the stream and the pictures of the floors, and tells.
    pub fn run(mut self, track: &Track, folder: &Path, quiet: bool) -> Result<(), Error> {
        if track.steps.is_empty() {
            return Err(Error::new("there are no steps to follow in the building"));
        }
        let bar = progress(track.steps.len() as u64, "following", quiet);
        let mut stream = String::new();
        let mut said: Vec<Estimate> = Vec::with_capacity(track.steps.len());
        for step in &track.steps {
            let estimate = self.filter.step(step).clone();
            stream.push_str(&serde_json::to_string(&self.line(&estimate))?);
            stream.push('\n');
            said.push(estimate);
            bar.inc(1);
        }
        bar.finish_and_clear();
        file::folder(folder)?;
        file::write(&folder.join(STREAM), stream.as_bytes())?;
        let past = self.filter.past();
        let mut files = vec![STREAM.to_owned()];
        for (index, floor) in self.building.floors.iter().enumerate() {
            let drawing = self.picture(index, &said, &past);
            let name = |kind: &str| format!("floor{}.{kind}", floor.number);
            file::write(&folder.join(name("svg")), drawing.as_bytes())?;
            file::write(&folder.join(name("png")), &png::render(&drawing)?)?;
            files.extend([name("svg"), name("png")]);
        }
        if quiet {
            return Ok(());
        }
        print(&format!("\n{}\n{}: {}\n", self.told(&said), folder.display(), files.join(", ")))
    }

    /// What the filter said, for other programs.
    fn line(&self, estimate: &Estimate) -> serde_json::Value {
        let place = |cluster: &Cluster| {
            serde_json::json!({
                "probability": rounded(cluster.probability, 4),
                "floor": cluster.floor,
                "position_m": cluster.position.iter().map(|value| rounded(*value, 3)).collect::<Vec<_>>(),
                "sigma_m": rounded(cluster.sigma_m(), 3),
                "heading_deg": rounded(cluster.heading.to_degrees(), 1),
                "heading_agreement": rounded(cluster.heading_agreement, 3),
            })
        };
        let rooms = estimate.rooms.iter().take(10).map(|share| {
            serde_json::json!({
                "floor": share.floor,
                "room": self.name(share.floor, share.room),
                "probability": rounded(share.probability, 4),
            })
        });
        let rooms: Vec<_> = rooms.collect();
        serde_json::json!({
            "time_us": estimate.time.map(|Micros(time)| time),
            "step": estimate.step,
            "state": estimate.state,
            "places": estimate.clusters.iter().take(10).map(place).collect::<Vec<_>>(),
            "rooms": rooms,
            "particles": estimate.particles,
            "likelihood": rounded(estimate.likelihood, 4),
        })
    }

    fn name(&self, floor: i32, room: Option<u16>) -> Option<&str> {
        let room = self.building.floor(floor)?.rooms.get(usize::from(room?))?;
        Some(&room.name)
    }

    /// The plan of a floor with the paths on it.
    fn picture(&self, index: usize, said: &[Estimate], past: &[PastPlace]) -> String {
        let floor = &self.building.floors[index];
        let live = pieces(said.iter().map(|estimate| {
            let place = estimate.place()?;
            (place.floor_index == index).then_some([place.position.x, place.position.y])
        }));
        let corrected =
            pieces(past.iter().map(|place| (place.floor == index).then_some([place.position[0], place.position[1]])));
        let particles = self.filter.particles();
        let every = particles.len().div_ceil(MOST_DRAWN);
        let here = particles.iter().step_by(every.max(1)).filter(|particle| usize::from(particle.floor) == index);
        let places = here.map(|particle| [particle.x, particle.y].map(f64::from)).collect();
        let dots = [Dots { label: "particles at the end", colour: PARTICLES, places }];
        let traces = [
            Trace { label: "as it was said", colour: LIVE, width: 1.5, pieces: live },
            Trace { label: "corrected", colour: CORRECTED, width: 2.5, pieces: corrected },
        ];
        draw_with(&self.building, floor, &[], &dots, &traces)
    }

    /// A short account.
    fn told(&self, said: &[Estimate]) -> String {
        let Some(last) = said.last() else { return String::new() };
        let located = said.iter().find(|estimate| estimate.state == crate::particle::State::Located);
        let since = |time: Option<Micros>| {
            let first = said.first().and_then(|first| first.time);
            time.zip(first).map_or(0.0, |(time, first)| (time - first) as f64 * 1e-6)
        };
        let mut text = format!("in {}: {}", self.building.name, last.state.word());
        match located {
            Some(first) => text += &format!(" at the end, first located after {:.0} s\n\n", since(first.time)),
            None => text += " at the end, never located\n\n",
        }
        let mut table = Table::new("possible at the end", &["probability %", "floor", "x m", "y m", "sigma m"]);
        for cluster in last.clusters.iter().take(5) {
            let [x, y] = [cluster.position.x, cluster.position.y];
            let room = self.building.floor(cluster.floor).and_then(|floor| floor.room_at([x, y]));
            table.row(
                room.map_or("-", |room| &room.name),
                vec![
                    format!("{:.1}", 100.0 * cluster.probability),
                    cluster.floor.to_string(),
                    format!("{x:.2}"),
                    format!("{y:.2}"),
                    format!("{:.2}", cluster.sigma_m()),
                ],
            );
        }
        text + &table.text()
    }
}

fn rounded(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    (value * unit).round() / unit
}

/// Runs of places.
fn pieces(places: impl Iterator<Item = Option<[f64; 2]>>) -> Vec<Vec<[f64; 2]>> {
    let mut pieces: Vec<Vec<[f64; 2]>> = Vec::new();
    let mut going_on = false;
    for place in places {
        match (place, pieces.last_mut()) {
            (Some(place), Some(last)) if going_on => last.push(place),
            (Some(place), _) => pieces.push(vec![place]),
            (None, _) => {}
        }
        going_on = place.is_some();
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::generate;

    #[test]
    fn a_start_is_read_as_it_is_meant() {
        let building = generate::twin(2);
        let at = |text: &str| match start(&building, text) {
            Ok(Start::At(places)) => places,
            other => panic!("{other:?}"),
        };
        assert_eq!(start(&building, "anywhere").unwrap(), Start::Anywhere);
        assert_eq!((at("entrances")[0].place, at("entrances")[0].floor), ([26.0, 0.3], 0));
        assert_eq!(at("1, 26,7")[0], StartPlace { floor: 1, place: [26.0, 7.0], sigma_m: 0.3, heading: None });
        assert!((at("0,26,7,-90")[0].heading.unwrap().0 + std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        let room = at("F1/W16")[0];
        assert!(room.floor == 1 && (room.sigma_m - 1.42).abs() < 0.05, "{room:?}");
        for wrong in ["", "nowhere", "0,1", "0,1,2,3,4", "0,x,2", "0,1,2,NaN"] {
            assert!(start(&building, wrong).unwrap_err().to_string().starts_with("--start"), "{wrong}");
        }
    }

    #[test]
    fn a_path_that_leaves_a_floor_comes_back_as_another_piece() {
        let places = [Some([0.0; 2]), Some([1.0, 0.0]), None, Some([2.0, 0.0]), None, None];
        assert_eq!(pieces(places.into_iter()), [vec![[0.0; 2], [1.0, 0.0]], vec![[2.0, 0.0]]]);
    }
}
