//! The program of the shoe: connects the parts of the board to the tasks.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_futures::select::{Either3, select3};
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Instant, Timer};
use embedded_io_async::Read;
use heapless::String;
use sohle_shared::bmx055::Batch;
use sohle_shared::time::Micros;
use sohle_shared::tracker::State;
use sohle_shared::wire::frame::{FRAME_MAX, encode};
use sohle_shared::wire::link::{Identity, Link, Request};
use sohle_shared::wire::message::{FromShoe, Level, Log, Refusal, ResetReason, Status};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shoe::executor::{self, Load};
use sohle_shoe::line::{self, Receiver};
use sohle_shoe::sensor::{self, now};
use sohle_shoe::settings::Settings;
use sohle_shoe::{board, kept, stack};
use static_cell::{ConstStaticCell, StaticCell};

/// Steps that are kept until the laptop has them: more than half an hour of walking.
const STEPS: usize = 1_000;

/// From one status to the next. **Units:** microseconds.
const STATUS_US: i64 = 1_000_000;

/// 40 kB that must not be on the stack.
static OUTBOX: ConstStaticCell<Outbox<STEPS>> = ConstStaticCell::new(Outbox::new(0, Pace::SERIAL));

/// The link with its steps elsewhere.
type Wire = Link<STEPS, &'static mut Outbox<STEPS>>;

static LINK: StaticCell<Wire> = StaticCell::new();

/// What the boot left to be told.
struct Boot {
    words: Option<String<120>>,
    reset: ResetReason,
    number: u32,
}

/// When the line is full: until there is room for a frame again. **Units:** microseconds.
const LINE_FULL_US: i64 = 4_000;

/// How late the batches come through.
#[derive(Default)]
struct Lateness {
    /// Longest since the last status. **Units:** microseconds.
    longest_us: i64,
    /// Of the sensor. **Units:** °C.
    temperature: Option<f32>,
}

impl Lateness {
    /// A batch is through.
    fn count(&mut self, batch: &Batch) {
        self.longest_us = self.longest_us.max(now() - batch.stamp);
        self.temperature = batch.temperature.map(|half_kelvin| 23.0 + 0.5 * f32::from(half_kelvin));
    }

    /// The longest; counts anew.
    fn take(&mut self) -> u32 {
        core::mem::take(&mut self.longest_us).clamp(0, i64::from(u32::MAX)) as u32
    }
}

/// Hands what the link has to say to the line. When to come again if that was not all.
fn transmit(link: &mut Wire, frame: &mut [u8; FRAME_MAX]) -> Option<Micros> {
    while line::room() {
        line::put(link.transmit(now(), frame)?);
    }
    Some(now() + LINE_FULL_US)
}

/// Hands a message to the line, unless it is busy.
fn say(link: &mut Wire, frame: &mut [u8; FRAME_MAX], message: &FromShoe) {
    if !encode(message, frame).is_ok_and(line::put) {
        link.count_dropped_message();
    }
}

#[embassy_executor::task]
async fn serve(
    mut rx: Receiver,
    flash: board::Flash,
    mut watchdog: IndependentWatchdog<'static, IWDG>,
    mut boot: Boot,
) {
    let mut settings = Settings::open(flash);
    let identity = Identity { boot: boot.number, firmware: env!("CARGO_PKG_VERSION"), board: board::NAME };
    let (parameters, calibration) = (settings.parameters(), settings.calibration());
    let link = LINK.init_with(|| Link::new(identity, &parameters, &calibration, OUTBOX.take()));
    let mut load = Load::start();
    let mut status_due = now() + STATUS_US;
    let mut line_due = None;
    let mut late = Lateness::default();
    let (mut chunk, mut frame) = ([0; 128], [0; FRAME_MAX]);
    watchdog.unleash();
    loop {
        let due = line_due.unwrap_or_else(|| link.deadline(now())).min(status_due).0.max(0) as u64;
        match select3(rx.read(&mut chunk), sensor::BATCHES.receive(), Timer::at(Instant::from_micros(due))).await {
            Either3::First(Ok(count)) => link.receive(chunk.get(..count).unwrap_or_default(), now()),
            Either3::Second(batch) => late.count(&batch),
            Either3::Third(()) => {}
        }
        if let Some(request) = link.request() {
            let result = match &request {
                Request::Write(value) => settings.keep(value),
                Request::Order(_) | Request::Raw(_) => Err(Refusal::Unsupported),
            };
            link.answer(result);
        }
        line_due = transmit(link, &mut frame);
        if now() < status_due {
            continue;
        }
        status_due = now() + STATUS_US;
        // This loop runs; if the sensor's does not, the watchdog starts both anew.
        if sensor::alive() {
            watchdog.pet();
        }
        let (load, lateness_us) = (load.take(), late.take());
        if !link.connected() {
            continue;
        }
        if let Some(text) = boot.words.take() {
            say(link, &mut frame, &FromShoe::Log(Log { time: now(), level: Level::Error, text }));
        }
        let [accel, gyro] = sensor::counters();
        let status = Status {
            time: now(),
            state: State::Reset,
            load,
            lateness_us,
            temperature: late.temperature,
            battery: None,
            stack: stack::used(),
            reset: boot.reset,
            waiting: link.waiting() as u16,
            accel,
            gyro,
            tracker: Default::default(),
            link: link.counters(),
        };
        say(link, &mut frame, &FromShoe::Status(status));
    }
}

#[entry]
fn main() -> ! {
    let words = kept::take();
    let board = board::start();
    let core = cortex_m::Peripherals::take().expect("nobody took them before");
    defmt::info!("sohle {=str} on {=str}", env!("CARGO_PKG_VERSION"), board::NAME);
    if let Some(words) = &words {
        defmt::error!("before the reset: {=str}", words.as_str());
    }
    let boot = Boot { words, reset: board.reset, number: board.boot };
    sensor::start(board::urgent(), board.sensor);
    executor::run(core.SCB, |spawner: Spawner| {
        spawner.spawn(line::send(board.tx).expect("one line"));
        let rx = Receiver::new(board.rx);
        spawner.spawn(serve(rx, board.flash, board.watchdog, boot).expect("one task"));
    })
}
