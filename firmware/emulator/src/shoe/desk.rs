//! What the machine that runs the emulator gives: files, words of the command line, and the time.
//!
//! # Source
//! Arm, "Semihosting for AArch32 and AArch64" (IHI 0100).

use cortex_m_semihosting::{nr, syscall};

/// An open file.
#[derive(Clone, Copy, Debug)]
pub struct File(usize);

/// How a file is opened, by the number of the C library's mode.
#[derive(Clone, Copy)]
enum Mode {
    /// "rb".
    Read = 1,
    /// "r+b": it must be there.
    #[cfg(feature = "ble")]
    Change = 3,
    /// "w+b": it becomes empty.
    #[cfg(feature = "ble")]
    Create = 7,
}

impl File {
    /// Opens a file to be read; the name need not end in a zero.
    pub fn open(name: &[u8]) -> Option<Self> {
        Self::open_as(name, Mode::Read)
    }

    /// Opens a file to be read and written; whether it is new, and empty then.
    #[cfg(feature = "ble")]
    pub fn change(name: &[u8]) -> Option<(Self, bool)> {
        let old = Self::open_as(name, Mode::Change).map(|file| (file, false));
        old.or_else(|| Some((Self::open_as(name, Mode::Create)?, true)))
    }

    fn open_as(name: &[u8], mode: Mode) -> Option<Self> {
        let mut text = [0_u8; 512];
        text.get_mut(..name.len())?.copy_from_slice(name);
        // SAFETY: the host reads so many bytes of the name, and the zero after them.
        let file = unsafe { syscall!(OPEN, text.as_ptr(), mode as usize, name.len()) };
        (file != usize::MAX).then_some(Self(file))
    }

    fn seek(self, offset: usize) -> Option<()> {
        // SAFETY: numbers only.
        (unsafe { syscall!(SEEK, self.0, offset) } == 0).then_some(())
    }

    /// Reads what is there from this place of the file on.
    pub fn read(self, offset: usize, buffer: &mut [u8]) -> Option<()> {
        self.seek(offset)?;
        // SAFETY: the host writes at most so many bytes to the buffer.
        let unread = unsafe { syscall!(READ, self.0, buffer.as_mut_ptr(), buffer.len()) };
        (unread < buffer.len()).then_some(())
    }

    /// Writes all of this at this place of the file.
    #[cfg(feature = "ble")]
    pub fn write(self, offset: usize, bytes: &[u8]) -> Option<()> {
        self.seek(offset)?;
        // SAFETY: the host reads so many bytes.
        let unwritten = unsafe { syscall!(WRITE, self.0, bytes.as_ptr(), bytes.len()) };
        (unwritten == 0).then_some(())
    }
}

/// Length of what the emulator was told as the program's arguments.
fn command_line(buffer: &mut [u8]) -> Option<usize> {
    let mut block = [buffer.as_mut_ptr() as usize, buffer.len()];
    // SAFETY: the host writes at most so many bytes to the buffer, and the length to the block; both are alive.
    let failed = unsafe { cortex_m_semihosting::syscall1(nr::GET_CMDLINE, block.as_mut_ptr() as usize) };
    let [_, length] = block;
    (failed == 0).then_some(length)
}

/// The program's arguments; the first word stands for the program.
fn arguments(buffer: &mut [u8]) -> Option<&[u8]> {
    let length = command_line(buffer)?;
    let line = buffer.get(..length)?;
    line.get(line.iter().position(|&byte| byte == b' ')? + 1..)
}

/// Name of the file with the walk: the only argument, spaces and all.
#[cfg(not(feature = "ble"))]
pub fn walk(buffer: &mut [u8]) -> Option<&[u8]> {
    arguments(buffer)
}

/// Name of the file with the walk: all but the last argument.
#[cfg(feature = "ble")]
pub fn walk(buffer: &mut [u8]) -> Option<&[u8]> {
    split(buffer).map(|(walk, _)| walk)
}

/// Name of the file that is the flash: the last argument.
#[cfg(feature = "ble")]
pub fn flash(buffer: &mut [u8]) -> Option<&[u8]> {
    split(buffer).map(|(_, flash)| flash)
}

#[cfg(feature = "ble")]
fn split(buffer: &mut [u8]) -> Option<(&[u8], &[u8])> {
    let line = arguments(buffer)?;
    let (walk, flash) = line.split_at_checked(line.iter().rposition(|&byte| byte == b' ')?)?;
    Some((walk, flash.get(1..)?))
}

/// A number that differs from boot to boot: the seconds of the wall clock, and the hundredths that this program has run.
#[cfg(feature = "ble")]
pub fn moment() -> u64 {
    // SAFETY: both take no argument.
    let (seconds, hundredths) = unsafe { (syscall!(TIME), syscall!(CLOCK)) };
    (seconds as u64) << 32 | hundredths as u64
}
