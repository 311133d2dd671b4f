//! What the sensor of a shoe reads, from the frames of both dies as the shoe tells them.

use sohle_shared::bmx055::Merger;
use sohle_shared::sample::ImuSample;
use sohle_shared::shoe::celsius;
use sohle_shared::wire::message::RawItem;

/// Puts the frames of both dies together.
#[derive(Debug, Default)]
pub struct Samples {
    /// Nothing until the shoe has said how its sensor is set.
    merger: Option<Merger>,
}

impl Samples {
    /// Takes in what went into the tracker of the shoe; tells each sample that this completes, as it was read, and the
    /// temperature, where that is known. **Units:** °C.
    pub fn take(&mut self, item: &RawItem, mut sink: impl FnMut(&ImuSample, Option<f32>)) {
        match (item, &mut self.merger) {
            (RawItem::Start(sensor), merger) => *merger = Some(Merger::new(sensor)),
            (RawItem::Batch(batch), Some(merger)) => {
                let temperature = batch.temperature.map(celsius);
                merger.push(batch, |sample| sink(sample, temperature));
            }
            (RawItem::Batch(_), None) | (RawItem::Order(_), _) => {}
        }
    }
}
