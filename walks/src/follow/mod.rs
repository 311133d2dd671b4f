//! Follows somebody through a building, step by step: what a live shoe, a replayed walk and the demonstration share.
//!
//! [`Follower`] takes each step of the shoe as it comes and tells a [`Said`]: where the person is, how sure that is, where
//! else the person may be, and which floor mode the shoe should have. It owns the building and the particle filter on it, and
//! knows no file, no port and no clock.

mod error;
mod follower;
mod json;
mod modes;
mod orders;
mod reach;
mod runs;
pub mod scene;
mod sight;
pub mod start;

pub use error::Error;
pub use follower::{Followed, Follower, LONGEST_STEP_M, Said, Settings, Unusual};
pub use json::{line, mode_word};
pub use modes::{FloorModes, Shares, Steering};
pub use orders::Orders;
pub use runs::runs;
pub use sight::sight;
pub use start::parse as parse_start;
