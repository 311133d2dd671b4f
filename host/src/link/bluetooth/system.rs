//! The Bluetooth adapter of this machine, by btleplug: BlueZ, CoreBluetooth, or Windows.

use super::fault::Fault;
use super::radio::{Line, Radio, Sighting};
use btleplug::api::{
    Central as _, CentralEvent, CentralState, CharPropFlags, Characteristic, Manager as _, Peripheral as _, ScanFilter,
    WriteType,
};
use btleplug::platform::{Adapter, Manager, Peripheral};
use futures_util::StreamExt;
use sohle_shared::wire::bluetooth::{COMMANDS, HEADER, SERVICE, STEPS};
use std::collections::HashMap;
use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;
use tokio::runtime::{Builder, Runtime};
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep, timeout};
use uuid::Uuid;

/// What does not happen within this time does not happen.
const PATIENCE: Duration = Duration::from_secs(10);
/// A goodbye that takes longer is not waited for.
const GOODBYE: Duration = Duration::from_secs(2);
/// What was heard is looked at so often during a search.
const LOOK: Duration = Duration::from_millis(200);

/// The first adapter.
pub struct System {
    runtime: Arc<Runtime>,
    adapter: Adapter,
    known: HashMap<String, Peripheral>,
}

impl System {
    /// Reaches the system's Bluetooth.
    pub fn new() -> Result<Self, Fault> {
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = Arc::new(runtime.map_err(|error| Fault::Other(error.to_string()))?);
        let adapter = runtime.block_on(async {
            let manager = Manager::new().await.map_err(told)?;
            let adapter = manager.adapters().await.map_err(told)?.into_iter().next().ok_or(Fault::NoAdapter)?;
            match adapter.adapter_state().await.map_err(told)? {
                CentralState::PoweredOff => Err(Fault::Off),
                CentralState::PoweredOn | CentralState::Unknown => Ok(adapter),
            }
        })?;
        Ok(Self { runtime, adapter, known: HashMap::new() })
    }

    /// The shoes that have been heard so far.
    async fn heard(&mut self) -> Result<Vec<Sighting>, Fault> {
        let mut seen = Vec::new();
        for peripheral in self.adapter.peripherals().await.map_err(told)? {
            // It may have gone since.
            let Ok(Some(properties)) = peripheral.properties().await else { continue };
            // What the system remembers only, and does not hear, has no signal.
            let here = properties.rssi.is_some() || peripheral.is_connected().await.unwrap_or_default();
            if !here || !properties.services.contains(&Uuid::from_u128(SERVICE)) {
                continue;
            }
            let address = if cfg!(target_vendor = "apple") {
                peripheral.id().to_string().to_ascii_uppercase()
            } else {
                properties.address.to_string()
            };
            self.known.insert(address.clone(), peripheral);
            seen.push(Sighting { name: properties.advertisement_name, address, signal_dbm: properties.rssi });
        }
        Ok(seen)
    }

    async fn listen(&mut self, time: Duration, enough: &dyn Fn(&Sighting) -> bool) -> Result<Vec<Sighting>, Fault> {
        let until = Instant::now() + time;
        self.adapter.start_scan(ScanFilter { services: vec![Uuid::from_u128(SERVICE)] }).await.map_err(told)?;
        let seen = loop {
            let seen = self.heard().await;
            match &seen {
                Ok(shoes) if !shoes.iter().any(enough) && Instant::now() < until => sleep(LOOK).await,
                _ => break seen,
            }
        };
        // A scan that does not end by itself ends with the program.
        let _ = self.adapter.stop_scan().await;
        seen
    }
}

impl Radio for System {
    fn search(&mut self, time: Duration, enough: &dyn Fn(&Sighting) -> bool) -> Result<Vec<Sighting>, Fault> {
        self.runtime.clone().block_on(self.listen(time, enough))
    }

    fn connect(&mut self, shoe: &Sighting) -> Result<Line, Fault> {
        let address = shoe.address.as_str();
        let peripheral = self.known.get(address).ok_or_else(|| Fault::Silent(address.into()))?.clone();
        let (steps, received) = channel();
        let connected = self.runtime.block_on(async {
            let connected = timeout(PATIENCE, listen_to(&self.adapter, &peripheral, address, steps)).await;
            let connected = connected.unwrap_or_else(|_| Err(Fault::Silent(address.into())));
            if connected.is_err() {
                let _ = timeout(GOODBYE, peripheral.disconnect()).await;
            }
            connected
        });
        let (commands, listening) = connected?;
        let piece = usize::from(peripheral.mtu().saturating_sub(HEADER).max(1));
        let mut connection = Connection { runtime: self.runtime.clone(), peripheral, commands, listening };
        Ok(Line { received, send: Box::new(move |piece| connection.send(piece)), piece })
    }
}

/// Connects and hands on what the shoe says, until it is gone or nobody listens.
async fn listen_to(
    adapter: &Adapter,
    peripheral: &Peripheral,
    address: &str,
    steps: Sender<Vec<u8>>,
) -> Result<(Characteristic, JoinHandle<()>), Fault> {
    let fault = |error: btleplug::Error| match told(error) {
        Fault::Other(words) => Fault::of(&words, address),
        other => other,
    };
    let mut events = adapter.events().await.map_err(fault)?;
    peripheral.connect().await.map_err(fault)?;
    peripheral.discover_services().await.map_err(fault)?;
    let find = |uuid: u128| {
        let found = peripheral.characteristics().into_iter().find(|found| found.uuid == Uuid::from_u128(uuid));
        found.ok_or_else(|| Fault::NoShoe(address.into()))
    };
    let (told, commands) = (find(STEPS)?, find(COMMANDS)?);
    let mut pieces = peripheral.notifications().await.map_err(fault)?;
    peripheral.subscribe(&told).await.map_err(fault)?;
    let id = peripheral.id();
    let listening = tokio::spawn(async move {
        loop {
            let heard = tokio::select! {
                piece = pieces.next() => piece.map(|piece| (piece.uuid == told.uuid).then_some(piece.value)),
                event = events.next() => match event {
                    Some(CentralEvent::DeviceDisconnected(gone)) if gone == id => None,
                    Some(_) => Some(None),
                    None => None,
                },
            };
            match heard {
                Some(None) => {}
                Some(Some(piece)) => {
                    if steps.send(piece).is_err() {
                        return;
                    }
                }
                None => return,
            }
        }
    });
    Ok((commands, listening))
}

/// The words of btleplug; the names of the system's errors are only in the long form.
fn told(error: btleplug::Error) -> Fault {
    match error {
        btleplug::Error::PermissionDenied => Fault::Forbidden,
        btleplug::Error::NoAdapterAvailable => Fault::NoAdapter,
        error => match Fault::of(&format!("{error:?}"), "") {
            Fault::Other(long) => Fault::Other(if long.contains("org.bluez") { long } else { error.to_string() }),
            fault => fault,
        },
    }
}

/// A shoe that is connected, until this is dropped.
struct Connection {
    runtime: Arc<Runtime>,
    peripheral: Peripheral,
    commands: Characteristic,
    listening: JoinHandle<()>,
}

impl Connection {
    fn send(&mut self, piece: &[u8]) -> io::Result<()> {
        // Whatever is lost is sent again by the wire; an answer would take two more connection intervals.
        let kind = match self.commands.properties.contains(CharPropFlags::WRITE_WITHOUT_RESPONSE) {
            true => WriteType::WithoutResponse,
            false => WriteType::WithResponse,
        };
        // A time limit begins inside the runtime that keeps it.
        let _inside = self.runtime.enter();
        match self.runtime.block_on(timeout(GOODBYE, self.peripheral.write(&self.commands, piece, kind))) {
            Ok(written) => written.map_err(io::Error::other),
            Err(_) => Err(io::ErrorKind::TimedOut.into()),
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.listening.abort();
        // A shoe that is gone needs no goodbye.
        let _inside = self.runtime.enter();
        let _ = self.runtime.block_on(timeout(GOODBYE, self.peripheral.disconnect()));
    }
}
