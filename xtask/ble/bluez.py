"""The part of BlueZ that a GATT client sees, for the laptop of the virtual radio.

`sohle live ble:...` talks to BlueZ over the D-Bus. Here the same objects stand on a private bus, and what is asked of
them is done on the virtual radio, so that the program is tested with all the code that it uses with a real adapter. Only
what a client like btleplug uses is here, as BlueZ documents it (doc/org.bluez.Adapter.rst, org.bluez.Device.rst,
org.bluez.GattService.rst and org.bluez.GattCharacteristic.rst).
"""

import asyncio
from typing import Annotated

from bumble.core import AdvertisingData
from bumble.gatt import Characteristic as Attribute
from dbus_fast import DBusError, PropertyAccess, Variant
from dbus_fast.aio import MessageBus
from dbus_fast.annotations import (
    DBusBool, DBusBytes, DBusInt16, DBusObjectPath, DBusSignature, DBusStr, DBusUInt16, DBusUInt32,
)
from dbus_fast.service import ServiceInterface, dbus_method, dbus_property

from laptop import FAULTS, PATIENCE_S, told

DBusStrings = Annotated[list[str], DBusSignature("as")]
DBusOptions = Annotated[dict[str, Variant], DBusSignature("a{sv}")]

ADAPTER = "/org/bluez/hci0"
# A device that was not heard for so long, and is not connected, is forgotten; BlueZ takes longer.
FORGET_S = 3
# What BlueZ pairs for, and tries again.
UNPAIRED = {"INSUFFICIENT_AUTHENTICATION", "INSUFFICIENT_ENCRYPTION", "INSUFFICIENT_AUTHORIZATION"}
FLAGS = {
    Attribute.Properties.READ: "read",
    Attribute.Properties.WRITE_WITHOUT_RESPONSE: "write-without-response",
    Attribute.Properties.WRITE: "write",
    Attribute.Properties.NOTIFY: "notify",
    Attribute.Properties.INDICATE: "indicate",
}


def read_only(getter):
    """A property that only BlueZ changes."""
    return dbus_property(PropertyAccess.READ)(getter)


def failed(error):
    return DBusError("org.bluez.Error.Failed", told(error))


class Adapter(ServiceInterface):
    """The laptop's controller."""

    def __init__(self, bus, laptop):
        super().__init__("org.bluez.Adapter1")
        self.bus, self.laptop = bus, laptop
        self.powered, self.devices, self.scanners = True, {}, 0
        laptop.device.on("advertisement", self.seen)
        self.forgetting = asyncio.create_task(self.forget())

    def seen(self, advertisement):
        address = str(advertisement.address).removesuffix("/P")
        if not (device := self.devices.get(address)):
            device = self.devices[address] = Device(self, advertisement.address, address)
            device.take(advertisement)
            self.bus.export(device.path, device)
        device.take(advertisement)

    async def forget(self):
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(FORGET_S / 3)
            for address, device in list(self.devices.items()):
                if not device.connected and not device.connecting and loop.time() - device.heard > FORGET_S:
                    del self.devices[address]
                    self.bus.unexport(device.path)

    @dbus_method()
    async def StartDiscovery(self) -> None:
        self.scanners += 1
        if self.scanners == 1:
            await self.laptop.device.start_scanning()

    @dbus_method()
    async def StopDiscovery(self) -> None:
        if self.scanners == 0:
            raise DBusError("org.bluez.Error.Failed", "No discovery started")
        self.scanners -= 1
        if self.scanners == 0:
            await self.laptop.device.stop_scanning()

    @dbus_method()
    def SetDiscoveryFilter(self, _properties: DBusOptions) -> None:
        pass

    @read_only
    def Address(self) -> DBusStr:
        return str(self.laptop.device.public_address).removesuffix("/P")

    @read_only
    def AddressType(self) -> DBusStr:
        return "public"

    @read_only
    def Name(self) -> DBusStr:
        return self.laptop.name

    @read_only
    def Alias(self) -> DBusStr:
        return self.laptop.name

    @read_only
    def Class(self) -> DBusUInt32:
        return 0

    @dbus_property()
    def Powered(self) -> DBusBool:
        return self.powered

    @Powered.setter
    def Powered(self, powered: DBusBool):
        self.powered = powered

    @read_only
    def Discovering(self) -> DBusBool:
        return self.scanners > 0

    @read_only
    def Modalias(self) -> DBusStr:
        return "usb:v1D6Bp0246d0542"


class Device(ServiceInterface):
    """A device that the laptop hears or is connected to."""

    def __init__(self, adapter, peer, address):
        super().__init__("org.bluez.Device1")
        self.adapter, self.laptop, self.peer, self.address = adapter, adapter.laptop, peer, address
        self.path = f"{ADAPTER}/dev_{address.replace(':', '_')}"
        self.label, self.services, self.signal = "", [], 0
        self.connected = self.connecting = self.resolved = False
        self.objects, self.heard = [], 0.0

    def take(self, advertisement):
        """What a device says of itself."""
        kinds, data = AdvertisingData.Type, advertisement.data
        self.heard = asyncio.get_running_loop().time()
        self.signal = advertisement.rssi
        self.label = data.get(kinds.COMPLETE_LOCAL_NAME) or self.label
        for kind in (kinds.COMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS, kinds.INCOMPLETE_LIST_OF_128_BIT_SERVICE_CLASS_UUIDS):
            self.services += [s for u in data.get(kind) or [] if (s := u.to_hex_str("-").lower()) not in self.services]
        self.emit_properties_changed({"Name": self.label, "Alias": self.label, "RSSI": self.signal, "UUIDs": self.services})

    @dbus_method()
    async def Connect(self) -> None:
        if self.connected:
            return
        self.connecting = True
        try:
            bonded = await self.laptop.bonded(self.peer)
            await self.laptop.connect(to=(self.peer, self.label), bonded=bonded)
        except FAULTS as error:
            raise failed(error) from error
        finally:
            self.connecting = False
        self.laptop.connection.on("disconnection", self.lost)
        self.connected = True
        self.emit_properties_changed({"Connected": True})
        for number, service in enumerate(self.laptop.peer.services):
            path = f"{self.path}/service{number:04x}"
            self.export(path, Service(service, self.path))
            for count, characteristic in enumerate(service.characteristics):
                self.export(f"{path}/char{count:04x}", Characteristic(characteristic, path, self))
        self.resolved = True
        self.emit_properties_changed({"ServicesResolved": True})

    def export(self, path, interface):
        self.adapter.bus.export(path, interface)
        self.objects.append(path)

    def lost(self, _reason):
        self.connected = self.resolved = False
        self.heard = asyncio.get_running_loop().time()
        for path in reversed(self.objects):
            self.adapter.bus.unexport(path)
        self.objects.clear()
        self.emit_properties_changed({"ServicesResolved": False, "Connected": False})

    @dbus_method()
    async def Disconnect(self) -> None:
        await self.laptop.disconnect()

    @dbus_method()
    async def Pair(self) -> None:
        if not self.connected:
            await self.Connect()
        await self.pair()

    async def pair(self):
        try:
            await asyncio.wait_for(self.laptop.connection.pair(), PATIENCE_S)
        except FAULTS as error:
            raise DBusError("org.bluez.Error.AuthenticationFailed", "Authentication Failed") from error
        self.emit_properties_changed({"Paired": True, "Bonded": True})

    @read_only
    def Address(self) -> DBusStr:
        return self.address

    @read_only
    def AddressType(self) -> DBusStr:
        return "public" if self.peer.is_public else "random"

    @read_only
    def Name(self) -> DBusStr:
        return self.label

    @read_only
    def Alias(self) -> DBusStr:
        return self.label

    @read_only
    def Paired(self) -> DBusBool:
        return bool(self.connected and self.laptop.connection.encryption)

    @read_only
    def Bonded(self) -> DBusBool:
        return bool(self.connected and self.laptop.connection.encryption)

    @read_only
    def Trusted(self) -> DBusBool:
        return False

    @read_only
    def Blocked(self) -> DBusBool:
        return False

    @read_only
    def LegacyPairing(self) -> DBusBool:
        return False

    @read_only
    def Connected(self) -> DBusBool:
        return self.connected

    @read_only
    def ServicesResolved(self) -> DBusBool:
        return self.resolved

    @read_only
    def RSSI(self) -> DBusInt16:
        return self.signal

    @read_only
    def UUIDs(self) -> DBusStrings:
        return self.services

    @read_only
    def Adapter(self) -> DBusObjectPath:
        return ADAPTER


class Service(ServiceInterface):
    """A service of the device that is connected."""

    def __init__(self, service, device):
        super().__init__("org.bluez.GattService1")
        self.service, self.device = service, device

    @read_only
    def UUID(self) -> DBusStr:
        return uuid(self.service)

    @read_only
    def Primary(self) -> DBusBool:
        return True

    @read_only
    def Device(self) -> DBusObjectPath:
        return self.device


class Characteristic(ServiceInterface):
    """A characteristic of the device that is connected."""

    def __init__(self, characteristic, service, device):
        super().__init__("org.bluez.GattCharacteristic1")
        self.characteristic, self.service, self.device = characteristic, service, device
        self.notifying, self.value = False, b""

    async def ask(self, question):
        """Asks the device; on a link that it does not trust, pairs and asks again, as BlueZ does."""
        try:
            return await asyncio.wait_for(question(), PATIENCE_S)
        except FAULTS as error:
            if told(error) not in UNPAIRED:
                raise failed(error) from error
        await self.device.pair()
        try:
            return await asyncio.wait_for(question(), PATIENCE_S)
        except FAULTS as error:
            raise DBusError("org.bluez.Error.NotPermitted", told(error)) from error

    def notified(self, value):
        self.value = bytes(value)
        self.emit_properties_changed({"Value": self.value})

    @dbus_method()
    async def StartNotify(self) -> None:
        await self.ask(lambda: self.characteristic.subscribe(self.notified))
        self.notifying = True

    @dbus_method()
    async def StopNotify(self) -> None:
        if not self.notifying:
            raise DBusError("org.bluez.Error.Failed", "No notify session started")
        self.notifying = False
        await self.ask(lambda: self.characteristic.unsubscribe(self.notified))

    @dbus_method()
    async def ReadValue(self, _options: DBusOptions) -> DBusBytes:
        return bytes(await self.ask(self.characteristic.read_value))

    @dbus_method()
    async def WriteValue(self, value: DBusBytes, options: DBusOptions) -> None:
        answered = "type" not in options or options["type"].value != "command"
        await self.ask(lambda: self.characteristic.write_value(bytes(value), with_response=answered))

    @read_only
    def UUID(self) -> DBusStr:
        return uuid(self.characteristic)

    @read_only
    def Service(self) -> DBusObjectPath:
        return self.service

    @read_only
    def Value(self) -> DBusBytes:
        return self.value

    @read_only
    def Notifying(self) -> DBusBool:
        return self.notifying

    @read_only
    def Flags(self) -> DBusStrings:
        return [name for flag, name in FLAGS.items() if self.characteristic.properties & flag]

    @read_only
    def MTU(self) -> DBusUInt16:
        return self.device.laptop.peer.gatt_client.mtu


def uuid(attribute):
    text = attribute.uuid.to_hex_str("-").lower()
    return text if len(text) == 36 else f"{text:0>8}-0000-1000-8000-00805f9b34fb"


async def serve(address, laptop):
    """Stands on the bus at this address, as BlueZ does on that of the system."""
    bus = await MessageBus(bus_address=address).connect()
    bus.export(ADAPTER, Adapter(bus, laptop))
    await bus.request_name("org.bluez")
    return bus
