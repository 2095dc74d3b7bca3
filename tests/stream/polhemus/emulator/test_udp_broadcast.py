"""The packets of the emulated device without a socket: when they are due, and what they say."""

import pytest

from harness.stream.is900.emulator.device import Device
from harness.stream.polhemus.codec.datagram import Datagram, parse_datagram
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.udp_broadcast import UdpBroadcast
from tests.stream.is900.emulator.played import make_samples

FIRST_S = 5.0
"""The device's clock at power-on (`make_samples`); it is 20 ppm fast."""


class Broadcasting:
    """A device that broadcasts, and its clock."""

    def __init__(self, **config: object) -> None:
        self.device = Device(make_samples(), EmulatorConfig(udp=True, **config), 0.0)  # type: ignore[arg-type]
        self.broadcast = UdpBroadcast(self.device, 0.0)

    def send(self, data: bytes, now_s: float) -> None:
        self.device.receive(data, now_s)
        self.device.advance(now_s)

    def packets(self, now_s: float) -> list[Datagram]:
        parsed = [parse_datagram(packet) for packet in self.broadcast.packets(now_s)]
        assert None not in parsed
        return [packet for packet in parsed if packet is not None]


def test_each_reading_is_a_packet_in_metres_and_seconds() -> None:
    """At 50 Hz, four stations one after another; each is ready 4 ms after its reading (`make_samples`)."""
    setup = Broadcasting()
    assert setup.broadcast.next_s == pytest.approx(0.004)
    assert setup.packets(0.0039) == []
    packets = setup.packets(0.0391)  # the second round's last reading is taken at 35 ms
    assert [packet.station for packet in packets] == [1, 2, 3, 4] * 2
    assert [packet.sequence for packet in packets] == list(range(1, 9))
    assert packets[4].position_m == pytest.approx((1.001, -0.5, 1.5), abs=1e-6)
    assert packets[5].position_m == pytest.approx((1.101, -0.5, 1.5), abs=1e-6)
    assert packets[4].time_s == pytest.approx(FIRST_S + 0.02, abs=1e-5)
    assert {(packet.quality, packet.model) for packet in packets} == {(255, 4)}
    assert [packet.buttons for packet in packets[:4]] == [1, 2, 4, 8]
    assert packets[0].analogue == (127, 127, 0, 0, 0, 0, 0, 0)


def test_units_do_not_count_and_alignment_does() -> None:
    setup = Broadcasting()
    setup.send(b"U\rMt\rA1,100,0,0,200,0,0,100,100,0\r", 0.0)  # the origin is 1 m along X
    assert setup.packets(0.02)[0].position_m == pytest.approx((0.0, -0.5, 1.5), abs=1e-6)


def test_stations_that_are_off_or_lost_show() -> None:
    setup = Broadcasting()
    setup.send(b"l2,0\r", 0.0)
    setup.device.set_lost_stations("3")
    assert [(packet.station, packet.quality) for packet in setup.packets(0.0201)] == [(1, 255), (3, 0), (4, 255)]


def test_the_sequence_number_begins_anew_after_255() -> None:
    numbers = [packet.sequence for packet in Broadcasting().packets(2.0)]
    assert numbers[254:258] == [255, 0, 1, 2]


def test_a_restart_begins_the_motion_and_the_clock_anew() -> None:
    """The device is silent for 0.25 s; what was set at power-on returns."""
    setup = Broadcasting()
    setup.packets(1.0)
    setup.send(b"MEthUdp0\r\x19", 1.0)
    assert setup.packets(1.25) == []
    first = setup.packets(1.2545)
    assert [packet.station for packet in first] == [1]
    assert first[0].time_s == pytest.approx(FIRST_S, abs=1e-5)


def test_it_goes_on_where_it_is_switched_on_again() -> None:
    setup = Broadcasting()
    setup.packets(0.5)
    setup.send(b"MEthUdp0\r", 0.5)
    assert setup.packets(0.7) == []
    assert setup.broadcast.next_s == float("inf")
    setup.send(b"MEthUdp1\r", 0.8)
    assert setup.packets(0.8) == []
    packets = setup.packets(0.825)
    assert packets[0].station == 1
    assert packets[0].time_s == pytest.approx(FIRST_S + 0.8, abs=1e-4)
