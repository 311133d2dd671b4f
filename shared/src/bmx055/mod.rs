//! The BMX055: three dies in one package, of which two feed the tracker.

pub mod batch;

pub use batch::{BATCH_FRAMES, Batch, Die, DieCounters};
