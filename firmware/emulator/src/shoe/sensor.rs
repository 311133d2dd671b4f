//! The sensor that is not there: its twin, fed with the counts of a walk from a file on the host.

use super::desk::{self, File};
use core::cell::RefCell;
use embassy_time::Timer;
use embedded_hal::digital::{Error, ErrorKind, ErrorType};
use embedded_hal::spi::{self, Operation, SpiDevice};
use embedded_hal_async::digital::Wait;
use sohle_shared::bmx055::Die;
use sohle_shared::bmx055::counts::{HEADER_BYTES, Header, PAIR_BYTES, pair_from_bytes};
use sohle_shared::bmx055::twin::{BusFault, Chip, SimulatedBmx055, SimulatedDevice};
use sohle_tasks::{instant, now};

/// Pairs of frames that are fetched at once.
const PAIRS: usize = 64;

/// How long the foot stands still before the walk begins and after it has ended is the recording's affair; beyond its ends
/// the first and the last pair are repeated.
pub struct Walk {
    file: File,
    header: Header,
    readers: [Reader; 2],
}

/// The place of one die in the file.
#[derive(Clone, Copy)]
struct Reader {
    die: Die,
    period_ns: u64,
    /// Number of the first pair in `bytes`.
    first: u32,
    bytes: [u8; PAIRS * PAIR_BYTES],
    filled: bool,
}

impl Walk {
    /// Opens the file that the emulator's command line names; `None` if there is no such walk.
    pub fn open() -> Option<Self> {
        let mut line = [0_u8; 512];
        let file = File::open(desk::walk(&mut line)?)?;
        let mut header = [0; HEADER_BYTES];
        file.read(0, &mut header)?;
        let header = Header::from_bytes(&header).filter(|header| header.pairs > 0)?;
        let reader = |die, period_ns: u32| Reader {
            die,
            period_ns: u64::from(period_ns),
            first: 0,
            bytes: [0; PAIRS * PAIR_BYTES],
            filled: false,
        };
        let readers = [reader(Die::Accel, header.accel_period_ns), reader(Die::Gyro, header.gyro_period_ns)];
        Some(Self { file, header, readers })
    }

    /// Periods of both dies.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// What the die reads at this time. **Units:** ns since the power came.
    pub fn counts(&mut self, die: Die, time_ns: u64) -> [i16; 3] {
        let last = self.header.pairs - 1;
        let Some(reader) = self.readers.iter_mut().find(|reader| reader.die == die) else { return [0; 3] };
        let pair = u32::try_from(time_ns / reader.period_ns).unwrap_or(last).min(last);
        let missing = pair.checked_sub(reader.first).is_none_or(|at| at as usize >= PAIRS);
        if missing || !reader.filled {
            reader.first = pair;
            let offset = HEADER_BYTES + pair as usize * PAIR_BYTES;
            reader.filled = self.file.read(offset, &mut reader.bytes).is_some();
        }
        let at = (pair - reader.first) as usize * PAIR_BYTES;
        let bytes = reader.bytes.get(at..).and_then(|rest| rest.first_chunk());
        let (accel, gyro) = bytes.map_or(([0; 3], [0; 3]), pair_from_bytes);
        match die {
            Die::Accel => accel,
            Die::Gyro => gyro,
        }
    }
}

/// The bus as one chip select sees it: time passes on the sensor as it does here.
pub struct Bus<S: 'static> {
    twin: &'static RefCell<SimulatedBmx055<S>>,
    device: SimulatedDevice<'static, S>,
}

impl<S> Bus<S> {
    /// The chip select of `chip`.
    pub fn new(twin: &'static RefCell<SimulatedBmx055<S>>, chip: Chip) -> Self {
        Self { twin, device: SimulatedDevice::new(twin, chip) }
    }
}

impl<S> spi::ErrorType for Bus<S> {
    type Error = BusFault;
}

impl<S: FnMut(Die, u64) -> [i16; 3]> SpiDevice for Bus<S> {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusFault> {
        self.twin.try_borrow_mut().map_err(|_| BusFault)?.advance_to(now());
        self.device.transaction(operations)
    }
}

/// The pin that a die's watermark drives.
pub struct Pin<S: 'static> {
    twin: &'static RefCell<SimulatedBmx055<S>>,
    die: Die,
}

impl<S> Pin<S> {
    /// The pin of `die`.
    pub fn new(twin: &'static RefCell<SimulatedBmx055<S>>, die: Die) -> Self {
        Self { twin, die }
    }
}

/// The twin was in use while its pin was looked at.
#[derive(Clone, Copy, Debug)]
pub struct InUse;

impl Error for InUse {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl<S> ErrorType for Pin<S> {
    type Error = InUse;
}

impl<S: FnMut(Die, u64) -> [i16; 3]> Wait for Pin<S> {
    async fn wait_for_high(&mut self) -> Result<(), InUse> {
        loop {
            let next = {
                let mut twin = self.twin.try_borrow_mut().map_err(|_| InUse)?;
                twin.advance_to(now());
                if twin.take_interrupt(self.die).is_some() {
                    return Ok(());
                }
                twin.next_interrupt(self.die)
            };
            match next {
                Some(time) => Timer::at(instant(time)).await,
                // None will come before somebody sets the die up.
                None => core::future::pending().await,
            }
        }
    }

    async fn wait_for_low(&mut self) -> Result<(), InUse> {
        // The pin is low whenever its interrupt was taken.
        Ok(())
    }

    async fn wait_for_rising_edge(&mut self) -> Result<(), InUse> {
        self.wait_for_high().await
    }

    async fn wait_for_falling_edge(&mut self) -> Result<(), InUse> {
        Ok(())
    }

    async fn wait_for_any_edge(&mut self) -> Result<(), InUse> {
        self.wait_for_high().await
    }
}
