"""The air between two Bluetooth LE controllers: connection events, air time, range.

Bumble's own link hands every packet over at once. Here data waits for the next connection event as on a real link, a
connection event has only so much air time, and two controllers out of range of each other lose the connection when the
supervision timeout has passed (Bluetooth Core Specification 5.4, volume 6, part B, 4.5).

Left out: errors of transmission, clock drift, the time to hop, and what else uses the antenna of a real laptop. What a
connection event carries is handed over when it begins.
"""

import asyncio
import collections
import dataclasses

from bumble import hci, link, ll
from bumble.controller import Controller

# Lengths of a data channel's packet on the LE 1M and the LE 2M PHY: preamble, access address, header, check value, and bits
# each microsecond (volume 6, part B, 2.1 and 2.2).
PREAMBLE_BYTES = {hci.Phy.LE_1M: 1, hci.Phy.LE_2M: 2}
BITS_PER_US = {hci.Phy.LE_1M: 1, hci.Phy.LE_2M: 2}
FRAME_BYTES = 4 + 2 + 3
# Message integrity check of a packet that is not empty.
MIC_BYTES = 4
# Space between two packets of one connection event.
INTER_FRAME_US = 150
# Of a connection without, and the most with data length extension.
SHORT_OCTETS, LONG_OCTETS = 27, 251
# A connection in which nothing came within so many intervals was never there.
ESTABLISH_EVENTS = 6
# Unit of a connection interval, and of a supervision timeout.
INTERVAL_S, TIMEOUT_S = 1.25e-3, 10e-3


@dataclasses.dataclass
class Packet:
    """One packet on its way: how long it is, what hands it over, and when it came from its host."""

    length: int
    deliver: collections.abc.Callable
    since: float
    sent: collections.abc.Callable | None = None


class End:
    """One end of a connection, with what it has to send."""

    def __init__(self, controller, connection):
        self.controller, self.connection = controller, connection
        self.packets = collections.deque()
        self.octets = SHORT_OCTETS
        self.here = True

    def heard_by_host(self):
        """Whether the host at this end still has the connection."""
        return self.here and self.connection in self.controller.le_connections.values()


class Link:
    """A connection of a central (end 0) and a peripheral (end 1)."""

    def __init__(self, air, central, peripheral, request):
        self.air, self.ends = air, (central, peripheral)
        self.phy = hci.Phy.LE_1M
        self.established = self.closed = False
        self.skipped = 0
        self.waits = []
        self.bytes = [0, 0]
        self.set_parameters(request.interval, request.latency, request.timeout)
        self.task = asyncio.get_running_loop().create_task(self.run())

    def set_parameters(self, interval, latency, timeout):
        self.interval, self.latency, self.timeout = interval * INTERVAL_S, latency, timeout * TIMEOUT_S

    def end(self, controller):
        return next(end for end in self.ends if end.controller is controller)

    def other(self, end):
        return self.ends[end is self.ends[0]]

    def air_time_us(self, packet):
        length = packet.length + MIC_BYTES if packet else 0
        return (PREAMBLE_BYTES[self.phy] + FRAME_BYTES + length) * 8 / BITS_PER_US[self.phy]

    async def run(self):
        """Connection events until one end has gone, at the times that the anchor and the interval give."""
        loop = asyncio.get_running_loop()
        heard = anchor = loop.time()
        while True:
            anchor = max(anchor + self.interval, loop.time())
            await asyncio.sleep(anchor - loop.time())
            now = loop.time()
            if self.air.in_range and all(end.here for end in self.ends):
                if self.event(now):
                    heard, self.established = now, True
                if self.closed:
                    break
            elif now - heard > (self.timeout if self.established else ESTABLISH_EVENTS * self.interval):
                self.lose()
                break
        self.air.links.remove(self)

    def event(self, now):
        """One connection event; whether both have been heard. The peripheral may sleep through as many as it is allowed."""
        central, peripheral = self.ends
        if not peripheral.packets and self.skipped < self.latency:
            self.skipped += 1
            return False
        self.skipped, used = 0, 0.0
        while True:
            there = central.packets[0] if central.packets else None
            back = peripheral.packets[0] if peripheral.packets else None
            used += self.air_time_us(there) + self.air_time_us(back) + 2 * INTER_FRAME_US
            if used > self.interval * 1e6:
                break
            for end, packet in ((central, there), (peripheral, back)):
                if packet:
                    end.packets.popleft()
                    self.hand_over(end, packet, now)
            if not central.packets and not peripheral.packets:
                break
        return True

    def hand_over(self, end, packet, now):
        packet.deliver()
        if packet.sent:
            packet.sent()
            self.bytes[end is self.ends[1]] += packet.length
            if end is self.ends[1]:
                self.waits.append(now - packet.since)

    def lose(self):
        """Both ends that are still there find that the other is not."""
        codes = hci.HCI_ErrorCode
        lost, absent = codes.CONNECTION_TIMEOUT_ERROR, codes.CONNECTION_FAILED_TO_BE_ESTABLISHED_ERROR
        reason = lost if self.established else absent
        for end in self.ends:
            if end.here:
                end.here = False
                end.controller.on_le_disconnected(end.connection, reason)

    def agree(self, end, change):
        """Both ends change something of the link, after a question and an answer on the air."""
        other = self.other(end)
        self.send(end, SHORT_OCTETS, lambda: self.send(other, SHORT_OCTETS, change))

    def tell(self, event):
        for end in self.ends:
            if end.heard_by_host():
                end.controller.send_hci_packet(event(end.connection.handle))

    def set_octets(self, octets):
        for end in self.ends:
            end.octets = octets
        # Microseconds that so many octets take on the LE 1M PHY.
        time = (octets + 14) * 8
        self.tell(lambda handle: hci.HCI_LE_Data_Length_Change_Event(handle, octets, time, octets, time))

    def set_phy(self, phy):
        self.phy = phy
        self.tell(lambda handle: hci.HCI_LE_PHY_Update_Complete_Event(hci.HCI_ErrorCode.SUCCESS, handle, phy, phy))

    def send(self, end, length, deliver, sent=None):
        end.packets.append(Packet(length, deliver, asyncio.get_running_loop().time(), sent))


class Air(link.LocalLink):
    """All controllers, and whether they are in range of each other."""

    def __init__(self):
        super().__init__()
        self.in_range = True
        self.links = []

    def find(self, connection):
        return next(((l, end) for l in self.links for end in l.ends if end.connection is connection), (None, None))

    def send_advertising_pdu(self, sender_controller, packet):
        if isinstance(packet, ll.ConnectInd):
            self.connect(sender_controller, packet)
        elif self.in_range:
            packet.scan_response = sender_controller.scan_response(packet)
            super().send_advertising_pdu(sender_controller, packet)

    def connect(self, central, request):
        """A central answers the advertisement of a peripheral, which may have gone since."""
        found = None
        for controller in self.controllers:
            if self.in_range and controller is not central:
                controller.on_ll_advertising_pdu(request)
                if connection := controller.le_connections.get(request.initiator_address):
                    found = End(controller, connection)
        absent = End(None, None)
        absent.here = False
        ours = End(central, central.le_connections[request.advertiser_address])
        self.links.append(Link(self, ours, found or absent, request))

    def send_ll_control_pdu(self, sender_address, receiver_address, packet):
        for l in self.links:
            for end in l.ends:
                c = end.connection
                if c and c.self_address == sender_address and c.peer_address == receiver_address:
                    self.send_control(l, end, packet)
                    return

    def send_control(self, l, end, packet):
        other = l.other(end)

        def deliver():
            if not other.here:
                return
            if isinstance(packet, ll.ConnectionUpdateInd):
                l.set_parameters(packet.interval, packet.latency, packet.timeout)
            other.controller.on_ll_control_pdu(end.connection.self_address, packet)
            l.closed |= isinstance(packet, ll.TerminateInd)

        l.send(end, SHORT_OCTETS, deliver)


class Radio(Controller):
    """Bumble's controller on this air, with the commands that it has not: data length, PHY, version of the other end."""

    le_acl_data_packet_length = LONG_OCTETS
    total_num_le_acl_data_packets = 8
    supported_max_tx_octets = supported_max_rx_octets = LONG_OCTETS
    supported_max_tx_time = supported_max_rx_time = 2120
    request = None

    def power_off(self):
        """Everything that it knew is gone; the other ends are not told."""
        self.le_legacy_advertiser.stop()
        for advertiser in self.advertising_sets.values():
            advertiser.stop()
        self.advertising_sets.clear()
        self.pending_le_connection = None
        self.le_scan_enable = False
        for connection in list(self.le_connections.values()):
            if end := self.link.find(connection)[1]:
                end.here = False
        self.le_connections.clear()

    def on_hci_reset_command(self, _command):
        self.power_off()
        return super().on_hci_reset_command(_command)

    def on_le_connect_ind(self, packet):
        self.request = packet
        super().on_le_connect_ind(packet)

    def send_hci_packet(self, packet):
        if isinstance(packet, hci.HCI_LE_Connection_Complete_Event) and packet.role == hci.Role.PERIPHERAL:
            # Bumble leaves constants here.
            packet = dataclasses.replace(
                packet,
                connection_interval=self.request.interval,
                peripheral_latency=self.request.latency,
                supervision_timeout=self.request.timeout,
            )
        super().send_hci_packet(packet)

    def on_le_disconnected(self, connection, reason):
        # Who has said goodbye stays on the air until the other has heard it, but its host knows already.
        if self.le_connections.get(connection.peer_address) is connection:
            super().on_le_disconnected(connection, reason)

    def on_hci_acl_data_packet(self, packet):
        connection = self.find_le_connection_by_handle(packet.connection_handle)
        l, end = self.link.find(connection) if connection else (None, None)
        if not l:
            return
        other = l.other(end)
        pieces = [packet.data[i : i + end.octets] for i in range(0, len(packet.data), end.octets)] or [b""]
        for index, piece in enumerate(pieces):
            start = index == 0 and packet.pb_flag != hci.HCI_ACL_PB_CONTINUATION

            def deliver(piece=piece, flag=2 if start else hci.HCI_ACL_PB_CONTINUATION):
                if other.heard_by_host():
                    handle = other.connection.handle
                    other.controller.send_hci_packet(hci.HCI_AclDataPacket(handle, flag, 0, len(piece), piece))

            def sent():
                if end.heard_by_host():
                    self.send_hci_packet(hci.HCI_Number_Of_Completed_Packets_Event([connection.handle], [1]))

            l.send(end, len(piece), deliver, sent if index == len(pieces) - 1 else None)

    def scan_response(self, pdu):
        """What this controller answers whoever asks for more than was advertised."""
        if isinstance(pdu, ll.AdvInd):
            return self.le_legacy_advertiser.scan_response_data
        return next(bytes(a.scan_response_data) for a in self.advertising_sets.values() if a.address == pdu.advertiser_address)

    def on_hci_le_set_data_length_command(self, command):
        connection = self.find_le_connection_by_handle(command.connection_handle)
        l, end = self.link.find(connection) if connection else (None, None)
        status = hci.HCI_ErrorCode.SUCCESS if l else hci.HCI_ErrorCode.UNKNOWN_CONNECTION_IDENTIFIER_ERROR
        if l:
            octets = min(command.tx_octets, LONG_OCTETS)
            l.agree(end, lambda: l.set_octets(octets))
        return hci.HCI_StatusAndConnectionHandleReturnParameters(status, command.connection_handle)

    def on_hci_le_set_phy_command(self, command):
        connection = self.find_le_connection_by_handle(command.connection_handle)
        l, end = self.link.find(connection) if connection else (None, None)
        pending, unknown = hci.HCI_COMMAND_STATUS_PENDING, hci.HCI_ErrorCode.UNKNOWN_CONNECTION_IDENTIFIER_ERROR
        self._send_hci_command_status(pending if l else unknown, command.op_code)
        if l:
            fast = command.tx_phys & hci.PhyBit.LE_2M and command.rx_phys & hci.PhyBit.LE_2M
            l.agree(end, lambda: l.set_phy(hci.Phy.LE_2M if fast else hci.Phy.LE_1M))

    def on_hci_read_remote_version_information_command(self, command):
        self._send_hci_command_status(hci.HCI_COMMAND_STATUS_PENDING, command.op_code)
        self.send_hci_packet(
            hci.HCI_Read_Remote_Version_Information_Complete_Event(
                hci.HCI_ErrorCode.SUCCESS, command.connection_handle, self.lmp_version, 0xFFFF, 0
            )
        )

    def on_hci_le_create_connection_cancel_command(self, _command):
        waiting, self.pending_le_connection = self.pending_le_connection, None
        if waiting:
            # Without this event the host waits for ever.
            cancelled, peer = hci.HCI_ErrorCode.UNKNOWN_CONNECTION_IDENTIFIER_ERROR, waiting.peer_address
            event = hci.HCI_LE_Connection_Complete_Event
            central = hci.Role.CENTRAL
            self.send_hci_packet(event(cancelled, 0, central, peer.address_type, peer, 0, 0, 0, 0))
        return hci.HCI_StatusReturnParameters(hci.HCI_ErrorCode.SUCCESS)

    def on_hci_command(self, command):
        """A command that this controller has not."""
        if isinstance(command, hci.HCI_SyncCommand):
            return super().on_hci_command(command)
        self._send_hci_command_status(hci.HCI_ErrorCode.UNKNOWN_HCI_COMMAND_ERROR, command.op_code)

    def on_hci_command_packet(self, command):
        # The only command without an answer.
        if command.op_code != hci.HCI_HOST_NUMBER_OF_COMPLETED_PACKETS_COMMAND:
            super().on_hci_command_packet(command)

    def on_advertising_pdu(self, pdu):
        """Bumble answers a scan with the advertisement itself; here the scan response is told apart from it."""
        kinds = hci.HCI_LE_Extended_Advertising_Report_Event.EventType
        seen = kinds.CONNECTABLE_ADVERTISING | kinds.SCANNABLE_ADVERTISING | kinds.LEGACY_ADVERTISING_PDU_USED
        if self.le_scan_enable:
            for kind, data in ((seen, pdu.data), (seen | kinds.SCAN_RESPONSE, pdu.scan_response)):
                report = hci.HCI_LE_Extended_Advertising_Report_Event.Report(
                    event_type=kind,
                    address_type=pdu.advertiser_address.address_type,
                    address=pdu.advertiser_address,
                    primary_phy=hci.Phy.LE_1M,
                    secondary_phy=0,
                    advertising_sid=0xFF,
                    tx_power=0x7F,
                    rssi=-50,
                    periodic_advertising_interval=0,
                    direct_address_type=0,
                    direct_address=hci.Address.ANY,
                    data=data,
                )
                self.send_hci_packet(hci.HCI_LE_Extended_Advertising_Report_Event([report]))
        waiting = self.pending_le_connection
        if waiting and waiting.peer_address == pdu.advertiser_address:
            self.create_le_connection(pdu.advertiser_address)
