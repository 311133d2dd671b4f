//! The attributes of the shoe: its own service, the Nordic UART service, and the battery's where there is one.

use heapless::Vec;
use sohle_shared::wire::bluetooth::{COMMANDS, SERVICE, STATUS, STATUS_MAX, STEPS, UART_RX, UART_SERVICE, UART_TX};
use trouble_host::prelude::*;

/// In-shoe sensor of a walk (Bluetooth Assigned Numbers, 2.6.3).
pub(crate) const APPEARANCE: BluetoothUuid16 = BluetoothUuid16::new(0x0441);
/// Attributes of all services: those of GAP and GATT, 9 of the shoe, 6 of the UART, 4 of the battery.
const ATTRIBUTES: usize = GAP_SERVICE_ATTRIBUTE_COUNT + 9 + 6 + 4;
/// Laptops whose subscriptions are remembered.
const CLIENTS: usize = 1;

/// The server.
pub(crate) type Server<'v> = AttributeServer<'v, Mutex, DefaultPacketPool, ATTRIBUTES, CLIENTS>;
/// All of Bluetooth runs in one executor.
pub(crate) type Mutex = embassy_sync::blocking_mutex::raw::NoopRawMutex;
/// Nothing is kept of what is notified or written: it passes.
pub(crate) type Stream = Characteristic<Vec<u8, 0>>;

/// Where things are in the server.
pub(crate) struct Places {
    pub(crate) steps: Stream,
    pub(crate) commands: Stream,
    pub(crate) status: Characteristic<Vec<u8, STATUS_MAX>>,
    pub(crate) uart_tx: Stream,
    pub(crate) uart_rx: Stream,
    pub(crate) battery: Option<Characteristic<u8>>,
}

/// All attributes of a device of this name. None of the shoe's own can be read, written or subscribed to on an open link.
/// Not inlined: what it takes of the stack is free again when the server serves.
#[inline(never)]
pub(crate) fn build<'v>(name: &'v str, status: &'v mut [u8; STATUS_MAX], battery: bool) -> (Server<'v>, Places) {
    let mut table = AttributeTable::new();
    let profile = GapConfig::Peripheral(PeripheralConfig { name, appearance: &APPEARANCE });
    // Fails for a name of more than 22 letters only.
    let _ = profile.build(&mut table);
    let uuid = |number: u128| Uuid::new_long(number.to_le_bytes());

    let mut service = table.add_service(Service::new(uuid(SERVICE)));
    let steps = notified(&mut service, uuid(STEPS));
    let commands = written(&mut service, uuid(COMMANDS));
    let status = service
        .add_characteristic(uuid(STATUS), [CharacteristicProp::Read, CharacteristicProp::Notify], Vec::new(), status)
        .read_permission(PermissionLevel::EncryptionRequired)
        .cccd_permission(PermissionLevel::EncryptionRequired)
        .build();
    service.build();

    let mut service = table.add_service(Service::new(uuid(UART_SERVICE)));
    let uart_rx = written(&mut service, uuid(UART_RX));
    let uart_tx = notified(&mut service, uuid(UART_TX));
    service.build();

    let battery = battery.then(|| {
        let mut service = table.add_service(Service::new(service::BATTERY));
        let props = [CharacteristicProp::Read, CharacteristicProp::Notify];
        let level = service.add_characteristic_small(characteristic::BATTERY_LEVEL, props, 100_u8).build();
        service.build();
        level
    });
    (Server::new(table), Places { steps, commands, status, uart_tx, uart_rx, battery })
}

fn notified(service: &mut ServiceBuilder<'_, '_, Mutex, ATTRIBUTES>, uuid: Uuid) -> Stream {
    let stream = service.add_characteristic_small(uuid, [CharacteristicProp::Notify], Vec::new());
    stream.cccd_permission(PermissionLevel::EncryptionRequired).build()
}

fn written(service: &mut ServiceBuilder<'_, '_, Mutex, ATTRIBUTES>, uuid: Uuid) -> Stream {
    let props = [CharacteristicProp::Write, CharacteristicProp::WriteWithoutResponse];
    let stream = service.add_characteristic_small(uuid, props, Vec::new());
    stream.write_permission(PermissionLevel::EncryptionRequired).build()
}
