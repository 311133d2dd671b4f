//! The host: it keeps the controller running, is to be found, and pairs.

use crate::hci::{self, Error, Hci, Outward};
use crate::radio::Radio;
use crate::serve::{End, Serving};
use crate::server::{self, Places, Server};
use bt_hci::param::{AddrKind, BdAddr};
use core::fmt::Write as _;
use core::pin::pin;
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_io_async::{Read, Write};
use heapless::String;
use sohle_shared::bonds::{BONDS, Bond, Bonds};
use sohle_shared::wire::bluetooth::{NAME_PREFIX, SERVICE, STATUS_MAX};
use sohle_shared::wire::message::Level;
use trouble_host::prelude::*;

/// Before the controller is reset after an error, and at most, when it fails again and again.
const PAUSE: Duration = Duration::from_millis(500);
const LONGEST_PAUSE: Duration = Duration::from_secs(16);
/// So long after the start, a connection or the opening of the window for pairing the shoe is found at once.
const EAGER: Duration = Duration::from_secs(60);
/// From one advertisement to the next then, and later.
const EAGER_INTERVAL: Duration = Duration::from_millis(100);
const IDLE_INTERVAL: Duration = Duration::from_millis(500);
/// Advertising begins anew so often: a controller that has lost its state shows it then.
const ADVERTISING: Duration = Duration::from_secs(30);

/// What the host stack needs, apart from the task: a few kilobytes.
///
/// One more bond than are kept: the new one is there before the oldest gives way.
pub type Resources = HostResources<DefaultPacketPool, 1, 1, 1, { BONDS + 1 }>;

/// Who this shoe is.
#[derive(Clone, Copy, Debug)]
pub struct Device {
    /// The address, the lowest byte first. It stays the same from boot to boot: by it laptops know the shoe again.
    pub address: [u8; 6],
    /// The board measures a battery.
    pub battery: bool,
}

impl Device {
    /// With an address made of what differs from board to board: a random static one (Bluetooth Core Specification 5.4,
    /// volume 6, part B, 1.3.2.1).
    pub fn new(mut unique: [u8; 6], battery: bool) -> Self {
        unique[5] |= 0b1100_0000;
        Self { address: unique, battery }
    }

    /// The name that laptops show.
    pub fn name(&self) -> String<12> {
        let [low, high, ..] = self.address;
        let mut name = String::new();
        // Ten letters.
        let _ = write!(name, "{NAME_PREFIX}{high:02X}{low:02X}");
        name
    }
}

type Stack<'s, 'a, R> = trouble_host::Stack<'s, Hci<'a, R>, DefaultPacketPool>;

/// Serves laptops by the controller at this line, for ever.
///
/// `bonds` are those that were kept, `entropy` gives random bytes of the board. To be run where it may take a while: pairing
/// computes for a tenth of a second and more.
pub async fn run<R: Read, W: Write>(
    radio: &Radio,
    (mut reader, mut writer): (R, W),
    device: Device,
    mut bonds: Bonds,
    mut entropy: impl FnMut() -> [u8; 32],
    resources: &mut Resources,
) -> ! {
    let mut pause = PAUSE;
    loop {
        let begun = Instant::now();
        // Each of these futures is made where it stays: moved, they would be on the stack as well.
        let error = {
            let session = pin!(session(radio, (&mut reader, &mut writer), device, &mut bonds, entropy(), resources));
            session.await
        };
        radio.open(false).await;
        radio.say(Level::Warn, error.words());
        pause = if begun.elapsed() > EAGER { PAUSE } else { (pause * 2).min(LONGEST_PAUSE) };
        Timer::after(pause).await;
    }
}

/// Until the controller fails.
async fn session<R: Read, W: Write>(
    radio: &Radio,
    (reader, writer): (&mut R, &mut W),
    device: Device,
    bonds: &mut Bonds,
    entropy: [u8; 32],
    resources: &mut Resources,
) -> Error {
    if let Err(error) = hci::reset(reader, writer).await {
        return error;
    }
    let out = Outward::new();
    let stack = stack(Hci::new(reader, &out, radio, entropy), device, bonds, resources);
    let mut status = [0; STATUS_MAX];
    let name = device.name();
    let (server, places) = server::build(&name, &mut status, device.battery);
    let mut runner = stack.runner();
    let run = pin!(runner.run());
    let serve = pin!(laptops(radio, &stack, &server, &places, &name, bonds));
    let pump = pin!(out.pump(writer));
    match select3(run, serve, pump).await {
        Either3::First(Ok(())) => Error::Silence,
        Either3::First(Err(error)) => cause(error),
        Either3::Second(error) | Either3::Third(error) => error,
    }
}

/// The host stack. Not inlined: what it takes of the stack is free again when it runs.
#[inline(never)]
fn stack<'s, 'a, R: Read>(
    controller: Hci<'a, R>,
    device: Device,
    bonds: &Bonds,
    resources: &'s mut Resources,
) -> Stack<'s, 'a, R> {
    let address = Address::new(AddrKind::RANDOM, BdAddr::new(device.address));
    let stack = trouble_host::new(controller, resources).set_random_address(address).build();
    for bond in bonds.iter() {
        // There is room for more than are kept.
        let _ = stack.add_bond_information(information(bond));
    }
    stack
}

/// One laptop after the other.
async fn laptops<R: Read>(
    radio: &Radio,
    stack: &Stack<'_, '_, R>,
    server: &Server<'_>,
    places: &Places,
    name: &str,
    bonds: &mut Bonds,
) -> Error {
    let mut eager_until = Instant::now() + EAGER;
    loop {
        let eager = radio.lets_pair() || Instant::now() < eager_until;
        let connection = match advertise(stack, name, eager).await {
            Ok(Some(connection)) => connection,
            Ok(None) => continue,
            Err(error) => return error,
        };
        let serving = Serving { radio, stack, server, places };
        let end = {
            let serve = pin!(serving.serve(connection, bonds));
            serve.await
        };
        radio.open(false).await;
        if let End::Failed(error) = end {
            return error;
        }
        eager_until = Instant::now() + EAGER;
    }
}

/// Waits for a laptop; `None` after a while.
async fn advertise<'s, R: Read>(
    stack: &'s Stack<'_, '_, R>,
    name: &str,
    eager: bool,
) -> Result<Option<Connection<'s, DefaultPacketPool>>, Error> {
    let interval = if eager { EAGER_INTERVAL } else { IDLE_INTERVAL };
    let parameters = AdvertisementParameters {
        interval_min: interval,
        interval_max: interval,
        ..AdvertisementParameters::default()
    };
    let (mut found, mut asked) = ([0; 31], [0; 31]);
    let service = [SERVICE.to_le_bytes()];
    let length = AdStructure::encode_slice(
        &[
            AdStructure::Flags(LE_GENERAL_DISCOVERABLE | BR_EDR_NOT_SUPPORTED),
            AdStructure::CompleteServiceUuids128(&service),
        ],
        &mut found,
    );
    let asked_length = AdStructure::encode_slice(&[AdStructure::CompleteLocalName(name.as_bytes())], &mut asked);
    // Both are shorter than 31 bytes.
    let (Ok(length), Ok(asked_length)) = (length, asked_length) else { return Err(Error::TooLong) };
    let data = Advertisement::ConnectableScannableUndirected {
        adv_data: found.get(..length).unwrap_or_default(),
        scan_data: asked.get(..asked_length).unwrap_or_default(),
    };
    let advertiser = stack.peripheral().advertise(&parameters, data).await.map_err(cause)?;
    match with_timeout(ADVERTISING, advertiser.accept()).await {
        Ok(Ok(connection)) => Ok(Some(connection)),
        Ok(Err(_)) | Err(_) => Ok(None),
    }
}

/// Why the controller has to be reset.
pub(crate) fn cause(error: BleHostError<Error>) -> Error {
    match error {
        BleHostError::Controller(error) => error,
        BleHostError::BleHost(_) => Error::Nonsense,
    }
}

/// A bond as the host stack knows it.
fn information(bond: &Bond) -> BondInformation {
    let address = Address::new(AddrKind::new(bond.address_kind), BdAddr::new(bond.address));
    let irk = bond.identity_key.and_then(IdentityResolvingKey::from_le_bytes);
    let key = LongTermKey::from_le_bytes(bond.long_term_key);
    BondInformation::new(Identity { addr: address, irk }, key, SecurityLevel::Encrypted, true)
}

/// The identity of a bond, for the host stack.
pub(crate) fn identity(bond: &Bond) -> Identity {
    information(bond).identity
}

/// A bond as it is kept.
pub(crate) fn kept(information: &BondInformation) -> Bond {
    let Identity { addr, irk } = information.identity;
    Bond {
        // An identity address that the controller has resolved is of one of the two kinds all the same.
        address_kind: addr.kind.as_raw() & 1,
        address: addr.addr.into_inner(),
        identity_key: irk.map(IdentityResolvingKey::to_le_bytes),
        long_term_key: information.ltk.to_le_bytes(),
    }
}
