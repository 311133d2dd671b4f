//! One laptop, from its connection to its end.

use crate::hci::{Error, Hci};
use crate::host::{cause, identity, kept};
use crate::radio::Radio;
use crate::server::{Places, Server, Stream};
use bt_hci::cmd::info::ReadBdAddr;
use core::cell::Cell;
use core::pin::pin;
use embassy_futures::select::{Either, Either5, select, select5};
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use embedded_io_async::Read;
use heapless::Vec;
use portable_atomic::Ordering;
use sohle_shared::bonds::Bonds;
use sohle_shared::wire::bluetooth::{HEADER, MTU, STATUS_MAX};
use sohle_shared::wire::message::Level;
use trouble_host::prelude::*;

type Stack<'s, 'a, R> = trouble_host::Stack<'s, Hci<'a, R>, DefaultPacketPool>;
type Laptop<'s, 'v> = GattConnection<'s, 'v, DefaultPacketPool>;

/// Who has not shown so long after the connection that it has paired is sent away: it keeps others off.
const STRANGER: Duration = Duration::from_secs(30);
/// A connection that was ended is gone within this time.
const FAREWELL: Duration = Duration::from_secs(5);
/// The controller is asked so often whether it is still there.
const PULSE: Duration = Duration::from_secs(10);
/// The longest packet of the radio with data length extension, and the time that it takes at 1 Mbit/s. **Units:** bytes and
/// microseconds.
const PACKET: (u16, u16) = (251, 2_120);

/// For steps: at most 30 ms to the next chance to send one. When the shoe has nothing to send it may sleep through four of
/// them. The laptop has to be silent for two seconds to count as gone.
const STEPS: RequestedConnParams = RequestedConnParams {
    min_connection_interval: Duration::from_millis(30),
    max_connection_interval: Duration::from_millis(30),
    max_latency: 4,
    min_event_length: Duration::from_micros(0),
    max_event_length: Duration::from_micros(0),
    supervision_timeout: Duration::from_secs(2),
};
/// For the counts of the sensor: as often as it goes.
const RECORDING: RequestedConnParams = RequestedConnParams {
    min_connection_interval: Duration::from_micros(7_500),
    max_connection_interval: Duration::from_millis(15),
    max_latency: 0,
    ..STEPS
};

/// How it ended.
pub(crate) enum End {
    /// The laptop is gone.
    Gone,
    /// The controller has to be reset.
    Failed(Error),
}

/// What serving takes.
pub(crate) struct Serving<'x, 's, 'a, 'v, R> {
    pub(crate) radio: &'x Radio,
    pub(crate) stack: &'x Stack<'s, 'a, R>,
    pub(crate) server: &'x Server<'v>,
    pub(crate) places: &'x Places,
}

/// What is known of the laptop.
struct Standing {
    /// The link is encrypted with the key of a bond.
    trusted: Cell<bool>,
    became_trusted: Signal<crate::server::Mutex, ()>,
}

impl<'x, R: Read> Serving<'x, '_, '_, '_, R> {
    /// Serves it until it is gone. New bonds are added to `bonds`.
    pub(crate) async fn serve(&self, connection: Connection<'x, DefaultPacketPool>, bonds: &mut Bonds) -> End {
        // Keys are always kept: without, one could pair but not come back.
        if connection.set_bondable(true).is_err() {
            return End::Gone;
        }
        let Ok(laptop) = connection.with_attribute_server(self.server) else { return End::Gone };
        let standing = Standing { trusted: Cell::new(false), became_trusted: Signal::new() };
        {
            let gone = pin!(self.events(&laptop, &standing, bonds));
            let stream = pin!(self.stream(&laptop));
            let status = pin!(self.status(&laptop, &standing));
            let manage = pin!(self.manage(&laptop, &standing));
            let stranger = pin!(self.stranger(&standing));
            match select5(gone, stream, status, manage, stranger).await {
                Either5::First(()) => return End::Gone,
                Either5::Fourth(error) => return End::Failed(error),
                Either5::Second(()) | Either5::Third(()) | Either5::Fifth(()) => laptop.raw().disconnect(),
            }
        }
        // Its last events are of no interest, but the one that it is gone.
        let farewell = async { while !matches!(laptop.next().await, GattConnectionEvent::Disconnected { .. }) {} };
        match with_timeout(FAREWELL, farewell).await {
            Ok(()) => End::Gone,
            Err(_) => End::Failed(Error::Silence),
        }
    }

    /// Answers what the laptop asks, until it is gone.
    async fn events(&self, laptop: &Laptop<'_, '_>, standing: &Standing, bonds: &mut Bonds) {
        loop {
            match laptop.next().await {
                GattConnectionEvent::Disconnected { .. } => return,
                GattConnectionEvent::PairingComplete { bond: Some(bond), .. } if bond.is_bonded => {
                    if let Some(gone) = bonds.add(kept(&bond)).filter(|gone| !gone.is_of_same(&kept(&bond))) {
                        // The stack knows it: it was told of it, or has made it.
                        let _ = self.stack.remove_bond_information(identity(&gone));
                    }
                    self.radio.keep(bonds).await;
                    self.radio.say(Level::Info, "Bluetooth: a device has paired");
                }
                GattConnectionEvent::PairingComplete { .. } => laptop.raw().disconnect(),
                GattConnectionEvent::PairingFailed(_) => self.radio.say(Level::Warn, "Bluetooth: pairing failed"),
                GattConnectionEvent::Gatt { event } => self.answer(standing, event).await,
                _ => {}
            }
            self.judge(laptop, standing).await;
        }
    }

    /// Whether the laptop is one of those that have paired, and what it listens to.
    async fn judge(&self, laptop: &Laptop<'_, '_>, standing: &Standing) {
        let connection = laptop.raw();
        let trusted = connection.security_level().is_ok_and(|level| level.encrypted()) && connection.is_bonded_peer();
        if trusted && !standing.trusted.replace(true) {
            standing.became_trusted.signal(());
            self.radio.say(Level::Info, "Bluetooth: a laptop is connected");
        }
        self.radio.open(trusted && self.listened(laptop).is_some()).await;
    }

    /// By which of the two the laptop gets the stream.
    fn listened(&self, laptop: &Laptop<'_, '_>) -> Option<&Stream> {
        [&self.places.steps, &self.places.uart_tx].into_iter().find(|stream| stream.should_notify(laptop))
    }

    /// Answers a request.
    async fn answer(&self, standing: &Standing, event: GattEvent<'_, '_, DefaultPacketPool>) {
        let command = [self.places.commands.handle, self.places.uart_rx.handle];
        let reply = match event {
            GattEvent::Write(event) if command.contains(&event.handle()) => {
                if standing.trusted.get() {
                    let mut bytes = Vec::<u8, { MTU as usize }>::new();
                    // A write is no longer than the MTU.
                    let _ = event.with_data(|_, data| bytes.extend_from_slice(data));
                    self.radio.receive(&bytes).await;
                    event.accept_unprocessed()
                } else {
                    event.reject(AttErrorCode::INSUFFICIENT_AUTHENTICATION)
                }
            }
            // Encrypted, but with the key of no bond: nothing here is for it.
            GattEvent::Write(event) if !standing.trusted.get() => {
                event.reject(AttErrorCode::INSUFFICIENT_AUTHENTICATION)
            }
            event => event.accept(),
        };
        // Without a packet for the answer there is none; the laptop asks again.
        if let Ok(reply) = reply {
            reply.send().await;
        }
    }

    /// Sends the stream in pieces.
    async fn stream(&self, laptop: &Laptop<'_, '_>) {
        let mut bytes = [0; (MTU - HEADER) as usize];
        loop {
            let most = usize::from(laptop.raw().att_mtu().saturating_sub(HEADER)).min(bytes.len());
            let length = self.radio.out.read(bytes.get_mut(..most).unwrap_or_default()).await;
            let Some(stream) = self.listened(laptop) else { continue };
            let piece = bytes.get(..length).unwrap_or_default();
            // Packets are lent to requests, too: there will be one again.
            while let Err(trouble_host::Error::OutOfMemory) = stream.notify_raw(laptop, piece, false).await {
                Timer::after_millis(1).await;
            }
        }
    }

    /// Keeps the status and the charge that can be read, and tells them who wants to know.
    async fn status(&self, laptop: &Laptop<'_, '_>, standing: &Standing) {
        let mut told = 0;
        loop {
            self.radio.status_changed.wait().await;
            let status: Vec<u8, STATUS_MAX> = self.radio.status.lock(|status| status.borrow().clone());
            let _ = self.places.status.set(self.server, &status);
            if standing.trusted.get() && status.len() + usize::from(HEADER) <= usize::from(laptop.raw().att_mtu()) {
                let _ = self.places.status.notify_raw(laptop, &status, false).await;
            }
            if let Some(level) = &self.places.battery {
                let charge = self.radio.battery.load(Ordering::Relaxed);
                if charge != told {
                    let _ = level.notify(laptop, &charge, true).await;
                    told = charge;
                }
            }
        }
    }

    /// Chooses how the radio works for this laptop, and asks the controller now and then whether it is there.
    async fn manage(&self, laptop: &Laptop<'_, '_>, standing: &Standing) -> Error {
        standing.became_trusted.wait().await;
        let (length, time) = PACKET;
        if let Err(error) = tolerate(laptop.raw().update_data_length(self.stack, length, time).await) {
            return error;
        }
        loop {
            let hurry = self.radio.is_in_hurry();
            let wanted = if hurry { &RECORDING } else { &STEPS };
            let phy = if hurry { PhyKind::Le2M } else { PhyKind::Le1M };
            let phy = tolerate(laptop.raw().set_phy(self.stack, phy).await);
            let updated = tolerate(laptop.raw().update_connection_params(self.stack, wanted).await);
            if let Err(error) = phy.and(updated) {
                return error;
            }
            while with_timeout(PULSE, self.radio.hurry_changed.wait()).await.is_err() {
                if let Err(error) = self.stack.command(ReadBdAddr::new()).await {
                    return cause(error);
                }
            }
        }
    }

    /// Ends when a stranger has been here for too long.
    async fn stranger(&self, standing: &Standing) {
        loop {
            match select(Timer::after(STRANGER), self.radio.window_opened.wait()).await {
                Either::Second(()) => {}
                Either::First(()) if standing.trusted.get() => core::future::pending().await,
                Either::First(()) if self.radio.lets_pair() => {}
                Either::First(()) => return,
            }
        }
    }
}

/// A laptop or a controller that refuses what would be better goes on as it is.
fn tolerate(result: Result<(), BleHostError<Error>>) -> Result<(), Error> {
    match result {
        Err(BleHostError::Controller(error)) => Err(error),
        Ok(()) | Err(BleHostError::BleHost(_)) => Ok(()),
    }
}
