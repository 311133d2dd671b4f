//! Whole walks. One program for all of them: it is linked once.

mod heights;
mod outbox;
mod plans;
mod sleep;
