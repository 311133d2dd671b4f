//! One hypothesis: where somebody may be, on which way, in which direction.

use super::Parameters;
use super::net::{Net, Way};
use crate::building::geometry::Point;
use crate::graph::EdgeKind;
use nalgebra::{Matrix3, Matrix4, Vector2, Vector4};
use sohle_shared::step::Step;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Degrees of freedom of Student's distribution for what is beside the graph: plans err, and people go where nobody drew.
const FREEDOM: f64 = 4.0;
/// Somebody who walks more across a way than along it does not tell its direction. **Units:** rad.
const ALONG: f64 = 0.6;
/// A step on stairs is shorter or longer by this (standard deviation). **Units:** m.
const STAIRS_SIGMA_M: f64 = 0.08;
/// What is shorter has no direction. **Units:** m.
const SHORTEST_M: f64 = 0.1;
/// Steps are no longer or shorter than they say by more than this factor.
const SCALES: [f64; 2] = [0.6, 1.6];

/// A place with a direction, both with their errors, on a way.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub way: u32,
    /// x, y, heading of the frame of the next step, step scale. **Units:** m, m, rad, 1; **Frame:** building.
    pub mean: Vector4<f64>,
    pub covariance: Matrix4<f64>,
    /// The height that is measured above that of the graph, and its variance. **Units:** m, m².
    pub offset_m: f64,
    pub offset_m2: f64,
    /// Logarithm of the odds against the best of all.
    pub weight: f64,
}

/// A step as all hypotheses need it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Move {
    x: f64,
    y: f64,
    turn: f64,
    /// Covariance of (x, y, turn).
    noise: Matrix3<f64>,
    pub length_m: f64,
    /// Sum of all rises, if heights are measured. **Units:** m.
    pub height_m: Option<f64>,
    /// Variance that this step adds to it. **Units:** m².
    height_m2: f64,
}

impl Move {
    pub fn new(step: &Step, height_m: Option<f64>, parameters: &Parameters) -> Self {
        let [x, y, _] = step.displacement.map(f64::from).into();
        let covariance = step.covariance.map(f64::from);
        let noise = Matrix3::from_fn(|row, column| {
            let at = |index: usize| if index == 2 { 3 } else { index };
            covariance[(at(row), at(column))]
        });
        let place = parameters.place_m * parameters.place_m;
        let turn = parameters.turn_deg.to_radians().powi(2);
        Self {
            x,
            y,
            turn: f64::from(step.turn),
            noise: noise + Matrix3::from_diagonal(&[place, place, turn].into()),
            length_m: x.hypot(y),
            height_m,
            height_m2: parameters.height_walk_m * parameters.height_walk_m,
        }
    }
}

impl Move {
    /// In the frame before the turn. **Units:** m.
    pub fn way(&self) -> Vector2<f64> {
        Vector2::new(self.x, self.y)
    }
}

/// A hypothesis that has moved but does not know yet on which way it is.
#[derive(Clone, Debug)]
pub(super) struct Moved {
    pub mean: Vector4<f64>,
    covariance: Matrix4<f64>,
    offset_m: f64,
    offset_m2: f64,
    weight: f64,
    /// Direction of the move. **Units:** rad; **Frame:** building.
    direction: Option<f64>,
    length_m: f64,
    height_m: Option<f64>,
}

/// How a move fits a way.
#[derive(Clone, Copy, Debug)]
struct Fit {
    /// To the left of the way, its variance as an observation. **Units:** m, m².
    aside: (f64, f64),
    /// Beyond an end, negative before the beginning. **Units:** m, m².
    beyond: Option<(f64, f64)>,
    /// From its direction. **Units:** rad, rad².
    turned: Option<(f64, f64)>,
    /// Above its height. **Units:** m, m².
    above: Option<(f64, f64)>,
    weight: f64,
}

impl Hypothesis {
    /// Somebody somewhere on a way. **Units:** m, rad.
    pub fn new(way: u32, place: (Point, [[f64; 2]; 2]), heading: (f64, f64), scale: f64) -> Self {
        let ([x, y], [[xx, xy], [yx, yy]]) = place;
        let mut covariance = Matrix4::zeros();
        (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 0)], covariance[(1, 1)]) = (xx, xy, yx, yy);
        (covariance[(2, 2)], covariance[(3, 3)]) = (heading.1 * heading.1, scale * scale);
        Self { way, mean: Vector4::new(x, y, heading.0, 1.0), covariance, offset_m: 0.0, offset_m2: 0.0, weight: 0.0 }
    }

    /// **Units:** m; **Frame:** building.
    pub fn place(&self) -> Point {
        [self.mean[0], self.mean[1]]
    }

    /// The larger standard deviation of the place is not beyond this. **Units:** m.
    pub fn sigma_m(&self) -> f64 {
        (self.covariance[(0, 0)] + self.covariance[(1, 1)]).sqrt()
    }

    /// The height of the graph at the place. **Units:** m.
    pub fn height_m(&self, net: &Net, measured_m: Option<f64>) -> f64 {
        let way = net.way(self.way);
        let [low, high] = way.heights(way.project(self.place())[0]);
        measured_m.map_or(low, |measured| (measured - self.offset_m).clamp(low, high))
    }

    /// Less is known of it: steps are missing. **Units:** m, rad.
    pub fn blur(&mut self, place_m: f64, heading: f64) {
        for axis in 0..2 {
            self.covariance[(axis, axis)] += place_m * place_m;
        }
        self.covariance[(2, 2)] += heading * heading;
    }

    /// Moves by a step.
    pub fn moved(&self, by: &Move, net: &Net, parameters: &Parameters) -> Moved {
        let on_stairs = net.way(self.way).kind == EdgeKind::Stairs && parameters.stairs_step_m > 0.0;
        let shorter = if on_stairs && by.length_m > SHORTEST_M { parameters.stairs_step_m / by.length_m } else { 1.0 };
        let (x, y) = (by.x * shorter, by.y * shorter);
        let [_, _, heading, scale] = self.mean.into();
        let (sin, cos) = heading.sin_cos();
        let (along, aside) = (cos * x - sin * y, sin * x + cos * y);
        let mean = self.mean + Vector4::new(scale * along, scale * aside, by.turn, 0.0);
        // Jacobian of the place by heading and scale; heading and scale themselves only add.
        let f = Matrix4::new(
            1.0,
            0.0,
            -scale * aside,
            along, //
            0.0,
            1.0,
            scale * along,
            aside, //
            0.0,
            0.0,
            1.0,
            0.0, //
            0.0,
            0.0,
            0.0,
            1.0,
        );
        let g = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let mut noise = g * by.noise * g.transpose();
        if on_stairs {
            noise[(0, 0)] += STAIRS_SIGMA_M * STAIRS_SIGMA_M;
            noise[(1, 1)] += STAIRS_SIGMA_M * STAIRS_SIGMA_M;
        }
        let mut covariance = f * self.covariance * f.transpose();
        covariance.fixed_view_mut::<3, 3>(0, 0).zip_apply(&noise, |value, noise| *value += noise);
        covariance[(3, 3)] += parameters.scale_walk * parameters.scale_walk;
        Moved {
            mean,
            covariance,
            offset_m: self.offset_m,
            offset_m2: self.offset_m2 + by.height_m2,
            weight: self.weight,
            direction: (by.length_m * shorter > SHORTEST_M).then(|| aside.atan2(along)),
            length_m: by.length_m * shorter,
            height_m: by.height_m,
        }
    }
}

impl Moved {
    fn fit(&self, way: &Way, cost: f64, parameters: &Parameters) -> Fit {
        let p = parameters;
        let covariance = &self.covariance;
        let variance =
            |[x, y]: Point| x * x * covariance[(0, 0)] + 2.0 * x * y * covariance[(0, 1)] + y * y * covariance[(1, 1)];
        let [along, aside] = way.project([self.mean[0], self.mean[1]]);
        let once = p.aside_over_m / self.length_m.max(SHORTEST_M);
        let mut weight = self.weight - cost;
        let to_left = [-way.along[1], way.along[0]];
        let (width, over) = if way.open { (p.open_aside_m, p.open_over_m) } else { (p.aside_m, p.aside_over_m) };
        let aside_m2 = width * width * over / self.length_m.max(SHORTEST_M);
        let aside = (aside, robust(aside, aside_m2, variance(to_left), &mut weight));
        let off = along - along.clamp(0.0, way.length_m);
        // Beyond an end from which others lead on nothing is wrong with the place, only with the way.
        let blind = way.blind[usize::from(off > 0.0)];
        let sigma = if blind { p.blind_m } else { p.beyond_m };
        let beyond = (off != 0.0)
            .then(|| (off, robust(off, sigma * sigma * once, variance(way.along), &mut weight)))
            .filter(|_| blind || way.kind == EdgeKind::Elevator);
        let turned = self.direction.filter(|_| !way.open && way.kind != EdgeKind::Elevator).and_then(|direction| {
            // Either direction of the way is as good.
            let off = (direction - way.direction + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
            let sigma = p.direction_deg.to_radians();
            let times = self.length_m / p.direction_over_m;
            let spread = sigma * sigma + covariance[(2, 2)];
            let fits = (-0.5 * off * off / spread).exp();
            weight += times * (p.any_direction + (1.0 - p.any_direction) * fits).ln();
            (off.abs() < ALONG).then_some((off, sigma * sigma / times))
        });
        let above = self.height_m.map(|measured| {
            let [low, high] = way.heights(along);
            let height = measured - self.offset_m;
            let off = height - height.clamp(low, high);
            (off, robust(off, p.height_m * p.height_m, self.offset_m2, &mut weight))
        });
        Fit { aside, beyond, turned, above, weight }
    }

    /// How likely it is that it is on a way now (logarithm of odds).
    pub fn weight_on(&self, way: &Way, cost: f64, parameters: &Parameters) -> f64 {
        self.fit(way, cost, parameters).weight
    }

    /// The hypothesis that it is on a way, corrected by what that says.
    pub fn on(&self, number: u32, way: &Way, cost: f64, parameters: &Parameters) -> Hypothesis {
        let fit = self.fit(way, cost, parameters);
        let mut new = Hypothesis {
            way: number,
            mean: self.mean,
            covariance: self.covariance,
            offset_m: self.offset_m,
            offset_m2: self.offset_m2,
            weight: fit.weight,
        };
        let [cos, sin] = way.along;
        if let Some((off, variance)) = fit.turned {
            new.correct(Vector4::new(0.0, 0.0, 1.0, 0.0), -off, variance);
        }
        new.correct(Vector4::new(-sin, cos, 0.0, 0.0), -fit.aside.0, fit.aside.1);
        if let Some((off, variance)) = fit.beyond {
            new.correct(Vector4::new(cos, sin, 0.0, 0.0), -off, variance);
        }
        if let Some((off, variance)) = fit.above {
            let gain = new.offset_m2 / (new.offset_m2 + variance);
            new.offset_m += gain * off;
            new.offset_m2 *= 1.0 - gain;
        }
        new.mean[2] = (new.mean[2] + PI).rem_euclid(TAU) - PI;
        new.mean[3] = new.mean[3].clamp(SCALES[0], SCALES[1]);
        new
    }
}

impl Hypothesis {
    /// Kalman's update with one number: `h` times the state differs by `off` from what it should be.
    pub(super) fn correct(&mut self, h: Vector4<f64>, off: f64, variance: f64) {
        let ph = self.covariance * h;
        let gain = ph / (h.dot(&ph) + variance);
        self.mean += gain * off;
        self.covariance -= gain * ph.transpose();
    }
}

/// Weighs a distance from the graph with Student's distribution, and tells its variance as an observation: more the farther
/// it is. `own` is the variance of what is known of it.
fn robust(off: f64, variance: f64, own: f64, weight: &mut f64) -> f64 {
    let spread = off * off / (FREEDOM * (variance + own));
    *weight -= 0.5 * (FREEDOM + 1.0) * spread.ln_1p() + 0.5 * (own / variance).ln_1p();
    variance * (1.0 + spread)
}
