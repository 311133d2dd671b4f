//! From where the map is looked at, and what of it is seen where.
//!
//! # Frame
//! That of the building, but floors may stand farther apart than they are; see [`super::Scene::shown`].

use crate::building::Point;
use crate::building::geometry::wrapped;
use eframe::egui::{Pos2, Rect, Vec2, pos2, vec2};
use nalgebra::{Matrix4, Vector3};
use serde::{Deserialize, Serialize};

/// Half of what is seen from bottom to top, as the tangent of its angle: 15 degrees, as of a long lens, which keeps
/// walls upright.
const HALF_VIEW: f64 = 0.268;
/// Lowest and highest view: from just above the horizon to straight down. **Units:** rad.
const ELEVATION: (f64, f64) = (0.12, std::f64::consts::FRAC_PI_2);
/// Nearest and farthest. **Units:** m.
const DISTANCE: (f64, f64) = (2.0, 40_000.0);
/// Of the picture, what remains free around what is fitted into it.
const MARGIN: f64 = 0.08;

/// How the building is projected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// In perspective, all floors.
    #[default]
    Orbit,
    /// Straight down on one floor, to scale.
    Flat,
}

/// From where one looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// What is in the middle. **Units:** m.
    pub target: [f64; 3],
    /// From there to the eye. **Units:** m.
    pub distance_m: f64,
    /// Where up in the picture points to, clockwise from north. **Units:** rad.
    pub bearing: f64,
    /// Of the eye above the horizon. **Units:** rad.
    pub elevation: f64,
}

impl Default for Camera {
    fn default() -> Self {
        Self { target: [0.0; 3], distance_m: 100.0, bearing: -0.35, elevation: 0.85 }
    }
}

/// A line from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it begins. **Units:** m.
    pub from: Vector3<f64>,
    /// Where it goes.
    pub along: Vector3<f64>,
}

impl Ray {
    /// Where it meets the plane of a height in front of the eye, if it does.
    pub fn at_height(&self, height_m: f64) -> Option<Point> {
        let part = (height_m - self.from.z) / self.along.z;
        let at = self.from + self.along * part;
        (part >= 0.0 && at.iter().all(|value| value.is_finite())).then_some([at.x, at.y])
    }
}

/// A camera with a picture to fill: what is seen where.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    camera: Camera,
    projection: Projection,
    rect: Rect,
    right: Vector3<f64>,
    up: Vector3<f64>,
    forward: Vector3<f64>,
}

impl Camera {
    /// It again with every number within its bounds; what is no number becomes that of the default.
    pub fn bounded(self) -> Self {
        let usual = Self::default();
        let number = |value: f64, usual: f64| if value.is_finite() { value } else { usual };
        Self {
            target: [0, 1, 2].map(|axis| number(self.target[axis], 0.0).clamp(-20_000.0, 20_000.0)),
            distance_m: number(self.distance_m, usual.distance_m).clamp(DISTANCE.0, DISTANCE.1),
            bearing: wrapped(number(self.bearing, usual.bearing)),
            elevation: number(self.elevation, usual.elevation).clamp(ELEVATION.0, ELEVATION.1),
        }
    }

    /// Between this one and another: at 0 this, at 1 the other.
    pub fn towards(&self, other: &Self, part: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * part;
        Self {
            target: [0, 1, 2].map(|axis| mix(self.target[axis], other.target[axis])),
            distance_m: (mix(self.distance_m.ln(), other.distance_m.ln())).exp(),
            bearing: wrapped(self.bearing + wrapped(other.bearing - self.bearing) * part),
            elevation: mix(self.elevation, other.elevation),
        }
    }

    /// Whether another one shows the same to within a pixel or so.
    pub fn is_at(&self, other: &Self) -> bool {
        let near = 2e-4 * self.distance_m.min(other.distance_m);
        (0..3).all(|axis| (self.target[axis] - other.target[axis]).abs() < near)
            && (self.distance_m - other.distance_m).abs() < near
            && wrapped(self.bearing - other.bearing).abs() < 2e-4
            && (self.elevation - other.elevation).abs() < 2e-4
    }

    /// Turns by a drag of the mouse. **Units:** points.
    pub fn turn(&mut self, drag: Vec2) {
        self.bearing = wrapped(self.bearing + f64::from(drag.x) * 0.006);
        self.elevation = (self.elevation + f64::from(drag.y) * 0.006).clamp(ELEVATION.0, ELEVATION.1);
    }
}

impl Sight {
    /// Of a camera on a picture. **Units:** points.
    pub fn new(camera: Camera, projection: Projection, rect: Rect) -> Self {
        let elevation = match projection {
            Projection::Orbit => camera.elevation,
            Projection::Flat => ELEVATION.1,
        };
        let (sin_b, cos_b) = camera.bearing.sin_cos();
        let (sin_e, cos_e) = elevation.sin_cos();
        Self {
            camera,
            projection,
            rect,
            right: Vector3::new(cos_b, -sin_b, 0.0),
            up: Vector3::new(sin_b * sin_e, cos_b * sin_e, cos_e),
            forward: Vector3::new(sin_b * cos_e, cos_b * cos_e, -sin_e),
        }
    }

    /// What it is the sight of.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// How it is projected.
    pub fn projection(&self) -> Projection {
        self.projection
    }

    /// The picture. **Units:** points.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Where the eye is; far above for a flat map. **Units:** m.
    pub fn eye(&self) -> Vector3<f64> {
        Vector3::from(self.camera.target) - self.forward * self.camera.distance_m
    }

    fn half_width(&self) -> f64 {
        HALF_VIEW * f64::from(self.rect.width().max(1.0) / self.rect.height().max(1.0))
    }

    /// Across, up and along the sight from the eye. **Units:** m.
    fn seen(&self, point: [f64; 3]) -> Vector3<f64> {
        let to = Vector3::from(point) - self.eye();
        Vector3::new(self.right.dot(&to), self.up.dot(&to), self.forward.dot(&to))
    }

    /// What a distance at a place is divided by.
    fn depth(&self, along: f64) -> f64 {
        if self.projection == Projection::Flat { self.camera.distance_m } else { along }
    }

    /// Where a place is seen; nothing behind the eye.
    pub fn project(&self, point: [f64; 3]) -> Option<Pos2> {
        let seen = self.seen(point);
        let depth = self.depth(seen.z);
        if depth < 1e-3 * self.camera.distance_m {
            return None;
        }
        let x = seen.x / (depth * self.half_width());
        let y = seen.y / (depth * HALF_VIEW);
        let middle = self.rect.center();
        Some(pos2(
            middle.x + (x * f64::from(self.rect.width()) / 2.0) as f32,
            middle.y - (y * f64::from(self.rect.height()) / 2.0) as f32,
        ))
    }

    /// Pixels for a metre at a place. **Units:** points/m.
    pub fn scale_at(&self, point: [f64; 3]) -> f64 {
        let depth = self.depth(self.seen(point).z).max(1e-3 * self.camera.distance_m);
        f64::from(self.rect.height()) / (2.0 * HALF_VIEW * depth)
    }

    /// What is seen at a point of the picture.
    pub fn ray(&self, at: Pos2) -> Ray {
        let from_middle = at - self.rect.center();
        let x = f64::from(2.0 * from_middle.x / self.rect.width().max(1.0)) * self.half_width();
        let y = f64::from(-2.0 * from_middle.y / self.rect.height().max(1.0)) * HALF_VIEW;
        match self.projection {
            Projection::Orbit => Ray { from: self.eye(), along: self.forward + self.right * x + self.up * y },
            Projection::Flat => {
                Ray { from: self.eye() + (self.right * x + self.up * y) * self.camera.distance_m, along: self.forward }
            }
        }
    }

    /// The camera after the place under `from` was dragged to `to`; the place is at the height of what is in the middle.
    pub fn dragged(&self, from: Pos2, to: Pos2) -> Camera {
        let height = self.camera.target[2];
        let mut camera = self.camera;
        if let (Some(a), Some(b)) = (self.ray(from).at_height(height), self.ray(to).at_height(height)) {
            // Near the horizon a pixel is a kilometre: no farther than from the eye to the middle at a time.
            let step = [a[0] - b[0], a[1] - b[1]];
            let part = (self.camera.distance_m / step[0].hypot(step[1]).max(1e-9)).min(1.0);
            camera.target = [camera.target[0] + step[0] * part, camera.target[1] + step[1] * part, height];
        }
        camera
    }

    /// The camera nearer by `factor`, so that the place under `at` stays there.
    pub fn zoomed(&self, at: Pos2, factor: f64) -> Camera {
        let mut camera = self.camera;
        camera.distance_m = (camera.distance_m / factor.clamp(0.1, 10.0)).clamp(DISTANCE.0, DISTANCE.1);
        let height = camera.target[2];
        let after = Self { camera, ..*self };
        if let (Some(a), Some(b)) = (self.ray(at).at_height(height), after.ray(at).at_height(height)) {
            let step = [a[0] - b[0], a[1] - b[1]];
            if step[0].hypot(step[1]) < self.camera.distance_m {
                camera.target = [camera.target[0] + step[0], camera.target[1] + step[1], height];
            }
        }
        camera
    }

    /// The camera that shows all of some points, looking the same way.
    pub fn fitted(&self, points: &[[f64; 3]]) -> Camera {
        let mut camera = self.camera;
        let Some(first) = points.first() else { return camera };
        let bound = |axis: usize, pick: fn(f64, f64) -> f64| points.iter().map(|p| p[axis]).fold(first[axis], pick);
        camera.target = [0, 1, 2].map(|axis| (bound(axis, f64::min) + bound(axis, f64::max)) / 2.0);
        let room = 1.0 - MARGIN;
        // The middle of what is seen is not that of the box: a few rounds bring it there.
        for _ in 0..8 {
            let sight = Self::new(camera, self.projection, self.rect);
            let (across, upwards) = (sight.half_width() * room, HALF_VIEW * room);
            let offsets: Vec<Vector3<f64>> =
                points.iter().map(|&point| sight.seen(point) - Vector3::new(0.0, 0.0, camera.distance_m)).collect();
            let need = |offset: &Vector3<f64>| {
                let wide = (offset.x.abs() / across).max(offset.y.abs() / upwards);
                if self.projection == Projection::Flat { wide } else { wide - offset.z }
            };
            camera.distance_m = offsets.iter().map(need).fold(DISTANCE.0, f64::max).min(DISTANCE.1);
            let sight = Self::new(camera, self.projection, self.rect);
            let seen = points.iter().filter_map(|&point| sight.project(point));
            let all = Rect::from_points(&seen.collect::<Vec<_>>());
            let off = (all.center() - self.rect.center()) / sight.scale_at(camera.target) as f32;
            let moved = sight.right * f64::from(off.x) - sight.up * f64::from(off.y);
            camera.target = [0, 1, 2].map(|axis| camera.target[axis] + moved[axis]);
        }
        let sight = Self::new(camera, self.projection, self.rect);
        let inner = self.rect.shrink2(vec2(self.rect.width(), self.rect.height()) * (MARGIN / 4.0) as f32);
        while camera.distance_m < DISTANCE.1
            && !points.iter().all(|&p| Self { camera, ..sight }.project(p).is_some_and(|at| inner.contains(at)))
        {
            camera.distance_m *= 1.02;
        }
        camera
    }

    /// From a place, with 1 behind it, to what the graphics card clips: x and y from -1 to 1, the depth from 0 to 1,
    /// all times the last. `reach` is how far from the target there is something to see. **Units:** m.
    pub fn matrix(&self, reach: f64) -> Matrix4<f64> {
        let away = self.camera.distance_m;
        let eye = self.eye();
        let row = |along: &Vector3<f64>, scale: f64| {
            nalgebra::RowVector4::new(along.x, along.y, along.z, -along.dot(&eye)) * scale
        };
        let (near, far) = match self.projection {
            Projection::Orbit => ((away - reach).max(0.03 * away), away + reach),
            Projection::Flat => (away - reach, away + reach),
        };
        let along = row(&self.forward, 1.0);
        let one = nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
        match self.projection {
            Projection::Orbit => Matrix4::from_rows(&[
                row(&self.right, 1.0 / self.half_width()),
                row(&self.up, 1.0 / HALF_VIEW),
                (along - one * near) * (far / (far - near)),
                along,
            ]),
            Projection::Flat => Matrix4::from_rows(&[
                row(&self.right, 1.0 / (self.half_width() * away)),
                row(&self.up, 1.0 / (HALF_VIEW * away)),
                (along - one * near) / (far - near),
                one,
            ]),
        }
    }

    /// Metres a pixel of a picture of so many pixels from bottom to top, for each metre of depth; for a flat map,
    /// anywhere. **Units:** m.
    pub fn metres_per_pixel(&self, height_px: u32) -> f64 {
        let one = 2.0 * HALF_VIEW / f64::from(height_px.max(1));
        if self.projection == Projection::Flat { one * self.camera.distance_m } else { one }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cameras() -> impl Strategy<Value = Sight> {
        let angles = (-3.0..3.0, 0.2..1.57);
        let places = (-50.0..50.0, -50.0..50.0, 0.0..20.0, 10.0..300.0);
        let sizes = (200.0_f32..1600.0, 150.0_f32..1000.0, proptest::bool::ANY);
        (angles, places, sizes).prop_map(|((bearing, elevation), (x, y, z, distance_m), (width, height, flat))| {
            let projection = if flat { Projection::Flat } else { Projection::Orbit };
            let rect = Rect::from_min_size(pos2(30.0, 60.0), vec2(width, height));
            Sight::new(Camera { target: [x, y, z], distance_m, bearing, elevation }, projection, rect)
        })
    }

    proptest! {
        #[test]
        fn what_is_seen_at_a_point_is_projected_there(sight in cameras(), across in 0.0_f32..1.0, down in 0.3_f32..1.0) {
            let at = sight.rect().lerp_inside(vec2(across, down));
            let place = sight.ray(at).at_height(2.0).map(|[x, y]| [x, y, 2.0]);
            // A place on the horizon is so far away that even f64 does not find back.
            let near = place.filter(|[x, y, _]| x.hypot(*y) < 1e4);
            if let Some(back) = near.and_then(|place| sight.project(place)) {
                // Points are f32: a hundredth of one is lost on the way.
                prop_assert!(back.distance(at) < 0.02, "{at} {back}");
            }
        }

        #[test]
        fn the_card_sees_the_same_as_the_pointer(sight in cameras(), x in -60.0..60.0, y in -60.0..60.0, z in 0.0..20.0) {
            let clipped = sight.matrix(500.0) * nalgebra::Vector4::new(x, y, z, 1.0);
            if let Some(at) = sight.project([x, y, z]) {
                let rect = sight.rect();
                let there = pos2(
                    rect.center().x + (clipped.x / clipped.w) as f32 * rect.width() / 2.0,
                    rect.center().y - (clipped.y / clipped.w) as f32 * rect.height() / 2.0,
                );
                let far = at.distance(rect.center()).max(1.0);
                prop_assert!(there.distance(at) < 1e-4 * far, "{at} {there}");
            }
        }

        #[test]
        fn what_is_fitted_is_inside(sight in cameras(), low in -200.0..0.0, size in 5.0..300.0, height in 0.0..60.0) {
            let corners: Vec<[f64; 3]> = (0..8)
                .map(|corner| [0, 1, 2].map(|axis| {
                    let high = corner >> axis & 1 == 1;
                    if axis == 2 { if high { height } else { 0.0 } } else if high { low + size } else { low }
                }))
                .collect();
            let fitted = Sight::new(sight.fitted(&corners), sight.projection(), sight.rect());
            for corner in corners {
                let at = fitted.project(corner);
                prop_assert!(at.is_some_and(|at| sight.rect().contains(at)), "{corner:?} {at:?}");
            }
        }

        #[test]
        fn what_is_dragged_stays_under_the_pointer(sight in cameras(), across in 0.2_f32..0.8, by in -0.2_f32..0.2) {
            prop_assume!(sight.camera().elevation > 0.7);
            let from = sight.rect().lerp_inside(vec2(across, 0.5));
            let to = from + vec2(by, by) * sight.rect().height();
            let place = sight.ray(from).at_height(sight.camera().target[2]);
            let after = Sight::new(sight.dragged(from, to), sight.projection(), sight.rect());
            prop_assert!(
                place.and_then(|[x, y]| after.project([x, y, sight.camera().target[2]])).is_some_and(|at| at.distance(to) < 0.1)
            );
        }

        #[test]
        fn zooming_keeps_what_is_under_the_pointer(sight in cameras(), across in 0.2_f32..0.8, factor in 0.5..2.0) {
            prop_assume!(sight.camera().elevation > 0.7);
            let at = sight.rect().lerp_inside(vec2(across, 0.6));
            let height = sight.camera().target[2];
            let after = Sight::new(sight.zoomed(at, factor), sight.projection(), sight.rect());
            let place = sight.ray(at).at_height(height);
            prop_assert!(place.and_then(|[x, y]| after.project([x, y, height])).is_some_and(|back| back.distance(at) < 0.1));
        }
    }

    #[test]
    fn north_is_up_and_east_is_right() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0));
        for projection in [Projection::Orbit, Projection::Flat] {
            let sight = Sight::new(Camera { bearing: 0.0, ..Camera::default() }, projection, rect);
            let middle = sight.project([0.0; 3]).unwrap();
            assert!(middle.distance(rect.center()) < 1e-3);
            assert!(sight.project([5.0, 0.0, 0.0]).unwrap().x > middle.x);
            assert!(sight.project([0.0, 5.0, 0.0]).unwrap().y < middle.y);
        }
        let east_up = Camera { bearing: std::f64::consts::FRAC_PI_2, ..Camera::default() };
        let sight = Sight::new(east_up, Projection::Flat, rect);
        assert!(sight.project([5.0, 0.0, 0.0]).unwrap().y < rect.center().y);
    }

    #[test]
    fn a_camera_from_a_broken_file_is_still_one() {
        let broken = Camera { target: [f64::NAN, 1e30, 0.0], distance_m: -3.0, bearing: 1e9, elevation: f64::INFINITY };
        let camera = broken.bounded();
        assert_eq!(camera, camera.bounded());
        assert!(
            camera.distance_m >= DISTANCE.0
                && camera.target[1] == 20_000.0
                && camera.bearing.abs() <= std::f64::consts::PI
        );
    }
}
