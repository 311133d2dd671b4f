//! Packets of the controller, before the host stack sees them: the stack takes for granted that they are well formed.
//!
//! # Source
//! Bluetooth Core Specification 5.4, volume 4, part E (HCI) and part A (UART transport), volume 3, parts A (L2CAP), F (ATT)
//! and H (security manager).

use bt_hci::FromHciBytes;
use bt_hci::event::le::{
    LeAdvertisingSetTerminated, LeConnectionComplete, LeConnectionUpdateComplete, LeDataLengthChange,
    LeEnhancedConnectionComplete, LeEventKind, LeEventPacket, LeFrameSpaceUpdateComplete, LeLongTermKeyRequest,
    LePhyUpdateComplete, LeRemoteConnectionParameterRequest,
};
use bt_hci::event::{
    DisconnectionComplete, EncryptionChangeV1, EncryptionKeyRefreshComplete, EventKind, EventPacket,
    NumberOfCompletedPackets,
};

/// Channel of the attribute protocol.
const ATTRIBUTES: u16 = 4;
/// Channel on which connections are negotiated.
const SIGNALS: u16 = 5;
/// Channel of the security manager.
const SECURITY: u16 = 6;
/// Command of the security manager that begins to pair.
const PAIRING_REQUEST: u8 = 0x01;
/// Its length with the code.
const PAIRING_REQUEST_LENGTH: usize = 7;
/// Bit of its authentication requirements: the keys are kept.
const BONDING: u8 = 0b01;
/// Attribute request that tells how long a packet may be, and its smallest length.
const EXCHANGE_MTU: u8 = 0x02;
const SMALLEST_MTU: u16 = 23;

/// What is to be done with a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fate {
    /// It goes on to the host stack.
    Pass,
    /// Nobody needs it, or a peer sent what makes no sense.
    Drop,
    /// A peer on this connection wants to pair and does not want to keep the keys (`false`), or does.
    Pairing(u16, bool),
    /// No working controller says this.
    Nonsense,
}

fn word(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..)?.first_chunk().map(|word| u16::from_le_bytes(*word))
}

/// The fate of an event: a whole packet.
pub(crate) fn event(packet: &[u8]) -> Fate {
    let Ok(EventPacket { kind, data: parameters }) = EventPacket::from_hci_bytes_complete(packet) else {
        return Fate::Nonsense;
    };
    let read = |is_read: bool| if is_read { Fate::Pass } else { Fate::Nonsense };
    match kind {
        EventKind::DisconnectionComplete => read(whole::<DisconnectionComplete>(parameters)),
        EventKind::EncryptionChangeV1 => read(whole::<EncryptionChangeV1>(parameters)),
        EventKind::EncryptionKeyRefreshComplete => read(whole::<EncryptionKeyRefreshComplete>(parameters)),
        EventKind::NumberOfCompletedPackets => read(whole::<NumberOfCompletedPackets<'_>>(parameters)),
        EventKind::Le => low_energy(parameters),
        _ => Fate::Drop,
    }
}

fn low_energy(parameters: &[u8]) -> Fate {
    let Ok(event) = LeEventPacket::from_hci_bytes_complete(parameters) else { return Fate::Nonsense };
    let is_read = match event.kind {
        LeEventKind::LeConnectionComplete => whole::<LeConnectionComplete>(event.data),
        LeEventKind::LeEnhancedConnectionComplete => whole::<LeEnhancedConnectionComplete>(event.data),
        LeEventKind::LeConnectionUpdateComplete => whole::<LeConnectionUpdateComplete>(event.data),
        LeEventKind::LeLongTermKeyRequest => whole::<LeLongTermKeyRequest>(event.data),
        LeEventKind::LeDataLengthChange => whole::<LeDataLengthChange>(event.data),
        LeEventKind::LePhyUpdateComplete => whole::<LePhyUpdateComplete>(event.data),
        LeEventKind::LeAdvertisingSetTerminated => whole::<LeAdvertisingSetTerminated>(event.data),
        LeEventKind::LeFrameSpaceUpdateComplete => whole::<LeFrameSpaceUpdateComplete>(event.data),
        LeEventKind::LeRemoteConnectionParameterRequest => whole::<LeRemoteConnectionParameterRequest>(event.data),
        _ => return Fate::Drop,
    };
    if is_read { Fate::Pass } else { Fate::Nonsense }
}

fn whole<'a, T: FromHciBytes<'a>>(bytes: &'a [u8]) -> bool {
    T::from_hci_bytes_complete(bytes).is_ok()
}

/// The fate of data that came by radio: its header, and what follows.
pub(crate) fn data(header: u16, data: &[u8]) -> Fate {
    const FIRST: u16 = 0b10;
    const CONTINUING: u16 = 0b01;
    match header >> 12 {
        CONTINUING => return Fate::Pass,
        FIRST => {}
        // Broadcasts, and what only a host sends.
        _ => return Fate::Drop,
    }
    let (Some(length), Some(channel), Some(payload)) = (word(data, 0), word(data, 2), data.get(4..)) else {
        return Fate::Drop;
    };
    if length == 0 || payload.is_empty() || payload.len() > usize::from(length) {
        return Fate::Drop;
    }
    match (channel, payload[0]) {
        (ATTRIBUTES, code) if !is_request(code, length) => Fate::Drop,
        (ATTRIBUTES, EXCHANGE_MTU) if word(payload, 1).is_none_or(|mtu| mtu < SMALLEST_MTU) => Fate::Drop,
        (SECURITY, PAIRING_REQUEST) => {
            let bonding = payload.len() == PAIRING_REQUEST_LENGTH && payload[3] & 0b11 == BONDING;
            Fate::Pairing(header & 0x0fff, bonding)
        }
        (ATTRIBUTES | SECURITY | SIGNALS, _) => Fate::Pass,
        _ => Fate::Drop,
    }
}

/// Whether this is the code of what a client says, and the packet as long as it has to be. What no server knows is answered
/// with an error by the host stack.
fn is_request(code: u8, length: u16) -> bool {
    match code {
        // Exchange MTU, read.
        0x02 | 0x0a => length == 3,
        // Find information, read blob.
        0x04 | 0x0c => length == 5,
        // Find by type value.
        0x06 => length >= 7,
        // Read by type: a short or a long UUID.
        0x08 => length == 7 || length == 21,
        // Read by group type: the types of groups are short.
        0x10 => length == 7,
        // Read multiple (by the specification, and as the host stack has it), prepare write.
        0x0e | 0x20 | 0x16 => length >= 5,
        // Write request and command.
        0x12 | 0x52 => length >= 3,
        // Execute write.
        0x18 => length == 2,
        // Odd codes are those of servers.
        _ => code.is_multiple_of(2),
    }
}

/// The packet that refuses to pair.
pub(crate) fn refusal(handle: u16, bonding: bool) -> [u8; 11] {
    const DATA: u8 = 0x02;
    const FAILED: u8 = 0x05;
    const NOT_SUPPORTED: u8 = 0x05;
    const REQUIREMENTS: u8 = 0x03;
    let [low, high] = handle.to_le_bytes();
    let reason = if bonding { NOT_SUPPORTED } else { REQUIREMENTS };
    [DATA, low, high, 6, 0, 2, 0, SECURITY as u8, 0, FAILED, reason]
}

/// Takes packets of our own out of an event that tells how many were sent: the host stack does not know of them.
pub(crate) fn discount(parameters: &mut [u8], own: &mut u16) {
    let Some((_, entries)) = parameters.split_first_mut() else { return };
    for entry in entries.chunks_exact_mut(4) {
        let sent = u16::from_le_bytes([entry[2], entry[3]]);
        let less = sent.min(*own);
        *own -= less;
        entry[2..].copy_from_slice(&(sent - less).to_le_bytes());
    }
}
