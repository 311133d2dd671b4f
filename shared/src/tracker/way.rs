//! Either way from samples to steps.

use super::documented::Documented;
use super::own::Own;
use super::{Counters, Insight, Method, Output, Parameters, State};
use crate::filter;
use crate::sample::ImuSample;
use crate::step::{FloorMode, Step};
use crate::time::Micros;

/// The way that the parameters choose.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "without a heap the larger one cannot be boxed, and there is one tracker"
)]
pub(super) enum Way {
    Own(Own),
    Documented(Documented),
}

impl Way {
    pub(super) fn new(p: &Parameters) -> Self {
        match p.method {
            Method::Pivot => Self::Own(Own::new(p)),
            Method::Unscented => Self::Documented(Documented::new(p)),
        }
    }

    pub(super) fn reset(&mut self, p: &Parameters) {
        match (self, p.method) {
            (Self::Own(own), Method::Pivot) => own.reset(p),
            (way, _) => *way = Self::new(p),
        }
    }

    pub(super) fn push(&mut self, sample: &ImuSample, counters: &mut Counters) -> Output {
        match self {
            Self::Own(own) => own.push(sample, counters),
            Self::Documented(documented) => documented.push(sample, counters),
        }
    }

    pub(super) fn finish(&mut self, counters: &mut Counters) -> Option<Step> {
        match self {
            Self::Own(own) => own.finish(counters),
            Self::Documented(documented) => documented.finish(counters),
        }
    }

    pub(super) fn command(&mut self, mode: Option<FloorMode>) {
        match self {
            Self::Own(own) => own.command(mode),
            Self::Documented(documented) => documented.command(mode),
        }
    }

    pub(super) fn initialise(&mut self, now: Option<Micros>) {
        match self {
            Self::Own(own) => own.initialise(now),
            Self::Documented(documented) => documented.initialise(now),
        }
    }

    pub(super) fn start_moving(&mut self) -> bool {
        match self {
            Self::Own(own) => own.start_moving(),
            Self::Documented(documented) => documented.start_moving(),
        }
    }

    pub(super) fn stood_until(&mut self, time: Micros, slept_s: f32) {
        match self {
            Self::Own(own) => own.stood_until(time, slept_s),
            Self::Documented(documented) => documented.stood_until(time, slept_s),
        }
    }

    pub(super) fn rides(&self) -> bool {
        match self {
            Self::Own(own) => own.rides(),
            Self::Documented(documented) => documented.rides(),
        }
    }

    pub(super) fn phase(&self) -> State {
        match self {
            Self::Own(own) => own.phase(),
            Self::Documented(documented) => documented.phase(),
        }
    }

    pub(super) fn insight(&self) -> Insight {
        match self {
            Self::Own(own) => own.insight(),
            Self::Documented(documented) => documented.insight(),
        }
    }

    pub(super) fn foot(&self) -> &filter::state::State {
        match self {
            Self::Own(own) => own.foot(),
            Self::Documented(documented) => documented.foot(),
        }
    }
}
