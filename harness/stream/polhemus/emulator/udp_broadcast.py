"""The packets that a device broadcasts by UDP while `MEthUdp` is on (docs/is900.md 9), and the socket that sends
them.
"""

import ipaddress
import socket

from harness.core.network import LOOPBACK, check_loopback, parse_address, resolve_host
from harness.errors import BadInput
from harness.stream.polhemus.codec.datagram import Datagram
from harness.stream.polhemus.codec.records import RecordValues, yaw_pitch_roll_deg
from harness.stream.polhemus.emulator.device_state import DeviceState
from harness.stream.polhemus.emulator.settings import STATION_NAMES, DeviceSettings


def parse_udp_address(text: str, anywhere: bool) -> tuple[str, int]:
    """Parse `[HOST:]PORT`, by default on this computer. Raises BadInput for another one without `anywhere`."""
    host, port = parse_address(text, LOOPBACK)
    check_loopback(host, anywhere, "everyone on that network then receives the motion")
    return host, port


class UdpPort:
    """Sends packets to one host or broadcast address. It never blocks."""

    def __init__(self, host: str = LOOPBACK) -> None:
        """Open the socket; BadInput for an unknown host."""
        try:
            family, (self.host, _, *self._scope) = resolve_host(host, 0, socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise BadInput(f"No host is called {host} ({error}).", "Give [HOST:]PORT.") from error
        self.sent = self.unsent = 0
        """Numbers of packets that were sent, and of those that the operating system did not take."""
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        if not ipaddress.ip_address(self.host).is_loopback:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)

    def send(self, packet: bytes, port: int) -> None:
        """Send a packet; a receiver that is absent or slow does not show."""
        try:
            self._socket.sendto(packet, (self.host, port, *self._scope))
            self.sent += 1
        except OSError:
            self.unsent += 1

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


TRACKER_MODEL = 4
"""Number that InterSense's library takes for an IS-900 (docs/is900.md 9)."""
_ANALOGUE_CHANNELS = 8


class UdpBroadcast:
    """Makes a packet of each reading of each active station, whether the serial line streams or not.

    Units are those of the packet, whatever the settings; alignment, boresight and tip offset count. The sequence number
    counts all packets.
    """

    def __init__(self, device: DeviceState, now_s: float) -> None:
        """Begin to broadcast if the device is set to it."""
        self._device = device
        self._sequence = 0
        self._next: tuple[int, int] | None = None
        """Round and station row of the next reading; None while the device does not broadcast."""
        self._began_s = float("nan")
        """When the motion began in which that round is counted [s]."""
        self._values: tuple[int, DeviceSettings, RecordValues] | None = None
        """The latest round, the settings then and its values."""
        self._follow_device(now_s)

    @property
    def next_s(self) -> float:
        """When the next packet is due [s]; inf while the device does not broadcast."""
        if self._next is None:
            return float("inf")
        return self._device.rounds.player.time_s(*self._next) + self._device.samples.ready_s

    def packets(self, now_s: float) -> list[bytes]:
        """Return the packets that are due by now."""
        self._follow_device(now_s)
        device, packets = self._device, list[bytes]()
        while self._next is not None and self.next_s <= now_s:
            number, row = self._next
            if device.settings.station(device.rounds.station_characters[row]).active:
                packets.append(self._packet(number, row))
            self._next = (number, row + 1) if row + 1 < len(device.rounds.station_characters) else (number + 1, 0)
        return packets

    def _follow_device(self, now_s: float) -> None:
        """Start, stop, or begin anew where the device has restarted its motion."""
        player = self._device.rounds.player
        if not self._device.settings.udp:
            self._next = None
        elif self._next is None or self._began_s != player.epoch[0]:
            self._next, self._began_s = (player.first_from(now_s), 0), player.epoch[0]

    def _packet(self, number: int, row: int) -> bytes:
        values = self._round_values(number)
        yaw, pitch, roll = yaw_pitch_roll_deg(values.tracker_from_station[row : row + 1])[0].tolist()
        x, y, z = values.position_m[row].tolist()
        one = values.rows([row])
        joystick = [127, 127] if isinstance(one.joystick, int) else one.joystick[0].tolist()
        self._sequence = (self._sequence + 1) % 256
        return Datagram(
            sequence=self._sequence,
            model=TRACKER_MODEL,
            station=1 + STATION_NAMES.index(self._device.rounds.station_characters[row]),
            quality=round(255 * min(max(float(values.quality[row]), 0.0), 1.0)),
            buttons=0 if isinstance(one.buttons, int) else int(one.buttons[0]),
            analogue=(*joystick, *[0] * (_ANALOGUE_CHANNELS - 2)),
            yaw_pitch_roll_deg=(yaw, pitch, roll),
            position_m=(x, y, z),
            time_s=float(values.measured_s[row]),
        ).packet()

    def _round_values(self, number: int) -> RecordValues:
        settings, cached = self._device.settings, self._values
        if cached is None or cached[0] != number or cached[1] is not settings:
            self._values = cached = number, settings, self._device.rounds.values(number, settings)
        return cached[2]
