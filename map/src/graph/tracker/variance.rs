//! The error of a position on the graph, propagated from step to step.

use super::Parameters;
use nalgebra::{Matrix2, Vector2};

/// Covariance of a position. **Units:** m²; **Frame:** building.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Variance(pub Matrix2<f64>);

impl Variance {
    /// After a step of a length along a direction: `B S B^T` with the partial derivatives by length, heading, position and
    /// the error of the graph, which is the same in both coordinates.
    ///
    /// # Source
    /// Graph, 6.5 to 6.8, in the building's frame: x is the document's y.
    pub fn step(self, direction: f64, length_m: f64, parameters: &Parameters) -> Self {
        let (sin, cos) = direction.sin_cos();
        let along = Vector2::new(cos, sin);
        let aside = Vector2::new(-sin, cos) * length_m;
        let graph = Vector2::new(1.0, 1.0);
        let outer = |vector: Vector2<f64>, sigma: f64| vector * vector.transpose() * (sigma * sigma);
        Self(
            self.0
                + outer(along, parameters.sigma_length_m)
                + outer(aside, parameters.sigma_heading_deg.to_radians())
                + outer(graph, parameters.sigma_graph_m),
        )
    }

    /// The larger of both standard deviations. **Units:** m.
    pub fn sigma_m(&self) -> f64 {
        self.0[(0, 0)].max(self.0[(1, 1)]).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Graph, 6.4 and figure 6.12: from 1.5 m after one step to 3 m after four.
    #[test]
    fn errors_grow_from_one_and_a_half_to_three_metres_in_four_steps() {
        let parameters = Parameters::documented();
        let mut variance = Variance::default();
        let mut sigmas = Vec::new();
        for _ in 0..4 {
            variance = variance.step(0.0, 0.68, &parameters);
            sigmas.push(variance.sigma_m());
        }
        // Length and heading add 0.05 m and 0.006 m a step to the 1.5 m of the graph.
        assert!((sigmas[0] - 1.5).abs() < 0.001 && (sigmas[3] - 3.0).abs() < 0.002, "{sigmas:?}");
    }

    #[test]
    fn along_a_direction_the_length_counts_and_aside_the_heading() {
        let parameters = Parameters { sigma_graph_m: 0.0, ..Parameters::documented() };
        let north = Variance::default().step(std::f64::consts::FRAC_PI_2, 2.0, &parameters);
        assert!((north.0[(1, 1)] - 0.0025).abs() < 1e-12);
        assert!((north.0[(0, 0)].sqrt() - 2.0 * 0.5_f64.to_radians()).abs() < 1e-12);
        assert!(north.0[(0, 1)].abs() < 1e-12);
    }
}
