//! The parameters of the tracker in pieces, since they are longer than a message.
//!
//! Each piece tells the length and the checksum of the whole. Pieces of different wholes never mix, nothing takes effect
//! before the whole is there and its checksum is right, and a transfer that was cut is simply begun again.

use super::message::Refusal;
use crate::checksum::CRC32;
use crate::tracker::Parameters;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// The parameters are never longer. **Units:** bytes.
pub const PARAMETERS_MAX: usize = 512;

/// A piece is never longer. **Units:** bytes.
pub const CHUNK_MAX: usize = 128;

/// A piece of encoded parameters.
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

/// The piece of the parameters that begins at `offset`.
pub fn chunk(parameters: &Parameters, offset: u16) -> Result<Chunk, Refusal> {
    let mut buffer = [0; PARAMETERS_MAX];
    let whole = postcard::to_slice(parameters, &mut buffer).map_err(|_| Refusal::TooLong)?;
    let rest = whole.get(usize::from(offset)..).ok_or(Refusal::Piece(0))?;
    let piece = rest.get(..CHUNK_MAX).unwrap_or(rest);
    Ok(Chunk {
        // No longer than PARAMETERS_MAX.
        total: whole.len() as u16,
        checksum: CRC32.checksum(whole),
        offset,
        bytes: Vec::from_slice(piece).map_err(|_| Refusal::TooLong)?,
    })
}

/// Puts pieces together.
#[derive(Clone, Debug)]
pub struct Assembly {
    bytes: [u8; PARAMETERS_MAX],
    filled: usize,
    /// Length and checksum of the whole.
    whole: (u16, u32),
}

impl Assembly {
    /// Nothing has come.
    pub const fn new() -> Self {
        Self { bytes: [0; PARAMETERS_MAX], filled: 0, whole: (0, 0) }
    }

    /// Where the next piece begins. **Units:** bytes.
    pub fn next_offset(&self) -> u16 {
        // No more than PARAMETERS_MAX.
        self.filled as u16
    }

    /// Takes a piece in; the parameters, once they are whole. A piece at the beginning begins a new transfer.
    pub fn push(&mut self, chunk: &Chunk) -> Result<Option<Parameters>, Refusal> {
        if chunk.offset == 0 {
            self.filled = 0;
            self.whole = (chunk.total, chunk.checksum);
        }
        let total = usize::from(chunk.total);
        if total > PARAMETERS_MAX {
            return Err(Refusal::TooLong);
        }
        let begin = usize::from(chunk.offset);
        let end = begin + chunk.bytes.len();
        if self.whole != (chunk.total, chunk.checksum) || begin != self.filled || chunk.bytes.is_empty() || end > total
        {
            return Err(Refusal::Piece(self.next_offset()));
        }
        let place = self.bytes.get_mut(begin..end).ok_or(Refusal::TooLong)?;
        place.copy_from_slice(&chunk.bytes);
        self.filled = end;
        if end < total {
            return Ok(None);
        }
        self.filled = 0;
        let whole = self.bytes.get(..total).ok_or(Refusal::TooLong)?;
        if CRC32.checksum(whole) != chunk.checksum {
            return Err(Refusal::Checksum);
        }
        match postcard::take_from_bytes(whole) {
            Ok((parameters, [])) => Ok(Some(parameters)),
            _ => Err(Refusal::Parameters),
        }
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

    fn changed() -> Parameters {
        Parameters { start_after_s: 4.25, ..Parameters::documented() }
    }

    fn pieces(parameters: &Parameters) -> std::vec::Vec<Chunk> {
        let mut pieces = std::vec::Vec::new();
        let mut offset = 0;
        loop {
            let piece = chunk(parameters, offset).unwrap();
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
            assert_eq!(assembly.push(piece), Ok(None));
        }
        assert_eq!(assembly.push(&pieces[pieces.len() - 1]), Ok(Some(changed())));
    }

    #[test]
    fn a_cut_transfer_leaves_nothing_behind() {
        let (old, new) = (pieces(&Parameters::default()), pieces(&changed()));
        for cut in 0..old.len() {
            let mut assembly = Assembly::new();
            for piece in &old[..cut] {
                assembly.push(piece).unwrap();
            }
            // The rest of another transfer is no continuation.
            if cut > 0 {
                assert_eq!(assembly.push(&new[cut]), Err(Refusal::Piece(old[cut].offset)));
            }
            let results: std::vec::Vec<_> = new.iter().map(|piece| assembly.push(piece)).collect();
            assert_eq!(results.last(), Some(&Ok(Some(changed()))));
        }
    }

    #[test]
    fn damage_is_found() {
        let mut assembly = Assembly::new();
        let mut pieces = pieces(&changed());
        let last = pieces.len() - 1;
        pieces[last].bytes[3] ^= 1;
        let results: std::vec::Vec<_> = pieces.iter().map(|piece| assembly.push(piece)).collect();
        assert_eq!(results[last], Err(Refusal::Checksum));
        let whole = [9; 20];
        let foreign =
            Chunk { total: 20, checksum: CRC32.checksum(&whole), offset: 0, bytes: Vec::from_slice(&whole).unwrap() };
        assert_eq!(assembly.push(&foreign), Err(Refusal::Parameters));
        assert_eq!(assembly.push(&Chunk { total: 513, ..foreign.clone() }), Err(Refusal::TooLong));
        assert_eq!(assembly.push(&Chunk { total: 19, ..foreign }), Err(Refusal::Piece(0)));
    }

    #[test]
    fn there_is_room_for_more_parameters() {
        let whole = chunk(&Parameters::default(), 0).unwrap().total;
        assert!(usize::from(whole) < PARAMETERS_MAX * 4 / 5, "{whole} bytes");
    }
}
