//! A walk as what the registers of both dies showed: the food of the [twin](super::twin).
//!
//! A header of 24 bytes, then 12 bytes for each pair of frames: x, y, z of the accelerometer, x, y, z of the gyroscope, each a
//! little-endian 16-bit number. The frames of a pair have the same number, not the same time: each die has its own period.

/// Bytes of a [`Header`].
pub const HEADER_BYTES: usize = 24;
/// Bytes of a pair of frames.
pub const PAIR_BYTES: usize = 12;

const MAGIC: [u8; 8] = *b"SOHLECNT";
const VERSION: u32 = 1;

/// What is known of the frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// From one frame of the accelerometer to the next. **Units:** ns.
    pub accel_period_ns: u32,
    /// From one frame of the gyroscope to the next. **Units:** ns.
    pub gyro_period_ns: u32,
    /// Pairs of frames.
    pub pairs: u32,
}

impl Header {
    /// As bytes.
    pub fn to_bytes(&self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        let (magic, numbers) = bytes.split_at_mut(MAGIC.len());
        magic.copy_from_slice(&MAGIC);
        let values = [VERSION, self.accel_period_ns, self.gyro_period_ns, self.pairs];
        for (place, value) in numbers.chunks_exact_mut(4).zip(values) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        bytes
    }

    /// From bytes; `None` if they are no header of this version, or a period is zero.
    pub fn from_bytes(bytes: &[u8; HEADER_BYTES]) -> Option<Self> {
        let (magic, numbers) = bytes.split_at(MAGIC.len());
        let mut values = numbers.chunks_exact(4).map_while(|value| value.try_into().ok().map(u32::from_le_bytes));
        let (version, accel_period_ns, gyro_period_ns, pairs) =
            (values.next()?, values.next()?, values.next()?, values.next()?);
        let known = magic == MAGIC && version == VERSION && accel_period_ns > 0 && gyro_period_ns > 0;
        known.then_some(Self { accel_period_ns, gyro_period_ns, pairs })
    }
}

/// A pair of frames as bytes.
pub fn pair_to_bytes(accel: [i16; 3], gyro: [i16; 3]) -> [u8; PAIR_BYTES] {
    let mut bytes = [0; PAIR_BYTES];
    for (place, count) in bytes.chunks_exact_mut(2).zip(accel.into_iter().chain(gyro)) {
        place.copy_from_slice(&count.to_le_bytes());
    }
    bytes
}

/// The frames of accelerometer and gyroscope from bytes.
pub fn pair_from_bytes(bytes: &[u8; PAIR_BYTES]) -> ([i16; 3], [i16; 3]) {
    let [a, b, c, d, e, f, g, h, i, j, k, l] = *bytes;
    let count = |low, high| i16::from_le_bytes([low, high]);
    ([count(a, b), count(c, d), count(e, f)], [count(g, h), count(i, j), count(k, l)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_was_written_is_read(accel: [i16; 3], gyro: [i16; 3], periods in (1..u32::MAX, 1..u32::MAX), pairs: u32) {
            prop_assert_eq!(pair_from_bytes(&pair_to_bytes(accel, gyro)), (accel, gyro));
            let header = Header { accel_period_ns: periods.0, gyro_period_ns: periods.1, pairs };
            prop_assert_eq!(Header::from_bytes(&header.to_bytes()), Some(header));
        }

        #[test]
        fn other_bytes_are_no_header(at in 0..12_usize, change in 1..=255_u8) {
            let mut bytes = Header { accel_period_ns: 1, gyro_period_ns: 1, pairs: 1 }.to_bytes();
            bytes[at] ^= change;
            prop_assert_eq!(Header::from_bytes(&bytes), None);
        }
    }
}
