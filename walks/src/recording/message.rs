//! The messages of the project's own recordings, as bytes.
//!
//! A message is a fixed sequence of numbers, little-endian, in the order of its schema: the CDR encoding of ROS 2 with a
//! `ros2msg` schema. Every message lists its fields from the widest to the narrowest, so that CDR never inserts padding
//! and no code is needed for it. The values come back bit for bit.

use super::truth::{TruthPose, TruthStance};
use nalgebra::{Matrix4, Vector3};
use sohle_shared::sample::{Accel, Clipped, ClippedSamples, Gyro, ImuSample};
use sohle_shared::step::{FloorMode, Step, StepQuality};
use sohle_shared::time::Micros;

/// CDR, little-endian, no options.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Something that is recorded as one message of a channel.
pub(super) trait Message: Sized {
    /// Name of the channel.
    const TOPIC: &'static str;
    /// Name of the schema.
    const SCHEMA: &'static str;
    /// The schema. It is compared as text when reading: a changed message needs a new schema name.
    const DEFINITION: &'static str;
    /// When the message belongs on the time line.
    fn time(&self) -> Micros;
    /// Appends the fields.
    fn put(&self, out: &mut Encoder);
    /// Takes the fields.
    fn take(from: &mut Decoder<'_>) -> Option<Self>;

    /// The message as bytes, in place of what `buffer` held.
    fn encode<'a>(&self, buffer: &'a mut Encoder) -> &'a [u8] {
        buffer.0.clear();
        buffer.0.extend(ENCAPSULATION);
        self.put(buffer);
        &buffer.0
    }

    /// The message in `bytes`, unless they are something else.
    fn decode(bytes: &[u8]) -> Option<Self> {
        let mut from = Decoder(bytes.strip_prefix(&ENCAPSULATION)?);
        let message = Self::take(&mut from)?;
        // Writers of CDR may pad the end of a message to a multiple of four.
        (from.0.len() < 4).then_some(message)
    }
}

/// Collects the fields of a message.
#[derive(Default)]
pub(super) struct Encoder(Vec<u8>);

impl Encoder {
    pub(super) fn time(&mut self, time: Micros) {
        self.0.extend(time.0.to_le_bytes());
    }

    /// Bytes with their number before them; the number is aligned when only eights come before.
    pub(super) fn sequence(&mut self, bytes: &[u8]) {
        // A message of the wire is some hundred bytes long.
        self.0.extend((bytes.len() as u32).to_le_bytes());
        self.0.extend(bytes);
    }

    /// A text; its number is aligned when nothing narrower than four bytes comes before.
    pub(super) fn string(&mut self, text: &str) {
        // CDR ends texts with a zero, so none may be inside.
        let text = text.replace('\0', " ");
        self.0.extend((text.len() as u32 + 1).to_le_bytes());
        self.0.extend(text.bytes().chain([0]));
    }

    pub(super) fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    pub(super) fn i32(&mut self, value: i32) {
        self.0.extend(value.to_le_bytes());
    }

    pub(super) fn f64s(&mut self, values: &[f64]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn f32s<'a>(&mut self, values: impl IntoIterator<Item = &'a f32>) {
        self.0.extend(values.into_iter().flat_map(|value| value.to_le_bytes()));
    }

    pub(super) fn flags<const N: usize>(&mut self, flags: [bool; N]) {
        self.0.extend(flags.map(u8::from));
    }
}

/// Takes the fields of a message one after the other; `None` when there are too few bytes.
pub(super) struct Decoder<'a>(&'a [u8]);

impl<'a> Decoder<'a> {
    /// As [`Encoder::sequence`] wrote it.
    pub(super) fn sequence(&mut self) -> Option<&'a [u8]> {
        let length = self.bytes().map(u32::from_le_bytes)?;
        let (head, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(head)
    }

    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*head)
    }

    pub(super) fn time(&mut self) -> Option<Micros> {
        self.bytes().map(i64::from_le_bytes).map(Micros)
    }

    /// As [`Encoder::string`] wrote it.
    pub(super) fn string(&mut self) -> Option<&'a str> {
        let (end, text) = self.sequence()?.split_last()?;
        (*end == 0).then(|| std::str::from_utf8(text).ok()).flatten()
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Option<i32> {
        self.bytes().map(i32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.bytes().map(f64::from_le_bytes)
    }

    pub(super) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }

    fn f32s<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.bytes().map(f32::from_le_bytes)?;
        }
        Some(values)
    }

    fn u16(&mut self) -> Option<u16> {
        self.bytes().map(u16::from_le_bytes)
    }

    pub(super) fn flag(&mut self) -> Option<bool> {
        match self.bytes()? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }
}

impl Message for ImuSample {
    const TOPIC: &'static str = "/imu";
    const SCHEMA: &'static str = "sohle/msg/ImuSample";
    const DEFINITION: &'static str = "\
# One reading of accelerometer and gyroscope, sensor frame.
int64 time_us
# m/s^2; at rest the reaction to gravity, +9.81 upwards
float32[3] accel
# rad/s
float32[3] gyro
# an axis stood at the end of its range
bool accel_clipped
bool gyro_clipped
";

    fn time(&self) -> Micros {
        self.time
    }

    fn put(&self, out: &mut Encoder) {
        out.time(self.time);
        out.f32s(&self.accel.0);
        out.f32s(&self.gyro.0);
        out.flags([self.clipped.accel, self.clipped.gyro]);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        Some(Self {
            time: from.time()?,
            accel: Accel(from.f32s::<3>()?.into()),
            gyro: Gyro(from.f32s::<3>()?.into()),
            clipped: Clipped { accel: from.flag()?, gyro: from.flag()? },
        })
    }
}

impl Message for TruthPose {
    const TOPIC: &'static str = "/truth/pose";
    const SCHEMA: &'static str = "sohle/msg/TruthPose";
    const DEFINITION: &'static str = "\
# Where a simulated foot was when a sample was taken; world frame, z up.
int64 time_us
# m
float64[3] position
# m/s
float64[3] velocity
# w, x, y, z; turns sensor vectors into the world
float64[4] attitude
# the foot stands
bool stance
";

    fn time(&self) -> Micros {
        self.time
    }

    fn put(&self, out: &mut Encoder) {
        out.time(self.time);
        out.f64s(&self.position);
        out.f64s(&self.velocity);
        out.f64s(&self.attitude);
        out.flags([self.stance]);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        Some(Self {
            time: from.time()?,
            position: from.f64s()?,
            velocity: from.f64s()?,
            attitude: from.f64s()?,
            stance: from.flag()?,
        })
    }
}

impl Message for TruthStance {
    const TOPIC: &'static str = "/truth/stance";
    const SCHEMA: &'static str = "sohle/msg/TruthStance";
    const DEFINITION: &'static str = "\
# A time during which a simulated foot stood; world frame, z up.
int64 start_us
int64 end_us
# m, at the end
float64[3] position
# rad, at the end, counter-clockwise from the world's x axis
float64 heading
# the sensor was at rest in the world
bool still
";

    fn time(&self) -> Micros {
        self.end
    }

    fn put(&self, out: &mut Encoder) {
        out.time(self.start);
        out.time(self.end);
        out.f64s(&self.position);
        out.f64s(&[self.heading]);
        out.flags([self.still]);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        Some(Self {
            start: from.time()?,
            end: from.time()?,
            position: from.f64s()?,
            heading: from.f64()?,
            still: from.flag()?,
        })
    }
}

/// The numbers of the floor modes.
const MODES: [FloorMode; 3] = [FloorMode::Level, FloorMode::Stairs, FloorMode::Elevator];

impl Message for Step {
    const TOPIC: &'static str = "/step";
    const SCHEMA: &'static str = "sohle/msg/StepWithCounts";
    const DEFINITION: &'static str = "\
# The change from the end of the previous stance to the end of this one.
int64 stance_start_us
int64 stance_end_us
# counts up by one
uint32 index
# m; heading frame of the previous stance: x ahead, y left, z up
float32[3] displacement
# rad, counter-clockwise from above
float32 turn
# of x, y, z, turn; row by row
float32[16] covariance
# samples of which an axis stood at the end of its range
uint16 accel_clipped_samples
uint16 gyro_clipped_samples
uint8 LEVEL=0
uint8 STAIRS=1
uint8 ELEVATOR=2
uint8 mode
bool accel_clipped
bool gyro_clipped
bool gap
bool long_swing
bool weak_stance
bool repaired
";

    fn time(&self) -> Micros {
        self.stance_end
    }

    fn put(&self, out: &mut Encoder) {
        out.time(self.stance_start);
        out.time(self.stance_end);
        out.0.extend(self.index.to_le_bytes());
        out.f32s(&self.displacement);
        out.f32s([&self.turn]);
        out.f32s(&self.covariance.transpose());
        out.0.extend([self.clipped.accel, self.clipped.gyro].iter().flat_map(|count| count.to_le_bytes()));
        out.0.push(MODES.iter().position(|&mode| mode == self.mode).map_or(0, |number| number as u8));
        let StepQuality { accel_clipped, gyro_clipped, gap, long_swing, weak_stance, repaired } = self.quality;
        out.flags([accel_clipped, gyro_clipped, gap, long_swing, weak_stance, repaired]);
    }

    fn take(from: &mut Decoder<'_>) -> Option<Self> {
        let stance_start = from.time()?;
        let stance_end = from.time()?;
        let index = from.bytes().map(u32::from_le_bytes)?;
        let displacement = Vector3::from(from.f32s::<3>()?);
        let [turn] = from.f32s()?;
        let covariance = Matrix4::from_row_slice(&from.f32s::<16>()?);
        let clipped = ClippedSamples { accel: from.u16()?, gyro: from.u16()? };
        let [mode] = from.bytes()?;
        Some(Self {
            index,
            stance_start,
            stance_end,
            displacement,
            turn,
            covariance,
            mode: *MODES.get(usize::from(mode))?,
            quality: StepQuality {
                accel_clipped: from.flag()?,
                gyro_clipped: from.flag()?,
                gap: from.flag()?,
                long_swing: from.flag()?,
                weak_stance: from.flag()?,
                repaired: from.flag()?,
            },
            clipped,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width of each field in bytes, from the schema's text.
    fn widths(definition: &str) -> Vec<usize> {
        let fields = definition.lines().filter(|line| !line.starts_with('#') && !line.contains('='));
        fields
            .map(|line| {
                let kind = line.split(' ').next().unwrap();
                match kind.split('[').next().unwrap() {
                    "int64" | "float64" => 8,
                    "uint32" | "float32" => 4,
                    "uint16" => 2,
                    "uint8" | "bool" => 1,
                    other => panic!("{other} in {line}"),
                }
            })
            .collect()
    }

    fn no_padding<M: Message>() {
        let widths = widths(M::DEFINITION);
        assert!(widths.is_sorted_by(|wide, narrow| wide >= narrow), "{}", M::SCHEMA);
        assert!(M::DEFINITION.is_ascii());
    }

    #[test]
    fn fields_go_from_wide_to_narrow_so_that_no_padding_is_due() {
        no_padding::<ImuSample>();
        no_padding::<TruthPose>();
        no_padding::<TruthStance>();
        no_padding::<Step>();
    }

    #[test]
    fn a_sample_has_these_bytes() {
        let mut sample = ImuSample::new(Micros(0x0102), [1.0, -2.0, 0.5], [0.0, -0.0, 1e-42]);
        sample.clipped.gyro = true;
        let mut buffer = Encoder::default();
        let expected = [
            0, 1, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0, 0, 0, 0, 0,
            0x80, 0xca, 2, 0, 0, 0, 1,
        ];
        assert_eq!(sample.encode(&mut buffer), expected);
        let back = ImuSample::decode(&expected).unwrap();
        assert_eq!(back, sample);
        assert_eq!(back.gyro.0.y.to_bits(), (-0.0_f32).to_bits());
    }

    #[test]
    fn other_lengths_and_flags_are_refused() {
        let sample = ImuSample::new(Micros(7), [0.0; 3], [0.0; 3]);
        let mut buffer = Encoder::default();
        let bytes = sample.encode(&mut buffer).to_vec();
        for length in 0..bytes.len() {
            assert!(ImuSample::decode(&bytes[..length]).is_none());
        }
        let with_tail = |tail: usize| [bytes.clone(), vec![0; tail]].concat();
        assert!(ImuSample::decode(&with_tail(3)).is_some());
        assert!(ImuSample::decode(&with_tail(4)).is_none());
        let mut flag = bytes.clone();
        *flag.last_mut().unwrap() = 2;
        assert!(ImuSample::decode(&flag).is_none());
    }
}
