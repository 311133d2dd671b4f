"""The virtual radio of `cargo xtask emulate --ble`, made of Bumble's controllers.

The emulated shoe connects its HCI line (H4) to a port of this program, which is the shoe's controller. On the other side of the
radio are a laptop, whose connection to the shoe is bridged to another port for `sohle live tcp:...`, and a stranger who has no
bond. Orders come on the standard input, one a line; every order is answered by one line of JSON with `"order"`, and what
happens between is told in lines with `"event"`:

    pair                 the laptop connects, pairs, and keeps connected from then on
    connect              the laptop connects with its bond, and keeps connected from then on
    leave                the laptop disconnects and stays away
    forget               the laptop forgets its bonds
    out, in              shoe and laptops are out of range of each other, and in range again
    stranger             one without a bond connects and tries to pair, read, subscribe and write
    stranger-commands    the same connects and carries what comes on its port to the shoe's commands
    stranger-leave       and is gone
    garbage-controller N the shoe's controller sends N random packets and bytes
    garbage-stranger N   the stranger sends N random packets to the shoe
    garbage-laptop N     the laptop with the bond does, and random bytes as commands
    figures              what the radio carried since the last time
    quit
"""

import argparse
import asyncio
import contextlib
import json
import logging
import random
import sys

from bumble import hci
from bumble.core import InvalidPacketError
from bumble.hci import Address
from bumble.transport.common import PacketParser

import bluez
from air import Air, Radio
from laptop import COMMANDS, FAULTS, PATIENCE_S, STATUS, STEPS, UART_RX, UART_TX, Laptop, Refused, told

# Public addresses of the three controllers.
SHOE, LAPTOP, STRANGER = "C0:5E:00:00:00:01", "C0:5E:00:00:00:02", "C0:5E:00:00:00:03"
# Channels that every connection has: attributes, signals, security.
FIXED_CHANNELS = 4, 5, 6


class Line(asyncio.Protocol):
    """The shoe's HCI line, which ends in its controller. When it breaks, both have lost their power."""

    def __init__(self, radio):
        self.radio = radio
        self.parser = PacketParser(radio)

    def connection_made(self, transport):
        self.transport = transport
        self.radio.power_off()
        self.radio.host = self

    def connection_lost(self, _error):
        if self.radio.host is self:
            self.radio.power_off()
            self.radio.host = None

    def data_received(self, data):
        for byte in data:
            # What begins no packet is passed over, as controllers do.
            with contextlib.suppress(InvalidPacketError):
                self.parser.feed_data(bytes([byte]))

    def on_packet(self, packet):
        """What the controller has for the shoe."""
        self.transport.write(packet)


def quantile(sorted_values, share):
    return sorted_values[min(int(len(sorted_values) * share), len(sorted_values) - 1)] if sorted_values else None


class Program:
    """The radio with everybody on it."""

    def __init__(self, arguments):
        self.arguments = arguments
        self.air = Air()
        self.shoe = Radio("shoe", link=self.air, public_address=Address(SHOE, Address.PUBLIC_DEVICE_ADDRESS))
        self.laptop = Laptop(self.air, "laptop", LAPTOP, arguments.keys, self.tell)
        self.stranger = Laptop(self.air, "stranger", STRANGER, None, self.tell)
        self.random = random.Random(arguments.seed)
        self.since = None

    def tell(self, **words):
        print(json.dumps(words), flush=True)

    async def run(self):
        loop = asyncio.get_running_loop()
        self.since = loop.time()
        await loop.create_server(lambda: Line(self.shoe), "127.0.0.1", self.arguments.hci)
        for laptop, port in ((self.laptop, self.arguments.bridge), (self.stranger, self.arguments.stranger)):
            await laptop.power_on()
            if port:
                await laptop.bridge(port, subscribe=laptop is self.laptop)
        if self.arguments.bus:
            self.bus = await bluez.serve(self.arguments.bus, self.laptop)
        self.tell(event="ready")
        orders = asyncio.StreamReader()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(orders), sys.stdin)
        while line := await orders.readline():
            words = line.decode().split()
            if not words:
                continue
            if words[0] == "quit":
                break
            order = getattr(self, "order_" + words[0].replace("-", "_"), None)
            try:
                answer = await order(*words[1:]) if order else {"fault": "unknown order"}
            except FAULTS as error:
                answer = {"fault": told(error)}
            self.tell(order=words[0], **(answer or {}))

    async def up(self):
        self.laptop.keep()
        try:
            await asyncio.wait_for(self.laptop.up.wait(), 2 * PATIENCE_S)
        except TimeoutError:
            raise Refused(self.laptop.fault or "the shoe does not answer") from None
        return self.laptop.facts()

    async def order_pair(self):
        await self.laptop.leave()
        await self.laptop.connect(pair=True)
        self.laptop.up.set()
        return await self.up()

    async def order_connect(self):
        return await self.up()

    async def order_leave(self):
        await self.laptop.leave()

    async def order_forget(self):
        await self.laptop.device.keystore.delete_all()

    async def order_out(self):
        self.air.in_range = False

    async def order_in(self):
        self.air.in_range = True

    async def order_stranger(self):
        """What the shoe says to one without a bond; "allowed" where it should have refused."""
        said = {}

        async def attempt(what, action):
            try:
                await asyncio.wait_for(action(), PATIENCE_S)
                said[what] = "allowed"
            except FAULTS as error:
                said[what] = told(error)

        await self.stranger.connect(bonded=False)
        get = self.stranger.characteristic
        await attempt("read", lambda: get(STATUS).read_value())
        await attempt("subscribe", lambda: get(STEPS).subscribe(lambda _: None))
        await attempt("subscribe_uart", lambda: get(UART_TX).subscribe(lambda _: None))
        await attempt("write", lambda: get(COMMANDS).write_value(bytes(8), with_response=True))
        await attempt("write_uart", lambda: get(UART_RX).write_value(bytes(8), with_response=True))
        await attempt("pair", lambda: self.stranger.connection.pair())
        said["notified"] = self.stranger.received
        await self.stranger.disconnect()
        return said

    async def order_stranger_commands(self):
        await self.stranger.connect(bonded=False)

    async def order_stranger_leave(self):
        await self.stranger.disconnect()

    async def order_garbage_controller(self, count):
        """Packets of every kind with arbitrary content, and bytes that are no packets at all."""
        line = self.shoe.host
        if not line:
            raise Refused("the shoe has no power")
        for _ in range(int(count)):
            body = self.random.randbytes(self.random.randrange(64))
            handle = self.random.choice((1, 1, self.random.randrange(0x1000)))
            flags = self.random.randrange(16) << 12
            garbage = self.random.choice((
                # An event, a meta event, data; each with its right length.
                bytes([4, self.random.randrange(256), len(body)]) + body,
                bytes([4, 0x3E, len(body) + 1, self.random.randrange(0x30)]) + body,
                bytes([2]) + (handle | flags).to_bytes(2, "little") + len(body).to_bytes(2, "little") + body,
                # One that ends early: its bytes and the next packet's are one wrong packet.
                bytes([4, self.random.randrange(256), min(len(body) + 9, 255)]) + body,
                body,
            ))
            line.transport.write(garbage)
            await asyncio.sleep(0.005)

    async def garbage(self, laptop, count, connect, more=()):
        """Attribute, signalling and security packets with arbitrary content, on every channel and on none, or what `more` sends."""
        connections = 0
        for _ in range(int(count)):
            # The shoe may end a connection like this one, at any time.
            while laptop.connection is None or laptop.peer is None:
                connections += 1
                with contextlib.suppress(*FAULTS):
                    await connect()
            body = self.random.randbytes(self.random.randrange(1, 64))
            channel = self.random.choice((*FIXED_CHANNELS, self.random.randrange(0x10000)))
            length = len(body) if self.random.random() < 0.8 else self.random.randrange(0x10000)
            pdu = length.to_bytes(2, "little") + channel.to_bytes(2, "little") + body
            send = self.random.choice((lambda handle, _: laptop.device.host.send_acl_sdu(handle, pdu), *more))
            send(laptop.connection.handle, body)
            await asyncio.sleep(0.02)
        await laptop.leave()
        return {"connections": connections}

    async def order_garbage_stranger(self, count):
        return await self.garbage(self.stranger, count, lambda: self.stranger.connect(bonded=False))

    async def order_garbage_laptop(self, count):
        def command(handle, body):
            """A write without response, whose answer nobody waits for."""
            place = self.laptop.characteristic(self.random.choice((COMMANDS, UART_RX))).handle
            pdu = bytes([0x52]) + place.to_bytes(2, "little") + body
            self.laptop.device.host.send_l2cap_pdu(handle, FIXED_CHANNELS[0], pdu)

        return await self.garbage(self.laptop, count, self.laptop.connect, [command])

    async def order_figures(self):
        now = asyncio.get_running_loop().time()
        seconds, self.since = now - self.since, now
        link = next((l for l in self.air.links if l.ends[0].controller is self.laptop.radio), None)
        if not link:
            raise Refused("the laptop is not connected")
        waits = sorted(link.waits)
        there, back = link.bytes
        link.waits, link.bytes = [], [0, 0]
        milliseconds = [None if w is None else w * 1e3 for w in (*(quantile(waits, q) for q in (0.5, 0.99)), quantile(waits, 1))]
        return {
            "seconds": seconds, "to_shoe": there, "from_shoe": back, "packets": len(waits),
            "wait_median_ms": milliseconds[0], "wait_99_ms": milliseconds[1], "wait_longest_ms": milliseconds[2],
            **self.laptop.facts(),
        }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hci", type=int, required=True, metavar="PORT", help="where the shoe's HCI line connects to")
    parser.add_argument("--bridge", type=int, metavar="PORT", help="the laptop's connection, for sohle live tcp:...")
    parser.add_argument("--bus", metavar="ADDRESS", help="a D-Bus on which the laptop's Bluetooth is BlueZ, for sohle live ble:...")
    parser.add_argument("--stranger", type=int, metavar="PORT", help="to the shoe's commands without a bond")
    parser.add_argument("--keys", metavar="FILE.json", help="where the laptop keeps its bonds [default: in memory]")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of what is arbitrary")
    parser.add_argument("--log", default="ERROR", metavar="LEVEL", help="DEBUG shows every packet [default: ERROR]")
    arguments = parser.parse_args()
    logging.basicConfig(level=arguments.log, stream=sys.stderr)
    asyncio.run(run(arguments))


async def run(arguments):
    await Program(arguments).run()


if __name__ == "__main__":
    main()
