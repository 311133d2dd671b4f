//! A camera on its way.

use super::camera::Camera;

/// It is there after this time. **Units:** s.
const LASTS_S: f64 = 0.25;

/// How a camera goes from one place to another: quick at first, then slower, and there for certain after a quarter of a second,
/// so that a map that follows somebody rests between the steps.
#[derive(Clone, Debug)]
pub struct Glide {
    from: Camera,
    to: Camera,
    passed_s: f64,
}

impl Glide {
    /// It begins.
    pub fn new(from: Camera, to: Camera) -> Self {
        Self { from, to, passed_s: 0.0 }
    }

    /// Where it goes.
    pub fn goal(&self) -> Camera {
        self.to
    }

    /// Where it is after a while more. **Units:** s.
    pub fn go(&mut self, seconds: f64) -> Camera {
        self.passed_s += seconds;
        if self.is_over() {
            return self.to;
        }
        self.from.towards(&self.to, 1.0 - (1.0 - self.passed_s / LASTS_S).powi(3))
    }

    /// Whether it is there.
    pub fn is_over(&self) -> bool {
        self.passed_s >= LASTS_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_comes_nearer_all_the_time_and_is_there_to_the_last_bit() {
        let from = Camera::default();
        let to = Camera { target: [3.0, -7.0, 1.0], distance_m: 90.0, ..from };
        let mut glide = Glide::new(from, to);
        let mut left = f64::INFINITY;
        // The pictures of a display, and of one that is slow.
        for seconds in [1.0 / 60.0, 1.0 / 60.0, 0.04, 0.1] {
            let camera = glide.go(seconds);
            let now = (camera.target[1] - to.target[1]).abs();
            assert!(now < left && !glide.is_over(), "{now} {left}");
            left = now;
        }
        assert_eq!((glide.go(0.1), glide.is_over()), (to, true));
    }
}
