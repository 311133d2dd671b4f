"""A laptop on the virtual radio: finds the shoe, connects, pairs, and bridges the shoe's bytes to a port of this machine."""

import asyncio
import contextlib
import hashlib

from bumble import hci
from bumble.core import UUID, AdvertisingData, BaseBumbleError
from bumble.device import ConnectionParametersPreferences, Device, DeviceConfiguration, Peer
from bumble.hci import Address
from bumble.host import Host
from bumble.pairing import PairingConfig, PairingDelegate

from air import Radio

# The same as in shared/src/wire/bluetooth.rs; a test of xtask compares them.
SERVICE = "53480001-8e1f-4c6b-9a0d-736f686c6500"
STEPS = "53480002-8e1f-4c6b-9a0d-736f686c6500"
COMMANDS = "53480003-8e1f-4c6b-9a0d-736f686c6500"
STATUS = "53480004-8e1f-4c6b-9a0d-736f686c6500"
UART_SERVICE = "6e400001-b5a3-f393-e0a9-e50e24dcca9e"
UART_RX = "6e400002-b5a3-f393-e0a9-e50e24dcca9e"
UART_TX = "6e400003-b5a3-f393-e0a9-e50e24dcca9e"

# Attribute MTU that is asked for; the header of a write and of a notification.
MTU, HEADER_BYTES = 247, 3
# What Linux asks for: 30 to 50 ms, no latency, and a supervision timeout of 420 ms.
LINUX = {hci.HCI_LE_1M_PHY: ConnectionParametersPreferences(30, 50, 0, 420)}
# Air time of the longest packet on the LE 1M PHY.
LONG_OCTETS, LONG_US = 251, 2120
# What does not happen within so many seconds does not happen.
PATIENCE_S = 10
# Between two tries to connect.
PAUSE_S = 0.5


class Refused(Exception):
    """The shoe does not want this."""


# How what is tried here fails.
FAULTS = BaseBumbleError, TimeoutError, Refused


def told(fault):
    """A fault in one line."""
    return getattr(fault, "error_name", "") or str(fault) or type(fault).__name__


class Laptop:
    """A central with a store of keys. It keeps connected to the shoe while it is wanted."""

    def __init__(self, air, name, address, keys, tell):
        self.tell = tell
        self.name = name
        radio = Radio(name, link=air, public_address=Address(address, Address.PUBLIC_DEVICE_ADDRESS))
        config = DeviceConfiguration(name=name, address=Address(address), keystore=keys and f"JsonKeyStore:{keys}")
        config.irk = hashlib.sha256(address.encode()).digest()[:16]
        self.device = Device(config=config, host=Host(radio, radio))
        self.radio = radio
        delegate = PairingDelegate(PairingDelegate.IoCapability.NO_OUTPUT_NO_INPUT)
        self.device.pairing_config_factory = lambda _: PairingConfig(sc=True, mitm=False, bonding=True, delegate=delegate)
        self.connection = self.peer = self.server = self.client = None
        self.keeper = None
        self.up = asyncio.Event()
        self.received = 0
        self.fault = None

    async def power_on(self):
        await self.device.power_on()

    async def find(self):
        """The address of a device that advertises the service or the name of a shoe."""
        found, shoes = asyncio.get_running_loop().create_future(), set()

        def seen(advertisement):
            data = advertisement.data
            services = data.get(AdvertisingData.Type.INCOMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS) or []
            services += data.get(AdvertisingData.Type.COMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS) or []
            name = data.get(AdvertisingData.Type.COMPLETE_LOCAL_NAME) or ""
            if UUID(SERVICE) in services:
                shoes.add(advertisement.address)
            # The name may come later, in the answer to the scan.
            if name and (advertisement.address in shoes or name.startswith("Sohle-")) and not found.done():
                found.set_result((advertisement.address, name))

        self.device.on("advertisement", seen)
        try:
            await self.device.start_scanning()
            return await asyncio.wait_for(found, PATIENCE_S)
        finally:
            self.device.remove_listener("advertisement", seen)
            await self.device.stop_scanning()

    async def bonded(self, address):
        """Whether there is a bond with the device of this address."""
        return await self.device.keystore.get(str(address)) is not None

    async def connect(self, to=None, pair=False, bonded=True):
        """Connects once, as far as services and characteristics, to a device by address and name or to what is found.

        `bonded` is to encrypt with the key of the bond, `pair` to make one if there is none.
        """
        address, name = to or await self.find()
        connection = await self.device.connect(
            address, connection_parameters_preferences=LINUX, own_address_type=hci.OwnAddressType.PUBLIC, timeout=PATIENCE_S
        )
        self.connection = connection
        connection.on("disconnection", lambda reason: self.lost(connection, reason))
        try:
            await asyncio.wait_for(self.prepare(connection, pair, bonded), PATIENCE_S)
        except BaseException as error:
            # Bumble cancels what it waits for when the connection ends; nobody has cancelled this.
            if isinstance(error, asyncio.CancelledError) and not asyncio.current_task().cancelling():
                raise Refused("the connection was lost") from error
            await self.disconnect()
            raise
        self.tell(event="connected", laptop=self.name, shoe=name, address=str(address), **self.facts())

    async def prepare(self, connection, pair, bonded):
        await connection.set_data_length(LONG_OCTETS, LONG_US)
        known = await self.bonded(connection.peer_address)
        if pair and not known:
            await connection.pair()
        elif bonded:
            if not known:
                raise Refused("there is no bond")
            await connection.encrypt()
        self.peer = Peer(connection)
        await self.peer.request_mtu(MTU)
        await self.peer.discover_services()
        await self.peer.discover_characteristics()

    def characteristic(self, uuid):
        found = self.peer.get_characteristics_by_uuid(UUID(uuid))
        if not found:
            raise Refused(f"the shoe has no characteristic {uuid}")
        return found[0]

    def facts(self):
        if not self.connection:
            raise Refused("the connection was lost")
        link = self.radio.link.find(self.radio.find_le_connection_by_handle(self.connection.handle))[0]
        mtu = self.peer.gatt_client.mtu if self.peer else 23
        facts = {"mtu": mtu, "encrypted": bool(self.connection.encryption)}
        if link:
            facts |= {
                "interval_ms": link.interval * 1e3, "latency": link.latency, "timeout_ms": link.timeout * 1e3,
                "phy": link.phy.name, "octets": link.ends[1].octets,
            }
        return facts

    def lost(self, connection, reason):
        if self.connection is not connection:
            return
        self.tell(event="disconnected", laptop=self.name, reason=hci.HCI_ErrorCode(reason).name)
        self.connection = self.peer = None
        self.up.clear()
        if self.client:
            self.client.close()

    async def disconnect(self):
        if connection := self.connection:
            with contextlib.suppress(BaseBumbleError, TimeoutError):
                await asyncio.wait_for(connection.disconnect(), PATIENCE_S)

    def keep(self):
        """From now on connects whenever the shoe can be heard."""
        if not self.keeper:
            self.keeper = asyncio.create_task(self.keep_connected())

    async def keep_connected(self):
        while True:
            if self.connection is None:
                try:
                    await self.connect()
                    self.up.set()
                    self.fault = None
                except FAULTS as error:
                    self.fault = told(error)
            await asyncio.sleep(PAUSE_S)

    async def leave(self):
        """From now on does not connect."""
        if self.keeper:
            self.keeper.cancel()
            self.keeper = None
        await self.disconnect()

    async def bridge(self, port, subscribe=True):
        """Serves one program at a time on a port of this machine: bytes of the steps out, bytes of the commands in."""

        async def serve(reader, writer):
            # As with a port that is not there: whoever connects is sent away and tries again.
            if not self.peer or self.client:
                writer.close()
                return
            self.client = writer
            try:
                await self.carry(reader, writer, subscribe)
            except (*FAULTS, OSError) as error:
                self.tell(event="bridge", laptop=self.name, fault=told(error))
            finally:
                self.client = None
                writer.close()

        self.server = await asyncio.start_server(serve, "127.0.0.1", port)

    async def carry(self, reader, writer, subscribe):
        commands, steps = self.characteristic(COMMANDS), self.characteristic(STEPS)
        piece = self.peer.gatt_client.mtu - HEADER_BYTES

        def received(value):
            self.received += len(value)
            writer.write(value)

        if subscribe:
            await steps.subscribe(received)
        try:
            while data := await reader.read(4096):
                for start in range(0, len(data), piece):
                    await commands.write_value(data[start : start + piece], with_response=subscribe)
        finally:
            if self.peer and subscribe:
                with contextlib.suppress(BaseBumbleError, TimeoutError):
                    await asyncio.wait_for(steps.unsubscribe(received), PATIENCE_S)
