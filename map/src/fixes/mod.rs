//! Steps and absolute positions together: what one shoe or phone says of the way, corrected by what others say of the place.
//!
//! Steps know the way of the last metres and lose the place; positions (5G, UWB, WiFi, GNSS at the door, a word of the
//! person) know the place to a few metres and not the way. Here they meet, without a building.
//!
//! [`fix`] is what a source says, in whatever frame; [`observation`] the same in the frame of the building, checked. The
//! document's three methods are [`kalman`], [`extended`] and [`adjustment`]; [`smoother`] is the better one. Each is a
//! [`Method`] and takes the same steps and observations.
//!
//! [`line`](mod@line) is a fix as a line of JSON, [`intake`] where such lines come in and are counted, [`fusion`] what puts them
//! together with the steps as both come. [`beacon`] tells through which entrance a walk begins.
//!
//! # Frame
//! The building's: x east, y north, in metres; directions counter-clockwise from east.
//!
//! # Source
//! Fix, chapters 2 and 3.

pub mod adjustment;
mod aligner;
pub mod beacon;
mod beginning;
pub mod extended;
pub mod fix;
pub mod fusion;
pub mod intake;
pub mod kalman;
pub mod line;
mod method;
pub mod observation;
pub mod outlier;
pub mod parameters;
pub mod polar;
pub mod smoother;

pub use fix::{Fix, Frame, Measured};
pub use fusion::Fusion;
pub use intake::Intake;
pub use method::{Estimate, Method, Start};
pub use observation::{Frames, Observation, Refused};
pub use outlier::Outliers;
pub use parameters::Documented;
pub use smoother::{Outcome, Smoother, Verdict};
