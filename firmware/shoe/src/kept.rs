//! The last words of a program that stopped, kept in memory over the reset that follows.
//!
//! RAM keeps its content while the power stays, and the section `.uninit` is not cleared at boot. After a power-on it is
//! noise, which the checksum tells from words.

use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::ptr;
use heapless::String;
use sohle_shared::checksum::CRC32;

/// As long as a line of the log. **Units:** bytes.
const LENGTH: usize = 120;

/// The text in memory.
#[derive(Clone, Copy)]
#[repr(C)]
struct Words {
    checksum: u32,
    length: u32,
    text: [u8; LENGTH],
}

#[unsafe(link_section = ".uninit.kept")]
static mut WORDS: MaybeUninit<Words> = MaybeUninit::uninit();

/// Collects a text, cut where the space ends.
struct Pen(Words);

impl Write for Pen {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for character in text.chars() {
            let length = self.0.length as usize;
            let Some(room) = self.0.text.get_mut(length..length + character.len_utf8()) else { return Ok(()) };
            character.encode_utf8(room);
            self.0.length += character.len_utf8() as u32;
        }
        Ok(())
    }
}

impl Words {
    /// The text, if there are so many bytes.
    fn text(&self) -> Option<&[u8]> {
        self.text.get(..self.length as usize)
    }

    fn sum(text: &[u8]) -> u32 {
        let mut digest = CRC32.digest();
        // No text at all must not look like one that is kept in memory full of zeros.
        digest.update(b"kept");
        digest.update(text);
        digest.finalize()
    }
}

/// Keeps a text over the reset. To be followed by one.
pub(crate) fn keep(text: fmt::Arguments<'_>) {
    let mut pen = Pen(Words { checksum: 0, length: 0, text: [0; LENGTH] });
    // The pen never fails, it only runs dry.
    let _ = pen.write_fmt(text);
    let mut words = pen.0;
    words.checksum = words.text().map_or(0, Words::sum);
    // SAFETY: only the dying program writes here, with interrupts masked, and nobody holds a reference.
    unsafe { ptr::write_volatile((&raw mut WORDS).cast(), words) }
}

/// What the program said before the reset, once. To be called at boot.
pub fn take() -> Option<String<LENGTH>> {
    // SAFETY: any bits are a valid `Words`, and before the tasks are started nobody else reads or writes them. What was
    // not written since the power came is noise, which a volatile read takes from the memory as it is.
    let words: Words = unsafe { ptr::read_volatile((&raw const WORDS).cast()) };
    // SAFETY: as above; forgets the words.
    unsafe { ptr::write_volatile((&raw mut WORDS).cast::<u32>(), !words.checksum) }
    let text = words.text().filter(|text| Words::sum(text) == words.checksum)?;
    core::str::from_utf8(text).ok().and_then(|text| String::try_from(text).ok())
}
