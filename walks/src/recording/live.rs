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
use sohle_shared::tracker::{Order, Output, Parameters, Tracker};
use sohle_shared::wire::message::{Attitude, FromShoe, RawItem};
use sohle_shared::wire::packed::PackedStep;
use std::collections::BTreeMap;
use std::fmt;

/// Metadata in which the parameters of the shoe are kept.
pub const PARAMETERS: &str = "parameters";
/// Metadata in which is kept when the clock of the shoe was zero: microseconds since the beginning of 1970.
pub const BEGAN: &str = "began_unix_us";
/// Metadata in which the calibration of the shoe is kept.
pub const CALIBRATION: &str = "calibration";

/// How far what was computed again is what the shoe told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Steps that the shoe told of the time that was computed again.
    pub steps: usize,
    /// Of them, the same bit for bit.
    pub equal_steps: usize,
    /// Attitudes that the shoe told of that time.
    pub attitudes: usize,
    /// Of them, the same bit for bit.
    pub equal_attitudes: usize,
    /// Raw messages that the line lost; nothing is computed from there to the next reset.
    pub missing: u64,
    /// Boots of which raw messages came; the samples are those of the one with the most.
    pub boots: usize,
}

impl Agreement {
    /// Whether everything is the same.
    pub fn is_whole(&self) -> bool {
        self.steps == self.equal_steps && self.attitudes == self.equal_attitudes
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { steps, equal_steps, attitudes, equal_attitudes, missing, boots } = self;
        write!(
            f,
            "{equal_steps} of {steps} steps and {equal_attitudes} of {attitudes} attitudes are bit for bit the shoe's"
        )?;
        if *missing > 0 {
            write!(f, "; the line lost {missing} raw messages, after which nothing is computed")?;
        }
        if *boots > 1 {
            write!(f, "; the shoe was started {boots} times, its longest time is the walk")?;
        }
        Ok(())
    }
}

/// Fills in the samples of a live walk and how the steps computed from them agree; its steps are those of the shoe.
pub(super) fn compute(heard: &[Heard], recording: &mut Recording) -> Result<(), Problem> {
    if !heard.iter().any(|heard| matches!(heard.message, FromShoe::Raw(_))) {
        return Ok(());
    }
    let parameters = kept(recording, PARAMETERS, Parameters::default)?;
    let calibration = kept(recording, CALIBRATION, Calibration::default)?;
    // The samples are corrected already.
    recording.metadata.remove(CALIBRATION);
    let mut told = Told::of(heard);
    // Each boot has a time of its own.
    let mut samples: BTreeMap<u32, Vec<ImuSample>> = BTreeMap::new();
    let mut orders: BTreeMap<u32, Vec<(usize, Order)>> = BTreeMap::new();
    let mut pipeline: Option<Pipeline> = None;
    let (mut boot, mut next) = (0, 0);
    let mut begun = 0;
    for heard in heard {
        let raw = match &heard.message {
            FromShoe::Hello(hello) => {
                if hello.boot != boot {
                    told.end(boot, samples.get(&boot), begun);
                    pipeline = None;
                }
                boot = hello.boot;
                continue;
            }
            FromShoe::Raw(raw) => raw,
            _ => continue,
        };
        let samples = samples.entry(boot).or_default();
        if matches!(raw.item, RawItem::Start(_)) || raw.number != next {
            if !matches!(raw.item, RawItem::Start(_)) {
                told.agreement.missing += u64::from(raw.number.wrapping_sub(next));
            }
            told.end(boot, Some(samples), begun);
            pipeline = None;
            begun = samples.len();
        }
        next = raw.number.wrapping_add(1);
        match (&raw.item, &mut pipeline) {
            (RawItem::Start(sensor), _) => pipeline = Some(Pipeline::new(sensor, &parameters, &calibration)),
            (RawItem::Batch(batch), Some(pipeline)) => pipeline.push(batch, |sample, output, tracker| {
                told.compare(boot, sample, output, tracker);
                samples.push(*sample);
            }),
            (RawItem::Order(order), Some(pipeline)) => {
                orders.entry(boot).or_default().push((samples.len(), *order));
                pipeline.obey(*order);
            }
            (_, None) => {}
        }
    }
    told.end(boot, samples.get(&boot), begun);
    told.agreement.boots = samples.len();
    if let Some((boot, longest)) = samples.into_iter().max_by_key(|(_, samples)| samples.len()) {
        recording.samples = longest;
        recording.orders = orders.remove(&boot).unwrap_or_default();
    }
    recording.again = Some(told.agreement);
    Ok(())
}

/// A value in the metadata, as TOML.
fn kept<T: DeserializeOwned>(recording: &Recording, key: &str, or: impl FnOnce() -> T) -> Result<T, Problem> {
    let Some(text) = recording.metadata.get(key) else { return Ok(or()) };
    toml_file::parse(text).map_err(|(line, fault)| Problem::Malformed(format!("metadata {key}, line {line}: {fault}")))
}

/// What the shoe told and was not compared yet, by boot, and how the rest agrees.
struct Told {
    /// By the end of the stance and the number: after a reset both begin anew, but time does not.
    steps: BTreeMap<(u32, i64, u32), PackedStep>,
    attitudes: BTreeMap<(u32, Micros), Attitude>,
    agreement: Agreement,
}

impl Told {
    fn of(heard: &[Heard]) -> Self {
        let mut told = Self { steps: BTreeMap::new(), attitudes: BTreeMap::new(), agreement: Agreement::default() };
        let mut boot = 0;
        for heard in heard {
            match &heard.message {
                FromShoe::Hello(hello) => boot = hello.boot,
                FromShoe::Step(sent) => {
                    let step = sent.step.unpack();
                    told.steps.insert((sent.boot, step.stance_end.0, step.index), sent.step);
                }
                FromShoe::Attitude(attitude) => _ = told.attitudes.insert((boot, attitude.time), *attitude),
                _ => {}
            }
        }
        told
    }

    /// A run from one reset on has ended: `samples` from number `begun`. What the shoe told of its time and was not
    /// computed is not the same.
    fn end(&mut self, boot: u32, samples: Option<&Vec<ImuSample>>, begun: usize) {
        let run = samples.and_then(|samples| samples.get(begun..)).unwrap_or_default();
        let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
        let steps =
            self.steps.extract_if((boot, first.time.0, 0)..=(boot, last.time.0 - LATE_US, u32::MAX), |_, step| {
                step.unpack().stance_start >= first.time
            });
        self.agreement.steps += steps.count();
        // A shoe may have told of the time before its reset a moment later.
        let attitudes = (boot, first.time + SETTLED_US)..=(boot, last.time);
        if attitudes.start() <= attitudes.end() {
            self.agreement.attitudes += self.attitudes.extract_if(attitudes, |_, _| true).count();
        }
    }

    fn compare(&mut self, boot: u32, sample: &ImuSample, output: &Output, tracker: &Tracker) {
        if let Some(step) = &output.step {
            let packed = PackedStep::pack(step);
            let step = packed.unpack();
            // One that the shoe did not get rid of before the recording ended says nothing.
            let near = (boot, step.stance_end.0 - STRIDE_US, 0)..(boot, step.stance_end.0 + STRIDE_US, u32::MAX);
            let told = self.steps.range(near).map(|(key, told)| (*key, *told));
            let told = told.into_iter().find(|(_, told)| told.unpack().index == step.index);
            if let Some((key, told)) = told {
                self.steps.remove(&key);
                self.agreement.steps += 1;
                self.agreement.equal_steps += usize::from(told == packed);
            }
        }
        if let Some(told) = self.attitudes.remove(&(boot, sample.time)) {
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

/// A step is told at most so long after its stance: a second without the next stride ends it. **Units:** microseconds.
const LATE_US: i64 = 2_000_000;
/// The first samples after a reset lie no nearer to those before. **Units:** microseconds.
const SETTLED_US: i64 = 10_000;
/// No two steps with the same number are nearer to each other. **Units:** microseconds.
const STRIDE_US: i64 = 300_000;

#[cfg(test)]
mod tests {
    use super::*;
    use sohle_shared::bmx055::Config;
    use sohle_shared::selftest::Batches;
    use sohle_shared::wire::message::{Hello, Raw, SentStep, text};

    /// The beginning of a walk as a shoe tells it, with the boot it tells it from.
    fn told(boot: u32, batches: usize) -> Vec<Heard> {
        let (firmware, board) = (text("test"), text("test"));
        let hello = Hello { protocol: 0, schema: 0, boot, accepted: true, firmware, board };
        let mut messages =
            vec![FromShoe::Hello(hello), FromShoe::Raw(Raw { number: 0, item: RawItem::Start(Config::default()) })];
        let mut pipeline = Pipeline::new(&Config::default(), &Parameters::default(), &Calibration::default());
        let (mut id, mut due) = (0, Micros(0));
        for (batch, number) in Batches::new().take(batches).zip(1..) {
            pipeline.push(&batch, |sample, output, tracker| {
                if let Some(step) = &output.step {
                    messages.push(FromShoe::Step(SentStep { boot, id, oldest: id, step: PackedStep::pack(step) }));
                    id += 1;
                }
                if sample.time >= due {
                    due = sample.time + 50_000;
                    let attitude = tracker.attitude();
                    messages.push(FromShoe::Attitude(Attitude {
                        time: sample.time,
                        state: output.state,
                        stance: output.stance,
                        attitude: [attitude.w, attitude.i, attitude.j, attitude.k],
                        displacement: tracker.displacement().into(),
                        velocity: tracker.velocity().into(),
                    }));
                }
            });
            messages.push(FromShoe::Raw(Raw { number, item: RawItem::Batch(batch) }));
        }
        messages.into_iter().map(|message| Heard { time: Micros(0), message }).collect()
    }

    fn computed(heard: &[Heard]) -> (Agreement, usize) {
        let mut recording = Recording::default();
        compute(heard, &mut recording).unwrap();
        (recording.again.unwrap(), recording.samples.len())
    }

    /// 10 s: rest and some strides.
    const SOME: usize = 2_500;

    #[test]
    fn what_a_shoe_tells_is_computed_again_to_the_bit() {
        let (agreement, samples) = computed(&told(1, SOME));
        assert!(agreement.is_whole() && agreement.steps >= 5 && agreement.attitudes > 150, "{agreement}");
        assert!(samples > 19_000, "{samples}");
    }

    #[test]
    fn one_bit_is_noticed() {
        let mut heard = told(1, SOME);
        let attitude = heard.iter_mut().rev().find_map(|heard| match &mut heard.message {
            FromShoe::Attitude(attitude) => Some(attitude),
            _ => None,
        });
        let value = &mut attitude.unwrap().velocity[0];
        *value = f32::from_bits(value.to_bits() ^ 1);
        let (agreement, _) = computed(&heard);
        assert_eq!(agreement.equal_attitudes, agreement.attitudes - 1);
        assert!(!agreement.is_whole());
    }

    #[test]
    fn a_step_that_is_not_made_again_is_noticed() {
        let mut heard = told(1, SOME);
        let (whole, _) = computed(&heard);
        let place = heard.iter().position(|heard| matches!(&heard.message, FromShoe::Step(sent) if sent.id == 2));
        let FromShoe::Step(mut sent) = heard[place.unwrap()].message.clone() else { unreachable!() };
        // Half a stride later, with a number of its own.
        let mut step = sent.step.unpack();
        (step.index, step.stance_start, step.stance_end) = (99, step.stance_start + 500_000, step.stance_end + 500_000);
        sent.step = PackedStep::pack(&step);
        heard.insert(place.unwrap() + 1, Heard { time: Micros(0), message: FromShoe::Step(sent) });
        let (agreement, _) = computed(&heard);
        assert_eq!((agreement.steps, agreement.equal_steps), (whole.steps + 1, whole.steps));
    }

    #[test]
    fn after_a_lost_message_nothing_is_computed_or_missed() {
        let mut heard = told(1, SOME);
        let lost = heard.iter().position(|heard| matches!(&heard.message, FromShoe::Raw(raw) if raw.number == 1_800));
        heard.remove(lost.unwrap());
        let (agreement, samples) = computed(&heard);
        assert!(agreement.is_whole() && agreement.missing == 1 && agreement.steps >= 2, "{agreement}");
        assert!((14_000..14_500).contains(&samples), "{samples}");
    }

    #[test]
    fn each_boot_has_its_own_time_and_the_longest_is_the_walk() {
        let heard = [told(1, 1_500), told(2, SOME), told(3, 1_600)].concat();
        let (agreement, samples) = computed(&heard);
        let single: Vec<_> =
            [(1, 1_500), (2, SOME), (3, 1_600)].map(|(boot, count)| computed(&told(boot, count))).into();
        assert!(agreement.is_whole() && agreement.boots == 3, "{agreement}");
        assert_eq!(agreement.steps, single.iter().map(|(agreement, _)| agreement.steps).sum::<usize>());
        assert_eq!(agreement.attitudes, single.iter().map(|(agreement, _)| agreement.attitudes).sum::<usize>());
        assert_eq!(samples, single[1].1);
    }
}
