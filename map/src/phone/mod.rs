//! Steps from a phone in the hand: a second source of the same [`Step`](sohle_shared::step::Step) that the shoe tells.
//!
//! A phone cannot be integrated from stance to stance. Its steps are counted, their length is estimated from their
//! frequency and from how much the body bounces, and their direction comes from the gyroscope about the vertical; the
//! barometer tells of stairs. What follows (particle filter, graph, fixes) sees no difference but in the covariance.
//!
//! [`sample`] is what a phone measures, [`attitude`] how it is held, [`detector`] finds the steps, [`length`] says
//! how long they are, [`barometer`] how high;
//! [`tracker`] puts them together, and [`step`] is what is told of each. [`poslab`] and [`xyz10`] read recordings, [`open`](mod@open) knows them
//! apart.
//!
//! # Source
//! Graph, sections 4.1 and 6.11.

pub mod attitude;
pub mod barometer;
pub mod detector;
pub mod length;
pub mod open;
pub mod poslab;
pub mod sample;
pub mod step;
pub mod tracker;
pub mod xyz10;

pub use sample::PhoneSample;
pub use step::Measured;
pub use tracker::{Parameters, PhoneTracker, steps};
