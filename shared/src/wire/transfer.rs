//! Values in pieces, since they are longer than a message: the parameters of the tracker, the calibration of the sensor.
//!
//! Each piece tells the length and the checksum of the whole. Pieces of different wholes never mix, nothing takes effect
//! before the whole is there and its checksum is right, and a transfer that was cut is simply begun again.

use super::message::Refusal;
use crate::calibration::Calibration;
use crate::checksum::CRC32;
use crate::tracker::Parameters;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A value is never longer. **Units:** bytes.
pub const VALUE_MAX: usize = 512;

/// A piece is never longer. **Units:** bytes.
pub const CHUNK_MAX: usize = 128;

/// What can be written and read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Item {
    /// [`Parameters`] of the tracker.
    Parameters,
    /// [`Calibration`] of the sensor.
    Calibration,
}

/// A value that has come whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Parameters of the tracker.
    Parameters(Parameters),
    /// Calibration of the sensor.
    Calibration(Calibration),
}

/// A piece of an encoded value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Chunk {
    /// Length of the whole. **Units:** bytes.
    pub total: u16,
    /// CRC-32 of the whole.
    pub checksum: u32,
    /// Where in the whole this piece begins. **Units:** bytes.
    pub offset: u16,
    /// The piece.
    pub bytes: Vec<u8, CHUNK_MAX>,
}

impl Value {
    /// The piece that begins at `offset`.
    pub fn chunk(&self, offset: u16) -> Result<Chunk, Refusal> {
        match self {
            Self::Parameters(parameters) => chunk(parameters, offset),
            Self::Calibration(calibration) => chunk(calibration, offset),
        }
    }

    fn decode(item: Item, bytes: &[u8]) -> Result<Self, Refusal> {
        Ok(match item {
            Item::Parameters => {
                let parameters: Parameters = decode(bytes)?;
                parameters.check().map_err(|_| Refusal::Value)?;
                Self::Parameters(parameters)
            }
            Item::Calibration => {
                let calibration: Calibration = decode(bytes)?;
                if !calibration.is_finite() {
                    return Err(Refusal::Value);
                }
                Self::Calibration(calibration)
            }
        })
    }
}

fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, Refusal> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        _ => Err(Refusal::Value),
    }
}

fn chunk<T: Serialize>(value: &T, offset: u16) -> Result<Chunk, Refusal> {
    let mut buffer = [0; VALUE_MAX];
    let whole = postcard::to_slice(value, &mut buffer).map_err(|_| Refusal::TooLong)?;
    let rest = whole.get(usize::from(offset)..).ok_or(Refusal::Piece(0))?;
    let piece = rest.get(..CHUNK_MAX).unwrap_or(rest);
    Ok(Chunk {
        // No longer than VALUE_MAX.
        total: whole.len() as u16,
        checksum: CRC32.checksum(whole),
        offset,
        bytes: Vec::from_slice(piece).map_err(|_| Refusal::TooLong)?,
    })
}

/// Puts pieces together.
#[derive(Clone, Debug)]
pub struct Assembly {
    bytes: [u8; VALUE_MAX],
    filled: usize,
    /// What comes, with length and checksum of the whole.
    whole: (Item, u16, u32),
}

impl Assembly {
    /// Nothing has come.
    pub const fn new() -> Self {
        Self { bytes: [0; VALUE_MAX], filled: 0, whole: (Item::Parameters, 0, 0) }
    }

    /// Where the next piece begins. **Units:** bytes.
    pub fn next_offset(&self) -> u16 {
        // No more than VALUE_MAX.
        self.filled as u16
    }

    /// Takes a piece in; the value, once it is whole. A piece at the beginning begins a new transfer.
    pub fn push(&mut self, item: Item, chunk: &Chunk) -> Result<Option<Value>, Refusal> {
        let whole = (item, chunk.total, chunk.checksum);
        if chunk.offset == 0 {
            self.filled = 0;
            self.whole = whole;
        }
        let total = usize::from(chunk.total);
        if total > VALUE_MAX {
            return Err(Refusal::TooLong);
        }
        let begin = usize::from(chunk.offset);
        let end = begin + chunk.bytes.len();
        if self.whole != whole || begin != self.filled || chunk.bytes.is_empty() || end > total {
            return Err(Refusal::Piece(self.next_offset()));
        }
        let place = self.bytes.get_mut(begin..end).ok_or(Refusal::TooLong)?;
        place.copy_from_slice(&chunk.bytes);
        self.filled = end;
        if end < total {
            return Ok(None);
        }
        self.filled = 0;
        let bytes = self.bytes.get(..total).ok_or(Refusal::TooLong)?;
        if CRC32.checksum(bytes) != chunk.checksum {
            return Err(Refusal::Checksum);
        }
        Value::decode(item, bytes).map(Some)
    }
}

impl Default for Assembly {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed() -> Value {
        Value::Parameters(Parameters { start_after_s: 4.25, ..Parameters::documented() })
    }

    fn pieces(value: &Value) -> std::vec::Vec<Chunk> {
        let mut pieces = std::vec::Vec::new();
        let mut offset = 0;
        loop {
            let piece = value.chunk(offset).unwrap();
            offset += piece.bytes.len() as u16;
            let last = offset == piece.total;
            pieces.push(piece);
            if last {
                return pieces;
            }
        }
    }

    #[test]
    fn parameters_arrive_with_their_last_piece_and_not_before() {
        let pieces = pieces(&changed());
        assert!(pieces.len() > 1);
        let mut assembly = Assembly::new();
        for piece in &pieces[..pieces.len() - 1] {
            assert_eq!(assembly.push(Item::Parameters, piece), Ok(None));
        }
        assert_eq!(assembly.push(Item::Parameters, &pieces[pieces.len() - 1]), Ok(Some(changed())));
    }

    #[test]
    fn a_cut_transfer_leaves_nothing_behind() {
        let (old, new) = (pieces(&Value::Parameters(Parameters::default())), pieces(&changed()));
        for cut in 0..old.len() {
            let mut assembly = Assembly::new();
            for piece in &old[..cut] {
                assembly.push(Item::Parameters, piece).unwrap();
            }
            // The rest of another transfer is no continuation.
            if cut > 0 {
                assert_eq!(assembly.push(Item::Parameters, &new[cut]), Err(Refusal::Piece(old[cut].offset)));
            }
            let results: std::vec::Vec<_> = new.iter().map(|piece| assembly.push(Item::Parameters, piece)).collect();
            assert_eq!(results.last(), Some(&Ok(Some(changed()))));
        }
    }

    #[test]
    fn damage_is_found() {
        let mut assembly = Assembly::new();
        let mut pieces = pieces(&changed());
        let last = pieces.len() - 1;
        pieces[last].bytes[3] ^= 1;
        let results: std::vec::Vec<_> = pieces.iter().map(|piece| assembly.push(Item::Parameters, piece)).collect();
        assert_eq!(results[last], Err(Refusal::Checksum));
        let whole = [9; 20];
        let foreign =
            Chunk { total: 20, checksum: CRC32.checksum(&whole), offset: 0, bytes: Vec::from_slice(&whole).unwrap() };
        assert_eq!(assembly.push(Item::Parameters, &foreign), Err(Refusal::Value));
        assert_eq!(assembly.push(Item::Parameters, &Chunk { total: 513, ..foreign.clone() }), Err(Refusal::TooLong));
        assert_eq!(assembly.push(Item::Parameters, &Chunk { total: 19, ..foreign }), Err(Refusal::Piece(0)));
    }

    #[test]
    fn a_calibration_is_no_parameters_and_must_be_of_numbers() {
        let mut value = Calibration::default();
        let mut assembly = Assembly::new();
        let mut push = |item, value: Calibration| {
            let results: std::vec::Vec<_> =
                pieces(&Value::Calibration(value)).iter().map(|piece| assembly.push(item, piece)).collect();
            results.last().cloned().unwrap()
        };
        value.accel.bias[1] = 0.25;
        assert_eq!(push(Item::Calibration, value), Ok(Some(Value::Calibration(value))));
        assert_eq!(push(Item::Parameters, value), Err(Refusal::Value));
        value.accel.bias[1] = f32::NAN;
        assert_eq!(push(Item::Calibration, value), Err(Refusal::Value));
    }

    #[test]
    fn parameters_must_make_sense() {
        for floor in [1e6, -1.0, f32::NAN] {
            let mut parameters = Parameters::default();
            parameters.stance.floor = floor;
            let mut assembly = Assembly::new();
            let pieces = pieces(&Value::Parameters(parameters));
            let results: std::vec::Vec<_> = pieces.iter().map(|piece| assembly.push(Item::Parameters, piece)).collect();
            assert_eq!(results.last(), Some(&Err(Refusal::Value)), "{floor}");
        }
    }

    #[test]
    fn a_piece_of_another_value_does_not_follow() {
        let (first, second) = (pieces(&changed()), pieces(&changed()));
        let mut assembly = Assembly::new();
        assembly.push(Item::Parameters, &first[0]).unwrap();
        assert_eq!(assembly.push(Item::Calibration, &second[1]), Err(Refusal::Piece(CHUNK_MAX as u16)));
    }

    #[test]
    fn there_is_room_for_more() {
        let points = (0..crate::calibration::POINTS as i32).map(|at| crate::calibration::Point {
            temperature: at as f32 * 10.0,
            bias: [0.01; 3],
            sigma: 1e-4,
        });
        let full = Calibration {
            made: Some(u64::MAX),
            temperature: Some(20.0),
            mounting: Some([0.5; 4]),
            gyro: points.collect(),
            ..Calibration::default()
        };
        for value in [Value::Parameters(Parameters::default()), Value::Calibration(full)] {
            let whole = value.chunk(0).unwrap().total;
            assert!(usize::from(whole) < VALUE_MAX * 4 / 5, "{whole} bytes");
        }
    }
}
