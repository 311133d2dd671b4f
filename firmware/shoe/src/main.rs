//! The program of the shoe: connects the parts of the board to the tasks.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::usart::UartTx;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Instant, Timer};
use embedded_io_async::Read;
use heapless::String;
use sohle_shared::time::Micros;
use sohle_shared::tracker::State;
use sohle_shared::wire::frame::{FRAME_MAX, encode};
use sohle_shared::wire::link::{Identity, Link, Request};
use sohle_shared::wire::message::{FromShoe, Level, Log, Refusal, ResetReason, Status};
use sohle_shared::wire::outbox::Pace;
use sohle_shoe::executor::{self, Load};
use sohle_shoe::line::Receiver;
use sohle_shoe::settings::Settings;
use sohle_shoe::{board, kept, stack};
use static_cell::StaticCell;

/// Steps that are kept until the laptop has them: more than half an hour of walking.
const STEPS: usize = 1_000;

/// From one status to the next. **Units:** microseconds.
const STATUS_US: i64 = 1_000_000;

/// 40 kB that must not be on the stack.
static LINK: StaticCell<Link<STEPS>> = StaticCell::new();

fn now() -> Micros {
    // 2^63 microseconds are 292 000 years.
    Micros(Instant::now().as_micros() as i64)
}

/// What the boot left to be told.
struct Boot {
    words: Option<String<120>>,
    reset: ResetReason,
    number: u32,
}

/// The sending side, with the frame on its way.
struct Sender {
    tx: UartTx<'static, Async>,
    frame: [u8; FRAME_MAX],
}

impl Sender {
    async fn link(&mut self, link: &mut Link<STEPS>) {
        while let Some(frame) = link.transmit(now(), &mut self.frame) {
            // What does not arrive is sent again, or missed by nobody.
            let _ = self.tx.write(frame).await;
        }
    }

    async fn message(&mut self, message: &FromShoe) {
        if let Ok(frame) = encode(message, &mut self.frame) {
            let _ = self.tx.write(frame).await;
        }
    }
}

#[embassy_executor::task]
async fn serve(
    mut rx: Receiver,
    tx: UartTx<'static, Async>,
    flash: board::Flash,
    mut watchdog: IndependentWatchdog<'static, IWDG>,
    mut boot: Boot,
) {
    let mut settings = Settings::open(flash);
    let identity = Identity { boot: boot.number, firmware: env!("CARGO_PKG_VERSION"), board: board::NAME };
    let (parameters, calibration) = (settings.parameters(), settings.calibration());
    let link = LINK.init_with(|| Link::new(identity, &parameters, &calibration, Pace::default()));
    let mut sender = Sender { tx, frame: [0; FRAME_MAX] };
    let mut load = Load::start();
    let mut status_due = now() + STATUS_US;
    let mut chunk = [0; 256];
    watchdog.unleash();
    loop {
        let due = link.deadline(now()).min(status_due).0.max(0) as u64;
        let event = select(rx.read(&mut chunk), Timer::at(Instant::from_micros(due))).await;
        watchdog.pet();
        if let Either::First(Ok(count)) = event {
            link.receive(&chunk[..count], now());
        }
        if let Some(request) = link.request() {
            let result = match &request {
                Request::Write(value) => settings.keep(value),
                Request::Order(_) | Request::Raw(_) => Err(Refusal::Unsupported),
            };
            link.answer(result);
        }
        sender.link(link).await;
        if now() < status_due {
            continue;
        }
        status_due = now() + STATUS_US;
        let load = load.take();
        if !link.connected() {
            continue;
        }
        if let Some(text) = boot.words.take() {
            sender.message(&FromShoe::Log(Log { time: now(), level: Level::Error, text })).await;
        }
        let status = Status {
            time: now(),
            state: State::Reset,
            load,
            lateness_us: 0,
            temperature: None,
            battery: None,
            stack: stack::used(),
            reset: boot.reset,
            waiting: link.waiting() as u16,
            accel: Default::default(),
            gyro: Default::default(),
            tracker: Default::default(),
            link: link.counters(),
        };
        sender.message(&FromShoe::Status(status)).await;
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
    executor::run(core.SCB, |spawner: Spawner| {
        let rx = Receiver::new(board.rx);
        spawner.spawn(serve(rx, board.tx, board.flash, board.watchdog, boot).expect("one task"));
    })
}
