//! The gyroscope's bias over its temperature, learnt from every rest.
//!
//! The data sheet bounds how fast the bias changes with the temperature (±0.015 °/s/K, BMI088 data sheet
//! BST-BMI088-DS000-19, table 5) but says nothing of the shape, so no line is fitted: a few points hold what was seen,
//! each at the mean temperature of the rests it was made of. Between two points the bias is interpolated; beyond the
//! outermost it goes on with the slope of the two outermost points, as far as the data sheet allows for such a slope.

use super::DEG;
use nalgebra::Vector3;

/// Number of points: from -20 to +60 °C one every 10 K.
pub const POINTS: usize = 8;
/// A rest within this of a point belongs to it. **Units:** K.
const REACH_K: f32 = 4.0;
/// Steepest slope that is believed beyond the outermost point. **Units:** rad/s/K.
const STEEPEST: f32 = 0.015 * DEG;
/// A point is never known better than this, so that the newest twenty rests or so decide. **Units:** rad/s.
const BEST_SIGMA: f32 = 0.005 * DEG;
/// Points this close say nothing of a slope. **Units:** K.
const LEAST_SPAN_K: f32 = 4.0;

/// What was seen around one temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
#[cfg_attr(feature = "wire", derive(postcard_schema::Schema))]
pub struct Point {
    /// Mean temperature. **Units:** °C.
    pub temperature: f32,
    /// Mean bias. **Units:** rad/s; **Frame:** sensor.
    pub bias: [f32; 3],
    /// How well it is known (standard deviation). **Units:** rad/s.
    pub sigma: f32,
}

impl Point {
    fn weight(&self) -> f32 {
        1.0 / (self.sigma * self.sigma)
    }

    /// Both, each by its weight.
    fn merged(&self, other: &Self) -> Self {
        let share = other.weight() / (self.weight() + other.weight());
        let between = |a: f32, b: f32| a + (b - a) * share;
        Self {
            temperature: between(self.temperature, other.temperature),
            bias: [0, 1, 2].map(|axis| between(self.bias[axis], other.bias[axis])),
            sigma: libm::sqrtf(1.0 / (self.weight() + other.weight())).max(BEST_SIGMA),
        }
    }

    fn is_valid(&self) -> bool {
        let finite = self.bias.iter().chain([&self.temperature]).all(|value| value.is_finite());
        finite && self.sigma.is_finite() && self.sigma > 0.0
    }
}

/// Points in the order of their temperatures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GyroBiasTable {
    points: [Option<Point>; POINTS],
}

impl FromIterator<Point> for GyroBiasTable {
    /// Points may come in any order and number; those that make no sense are left out.
    fn from_iter<T: IntoIterator<Item = Point>>(points: T) -> Self {
        let mut table = Self::default();
        for point in points.into_iter().filter(Point::is_valid) {
            table.insert(point);
        }
        table
    }
}

/// Written as the list of its points.
#[cfg(feature = "serde")]
impl serde::Serialize for GyroBiasTable {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeSeq;
        let mut list = serializer.serialize_seq(Some(self.points().count()))?;
        self.points().try_for_each(|point| list.serialize_element(point))?;
        list.end()
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for GyroBiasTable {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List;
        impl<'de> serde::de::Visitor<'de> for List {
            type Value = GyroBiasTable;
            fn expecting(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                out.write_str("a list of points with temperature, bias and sigma")
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut list: A) -> Result<GyroBiasTable, A::Error> {
                let mut table = GyroBiasTable::default();
                while let Some(point) = list.next_element::<Point>()? {
                    if !point.is_valid() {
                        return Err(serde::de::Error::custom("a point of the gyroscope's bias is not finite"));
                    }
                    table.insert(point);
                }
                Ok(table)
            }
        }
        deserializer.deserialize_seq(List)
    }
}

#[cfg(feature = "wire")]
impl postcard_schema::Schema for GyroBiasTable {
    const SCHEMA: &'static postcard_schema::schema::NamedType = <[Point]>::SCHEMA;
}

impl GyroBiasTable {
    /// The points, from cold to warm.
    pub fn points(&self) -> impl DoubleEndedIterator<Item = &Point> {
        self.points.iter().flatten()
    }

    /// Whether nothing was seen yet.
    pub fn is_empty(&self) -> bool {
        self.points[0].is_none()
    }

    /// Takes in what a rest showed, known to `sigma`. A rest that makes no sense is passed over.
    /// **Units:** °C; rad/s; **Frame:** sensor.
    pub fn learn(&mut self, temperature: f32, bias: &Vector3<f32>, sigma: f32) {
        let rest = Point { temperature, bias: (*bias).into(), sigma: sigma.max(BEST_SIGMA) };
        if !rest.is_valid() || sigma.is_nan() {
            return;
        }
        let near = self.points.iter_mut().flatten().min_by(|one, other| {
            let distance = |point: &Point| (point.temperature - temperature).abs();
            distance(one).total_cmp(&distance(other))
        });
        match near.filter(|near| (near.temperature - temperature).abs() <= REACH_K) {
            // The point forgets as much as the rest brings, once it is known as well as it can be.
            Some(near) => *near = near.merged(&rest),
            None => self.insert(rest),
        }
        self.sort();
    }

    /// Puts a point into a free place; if there is none, the two that lie closest become one.
    fn insert(&mut self, point: Point) {
        if self.points[POINTS - 1].is_some() {
            let gap = |index: usize| match (self.points[index], self.points[index + 1]) {
                (Some(cold), Some(warm)) => warm.temperature - cold.temperature,
                _ => f32::INFINITY,
            };
            let closest = (0..POINTS - 1).min_by(|&one, &other| gap(one).total_cmp(&gap(other))).unwrap_or(0);
            if let (Some(cold), Some(warm)) = (self.points[closest], self.points[closest + 1]) {
                self.points[closest] = Some(cold.merged(&warm));
            }
            self.points[closest + 1] = self.points[POINTS - 1];
        }
        self.points[POINTS - 1] = Some(point);
        self.sort();
    }

    /// By temperature, free places last.
    fn sort(&mut self) {
        let key = |point: &Option<Point>| point.map_or(f32::INFINITY, |point| point.temperature);
        self.points.sort_unstable_by(|one, other| key(one).total_cmp(&key(other)));
    }

    /// The bias at `temperature`; without a temperature, that of the best-known point. `None` if nothing was seen yet.
    /// **Units:** °C; rad/s; **Frame:** sensor.
    pub fn bias(&self, temperature: Option<f32>) -> Option<Vector3<f32>> {
        let best = self.points().min_by(|one, other| one.sigma.total_cmp(&other.sigma))?;
        let Some(temperature) = temperature.filter(|value| value.is_finite()) else {
            return Some(Vector3::from(best.bias));
        };
        let colder = self.points().rfind(|point| point.temperature <= temperature);
        let warmer = self.points().find(|point| point.temperature > temperature);
        Some(match (colder, warmer) {
            (Some(cold), Some(warm)) => {
                let share = (temperature - cold.temperature) / (warm.temperature - cold.temperature);
                Vector3::from(cold.bias).lerp(&Vector3::from(warm.bias), share)
            }
            (Some(outermost), None) | (None, Some(outermost)) => {
                let beyond = temperature - outermost.temperature;
                Vector3::from(outermost.bias) + self.slope_at(outermost) * beyond
            }
            (None, None) => Vector3::from(best.bias),
        })
    }

    /// Slope from an outermost point to the next one far enough from it. **Units:** rad/s/K.
    fn slope_at(&self, outermost: &Point) -> Vector3<f32> {
        let span = |point: &Point| (point.temperature - outermost.temperature).abs();
        let next = self
            .points()
            .filter(|point| span(point) >= LEAST_SPAN_K)
            .min_by(|one, other| span(one).total_cmp(&span(other)));
        next.map_or_else(Vector3::zeros, |next| slope(outermost, next).map(|value| value.clamp(-STEEPEST, STEEPEST)))
    }

    /// Steepest slope over the whole range that was seen, if it is wide enough to tell. **Units:** rad/s/K.
    pub fn slope(&self) -> Option<Vector3<f32>> {
        let (cold, warm) = (self.points().next()?, self.points().next_back()?);
        (warm.temperature - cold.temperature >= LEAST_SPAN_K).then(|| slope(cold, warm))
    }
}

fn slope(one: &Point, other: &Point) -> Vector3<f32> {
    (Vector3::from(other.bias) - Vector3::from(one.bias)) / (other.temperature - one.temperature)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    const SIGMA: f32 = 0.02 * DEG;

    /// A gyroscope with a bias that bends with the temperature.
    fn bias(temperature: f32) -> Vector3<f32> {
        let t = temperature - 25.0;
        Vector3::new(0.5 + 0.01 * t, -0.2 + 2e-4 * t * t, -0.008 * t) * DEG
    }

    fn taught(temperatures: impl IntoIterator<Item = f32>) -> GyroBiasTable {
        let mut table = GyroBiasTable::default();
        temperatures.into_iter().for_each(|t| table.learn(t, &bias(t), SIGMA));
        table
    }

    fn off(table: &GyroBiasTable, temperature: f32) -> f32 {
        (table.bias(Some(temperature)).unwrap() - bias(temperature)).amax() / DEG
    }

    #[test]
    fn between_what_was_seen_it_is_interpolated() {
        let table = taught((0..=100).map(|i| -5.0 + 0.5 * i as f32));
        assert!(table.points().count() >= 5);
        for t in 0..=40 {
            // A tenth of the 0.02 deg/s that a rest shows, and the bend between points 8 K apart: 2e-4 * 4 * 4.
            assert!(off(&table, t as f32) < 0.006, "{t} {}", off(&table, t as f32));
        }
    }

    #[test]
    fn beyond_it_goes_on_as_far_as_the_data_sheet_allows() {
        let table = taught([20.0, 30.0]);
        assert!(off(&table, 40.0) < 0.05);
        let mut steep = GyroBiasTable::default();
        steep.learn(20.0, &Vector3::zeros(), SIGMA);
        steep.learn(30.0, &Vector3::new(1.0 * DEG, 0.0, 0.0), SIGMA);
        let far = steep.bias(Some(50.0)).unwrap() / DEG;
        assert!((far.x - 1.3).abs() < 1e-4 && far.y == 0.0, "{far}");
        // One point says nothing of a slope.
        assert_eq!(taught([20.0]).bias(Some(60.0)).unwrap(), bias(20.0));
        assert_eq!(taught([20.0, 30.0]).bias(None).map(|bias| bias.iter().all(|v| v.is_finite())), Some(true));
        assert_eq!(GyroBiasTable::default().bias(Some(20.0)), None);
    }

    #[test]
    fn what_has_changed_is_learnt_anew() {
        let mut table = taught((0..1000).map(|_| 25.0));
        let aged = Vector3::new(1.0, 1.0, 1.0) * DEG;
        (0..60).for_each(|_| table.learn(25.0, &aged, SIGMA));
        // Each rest weighs (0.005 / 0.02)^2 = 1/17 of the point: after 60 of them 3 % of the old is left.
        assert!((table.bias(Some(25.0)).unwrap() - aged).amax() < 0.05 * (bias(25.0) - aged).amax());
    }

    #[test]
    fn senseless_rests_change_nothing() {
        let mut table = taught([20.0]);
        let before = table;
        table.learn(f32::NAN, &Vector3::zeros(), SIGMA);
        table.learn(20.0, &Vector3::new(f32::INFINITY, 0.0, 0.0), SIGMA);
        table.learn(20.0, &Vector3::zeros(), f32::NAN);
        assert_eq!(table, before);
    }

    proptest! {
        #[test]
        fn the_points_stay_in_order_and_the_bias_within_what_was_seen(
            rests in proptest::collection::vec((-40.0_f32..85.0, -0.1_f32..0.1, 1e-6_f32..1e-2), 1..80),
            at in -40.0_f32..85.0,
        ) {
            let mut table = GyroBiasTable::default();
            for (temperature, bias, sigma) in &rests {
                table.learn(*temperature, &Vector3::from_element(*bias), *sigma);
            }
            let temperatures: Vec<_> = table.points().map(|point| point.temperature).collect();
            prop_assert!(temperatures.is_sorted() && !temperatures.is_empty());
            let told = table.bias(Some(at)).unwrap();
            // Beyond the outermost by at most 125 K at the steepest slope.
            prop_assert!(told.amax() <= 0.1 + 125.0 * STEEPEST + 1e-5, "{}", told);
            let (first, last) = (temperatures[0], temperatures[temperatures.len() - 1]);
            if (first..=last).contains(&at) {
                prop_assert!(told.amax() <= 0.1 + 1e-6);
            }
            prop_assert_eq!(table.points().rev().copied().collect::<GyroBiasTable>(), table);
        }
    }
}
