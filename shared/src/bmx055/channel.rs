//! One die of the two that feed the tracker: its states, its FIFO, its faults.

use super::batch::{BATCH_FRAMES, Batch, Die, DieCounters};
use super::config::{AccelConfig, GyroConfig, SETTINGS, Setting};
use super::port::{self, Error};
use super::registers::{accel, both, gyro};
use crate::time::Micros;
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;
use heapless::Vec;

/// What a die is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// It is to be reset.
    Reset,
    /// It starts up and must not be spoken to.
    Wait,
    /// It is to be identified, and its registers written and read back.
    Configure,
    /// It delivers frames.
    Run,
    /// It delivers nothing, to save power.
    Asleep,
    /// It could not be reset or set up; tried again after a while.
    Fault,
}

/// Failures in a row after which a die is reset.
const FAILURES_MAX: u8 = 10;

/// Pause after a reset or a set-up that failed. **Units:** microseconds.
const FAULT_US: i64 = 100_000;

/// From one check of a register to the next. **Units:** microseconds.
const CHECK_US: i64 = 100_000;

/// Added to the start-up time of the data sheet: the die starts slower when its supply has just come. **Units:**
/// microseconds.
const BOOT_MARGIN_US: i64 = 1_200;

/// Wait after a write, 2 us by the data sheet (BMI088, table 12). **Units:** microseconds.
pub(super) const WRITE_US: u32 = 5;

/// The same for a die that sleeps then, 450 us by the data sheet (BMI088, table 13). **Units:** microseconds.
pub(super) const ASLEEP_US: u32 = 500;

/// Bytes of a frame.
const FRAME: usize = 6;

/// What comes out of a FIFO that has nothing: this on every axis (BMI088, 5.5.17). On one axis it is the end of the range.
const INVALID: i16 = i16::MIN;

/// Frames that may come while others are read. When fewer are missing to the watermark, the interrupt line may never have
/// fallen, and the die is asked again.
const MARGIN: usize = 4;

/// So often the FIFO is asked for one interrupt. Each time it is emptied but for some frames, and it does not fill as fast as
/// it is read: one that still has a watermark then does not count its frames.
const ROUNDS_MAX: usize = 8;

/// What came of a burst.
enum Burst {
    /// Its frames were handed out.
    Whole,
    /// The die was reset before its end: it is none of ours.
    Reset,
    /// The FIFO ran over before its end: the oldest frame made room for the newest while it was read, and what was read after
    /// that is out of step.
    Torn,
}

/// A die and what is known of it.
#[derive(Debug)]
pub(super) struct Channel<SPI> {
    spi: SPI,
    die: Die,
    id: u8,
    boot_us: i64,
    settings: [Setting; SETTINGS],
    /// Frames from one interrupt to the next.
    watermark: usize,
    /// By the data sheet. **Units:** microseconds.
    period_us: i64,
    /// From the last frame of a batch to the time when the next interrupt must have been seen. **Units:** microseconds.
    patience_us: i64,
    state: State,
    /// When the state ends; in [`State::Run`] when the next register is checked.
    due: Micros,
    /// When the FIFO is read though nobody told of it.
    overdue: Micros,
    /// Such a read follows a failure: no interrupt is missing.
    retry: bool,
    /// Stamp of the last frame read.
    last: Micros,
    /// Setting that is checked next.
    checked: usize,
    failures: u8,
    lost: bool,
    sequence: u32,
    counters: DieCounters,
}

impl<SPI> Channel<SPI> {
    /// The accelerometer.
    pub fn accel(spi: SPI, config: &AccelConfig) -> Self {
        let watermark = config.watermark_bits();
        let facts = (Die::Accel, accel::ID, accel::BOOT_US, accel::FIFO_DEPTH);
        Self::new(spi, facts, config.settings(), watermark, config.period_us())
    }

    /// The gyroscope.
    pub fn gyro(spi: SPI, config: &GyroConfig) -> Self {
        let watermark = config.watermark_bits();
        let facts = (Die::Gyro, gyro::ID, gyro::BOOT_US, gyro::FIFO_DEPTH_STREAM);
        Self::new(spi, facts, config.settings(), watermark, config.period_us())
    }

    fn new(
        spi: SPI,
        (die, id, boot_us, depth): (Die, u8, u32, usize),
        settings: [Setting; SETTINGS],
        watermark: u8,
        period_us: u32,
    ) -> Self {
        let watermark = usize::from(watermark);
        let period_us = i64::from(period_us);
        // Half of a watermark late, or half of the room that is left.
        let late = (watermark.min(depth.saturating_sub(watermark)) / 2).max(1);
        Self {
            spi,
            die,
            id,
            boot_us: i64::from(boot_us) + BOOT_MARGIN_US,
            settings,
            watermark,
            period_us,
            patience_us: (watermark + late) as i64 * period_us,
            state: State::Reset,
            due: Micros(i64::MIN),
            overdue: Micros(i64::MAX),
            retry: false,
            last: Micros(i64::MIN),
            checked: 0,
            failures: 0,
            lost: false,
            sequence: 0,
            counters: DieCounters::default(),
        }
    }

    pub fn state(&self) -> State {
        self.state
    }

    pub fn counters(&self) -> &DieCounters {
        &self.counters
    }

    /// When [`Channel::poll`] has something to do.
    pub fn due(&self) -> Micros {
        if self.state == State::Run { self.due.min(self.overdue) } else { self.due }
    }

    /// What the registers hold after `later` was written: first that, then what it left as it was.
    pub fn settings_after<const N: usize>(&self, later: [Setting; N]) -> impl Iterator<Item = Setting> + use<N, SPI> {
        let is_kept = move |setting: &Setting| later.iter().all(|other| other.register != setting.register);
        later.into_iter().chain(self.settings.into_iter().filter(is_kept))
    }

    /// The bus, for what has nothing to do with frames.
    pub fn spi(&mut self) -> &mut SPI {
        &mut self.spi
    }

    /// Sets the die up anew as soon as possible, because something went wrong.
    pub fn restart(&mut self, now: Micros) {
        self.set_up(now);
        self.counters.restarts = self.counters.restarts.saturating_add(1);
    }

    fn set_up(&mut self, now: Micros) {
        self.state = State::Reset;
        self.due = now;
        self.failures = 0;
        self.retry = false;
        self.lost = true;
    }

    /// It was told to sleep, and is looked at next at `due`.
    pub fn doze(&mut self, due: Micros) {
        (self.state, self.due, self.overdue) = (State::Asleep, due, Micros(i64::MAX));
    }

    /// Ends the sleep: the die is set up anew. Its frames go on after a gap.
    pub fn wake(&mut self, now: Micros) {
        self.set_up(now);
    }

    /// Counts what went wrong.
    pub fn count(&mut self, error: Error) {
        let counter = match error {
            Error::Bus(_) => &mut self.counters.bus_errors,
            Error::Identification { .. } => &mut self.counters.bad_ids,
            Error::ReadBack { .. } => &mut self.counters.readback_errors,
            Error::NotReady => return,
        };
        *counter = counter.saturating_add(1);
    }

    /// **Units:** microseconds.
    fn watermark_us(&self) -> i64 {
        self.watermark as i64 * self.period_us
    }

    /// From a frame to the one `frames` later, at least (`early`) or at most: 1 % off the data sheet. **Units:**
    /// microseconds.
    fn span_us(&self, frames: usize, early: bool) -> i64 {
        let nominal = frames as i64 * self.period_us;
        if early { nominal - nominal / 100 } else { nominal + nominal / 100 }
    }

    /// A read failed at about `now`.
    fn fail(&mut self, now: Micros) {
        self.failures = self.failures.saturating_add(1);
        self.retry = true;
        self.overdue = now + (self.watermark_us() / 4).max(self.period_us);
    }
}

impl<SPI: SpiDevice> Channel<SPI> {
    /// Does what is due.
    pub async fn poll(
        &mut self,
        now: Micros,
        temperature: Option<i8>,
        delay: &mut impl DelayNs,
        sink: &mut impl FnMut(&Batch),
    ) {
        if now < self.due() {
            return;
        }
        match self.state {
            State::Reset => {
                let reset = port::write(&mut self.spi, both::RESET, both::RESET_COMMAND).await;
                self.enter(reset, State::Wait, now, self.boot_us);
            }
            State::Wait => (self.state, self.due) = (State::Configure, now),
            State::Configure => {
                let configured = self.configure(delay).await;
                self.enter(configured, State::Run, now, CHECK_US);
                // The first frame may come at once.
                self.last = now + -self.watermark_us();
                self.overdue = now + self.patience_us;
            }
            State::Run => self.run(now, temperature, delay, sink).await,
            State::Asleep => {}
            State::Fault => self.restart(now),
        }
    }

    /// Goes on to `next` for `duration_us`, or to [`State::Fault`].
    fn enter(&mut self, result: Result<(), Error>, next: State, now: Micros, duration_us: i64) {
        match result {
            Ok(()) => (self.state, self.due) = (next, now + duration_us),
            Err(error) => {
                self.count(error);
                (self.state, self.due) = (State::Fault, now + FAULT_US);
            }
        }
    }

    async fn configure(&mut self, delay: &mut impl DelayNs) -> Result<(), Error> {
        port::identify(&mut self.spi, both::CHIP_ID, self.id).await?;
        for setting in self.settings {
            self.set(setting, WRITE_US, delay).await?;
        }
        // A supply that dropped in between has taken back what was written before.
        for setting in self.settings {
            self.verify(setting).await?;
        }
        Ok(())
    }

    /// Whether the die was reset since it was set up: then its interrupt is off, and what it measures has another weight.
    /// Asked after something was read, it tells of all that was read before.
    async fn was_reset(&mut self) -> Result<bool, Error> {
        let [.., interrupt, _] = self.settings;
        Ok(!self.holds(interrupt).await?)
    }

    /// What a register that nobody writes reads; `None` from a die that was reset, which is set up anew then.
    pub async fn look_up(&mut self, register: u8, now: Micros) -> Result<Option<u8>, Error> {
        let read = port::read_one(&mut self.spi, register).await?;
        if self.was_reset().await? {
            self.restart(now);
            return Ok(None);
        }
        Ok(Some(read))
    }

    /// Writes a register and, `wait_us` later, reads it back. **Units:** microseconds.
    pub async fn set(&mut self, setting: Setting, wait_us: u32, delay: &mut impl DelayNs) -> Result<(), Error> {
        port::write(&mut self.spi, setting.register, setting.value).await?;
        delay.delay_us(wait_us).await;
        self.verify(setting).await
    }

    /// Whether a register holds what was written.
    pub async fn verify(&mut self, setting: Setting) -> Result<(), Error> {
        let read = port::read_one(&mut self.spi, setting.register).await?;
        if (read ^ setting.value) & setting.mask == 0 {
            return Ok(());
        }
        Err(Error::ReadBack { register: setting.register, expected: setting.value, read })
    }

    async fn run(
        &mut self,
        now: Micros,
        temperature: Option<i8>,
        delay: &mut impl DelayNs,
        sink: &mut impl FnMut(&Batch),
    ) {
        if now >= self.overdue
            && let Err(error) = self.drain(now, temperature, delay, sink).await
        {
            self.count(error);
            self.fail(now);
        }
        if self.state == State::Run && now >= self.due {
            self.due = now + CHECK_US;
            if self.changed().await {
                return self.restart(now);
            }
        }
        if self.failures >= FAILURES_MAX {
            self.restart(now);
        }
    }

    /// Whether the next register in turn does not hold what was written: the die was disturbed, and its counts may have
    /// another weight.
    async fn changed(&mut self) -> bool {
        let Some(&setting) = self.settings.get(self.checked) else { return false };
        self.checked = (self.checked + 1) % SETTINGS;
        self.holds(setting).await.map_or_else(
            |error| {
                self.count(error);
                self.failures = self.failures.saturating_add(1);
                false
            },
            |holds| !holds,
        )
    }

    /// Whether a register holds what was written; not, if it is so twice.
    async fn holds(&mut self, setting: Setting) -> Result<bool, Error> {
        for _ in 0..2 {
            match self.verify(setting).await {
                Ok(()) => return Ok(true),
                Err(error @ Error::Bus(_)) => return Err(error),
                Err(error) => self.count(error),
            }
        }
        Ok(false)
    }

    /// Empties the FIFO though no interrupt told of it.
    async fn drain(
        &mut self,
        now: Micros,
        temperature: Option<i8>,
        delay: &mut impl DelayNs,
        sink: &mut impl FnMut(&Batch),
    ) -> Result<(), Error> {
        let retry = core::mem::take(&mut self.retry);
        if !retry {
            self.counters.missed_interrupts = self.counters.missed_interrupts.saturating_add(1);
        }
        let (frames, overrun) = self.stored().await?;
        if frames == 0 || frames < self.watermark && !retry {
            // It stands, or is much slower than it should be.
            self.fail(now);
            return Ok(());
        }
        if overrun {
            return self.start_over(now, delay).await;
        }
        let mut left = frames;
        while left > 0 {
            let next = left.min(BATCH_FRAMES);
            left -= next;
            // The last frame may have come after `now` was read from the clock.
            let stamp = now + (self.period_us - self.span_us(left, true));
            match self.read(next, stamp, temperature, sink).await? {
                Burst::Whole => {}
                Burst::Reset => {
                    self.restart(now);
                    return Ok(());
                }
                Burst::Torn => return self.start_over(now, delay).await,
            }
        }
        self.last = now + -self.period_us;
        self.overdue = now + self.patience_us;
        Ok(())
    }

    /// Empties a FIFO that has run over. Nothing in it is handed out: while it is full, every new frame takes the place of the
    /// oldest, also of one that is being read.
    async fn start_over(&mut self, now: Micros, delay: &mut impl DelayNs) -> Result<(), Error> {
        self.counters.overruns = self.counters.overruns.saturating_add(1);
        self.lost = true;
        // One that always says so must be set up anew.
        self.failures = self.failures.saturating_add(1);
        // The only way to take back the mark.
        port::write(&mut self.spi, both::FIFO_CONFIG_1, both::FIFO_STREAM).await?;
        delay.delay_us(WRITE_US).await;
        self.last = now + -self.period_us;
        self.overdue = now + self.patience_us;
        Ok(())
    }

    /// The watermark interrupt came at `stamp`.
    pub async fn on_watermark(&mut self, stamp: Micros, temperature: Option<i8>, sink: &mut impl FnMut(&Batch)) {
        // An interrupt before its time belongs to frames that were read without it.
        if self.state != State::Run || stamp < self.last + self.watermark_us() / 2 {
            return;
        }
        if let Err(error) = self.take(stamp, temperature, sink).await {
            self.count(error);
            self.fail(stamp);
        }
    }

    /// Reads one watermark after the other while there are that many frames: the last frame of the first came at `stamp`.
    async fn take(
        &mut self,
        stamp: Micros,
        temperature: Option<i8>,
        sink: &mut impl FnMut(&Batch),
    ) -> Result<(), Error> {
        let now = stamp;
        let mut stamp = stamp;
        for _ in 0..ROUNDS_MAX {
            let (mut frames, overrun) = self.stored().await?;
            if overrun {
                // Nobody knows which frame belongs to the stamp.
                (self.retry, self.overdue) = (true, stamp);
                return Ok(());
            }
            if frames < self.watermark {
                return Ok(());
            }
            while frames >= self.watermark {
                match self.read(self.watermark, stamp, temperature, sink).await? {
                    Burst::Whole => {}
                    Burst::Reset => {
                        self.restart(now);
                        return Ok(());
                    }
                    Burst::Torn => {
                        (self.retry, self.overdue) = (true, stamp);
                        return Ok(());
                    }
                }
                frames -= self.watermark;
                self.last = stamp;
                self.overdue = stamp + self.patience_us;
                stamp = stamp + self.span_us(self.watermark, false);
            }
            if frames + MARGIN < self.watermark {
                return Ok(());
            }
        }
        self.restart(now);
        Ok(())
    }

    /// Frames in the FIFO, and whether it has run over.
    async fn stored(&mut self) -> Result<(usize, bool), Error> {
        let status = port::read_one(&mut self.spi, both::FIFO_STATUS).await?;
        Ok((usize::from(status & !both::FIFO_OVERRUN), status & both::FIFO_OVERRUN != 0))
    }

    /// Reads `count` frames, at most [`BATCH_FRAMES`], in one burst; the last came at `stamp`. They are handed out if
    /// they are whole, and of the die as it was set up.
    async fn read(
        &mut self,
        count: usize,
        stamp: Micros,
        temperature: Option<i8>,
        sink: &mut impl FnMut(&Batch),
    ) -> Result<Burst, Error> {
        let mut bytes = [0; FRAME * BATCH_FRAMES];
        let bytes = bytes.get_mut(..FRAME * count).unwrap_or_default();
        // Until all is known to be well, some of the frames may be gone.
        let lost = core::mem::replace(&mut self.lost, true);
        port::read(&mut self.spi, both::FIFO_DATA, bytes).await?;
        if self.was_reset().await? {
            return Ok(Burst::Reset);
        }
        if self.stored().await?.1 {
            return Ok(Burst::Torn);
        }
        self.lost = lost;
        let mut valid = 0;
        if self.lost {
            self.sequence = self.sequence.wrapping_add(1);
        }
        let mut frames = Vec::new();
        for (index, frame) in bytes.chunks_exact(FRAME).enumerate() {
            let frame = port::words(frame);
            if frame == [INVALID; 3] {
                self.hand_out(&mut frames, stamp + -self.span_us(count - index, true), temperature, sink);
                self.sequence = self.sequence.wrapping_add(1);
                self.counters.invalid_frames = self.counters.invalid_frames.saturating_add(1);
                continue;
            }
            valid += 1;
            let shift = if self.die == Die::Accel { i16::BITS - AccelConfig::BITS } else { 0 };
            // There is room: a burst has no more frames than a batch.
            let _ = frames.push(frame.map(|word| word >> shift));
        }
        self.hand_out(&mut frames, stamp, temperature, sink);
        self.counters.frames = self.counters.frames.saturating_add(valid);
        // A die that gives nothing but marks of emptiness is broken.
        self.failures = if valid > 0 { 0 } else { self.failures.saturating_add(1) };
        Ok(Burst::Whole)
    }

    /// Hands frames out if there are any.
    fn hand_out(
        &mut self,
        frames: &mut Vec<[i16; 3], BATCH_FRAMES>,
        stamp: Micros,
        temperature: Option<i8>,
        sink: &mut impl FnMut(&Batch),
    ) {
        if frames.is_empty() {
            return;
        }
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(frames.len() as u32);
        let lost = core::mem::take(&mut self.lost);
        sink(&Batch { die: self.die, sequence, stamp, lost, temperature, frames: core::mem::take(frames) });
    }
}
