//! A live walk computed again from what the shoe told of its sensor: the samples, and whether the steps are the same.
//!
//! The shoe resets its tracker when it begins to tell raw counts, and then tells everything that goes into it in order. The
//! same code makes the same bits of it here; where it does not, shoe and laptop were built from different sources, or one of
//! them computes wrongly.

use super::Recording;
use super::error::Problem;
use super::heard::Heard;
use crate::toml_file;
use serde::de::DeserializeOwned;
use sohle_shared::calibration::Calibration;
use sohle_shared::sample::ImuSample;
use sohle_shared::shoe::Pipeline;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Output, Parameters, Tracker};
use sohle_shared::wire::message::{Attitude, FromShoe, RawItem};
use sohle_shared::wire::packed::PackedStep;
use std::collections::BTreeMap;
use std::fmt;

/// Metadata in which the parameters of the shoe are kept.
pub const PARAMETERS: &str = "parameters";
/// Metadata in which the calibration of the shoe is kept.
pub const CALIBRATION: &str = "calibration";

/// How far what was computed again is what the shoe told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Steps that the shoe told and that were computed again.
    pub steps: usize,
    /// Of them, the same bit for bit.
    pub equal_steps: usize,
    /// Attitudes that the shoe told and that were computed again.
    pub attitudes: usize,
    /// Of them, the same bit for bit.
    pub equal_attitudes: usize,
    /// Raw messages that the line lost; nothing is computed from there to the next reset.
    pub missing: u64,
}

impl Agreement {
    /// Whether everything is the same.
    pub fn is_whole(&self) -> bool {
        self.steps == self.equal_steps && self.attitudes == self.equal_attitudes
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { steps, equal_steps, attitudes, equal_attitudes, missing } = self;
        write!(
            f,
            "{equal_steps} of {steps} steps and {equal_attitudes} of {attitudes} attitudes are bit for bit the shoe's"
        )?;
        if *missing > 0 {
            write!(f, "; the line lost {missing} raw messages, after which nothing is computed")?;
        }
        Ok(())
    }
}

/// Fills in the samples of a live walk and how the steps computed from them agree; its steps are those of the shoe.
pub(super) fn compute(heard: &[Heard], recording: &mut Recording) -> Result<(), Problem> {
    let raw =
        || heard.iter().filter_map(|heard| if let FromShoe::Raw(raw) = &heard.message { Some(raw) } else { None });
    if raw().next().is_none() {
        return Ok(());
    }
    let parameters = kept(recording, PARAMETERS, Parameters::default)?;
    let calibration = kept(recording, CALIBRATION, Calibration::default)?;
    // The samples are corrected already.
    recording.metadata.remove(CALIBRATION);
    let mut told = Told::of(heard);
    let mut samples = Vec::new();
    let mut pipeline: Option<Pipeline> = None;
    let mut next = 0;
    for raw in raw() {
        if raw.number != next && !matches!(raw.item, RawItem::Start(_)) {
            told.agreement.missing += u64::from(raw.number.wrapping_sub(next));
            pipeline = None;
        }
        next = raw.number.wrapping_add(1);
        match (&raw.item, &mut pipeline) {
            (RawItem::Start(sensor), _) => pipeline = Some(Pipeline::new(sensor, &parameters, &calibration)),
            (RawItem::Batch(batch), Some(pipeline)) => pipeline.push(batch, |sample, output, tracker| {
                told.compare(sample, output, tracker);
                samples.push(*sample);
            }),
            (RawItem::Order(order), Some(pipeline)) => _ = pipeline.obey(*order),
            (_, None) => {}
        }
    }
    recording.samples = samples;
    recording.again = Some(told.agreement);
    Ok(())
}

/// A value in the metadata, as TOML.
fn kept<T: DeserializeOwned>(recording: &Recording, key: &str, or: impl FnOnce() -> T) -> Result<T, Problem> {
    let Some(text) = recording.metadata.get(key) else { return Ok(or()) };
    toml_file::parse(text).map_err(|(line, fault)| Problem::Malformed(format!("metadata {key}, line {line}: {fault}")))
}

/// What the shoe told, and how it agrees.
struct Told {
    /// By the end of the stance and the number: after a reset both begin anew, but time does not.
    steps: BTreeMap<(i64, u32), PackedStep>,
    attitudes: BTreeMap<Micros, Attitude>,
    agreement: Agreement,
}

impl Told {
    fn of(heard: &[Heard]) -> Self {
        let mut told = Self { steps: BTreeMap::new(), attitudes: BTreeMap::new(), agreement: Agreement::default() };
        for heard in heard {
            match &heard.message {
                FromShoe::Step(sent) => {
                    let step = sent.step.unpack();
                    told.steps.insert((step.stance_end.0, step.index), sent.step);
                }
                FromShoe::Attitude(attitude) => _ = told.attitudes.insert(attitude.time, *attitude),
                _ => {}
            }
        }
        told
    }

    fn compare(&mut self, sample: &ImuSample, output: &Output, tracker: &Tracker) {
        if let Some(step) = &output.step {
            let packed = PackedStep::pack(step);
            let step = packed.unpack();
            // One that the shoe did not get rid of before the recording ended says nothing.
            let near = (step.stance_end.0 - STRIDE_US, 0)..(step.stance_end.0 + STRIDE_US, u32::MAX);
            let told = self.steps.range(near).map(|(_, told)| *told).find(|told| told.unpack().index == step.index);
            if let Some(told) = told {
                self.agreement.steps += 1;
                self.agreement.equal_steps += usize::from(told == packed);
            }
        }
        if let Some(told) = self.attitudes.get(&sample.time) {
            let attitude = tracker.attitude();
            let bits = |values: [f32; 4], rest: [[f32; 3]; 2]| {
                values.into_iter().chain(rest.into_iter().flatten()).map(f32::to_bits).collect::<Vec<_>>()
            };
            let computed = bits(
                [attitude.w, attitude.i, attitude.j, attitude.k],
                [tracker.displacement().into(), tracker.velocity().into()],
            );
            let same = computed == bits(told.attitude, [told.displacement, told.velocity]);
            self.agreement.attitudes += 1;
            self.agreement.equal_attitudes +=
                usize::from(same && told.state == output.state && told.stance == output.stance);
        }
    }
}

/// No two steps with the same number are nearer to each other. **Units:** microseconds.
const STRIDE_US: i64 = 300_000;
