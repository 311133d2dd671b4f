//! Filters that follow the foot between stances and learn from each.
//!
//! [`unscented`] is the document's: an unscented Kalman filter on the manifold of attitude, position and velocity.
//! [`pivot`] is the project's own: it knows that the foot stands below the sensor. [`state`] is that manifold and how a sample moves a point on it, [`rebase`] the new beginning at the end of each
//! stance, [`covariance`] keeps the matrices usable in `f32`.

pub mod covariance;
pub mod pivot;
pub mod rebase;
pub mod state;
pub mod unscented;
