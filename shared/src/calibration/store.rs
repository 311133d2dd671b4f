//! Calibration, settings and bonds in flash, safe against a loss of power at any moment.
//!
//! Every save appends a whole record, with all that is kept, to a log over two or more pages: magic, sequence number,
//! length, CRC-32, then the values. The newest intact record counts. A page is erased only right before it is written to
//! and never while it holds the newest record, so whatever a loss of power leaves behind (a word half written, a page half
//! erased) is beside the newest record, and has a wrong CRC or an older number.
//!
//! A map that migrates single values between pages (crate `sequential-storage` 8.0) was tried on the same flash in memory and
//! lost or locked values at some of the cuts, probably because a page that was half erased can still carry its marks, and is
//! then taken for one of data. Whole records cost a kilobyte of buffer and need no marks.
//!
//! Flash with error correction (STM32WB) answers the read of a half-written word with a non-maskable interrupt: the board's
//! handler has to clear the flag and return.

#[cfg(test)]
pub(crate) mod flash;

use super::Calibration;
use crate::bonds::Bonds;
use crate::checksum::CRC32;
use crate::tracker::Parameters;
use core::ops::Range;
use embedded_storage_async::nor_flash::NorFlash;
use postcard::ser_flavors::Flavor;
use postcard::serialize_with_flavor;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Something that is kept.
///
/// The bytes say nothing of their layout, so every change of a field's name, type or place needs another
/// [`Stored::LAYOUT`]: values of another layout are refused instead of being taken for something else.
pub trait Stored: Serialize + DeserializeOwned {
    /// Its place among the others.
    const KEY: u8;
    /// Number of its layout.
    const LAYOUT: u16;

    /// Whether its values may be used; others are refused like bytes that are no such value.
    fn is_fit(&self) -> bool {
        true
    }
}

impl Stored for Calibration {
    const KEY: u8 = 1;
    const LAYOUT: u16 = 1;

    fn is_fit(&self) -> bool {
        self.is_finite()
    }
}

impl Stored for Parameters {
    const KEY: u8 = 2;
    const LAYOUT: u16 = 3;

    fn is_fit(&self) -> bool {
        self.check().is_ok()
    }
}

impl Stored for Bonds {
    const KEY: u8 = 3;
    const LAYOUT: u16 = 1;
}

/// Why something was not loaded or saved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error<E> {
    /// The flash refused.
    Flash(E),
    /// The range is not two or more whole pages, or its words are wider than 32 bytes.
    Range,
    /// The values do not fit into one record.
    TooLarge,
    /// The value was stored by another version of the program.
    Layout {
        /// Number of its layout.
        stored: u16,
        /// The one expected.
        expected: u16,
    },
    /// The bytes are intact but no such value, or its numbers make no sense.
    Value,
    /// What was written reads differently; the next attempt takes another page.
    Verify,
}

impl<E: core::fmt::Debug> core::fmt::Display for Error<E> {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Flash(error) => write!(out, "the flash refused: {error:?}"),
            Self::Range => out.write_str("the flash range is not two or more whole pages of words up to 32 bytes"),
            Self::TooLarge => write!(out, "the values do not fit into the {PAYLOAD} bytes of a record"),
            Self::Layout { stored, expected } => {
                write!(out, "the stored value has layout {stored}, expected {expected}: store it anew")
            }
            Self::Value => out.write_str("the stored bytes are intact but no value of use"),
            Self::Verify => out.write_str("the flash reads something else than was written"),
        }
    }
}

impl<E: core::fmt::Debug> core::error::Error for Error<E> {}

/// First bytes of a record.
const MAGIC: [u8; 4] = *b"SOH1";
/// Magic, sequence number, length, CRC.
const HEADER: usize = 16;
/// Bytes that the values may take.
const PAYLOAD: usize = 1024 - HEADER;
/// The largest record.
const RECORD: usize = HEADER + PAYLOAD;
/// Records begin at multiples of this, which is one of every flash word.
const SLOT: u32 = 32;
/// Key, layout, length.
const ENTRY: usize = 5;

/// Where the newest record is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    address: u32,
    length: u32,
    sequence: u32,
}

/// A log of records over the pages `range` of `flash`.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    range: Range<u32>,
    newest: Option<Place>,
    /// First slot after all that was ever written to the page of the newest record.
    free: u32,
}

/// One record in memory.
struct Record {
    bytes: [u8; RECORD],
    length: usize,
}

impl Record {
    fn empty() -> Self {
        Self { bytes: [0xFF; RECORD], length: HEADER }
    }

    /// Entries as (start, key, layout, end).
    fn entries(&self) -> impl Iterator<Item = (usize, u8, u16, usize)> + '_ {
        let mut next = HEADER;
        core::iter::from_fn(move || {
            let head = self.bytes.get(next..self.length)?.first_chunk::<ENTRY>()?;
            let [key, layout_low, layout_high, length_low, length_high] = *head;
            let start = next;
            next = start + ENTRY + usize::from(u16::from_le_bytes([length_low, length_high]));
            (next <= self.length).then_some((start, key, u16::from_le_bytes([layout_low, layout_high]), next))
        })
    }

    fn find(&self, wanted: u8) -> Option<(usize, u16, usize)> {
        self.entries().find(|&(_, key, ..)| key == wanted).map(|(start, _, layout, end)| (start, layout, end))
    }

    /// Takes an entry out.
    fn remove(&mut self, key: u8) -> bool {
        let Some((start, _, end)) = self.find(key) else { return false };
        self.bytes.copy_within(end..self.length, start);
        self.length -= end - start;
        true
    }

    /// Appends an entry; false if it does not fit.
    fn append<T: Stored>(&mut self, value: &T) -> bool {
        let start = self.length;
        let Some(room) = self.bytes.get_mut(start + ENTRY..) else { return false };
        let Ok(written) = postcard::to_slice(value, room) else { return false };
        let length = written.len();
        // At most 1024.
        let [low, high] = (length as u16).to_le_bytes();
        let [layout_low, layout_high] = T::LAYOUT.to_le_bytes();
        self.bytes[start..start + ENTRY].copy_from_slice(&[T::KEY, layout_low, layout_high, low, high]);
        self.length = start + ENTRY + length;
        true
    }

    /// Whether it has this very value.
    fn holds<T: Stored>(&self, value: &T) -> bool {
        let Some((start, layout, end)) = self.find(T::KEY) else { return false };
        let left = self.bytes.get(start + ENTRY..end).unwrap_or_default();
        layout == T::LAYOUT && serialize_with_flavor(value, Same { left }).unwrap_or(false)
    }

    /// Writes the header, and ones up to the end of the last slot.
    fn seal(&mut self, sequence: u32) -> Place {
        let length = self.length as u32;
        self.bytes[self.length..].fill(0xFF);
        self.bytes[0..4].copy_from_slice(&MAGIC);
        self.bytes[4..8].copy_from_slice(&sequence.to_le_bytes());
        self.bytes[8..12].copy_from_slice(&length.to_le_bytes());
        let sum = self.checksum();
        self.bytes[12..16].copy_from_slice(&sum.to_le_bytes());
        Place { address: 0, length, sequence }
    }

    fn checksum(&self) -> u32 {
        let mut digest = CRC32.digest();
        digest.update(&self.bytes[..12]);
        digest.update(&self.bytes[HEADER..self.length]);
        digest.finalize()
    }

    /// Sequence number and length, if `header` is one.
    fn header(header: &[u8; HEADER]) -> Option<(u32, u32)> {
        let word = |at: usize| header[at..].first_chunk().map(|word| u32::from_le_bytes(*word));
        let (sequence, length) = (word(4)?, word(8)?);
        (header[..4] == MAGIC && (HEADER as u32..=RECORD as u32).contains(&length)).then_some((sequence, length))
    }
}

/// Compares the bytes of a value with others while they are made.
struct Same<'a> {
    /// What is to come.
    left: &'a [u8],
}

impl Flavor for Same<'_> {
    type Output = bool;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        match self.left.split_first() {
            Some((&first, left)) if first == byte => self.left = left,
            _ => return Err(postcard::Error::SerializeBufferFull),
        }
        Ok(())
    }

    fn finalize(self) -> postcard::Result<bool> {
        Ok(self.left.is_empty())
    }
}

/// The first slot boundary at or after `length`.
fn whole_slots(length: u32) -> u32 {
    length.div_ceil(SLOT) * SLOT
}

impl<F: NorFlash> Store<F> {
    /// Looks for the newest record in `range`, which is two or more whole pages.
    pub async fn open(flash: F, range: Range<u32>) -> Result<Self, Error<F::Error>> {
        let page = F::ERASE_SIZE as u32;
        let words = SLOT.is_multiple_of(F::WRITE_SIZE as u32) && SLOT.is_multiple_of(F::READ_SIZE as u32);
        let whole = page as usize >= RECORD && range.start.is_multiple_of(page) && range.end.is_multiple_of(page);
        let inside = range.end as usize <= flash.capacity();
        if !(words && whole && inside) || range.end < range.start.saturating_add(2 * page) {
            return Err(Error::Range);
        }
        let mut store = Self { flash, free: range.end, range, newest: None };
        store.scan().await?;
        Ok(store)
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }

    /// The value kept; `None` if there is none.
    pub async fn load<T: Stored>(&mut self) -> Result<Option<T>, Error<F::Error>> {
        let mut record = Record::empty();
        self.fetch(&mut record).await?;
        let Some((start, layout, end)) = record.find(T::KEY) else { return Ok(None) };
        if layout != T::LAYOUT {
            return Err(Error::Layout { stored: layout, expected: T::LAYOUT });
        }
        let value = postcard::from_bytes(&record.bytes[start + ENTRY..end]).map_err(|_| Error::Value)?;
        if T::is_fit(&value) { Ok(Some(value)) } else { Err(Error::Value) }
    }

    /// Keeps `value` in place of the one before; the others stay. If the power fails meanwhile, one of both is found
    /// afterwards. What is kept already is not written again.
    pub async fn save<T: Stored>(&mut self, value: &T) -> Result<(), Error<F::Error>> {
        let mut record = Record::empty();
        self.fetch(&mut record).await?;
        if record.holds(value) {
            return Ok(());
        }
        record.remove(T::KEY);
        if !record.append(value) {
            return Err(Error::TooLarge);
        }
        self.write(&mut record).await
    }

    /// Keeps no such value any more.
    pub async fn forget<T: Stored>(&mut self) -> Result<(), Error<F::Error>> {
        let mut record = Record::empty();
        self.fetch(&mut record).await?;
        if record.remove(T::KEY) { self.write(&mut record).await } else { Ok(()) }
    }

    fn page_of(&self, address: u32) -> u32 {
        let page = F::ERASE_SIZE as u32;
        self.range.start + (address - self.range.start) / page * page
    }

    async fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), Error<F::Error>> {
        self.flash.read(address, bytes).await.map_err(Error::Flash)
    }

    /// Fills an empty record with the newest one, if there is one.
    async fn fetch(&mut self, record: &mut Record) -> Result<(), Error<F::Error>> {
        if let Some(Place { address, length, .. }) = self.newest {
            record.length = length as usize;
            self.read(address, &mut record.bytes[..whole_slots(length) as usize]).await?;
            // It was intact when it was found; a flash that forgets must not be believed.
            if record.checksum().to_le_bytes() != record.bytes[12..16] {
                return Err(Error::Verify);
            }
        }
        Ok(())
    }

    /// The record at `address`, if it is intact and ends before `end`. Read slot by slot, for it is not to be kept.
    async fn intact(&mut self, address: u32, end: u32) -> Result<Option<Place>, Error<F::Error>> {
        let mut slot = [0; SLOT as usize];
        self.read(address, &mut slot).await?;
        let Some((sequence, length)) = slot.first_chunk().and_then(Record::header) else { return Ok(None) };
        if address + whole_slots(length) > end {
            return Ok(None);
        }
        let mut digest = CRC32.digest();
        digest.update(&slot[..12]);
        let sum = [slot[12], slot[13], slot[14], slot[15]];
        digest.update(&slot[HEADER..length.min(SLOT) as usize]);
        for start in (SLOT..length).step_by(SLOT as usize) {
            self.read(address + start, &mut slot).await?;
            digest.update(&slot[..(length - start).min(SLOT) as usize]);
        }
        Ok((digest.finalize().to_le_bytes() == sum).then_some(Place { address, length, sequence }))
    }

    /// Finds the newest record and what is free behind it.
    async fn scan(&mut self) -> Result<(), Error<F::Error>> {
        let page = F::ERASE_SIZE as u32;
        for start in self.range.clone().step_by(F::ERASE_SIZE) {
            let (mut address, mut used, mut holds_newest) = (start, start, false);
            while address < start + page {
                let next = match self.intact(address, start + page).await? {
                    Some(found) => {
                        // Numbers count up; after 2^32 saves they begin anew, by which time no flash is left.
                        if self.newest.is_none_or(|newest| found.sequence > newest.sequence) {
                            self.newest = Some(found);
                            holds_newest = true;
                        }
                        address + whole_slots(found.length)
                    }
                    None => address + SLOT,
                };
                let mut slot = [0; SLOT as usize];
                self.read(next - SLOT, &mut slot).await?;
                if slot != [0xFF; SLOT as usize] || next > address + SLOT {
                    used = next;
                }
                address = next;
            }
            if holds_newest {
                self.free = used;
            }
        }
        Ok(())
    }

    /// Appends `record` to the page of the newest one, or to the page after it.
    async fn write(&mut self, record: &mut Record) -> Result<(), Error<F::Error>> {
        let page = F::ERASE_SIZE as u32;
        let mut place = record.seal(self.newest.map_or(0, |newest| newest.sequence.saturating_add(1)));
        let length = whole_slots(place.length);
        place.address = match self.newest {
            Some(newest) if self.free + length <= self.page_of(newest.address) + page => self.free,
            newest => {
                let next = newest.map_or(self.range.start, |newest| self.page_of(newest.address) + page);
                let next = if next < self.range.end { next } else { self.range.start };
                self.flash.erase(next, next + page).await.map_err(Error::Flash)?;
                next
            }
        };
        // Whatever goes wrong from here on, this place is spoilt; the next attempt takes the page after the newest record's.
        self.free = self.range.end;
        self.flash.write(place.address, &record.bytes[..length as usize]).await.map_err(Error::Flash)?;
        if self.intact(place.address, place.address + length).await? != Some(place) {
            return Err(Error::Verify);
        }
        self.newest = Some(place);
        self.free = place.address + length;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::flash::{Cut, Fault, MockFlash, run};
    use super::*;
    use crate::bonds::Bond;
    use crate::calibration::{Correction, Point};
    use nalgebra::Vector3;
    use proptest::prelude::*;
    use std::format;
    use std::string::String;

    /// As the STM32WB55: words of 8 bytes, pages of 4 KiB.
    type Flash = MockFlash<8, 4096>;
    const RANGE: Range<u32> = 0..8192;

    fn calibration(number: u32) -> Calibration {
        let mut calibration = Calibration {
            made: Some(u64::from(number)),
            accel: Correction { bias: [number as f32, 0.5, -0.5], ..Correction::default() },
            ..Calibration::default()
        };
        // As long as it can become.
        (0..8).for_each(|i| calibration.gyro.learn(10.0 * i as f32, &Vector3::repeat(0.01), 1e-3));
        calibration
    }

    fn parameters(number: u32) -> Parameters {
        Parameters { start_after_s: number as f32, ..Parameters::default() }
    }

    /// As many as there can be, as long as they can become.
    fn bonds(number: u8) -> Bonds {
        let mut bonds = Bonds::NONE;
        for number in number..number + 4 {
            let (address, key) = ([number; 6], [!number; 16]);
            bonds.add(Bond { address_kind: 1, address, identity_key: Some([number; 16]), long_term_key: key });
        }
        bonds
    }

    fn open(flash: Flash) -> Store<Flash> {
        run(Store::open(flash, RANGE)).unwrap()
    }

    /// What is kept, by its number.
    fn kept(store: &mut Store<Flash>) -> (Option<u32>, Option<u32>) {
        let calibration = run(store.load::<Calibration>()).unwrap().map(|found| found.made.unwrap() as u32);
        let parameters = run(store.load::<Parameters>()).unwrap().map(|found| found.start_after_s as u32);
        (calibration, parameters)
    }

    /// Saves calibrations and parameters in turn until the power fails; what was kept last and what was being written.
    fn saves(store: &mut Store<Flash>, numbers: Range<u32>) -> ((Option<u32>, Option<u32>), Option<u32>) {
        let mut last = kept(store);
        for number in numbers {
            let calibration_next = number % 2 == 0;
            let result = match calibration_next {
                true => run(store.save(&calibration(number))),
                false => run(store.save(&parameters(number))),
            };
            match result {
                Ok(()) if calibration_next => last.0 = Some(number),
                Ok(()) => last.1 = Some(number),
                Err(error) => {
                    assert_eq!(error, Error::Flash(Fault::Power));
                    return (last, Some(number));
                }
            }
        }
        (last, None)
    }

    /// Whether what is kept is what was kept before or what was being written.
    fn old_or_new(found: (Option<u32>, Option<u32>), last: (Option<u32>, Option<u32>), flying: Option<u32>) -> bool {
        let next = match flying {
            Some(number) if number % 2 == 0 => (flying, last.1),
            Some(_) => (last.0, flying),
            None => last,
        };
        found == last || found == next
    }

    #[test]
    fn what_was_saved_is_found_again_through_many_pages() {
        let mut store = open(Flash::new(2));
        assert_eq!(kept(&mut store), (None, None));
        for number in 0..100 {
            run(store.save(&calibration(number))).unwrap();
            run(store.save(&parameters(number + 7))).unwrap();
            store = open(store.into_flash());
            assert_eq!(kept(&mut store), (Some(number), Some(number + 7)));
        }
        assert_eq!(run(store.load::<Calibration>()).unwrap(), Some(calibration(99)));
        run(store.forget::<Calibration>()).unwrap();
        store = open(store.into_flash());
        assert_eq!(kept(&mut store), (None, Some(106)));
    }

    #[test]
    fn bonds_are_kept_beside_the_others_and_a_cut_leaves_the_old_or_the_new() {
        let mut store = open(Flash::new(2));
        run(store.save(&calibration(1))).unwrap();
        run(store.save(&parameters(2))).unwrap();
        run(store.save(&bonds(3))).unwrap();
        for fuel in 0..200 {
            let mut flash = store.into_flash();
            flash.fail_after(fuel, Cut::During(128), u64::from(fuel));
            store = open(flash);
            let before = run(store.load::<Bonds>()).unwrap().unwrap();
            let next = bonds(4 + fuel as u8);
            let whole = run(store.save(&next)).is_ok();
            let mut flash = store.into_flash();
            flash.restore();
            store = open(flash);
            let after = run(store.load::<Bonds>()).unwrap().unwrap();
            assert!(after == next || !whole && after == before, "cut at {fuel}");
            assert_eq!(kept(&mut store), (Some(1), Some(2)));
        }
    }

    #[test]
    fn what_is_kept_already_is_not_written_again() {
        let mut store = open(Flash::new(2));
        run(store.save(&calibration(1))).unwrap();
        let flash = store.into_flash();
        let operations = flash.operations;
        let mut store = open(flash);
        run(store.save(&calibration(1))).unwrap();
        run(store.forget::<Parameters>()).unwrap();
        assert_eq!(store.into_flash().operations, operations);
    }

    #[test]
    fn a_cut_in_any_operation_leaves_the_old_or_the_new() {
        let cuts = [Cut::Before].into_iter().chain([2, 30, 128, 192, 250].map(Cut::During));
        // Twelve saves go through both pages and back into the first.
        let mut whole = open(Flash::new(2));
        saves(&mut whole, 0..12);
        let operations = whole.into_flash().operations;
        assert!(operations > 500, "{operations}");
        for fuel in 0..operations {
            for (seed, cut) in cuts.clone().enumerate() {
                let mut flash = Flash::new(2);
                flash.fail_after(fuel, cut, u64::from(fuel) * 8 + seed as u64);
                let mut store = open(flash);
                let (last, flying) = saves(&mut store, 0..12);
                let mut flash = store.into_flash();
                flash.restore();
                let mut store = open(flash);
                let found = kept(&mut store);
                assert!(old_or_new(found, last, flying), "cut {cut:?} at {fuel}: {found:?}, {last:?}, {flying:?}");
                // It goes on as if nothing had happened.
                run(store.save(&calibration(1000))).unwrap();
                run(store.save(&parameters(1001))).unwrap();
                let mut store = open(store.into_flash());
                assert_eq!(kept(&mut store), (Some(1000), Some(1001)), "cut {cut:?} at {fuel}");
            }
        }
    }

    #[test]
    fn other_layouts_and_broken_values_are_refused_and_can_be_replaced() {
        #[derive(serde::Serialize, serde::Deserialize)]
        struct Later(u8);
        impl Stored for Later {
            const KEY: u8 = Calibration::KEY;
            const LAYOUT: u16 = 2;
        }
        #[derive(serde::Serialize, serde::Deserialize)]
        struct Short(u8);
        impl Stored for Short {
            const KEY: u8 = Calibration::KEY;
            const LAYOUT: u16 = Calibration::LAYOUT;
        }
        let mut store = open(Flash::new(2));
        run(store.save(&Later(3))).unwrap();
        assert_eq!(run(store.load::<Calibration>()), Err(Error::Layout { stored: 2, expected: 1 }));
        run(store.save(&Short(3))).unwrap();
        assert_eq!(run(store.load::<Calibration>()), Err(Error::Value));
        let unfit = Calibration { mounting: Some([f32::NAN; 4]), ..Calibration::default() };
        run(store.save(&unfit)).unwrap();
        assert_eq!(run(store.load::<Calibration>()), Err(Error::Value));
        let mut unfit = Parameters::default();
        (unfit.stance.floor, unfit.stance.ceiling) = (10.0, 1.0);
        run(store.save(&unfit)).unwrap();
        assert_eq!(run(store.load::<Parameters>()), Err(Error::Value));
        run(store.forget::<Parameters>()).unwrap();
        run(store.save(&calibration(5))).unwrap();
        assert_eq!(kept(&mut store), (Some(5), None));
    }

    #[test]
    fn a_wrong_range_and_a_value_too_large_are_refused() {
        let reversed = core::ops::Range { start: 8192, end: 0 };
        for range in [0..4096, 0..6000, 100..8292, 4096..12288, reversed] {
            assert_eq!(run(Store::open(Flash::new(2), range)).err(), Some(Error::Range));
        }
        #[derive(serde::Serialize, serde::Deserialize)]
        struct Large([[u8; 32]; 32]);
        impl Stored for Large {
            const KEY: u8 = 9;
            const LAYOUT: u16 = 1;
        }
        #[derive(serde::Serialize, serde::Deserialize)]
        struct Medium([[u8; 32]; 25]);
        impl Stored for Medium {
            const KEY: u8 = 9;
            const LAYOUT: u16 = 1;
        }
        let mut store = open(Flash::new(2));
        run(store.save(&calibration(5))).unwrap();
        assert_eq!(run(store.save(&Large([[1; 32]; 32]))), Err(Error::TooLarge));
        assert_eq!(run(store.save(&Medium([[1; 32]; 25]))), Err(Error::TooLarge));
        assert_eq!(kept(&mut store), (Some(5), None));
    }

    /// Names of the fields and number of bytes: a change of layout that forgets its number shows here.
    fn layout<T: core::fmt::Debug + Serialize>(value: &T) -> (u32, usize) {
        let text = format!("{value:?}");
        let fields = text.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':'));
        let names: String = fields.filter(|word| word.ends_with(':')).collect();
        let mut bytes = [0; PAYLOAD];
        (CRC32.checksum(names.as_bytes()), postcard::to_slice(value, &mut bytes).unwrap().len())
    }

    #[test]
    fn the_layouts_are_those_of_their_numbers() {
        // When one of these changes, its `LAYOUT` needs the next number, and then this line the new figures.
        assert_eq!((Calibration::LAYOUT, layout(&calibration(1))), (1, (1_302_369_335, 251)));
        assert_eq!((Parameters::LAYOUT, layout(&Parameters::default())), (3, (828_929_439, 359)));
        assert_eq!((Bonds::LAYOUT, layout(&bonds(1))), (1, (609_160_294, 161)));
        let all = layout(&calibration(u32::MAX)).1 + layout(&Parameters::default()).1 + layout(&bonds(1)).1 + 3 * ENTRY;
        assert!(all <= PAYLOAD, "{all}");
        let _: Point = *calibration(1).gyro.points().next().unwrap();
    }

    /// What happens to a shoe.
    #[derive(Clone, Debug)]
    enum Event {
        Calibration(u32),
        Parameters(u32),
        ForgetCalibration,
        ForgetParameters,
        Reboot,
        Cut(u32, Cut, u64),
    }

    fn event() -> impl Strategy<Value = Event> {
        prop_oneof![
            3 => (0_u32..1000).prop_map(Event::Calibration),
            3 => (0_u32..1000).prop_map(Event::Parameters),
            1 => Just(Event::ForgetCalibration),
            1 => Just(Event::ForgetParameters),
            1 => Just(Event::Reboot),
            3 => (0_u32..300, any::<u8>(), any::<u64>()).prop_map(|(fuel, how, seed)| {
                Event::Cut(fuel, if how < 64 { Cut::Before } else { Cut::During(how) }, seed)
            }),
        ]
    }

    proptest! {
        #[test]
        fn it_keeps_what_a_model_keeps_through_any_number_of_cuts(events in proptest::collection::vec(event(), 1..60)) {
            let mut store = open(Flash::new(2));
            let mut model = (None, None);
            for event in events {
                let (result, next) = match event {
                    Event::Calibration(number) => (run(store.save(&calibration(number))), (Some(number), model.1)),
                    Event::Parameters(number) => (run(store.save(&parameters(number))), (model.0, Some(number))),
                    Event::ForgetCalibration => (run(store.forget::<Calibration>()), (None, model.1)),
                    Event::ForgetParameters => (run(store.forget::<Parameters>()), (model.0, None)),
                    Event::Reboot => {
                        store = open(store.into_flash());
                        (Ok(()), model)
                    }
                    Event::Cut(fuel, cut, seed) => {
                        let mut flash = store.into_flash();
                        flash.fail_after(fuel, cut, seed);
                        store = open(flash);
                        (Ok(()), model)
                    }
                };
                if result.is_err() {
                    let mut flash = store.into_flash();
                    flash.restore();
                    store = open(flash);
                    let found = kept(&mut store);
                    prop_assert!(found == model || found == next, "{:?} {:?} {:?}", found, model, next);
                    model = found;
                } else {
                    model = next;
                }
                prop_assert_eq!(kept(&mut store), model);
            }
        }

        #[test]
        fn whatever_stands_in_the_flash_is_no_value_and_can_be_overwritten(
            spoilt in proptest::collection::vec((any::<usize>(), any::<u8>()), 0..400),
            saved in 0_u32..20,
        ) {
            let mut store = open(Flash::new(2));
            (0..saved).for_each(|number| run(store.save(&calibration(number))).unwrap());
            let mut flash = store.into_flash();
            spoilt.iter().for_each(|&(place, byte)| flash.spoil(place, byte));
            let mut store = open(flash);
            let found = kept(&mut store);
            prop_assert!(found.0.is_none_or(|number| number < saved) && found.1.is_none());
            run(store.save(&calibration(77))).unwrap();
            let mut store = open(store.into_flash());
            prop_assert_eq!(kept(&mut store).0, Some(77));
        }
    }
}
