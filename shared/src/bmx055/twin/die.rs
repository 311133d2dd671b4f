//! Accelerometer or gyroscope of the twin: registers, clock, FIFO, interrupt line.

use super::address::Address;
use super::fifo::{EMPTY, FRAME, Fifo};
use crate::bmx055::batch::Die;
use crate::bmx055::config::{period_of_accel, period_of_gyro};
use crate::bmx055::registers::{accel, both, gyro};
use crate::time::Micros;

/// Addresses of seven bits.
const REGISTERS: usize = 128;

/// Shortest time from one write to the next in normal and in suspend mode (BMI088, tables 12 and 13). **Units:** ns.
const WRITE_IDLE_NS: [u64; 2] = [2_000, 450_000];

/// Bits of the power register that stop a die: suspend and deep suspend.
const SUSPENDED: u8 = 0xA0;

/// Sleep of the accelerometer by its code in bits 4 to 1 of the power register; all below the sixth are 0.5 ms (BMA255).
/// **Units:** us.
const SLEEPS_US: [u64; 16] =
    [500, 500, 500, 500, 500, 500, 1_000, 2_000, 4_000, 6_000, 10_000, 25_000, 50_000, 100_000, 500_000, 1_000_000];

/// Counts of a unit of the slope threshold.
const SLOPE_UNIT: u32 = 4;

/// How long the gyroscope tests itself (Bosch's driver waits as long). **Units:** ns.
const GYRO_TEST_NS: u64 = 10_000_000;

/// Deflection of an axis of the accelerometer under test, half of the 800 mg that Bosch demands and a fifth more.
/// **Units:** g.
const DEFLECTION_G: f32 = 0.48;

/// What can be wrong with a die.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// It gives this identification.
    pub chip_id: Option<u8>,
    /// This register reads as this value, whatever is written.
    pub register: Option<(u8, u8)>,
    /// So many transfers fail from now on.
    pub transfers: u32,
    /// So many edges of the interrupt line are lost from now on.
    pub interrupts: u32,
    /// So many frames come as 0x8000 from now on.
    pub frames: u32,
    /// It takes no readings.
    pub stuck: bool,
    /// Its self-test fails.
    pub self_test: bool,
    /// Its supply drops at this time, once.
    pub supply: Option<Micros>,
}

/// What was done to a die that its data sheet forbids or that costs data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Observed {
    /// Readings taken.
    pub taken: u64,
    /// Bytes on its bus.
    pub bytes: u64,
    /// Frames that were read whole.
    pub read: u64,
    /// Writes that came too soon after the last, or during a reset, and had no effect.
    pub ignored_writes: u32,
    /// Soft resets.
    pub resets: u32,
}

/// One of the two dies that have a FIFO.
#[derive(Debug)]
pub(super) struct DieTwin {
    die: Die,
    /// At the full rate, 2 kHz by the data sheet. **Units:** ns.
    period_ns: u64,
    registers: [u8; REGISTERS],
    fifo: Fifo,
    latest: [u8; FRAME],
    /// When the next reading is taken.
    next_ns: u64,
    /// Until when it starts up.
    boot_ns: u64,
    /// End of the last write.
    written_ns: Option<u64>,
    /// End of the self-test of the gyroscope.
    tested_ns: u64,
    /// Counts of the last reading, of which the slope is taken.
    before: Option<[i16; 3]>,
    /// Slopes above the threshold, one after the other.
    steep: u8,
    /// The interrupt of motion.
    motion: bool,
    line: bool,
    edge_ns: Option<u64>,
    /// Start of the transaction.
    selected_ns: u64,
    address: Address,
    fifo_bytes: usize,
    pub temperature: i8,
    pub faults: Faults,
    pub observed: Observed,
}

impl DieTwin {
    /// Just powered.
    pub fn new(die: Die, period_ns: u32) -> Self {
        let mut twin = Self {
            die,
            period_ns: u64::from(period_ns.max(1)),
            registers: [0; REGISTERS],
            fifo: Fifo::default(),
            latest: EMPTY,
            next_ns: 0,
            boot_ns: 0,
            written_ns: None,
            tested_ns: u64::MAX,
            before: None,
            steep: 0,
            motion: false,
            line: false,
            edge_ns: None,
            selected_ns: 0,
            address: Address::default(),
            fifo_bytes: 0,
            temperature: 0,
            faults: Faults::default(),
            observed: Observed::default(),
        };
        twin.reset(0);
        twin
    }

    /// Registers as after power on; deaf for the time of the start.
    pub fn reset(&mut self, now_ns: u64) {
        self.registers = [0; REGISTERS];
        let boot_us = match self.die {
            Die::Accel => {
                self.set(both::RANGE, 0x03);
                self.set(both::BANDWIDTH, 0x0F);
                self.set(accel::INT_OUT, 0x05);
                accel::BOOT_US
            }
            Die::Gyro => {
                self.set(both::BANDWIDTH, 0x80);
                self.set(gyro::INT_EN_1, 0x0F);
                gyro::BOOT_US
            }
        };
        self.fifo.clear();
        self.boot_ns = now_ns + u64::from(boot_us) * 1_000;
        self.next_ns = self.boot_ns + self.sample_ns();
        self.written_ns = None;
        self.tested_ns = u64::MAX;
        (self.before, self.steep, self.motion) = (None, 0, false);
        self.update_line(now_ns);
    }

    fn get(&self, register: u8) -> u8 {
        self.registers.get(usize::from(register)).copied().unwrap_or_default()
    }

    fn set(&mut self, register: u8, value: u8) {
        if let Some(place) = self.registers.get_mut(usize::from(register)) {
            *place = value;
        }
    }

    /// Time between readings as the bandwidth is set.
    fn sample_ns(&self) -> u64 {
        let nominal_us = match self.die {
            Die::Accel if self.get(both::HIGH_BANDWIDTH) & 0x80 != 0 => 500,
            Die::Accel => period_of_accel(self.get(both::BANDWIDTH)),
            Die::Gyro => period_of_gyro(self.get(both::BANDWIDTH)),
        };
        let sleep_us = if self.dozes() { SLEEPS_US[usize::from(self.get(both::POWER) >> 1 & 0x0F)] } else { 0 };
        self.period_ns * (u64::from(nominal_us) + sleep_us) / 500
    }

    fn suspended(&self) -> bool {
        self.get(both::POWER) & SUSPENDED != 0
    }

    /// Sleeps between readings.
    fn dozes(&self) -> bool {
        self.die == Die::Accel && !self.suspended() && self.get(both::POWER) & accel::POWER_LOW != 0
    }

    /// The interrupt of motion is led to a pin that can be seen.
    fn tells_of_motion(&self) -> bool {
        self.die == Die::Accel
            && self.get(accel::INT_EN_0) & accel::INT_EN_0_SLOPE != 0
            && self.get(accel::INT_MAP_0) & accel::INT_MAP_0_SLOPE != 0
            && self.get(accel::INT_OUT) & 0x03 == accel::INT_OUT_INT1_HIGH
    }

    /// Takes the slope to a new reading.
    fn measure_slope(&mut self, counts: [i16; 3]) {
        let enabled = self.get(accel::INT_EN_0) & accel::INT_EN_0_SLOPE;
        if enabled == 0 {
            (self.before, self.steep) = (None, 0);
            return;
        }
        let Some(before) = self.before.replace(counts) else { return };
        let threshold = u32::from(self.get(accel::SLOPE_THRESHOLD)) * SLOPE_UNIT;
        let mut axes = counts.into_iter().zip(before).enumerate();
        let steep =
            axes.any(|(axis, (now, before))| enabled >> axis & 1 != 0 && u32::from(now.abs_diff(before)) > threshold);
        self.steep = if steep { self.steep.saturating_add(1) } else { 0 };
        let latched = self.get(accel::INT_LATCH) & 0x0F == accel::INT_LATCH_FOREVER;
        self.motion = self.steep > self.get(accel::SLOPE_DURATION) & 0x03 || latched && self.motion;
    }

    fn depth(&self) -> usize {
        match self.die {
            Die::Accel => accel::FIFO_DEPTH,
            Die::Gyro if self.get(both::FIFO_CONFIG_1) & both::FIFO_MODE == both::FIFO_STREAM => {
                gyro::FIFO_DEPTH_STREAM
            }
            Die::Gyro => gyro::FIFO_DEPTH,
        }
    }

    /// The watermark, when it is led to a pin that can be seen.
    fn watermark(&self) -> Option<usize> {
        let is = |register, mask, value| self.get(register) & mask == value;
        let (led, register) = match self.die {
            Die::Accel => (
                is(accel::INT_EN_1, accel::INT_EN_1_WATERMARK, accel::INT_EN_1_WATERMARK)
                    && is(accel::INT_MAP_1, accel::INT_MAP_1_WATERMARK, accel::INT_MAP_1_WATERMARK)
                    && is(accel::INT_OUT, 0x03, accel::INT_OUT_INT1_HIGH),
                accel::FIFO_WATERMARK,
            ),
            Die::Gyro => (
                is(gyro::INT_EN_0, gyro::INT_EN_0_FIFO, gyro::INT_EN_0_FIFO)
                    && is(gyro::FIFO_WM_EN, gyro::FIFO_WM_EN_ON, gyro::FIFO_WM_EN_ON)
                    && is(gyro::INT_MAP_1, gyro::INT_MAP_1_FIFO, gyro::INT_MAP_1_FIFO)
                    && is(gyro::INT_EN_1, 0x03, gyro::INT_EN_1_INT1_HIGH),
                gyro::FIFO_WATERMARK,
            ),
        };
        let watermark = usize::from(self.get(register) & 0x7F);
        (led && watermark > 0).then_some(watermark)
    }

    fn update_line(&mut self, now_ns: u64) {
        let line = self.watermark().is_some_and(|watermark| self.fifo.len() >= watermark)
            || self.motion && self.tells_of_motion();
        if line && !self.line {
            if self.faults.interrupts > 0 {
                self.faults.interrupts -= 1;
            } else {
                self.edge_ns = Some(now_ns);
            }
        }
        self.line = line;
        if self.watermark().is_none() && !self.tells_of_motion() {
            self.edge_ns = None;
        }
    }

    /// The last rising edge of the line that was not taken yet. **Units:** ns.
    pub fn take_edge(&mut self) -> Option<u64> {
        self.edge_ns.take()
    }

    /// When the line rises next if nobody reads, or, where motion raises it, when it may. **Units:** ns.
    pub fn next_edge(&self) -> Option<u64> {
        if self.suspended() || self.faults.stuck || self.faults.interrupts > 0 {
            return None;
        }
        if self.tells_of_motion() {
            return (!self.line).then_some(self.next_ns);
        }
        let missing = self.watermark()?.checked_sub(self.fifo.len())?.checked_sub(1)?;
        Some(self.next_ns + missing as u64 * self.sample_ns())
    }

    /// Takes the readings that are due.
    pub fn advance(&mut self, now_ns: u64, mut counts: impl FnMut(u64) -> [i16; 3]) {
        let drop_ns = self.faults.supply.map(|time| u64::try_from(time.0).unwrap_or_default().saturating_mul(1_000));
        if let Some(drop_ns) = drop_ns.filter(|&drop_ns| drop_ns <= now_ns) {
            self.faults.supply = None;
            self.take_readings(drop_ns, &mut counts);
            self.reset(drop_ns);
        }
        self.take_readings(now_ns, &mut counts);
    }

    fn take_readings(&mut self, now_ns: u64, counts: &mut impl FnMut(u64) -> [i16; 3]) {
        while self.next_ns <= now_ns {
            let time_ns = self.next_ns;
            self.next_ns += self.sample_ns();
            if self.suspended() || self.faults.stuck {
                continue;
            }
            let counts = if self.dozes() { self.filtered(time_ns, counts) } else { counts(time_ns) };
            let frame = self.frame(counts);
            self.observed.taken += 1;
            if self.die == Die::Accel {
                self.measure_slope(counts);
            }
            self.latest = frame;
            self.fifo.push(frame, self.get(both::FIFO_CONFIG_1), self.depth());
            self.update_line(time_ns);
        }
    }

    /// A reading that took its time: the mean of four, spread over the time that the low-pass filter needs.
    fn filtered(&self, time_ns: u64, counts: &mut impl FnMut(u64) -> [i16; 3]) -> [i16; 3] {
        let apart_ns = self.period_ns * u64::from(period_of_accel(self.get(both::BANDWIDTH))) / 500 / 4;
        let mut sums = [0_i32; 3];
        for before in (0..4).rev() {
            let reading = counts(time_ns.saturating_sub(before * apart_ns));
            for (sum, count) in sums.iter_mut().zip(reading) {
                *sum += i32::from(count);
            }
        }
        // A mean of four numbers of 16 bits.
        sums.map(|sum| (sum / 4) as i16)
    }

    /// The bytes of a reading.
    fn frame(&mut self, counts: [i16; 3]) -> [u8; FRAME] {
        if self.faults.frames > 0 {
            self.faults.frames -= 1;
            return EMPTY;
        }
        let mut counts = counts;
        if self.die == Die::Accel {
            self.deflect(&mut counts);
            // Left-justified; bit 0 marks new data, bits 3 to 1 are undefined and differ from frame to frame here.
            let undefined = (self.observed.taken % 8) as i16;
            counts = counts.map(|count| count.clamp(-2048, 2047) << 4 | undefined << 1 | 1);
        }
        let [x, y, z] = counts.map(i16::to_le_bytes);
        [x[0], x[1], y[0], y[1], z[0], z[1]]
    }

    /// Self-test of the accelerometer.
    fn deflect(&self, counts: &mut [i16; 3]) {
        let test = self.get(accel::SELF_TEST);
        let axis = usize::from(test & 0x03).checked_sub(1);
        let Some(count) = axis.and_then(|axis| counts.get_mut(axis)) else { return };
        let per_g = match self.get(both::RANGE) & 0x0F {
            0x05 => 512.0,
            0x08 => 256.0,
            0x0C => 128.0,
            _ => 1024.0,
        };
        let sign = if test & accel::SELF_TEST_POSITIVE != 0 { 1.0 } else { -1.0 };
        let healthy = if self.faults.self_test { 0.1 } else { 1.0 };
        *count = count.saturating_add((DEFLECTION_G * per_g * sign * healthy) as i16);
    }

    /// Chip select falls.
    pub fn select(&mut self, now_ns: u64) {
        self.address.select();
        self.selected_ns = now_ns;
    }

    /// A byte goes either way; the first is the address.
    pub fn exchange(&mut self, sent: u8, now_ns: u64) -> u8 {
        self.observed.bytes += 1;
        let Some((register, read)) = self.address.next(sent) else { return 0 };
        if read {
            return self.read(register, now_ns);
        }
        self.write(register, sent, now_ns);
        0
    }

    /// Chip select rises.
    pub fn release(&mut self, now_ns: u64) {
        self.fifo.release();
        self.fifo_bytes = 0;
        self.update_line(now_ns);
    }

    fn read(&mut self, register: u8, now_ns: u64) -> u8 {
        if now_ns < self.boot_ns {
            return 0;
        }
        if let Some((faulty, value)) = self.faults.register
            && faulty == register
        {
            return value;
        }
        match register {
            both::CHIP_ID => self.faults.chip_id.unwrap_or(match self.die {
                Die::Accel => accel::ID,
                Die::Gyro => gyro::ID,
            }),
            both::DATA..=0x07 => {
                let place = usize::from(register - both::DATA);
                let byte = self.latest.get(place).copied().unwrap_or_default();
                if let (Die::Accel, Some(latest)) = (self.die, self.latest.get_mut(place))
                    && place.is_multiple_of(2)
                {
                    *latest &= !1;
                }
                byte
            }
            accel::TEMPERATURE if self.die == Die::Accel => self.temperature as u8,
            both::FIFO_STATUS => self.fifo.len() as u8 | if self.fifo.overrun { both::FIFO_OVERRUN } else { 0 },
            both::FIFO_DATA => {
                if self.fifo.len() > 0 {
                    self.fifo_bytes += 1;
                    self.observed.read += u64::from(self.fifo_bytes.is_multiple_of(FRAME));
                }
                self.fifo.read()
            }
            both::BANDWIDTH if self.die == Die::Gyro => self.get(register) | 0x80,
            gyro::SELF_TEST if self.die == Die::Gyro => {
                let rate_ok = if self.faults.stuck { 0 } else { gyro::SELF_TEST_RATE_OK };
                let failed = if self.faults.self_test { gyro::SELF_TEST_FAILED } else { 0 };
                rate_ok | if now_ns >= self.tested_ns { gyro::SELF_TEST_READY | failed } else { 0 }
            }
            _ => self.get(register),
        }
    }

    fn write(&mut self, register: u8, value: u8, now_ns: u64) {
        let idle_ns = WRITE_IDLE_NS[usize::from(self.suspended())];
        let soon = self.written_ns.is_some_and(|written| self.selected_ns < written + idle_ns);
        let deaf = self.suspended() && self.die == Die::Gyro && register != both::POWER && register != both::RESET;
        if soon || deaf || now_ns < self.boot_ns {
            self.observed.ignored_writes += 1;
            return;
        }
        self.written_ns = Some(now_ns);
        match register {
            both::RESET if value == both::RESET_COMMAND => {
                self.observed.resets += 1;
                self.reset(now_ns);
                return;
            }
            both::FIFO_CONFIG_1 => self.fifo.clear(),
            gyro::FIFO_WATERMARK if self.die == Die::Gyro => self.fifo.clear(),
            gyro::SELF_TEST if self.die == Die::Gyro && value & gyro::SELF_TEST_START != 0 => {
                self.tested_ns = now_ns + GYRO_TEST_NS;
            }
            accel::INT_LATCH if self.die == Die::Accel && value & accel::INT_LATCH_END != 0 => self.motion = false,
            _ => {}
        }
        let (period_ns, suspended) = (self.sample_ns(), self.suspended());
        let ends = if register == accel::INT_LATCH && self.die == Die::Accel { accel::INT_LATCH_END } else { 0 };
        self.set(register, value & !ends);
        if self.sample_ns() != period_ns {
            self.next_ns = now_ns + self.sample_ns();
        }
        if suspended && !self.suspended() {
            let start_us = if self.die == Die::Gyro { gyro::BOOT_US } else { accel::BOOT_US };
            self.next_ns = now_ns + u64::from(start_us) * 1_000 + self.sample_ns();
        }
        self.update_line(now_ns);
    }
}
