//! The controller at the other end of a serial line, as the host stack wants it.
//!
//! Each packet of the line is looked at before the stack sees it ([`packet`](crate::packet)), one command is under way at
//! a time, and one that is not answered soon is an error. What is sent is handed over in whole packets, so that nobody who
//! stops to wait leaves half of one on the line.
//!
//! # Source
//! Bluetooth Core Specification 5.4, volume 4, part A (UART transport, H4) and part E (HCI).

use crate::packet::{self, Fate};
use crate::radio::Radio;
use bt_hci::cmd::le::LeRand;
use bt_hci::cmd::{self, AsyncCmd, Cmd, SyncCmd};
use bt_hci::controller::{Controller, ControllerCmdAsync, ControllerCmdSync};
use bt_hci::data::{AclPacket, IsoPacket, SyncPacket};
use bt_hci::param::Status;
use bt_hci::transport::{PacketKind, PacketToController, WithIndicator};
use bt_hci::{ControllerToHostPacket, FromHciBytes};
use core::cell::Cell;
use core::fmt;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::mutex::Mutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read, Write};
use heapless::Vec;

/// A command is answered within this time. Real controllers take a millisecond.
const PATIENCE: Duration = Duration::from_secs(2);
/// A packet that began is whole within this time.
const PACKET_PATIENCE: Duration = Duration::from_millis(500);
/// After a reset the controller answers within this time.
const RESET_PATIENCE: Duration = Duration::from_secs(1);

/// The longest packet: kind, header and 255 bytes of data.
const PACKET_MAX: usize = 1 + 4 + 255;
/// The longest answer to a command that is sent here.
const ANSWER_MAX: usize = 32;

/// Codes of events that are looked at here.
const COMMAND_COMPLETE: u8 = 0x0e;
const COMMAND_STATUS: u8 = 0x0f;
const HARDWARE_ERROR: u8 = 0x10;
const PACKETS_SENT: u8 = 0x13;

/// Why the controller has to be reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The serial line failed.
    Line,
    /// What it says makes no sense.
    Nonsense,
    /// It did not answer.
    Silence,
    /// It tells of a fault of its own.
    Fault,
    /// A packet for it is too long.
    TooLong,
}

impl Error {
    /// In words, for the log.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Line => "Bluetooth: the line to the controller failed",
            Self::Nonsense => "Bluetooth: the controller says what makes no sense",
            Self::Silence => "Bluetooth: the controller does not answer",
            Self::Fault => "Bluetooth: the controller tells of a fault",
            Self::TooLong => "Bluetooth: a packet is too long for the controller",
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.words())
    }
}

impl core::error::Error for Error {}

impl embedded_io::Error for Error {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

/// The answer to a command.
struct Answer {
    status: u8,
    parameters: Vec<u8, ANSWER_MAX>,
}

/// Whole packets that wait for the line.
pub struct Outward(Channel<NoopRawMutex, Vec<u8, PACKET_MAX>, 2>);

impl Outward {
    /// Nothing waits.
    pub const fn new() -> Self {
        Self(Channel::new())
    }

    /// Empties them into the line until it fails.
    pub async fn pump(&self, mut writer: impl Write) -> Error {
        loop {
            let packet = self.0.receive().await;
            if writer.write_all(&packet).await.is_err() {
                return Error::Line;
            }
        }
    }
}

impl Default for Outward {
    fn default() -> Self {
        Self::new()
    }
}

/// The controller.
pub struct Hci<'a, R> {
    reader: Mutex<NoopRawMutex, R>,
    out: &'a Outward,
    /// One command at a time.
    turn: Mutex<NoopRawMutex, ()>,
    asked: Cell<Option<u16>>,
    answer: Signal<NoopRawMutex, Answer>,
    /// The controller takes a command.
    ready: Cell<bool>,
    ready_again: Signal<NoopRawMutex, ()>,
    radio: &'a Radio,
    /// Mixed into the random numbers of the controller.
    entropy: Cell<[u8; 32]>,
    /// Data packets of our own that the controller has not sent yet.
    own: Cell<u16>,
}

/// Resets the controller, and reads over all that it said before: after a fault, nobody knows where a packet begins.
pub async fn reset(reader: &mut impl Read, writer: &mut impl Write) -> Result<(), Error> {
    const RESET: [u8; 4] = [0x01, 0x03, 0x0c, 0x00];
    /// Command complete: five parameters would be one too many; any number of commands may be sent; reset; success.
    const DONE: [Option<u8>; 7] = [Some(0x04), Some(0x0e), Some(0x04), None, Some(0x03), Some(0x0c), Some(0x00)];
    let reset = async {
        writer.write_all(&RESET).await.map_err(|_| Error::Line)?;
        let mut last = [0; DONE.len()];
        while !last.iter().zip(DONE).all(|(&byte, wanted)| wanted.is_none_or(|wanted| wanted == byte)) {
            last.rotate_left(1);
            let [.., newest] = &mut last;
            read(reader, core::slice::from_mut(newest)).await?;
        }
        Ok(())
    };
    with_timeout(RESET_PATIENCE, reset).await.unwrap_or(Err(Error::Silence))
}

impl<'a, R: Read> Hci<'a, R> {
    /// Before the first byte. `entropy` is random; keys are made of it and of the controller's own random numbers.
    pub fn new(reader: R, out: &'a Outward, radio: &'a Radio, entropy: [u8; 32]) -> Self {
        Self {
            reader: Mutex::new(reader),
            out,
            turn: Mutex::new(()),
            asked: Cell::new(None),
            answer: Signal::new(),
            ready: Cell::new(true),
            ready_again: Signal::new(),
            radio,
            entropy: Cell::new(entropy),
            own: Cell::new(0),
        }
    }

    async fn send<P: PacketToController>(&self, packet: &P) -> Result<(), Error> {
        let mut bytes = [0; PACKET_MAX];
        let mut left = &mut bytes[..];
        WithIndicator::new(packet).write_hci(&mut left).map_err(|_| Error::TooLong)?;
        let length = PACKET_MAX - left.len();
        let packet = Vec::from_slice(bytes.get(..length).unwrap_or_default()).map_err(|_| Error::TooLong)?;
        self.out.0.send(packet).await;
        Ok(())
    }

    /// Sends a command and waits for its answer.
    async fn ask<C: Cmd>(&self, command: &C) -> Result<Answer, Error> {
        let _turn = self.turn.lock().await;
        while !self.ready.get() {
            with_timeout(PATIENCE, self.ready_again.wait()).await.map_err(|_| Error::Silence)?;
        }
        self.answer.reset();
        self.asked.set(Some(C::OPCODE.to_raw()));
        self.send(command).await?;
        with_timeout(PATIENCE, self.answer.wait()).await.map_err(|_| Error::Silence)
    }

    /// Reads a packet; its kind and length.
    async fn receive(&self, packet: &mut [u8; PACKET_MAX]) -> Result<(PacketKind, usize), Error> {
        let mut reader = self.reader.lock().await;
        let [kind, packet @ ..] = packet;
        read(&mut *reader, core::slice::from_mut(kind)).await?;
        let (kind, header) = match *kind {
            0x02 => (PacketKind::AclData, 4),
            0x04 => (PacketKind::Event, 2),
            _ => return Err(Error::Nonsense),
        };
        let rest = async {
            read(&mut *reader, packet.get_mut(..header).unwrap_or_default()).await?;
            let length = match (kind, &packet[..4]) {
                (PacketKind::Event, &[_, length, ..]) => usize::from(length),
                (_, &[_, _, low, high]) => usize::from(u16::from_le_bytes([low, high])),
                _ => 0,
            };
            let data = packet.get_mut(header..header + length).ok_or(Error::Nonsense)?;
            read(&mut *reader, data).await?;
            Ok((kind, header + length))
        };
        with_timeout(PACKET_PATIENCE, rest).await.unwrap_or(Err(Error::Nonsense))
    }

    /// Whether the packet is for the host stack.
    async fn is_for_host(&self, kind: PacketKind, packet: &mut [u8]) -> Result<bool, Error> {
        let fate = match (kind, &mut *packet) {
            (PacketKind::AclData, [low, high, _, _, data @ ..]) => {
                packet::data(u16::from_le_bytes([*low, *high]), data)
            }
            (PacketKind::Event, [COMMAND_COMPLETE, _, parameters @ ..]) => {
                return self.completed(parameters).map(|()| false);
            }
            (PacketKind::Event, [COMMAND_STATUS, _, parameters @ ..]) => {
                return self.started(parameters).map(|()| false);
            }
            (PacketKind::Event, [HARDWARE_ERROR, ..]) => return Err(Error::Fault),
            (PacketKind::Event, whole) => packet::event(whole),
            _ => Fate::Nonsense,
        };
        if let (PacketKind::Event, Fate::Pass, [PACKETS_SENT, _, parameters @ ..]) = (kind, fate, packet) {
            let mut own = self.own.get();
            packet::discount(parameters, &mut own);
            self.own.set(own);
        }
        match fate {
            Fate::Pass => Ok(true),
            Fate::Drop => Ok(false),
            Fate::Nonsense => Err(Error::Nonsense),
            Fate::Pairing(_, true) if self.radio.lets_pair() => Ok(true),
            Fate::Pairing(handle, bonding) => {
                self.own.set(self.own.get().saturating_add(1));
                let refusal = packet::refusal(handle, bonding);
                self.out.0.send(refusal.iter().copied().collect()).await;
                Ok(false)
            }
        }
    }

    /// A command is complete.
    fn completed(&self, parameters: &[u8]) -> Result<(), Error> {
        let [commands, low, high, rest @ ..] = parameters else { return Err(Error::Nonsense) };
        self.accepts(*commands);
        match (u16::from_le_bytes([*low, *high]), rest) {
            // It only tells that it takes commands.
            (0, _) => Ok(()),
            (opcode, [status, rest @ ..]) => self.answered(opcode, *status, rest),
            _ => Err(Error::Nonsense),
        }
    }

    /// A command is under way, or was refused.
    fn started(&self, parameters: &[u8]) -> Result<(), Error> {
        let &[status, commands, low, high] = parameters else { return Err(Error::Nonsense) };
        self.accepts(commands);
        self.answered(u16::from_le_bytes([low, high]), status, &[])
    }

    fn accepts(&self, commands: u8) {
        self.ready.set(commands > 0);
        if commands > 0 {
            self.ready_again.signal(());
        }
    }

    fn answered(&self, opcode: u16, status: u8, parameters: &[u8]) -> Result<(), Error> {
        // Of a command that nobody waits for any more.
        if self.asked.get() != Some(opcode) {
            return Ok(());
        }
        self.asked.set(None);
        let parameters = Vec::from_slice(parameters).map_err(|_| Error::Nonsense)?;
        self.answer.signal(Answer { status, parameters });
        Ok(())
    }

    /// Mixes our own entropy into what the controller calls random.
    fn mix(&self, random: &mut [u8]) {
        let mut entropy = self.entropy.get();
        random.iter_mut().zip(&entropy).for_each(|(byte, own)| *byte ^= own);
        entropy.rotate_left(random.len().min(32));
        self.entropy.set(entropy);
    }
}

async fn read(reader: &mut impl Read, bytes: &mut [u8]) -> Result<(), Error> {
    reader.read_exact(bytes).await.map_err(|_| Error::Line)
}

impl<R: Read> embedded_io::ErrorType for Hci<'_, R> {
    type Error = Error;
}

impl<R: Read> Controller for Hci<'_, R> {
    type Buffer<'b> = [u8; PACKET_MAX];

    fn alloc_buf(&self) -> Result<Self::Buffer<'_>, Error> {
        Ok([0; PACKET_MAX])
    }

    async fn write_acl_data(&self, packet: &AclPacket<'_>) -> Result<(), Error> {
        self.send(packet).await
    }

    async fn write_sync_data(&self, packet: &SyncPacket<'_>) -> Result<(), Error> {
        self.send(packet).await
    }

    async fn write_iso_data(&self, packet: &IsoPacket<'_>) -> Result<(), Error> {
        self.send(packet).await
    }

    async fn read<'b>(&self, buffer: &'b mut Self::Buffer<'_>) -> Result<ControllerToHostPacket<'b>, Error> {
        let (kind, length) = loop {
            let (kind, length) = self.receive(buffer).await?;
            let packet = buffer.get_mut(1..=length).unwrap_or_default();
            if self.is_for_host(kind, packet).await? {
                break (kind, length);
            }
        };
        let packet = buffer.get(1..=length).unwrap_or_default();
        match ControllerToHostPacket::from_hci_bytes_with_kind(kind, packet) {
            Ok((packet, [])) => Ok(packet),
            _ => Err(Error::Nonsense),
        }
    }
}

impl<R: Read, C: SyncCmd> ControllerCmdSync<C> for Hci<'_, R> {
    async fn exec(&self, command: &C) -> Result<C::Return, cmd::Error<Error>> {
        let Answer { status, mut parameters } = self.ask(command).await.map_err(cmd::Error::Io)?;
        Status::from(status).to_result().map_err(cmd::Error::Hci)?;
        if C::OPCODE == LeRand::OPCODE {
            self.mix(&mut parameters);
        }
        C::Return::from_hci_bytes_complete(&parameters).map_err(|_| cmd::Error::Io(Error::Nonsense))
    }
}

impl<R: Read, C: AsyncCmd> ControllerCmdAsync<C> for Hci<'_, R> {
    async fn exec(&self, command: &C) -> Result<(), cmd::Error<Error>> {
        let answer = self.ask(command).await.map_err(cmd::Error::Io)?;
        Status::from(answer.status).to_result().map_err(cmd::Error::Hci)
    }
}
