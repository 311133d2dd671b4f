//! A scenario: who walks where, with which sensor, under which seed. Plain data, readable as TOML.

use super::error::Error;
use super::gait::Gait;
use super::motion::Motion;
use super::mounting::{Mounting, Orientation};
use super::person::Person;
use super::plan::Plan;
use super::random::{Purpose, Random};
use super::route::{Leg, Route};
use super::sensor::{G_M_S2, SensorModel};
use crate::toml_file;
use sohle_shared::calibration::Direction;

/// All that a simulation depends on: equal scenarios give equal samples, bit for bit.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// All that is random follows from it.
    pub seed: u64,
    /// Time at rest before the route, and after it unless `duration` says otherwise. **Units:** s.
    pub rest: f64,
    /// When the recording ends. A route that is over by then is followed by a rest, a longer one is cut off; without it,
    /// the route's own time. **Units:** s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration: Option<f64>,
    /// Number of strides of the instrumented foot after which the person stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strides: Option<u32>,
    /// Gravity. **Units:** m/s².
    pub gravity: f64,
    /// Who.
    pub person: Person,
    /// How the sensor sits on the shoe.
    pub mounting: Mounting,
    /// With what.
    pub sensor: SensorModel,
    /// Where.
    pub route: Route,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            seed: 1,
            rest: 4.0,
            duration: None,
            strides: None,
            gravity: G_M_S2,
            person: Person::default(),
            mounting: Mounting::default(),
            sensor: SensorModel::default(),
            route: Route::default(),
        }
    }
}

impl Scenario {
    /// Some minutes with everything in them: corners, turns on the spot, normal and fast pace, a short run, stairs up
    /// and down, side steps, waiting, an elevator. Ends where it starts.
    pub fn demo() -> Self {
        let legs = vec![
            Leg::with_gait(Gait::Walk, vec![[18.0, 0.0], [18.0, 9.0], [26.0, 9.0]]),
            // Up two flights with a landing between them, over 20 risers of 0.17 m.
            Leg::stairs(10),
            Leg::walk(30.5, 9.0),
            Leg::stairs(10),
            Leg::with_gait(Gait::Fast, vec![[45.0, 9.0], [45.0, 24.0], [20.0, 24.0]]),
            Leg::Stand { seconds: 6.0 },
            Leg::SideStep { left: 1.2 },
            Leg::SideStep { left: -1.2 },
            Leg::with_gait(Gait::Walk, vec![[4.0, 24.0], [4.0, 16.0]]),
            Leg::ride(-3.4),
            Leg::Turn { heading: std::f64::consts::FRAC_PI_2 },
            Leg::with_gait(Gait::Walk, vec![[4.0, 20.0], [-6.0, 20.0]]),
            Leg::with_gait(Gait::Run, vec![[-30.0, 20.0], [-30.0, 2.0]]),
            Leg::with_gait(Gait::Walk, vec![[-30.0, 0.0], [-22.0, 0.0]]),
            Leg::stairs(-9),
            Leg::walk(-14.0, 0.0),
            Leg::stairs(9),
            Leg::with_gait(Gait::Fast, vec![[-2.0, 0.0]]),
            Leg::with_gait(Gait::Walk, vec![[0.0, 0.0]]),
        ];
        Self { route: Route { legs, ..Route::default() }, ..Self::default() }
    }

    /// One person walks 200 strides of the instrumented foot in one gait, around a rectangle of corridors; that makes 200
    /// stances to be found besides the one at the start.
    pub fn detector_test(person: Person, gait: Gait) -> Self {
        let legs = vec![Leg::with_gait(gait, vec![[36.0, 0.0], [36.0, 14.0], [0.0, 14.0], [0.0, 0.0]])];
        Self { person, strides: Some(200), route: Route { legs, endless: true, ..Route::default() }, ..Self::default() }
    }

    /// The nine detector tests: three people, each at a normal pace, fast and running. The seeds differ.
    pub fn detector_tests(seed: u64) -> Vec<(String, Self)> {
        let mut tests = Vec::new();
        for (name, person) in ["a", "b", "c"].into_iter().zip(Person::all()) {
            for (pace, gait) in [("normal", Gait::Walk), ("fast", Gait::Fast), ("run", Gait::Run)] {
                let seed = seed.wrapping_mul(16).wrapping_add(tests.len() as u64);
                tests.push((format!("{name} {pace}"), Self { seed, ..Self::detector_test(person, gait) }));
            }
        }
        tests
    }

    /// Walking on and on around two blocks, with stairs, waits and both paces; give it a duration.
    pub fn endless(seed: u64) -> Self {
        let legs = vec![
            Leg::with_gait(Gait::Walk, vec![[30.0, 0.0], [30.0, 12.0], [16.0, 12.0]]),
            Leg::stairs(12),
            Leg::with_gait(Gait::Walk, vec![[10.0, 12.0]]),
            Leg::Stand { seconds: 8.0 },
            Leg::with_gait(Gait::Fast, vec![[-20.0, 12.0], [-20.0, 0.0], [-12.0, 0.0]]),
            Leg::stairs(-12),
            Leg::with_gait(Gait::Walk, vec![[0.0, 0.0]]),
        ];
        Self { seed, route: Route { legs, endless: true, ..Route::default() }, ..Self::default() }
    }

    /// The sensor is laid down in the twelve attitudes that a calibration wants, a little off, with a hand's motion in
    /// between. The unit, its errors included, is that of every scenario with the same sensor and seed.
    pub fn calibration(seed: u64) -> Self {
        let lay = |up: Direction| Leg::Lay { up: up.0.map(f64::from), seconds: 4.5 };
        let legs = Direction::WANTED.map(lay).to_vec();
        let mounting = Mounting { orientation: Orientation::Flat, place: [0.0, 0.0, 0.01] };
        Self { seed, rest: 0.5, mounting, route: Route { legs, ..Route::default() }, ..Self::default() }
    }

    /// Reads a scenario from TOML. What the text leaves out has its default; an unknown key is refused.
    pub fn from_toml(text: &str) -> Result<Self, Error> {
        let scenario: Self = toml_file::parse(text).map_err(|(line, message)| Error::Text { line, message })?;
        scenario.check()?;
        Ok(scenario)
    }

    /// Refuses numbers that no walk can have.
    pub fn check(&self) -> Result<(), Error> {
        let value = |place: &str, what, value| Err(Error::Value { place: place.to_owned(), what, value });
        let Person {
            height,
            stride,
            cadence,
            step_width,
            toe_out,
            pitch,
            clearance,
            impact,
            rocking,
            linger,
            variability,
            ..
        } = self.person;
        for (what, number) in [("height", height), ("stride", stride), ("cadence", cadence)] {
            if !(number > 0.05 && number < 10.0) {
                return value("person", what, number);
            }
        }
        let factors = [
            ("step_width", step_width),
            ("pitch", pitch),
            ("clearance", clearance),
            ("impact", impact),
            ("rocking", rocking),
            ("linger", linger),
        ];
        for (what, number) in factors {
            if !(0.0..=5.0).contains(&number) {
                return value("person", what, number);
            }
        }
        // With 2.5 standard deviations at most a stride keeps more than a third of its length and time.
        if !(0.0..=0.25).contains(&variability) {
            return value("person", "variability", variability);
        }
        if toe_out.is_nan() || toe_out.abs() > 1.5 {
            return value("person", "toe_out", toe_out);
        }
        let rotation = match self.mounting.orientation {
            Orientation::Rotation(vector) => vector,
            _ => [0.0; 3],
        };
        for (what, vector, end) in [("place", self.mounting.place, 1.0), ("rotation", rotation, 10.0)] {
            if let Some(&number) = vector.iter().find(|number| number.is_nan() || number.abs() > end) {
                return value("mounting", what, number);
            }
        }
        if !(0.0..1e6).contains(&self.rest) {
            return value("scenario", "rest", self.rest);
        }
        if !(self.gravity > 0.0 && self.gravity < 100.0) {
            return value("scenario", "gravity", self.gravity);
        }
        if let Some(duration) = self.duration {
            // Times in microseconds and stride numbers stay exact.
            if !(duration > 0.0 && duration < 1e9) {
                return value("scenario", "duration", duration);
            }
        }
        if let Some((die, what, number)) = self.sensor.fault() {
            return value(die, what, number);
        }
        self.route.check()?;
        if self.route.endless && self.duration.is_none() && self.strides.is_none() {
            return Err(Error::Endless);
        }
        Ok(())
    }

    /// The foot of this scenario, and when the recording ends if that is known beforehand.
    pub fn motion(&self) -> Result<Motion, Error> {
        self.check()?;
        let mut random = Random::new(self.seed, Purpose::Rocking);
        let gait = Random::new(self.seed, Purpose::Gait);
        let plan = Plan::new(self.person, self.route.clone(), gait, self.strides, self.rest, self.duration);
        Ok(Motion::new(plan, &self.mounting, &mut random))
    }

    /// How long the recording will be. Plans the whole walk without simulating it. **Units:** s.
    pub fn length(&self) -> Result<f64, Error> {
        if let Some(duration) = self.duration {
            return Ok(duration);
        }
        let mut motion = self.motion()?;
        loop {
            let end = motion.segment().start + motion.segment().duration;
            if !motion.advance(end) {
                return Ok(end);
            }
            while motion.stance_ended(end).is_some() {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_survive_being_written_and_read() {
        let mut presets = vec![Scenario::default(), Scenario::demo(), Scenario::calibration(4)];
        presets.push(Scenario { duration: Some(60.0), ..Scenario::endless(3) });
        presets.extend(Scenario::detector_tests(5).into_iter().map(|(_, scenario)| scenario));
        for preset in presets {
            let text = toml::to_string(&preset).unwrap();
            assert_eq!(Scenario::from_toml(&text).unwrap(), preset, "{text}");
        }
    }

    #[test]
    fn wrong_scenarios_are_refused_with_their_place() {
        let told = |text: &str| Scenario::from_toml(text).unwrap_err().to_string();
        assert!(told("\nshoe = 1\n").starts_with("line 2: unknown field `shoe`"));
        assert!(told("[person]\nheight = -1.0\n").starts_with("person: height = -1"));
        assert!(told("[route]\nendless = true\n").contains("endless"));
        assert!(told("[[route.legs]]\nkind = \"fly\"\n").contains("unknown variant `fly`"));
        assert!(told("[[route.legs]]\nkind = \"stand\"\nseconds = nan\n").starts_with("route, leg 1: seconds"));
        assert!(told("[[route.legs]]\nkind = \"stand\"\nseconds = 1.0\nminutes = 1.0\n").contains("minutes"));
        assert!(told("[sensor.accel]\nbits = 12\n").contains("missing field"));
        let mut narrow = Scenario::default();
        narrow.sensor.accel.bits = 40;
        assert!(narrow.check().unwrap_err().to_string().starts_with("accelerometer: bits"));
    }

    #[test]
    fn the_demo_takes_some_minutes() {
        let length = Scenario::demo().length().unwrap();
        assert!((150.0..400.0).contains(&length), "{length}");
    }
}
