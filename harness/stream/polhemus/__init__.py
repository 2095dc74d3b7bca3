"""What a FASTRAK and an IS-900 share: the protocol of Polhemus, and parts of drivers and emulators."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.polhemus.driver.open_transport import open_transport
    from harness.stream.polhemus.emulator.config import EmulatorConfig
    from harness.stream.polhemus.emulator.device_state import SentMessage
    from harness.stream.polhemus.emulator.emulator import LineEmulator
    from harness.stream.polhemus.emulator.faults import Fault, FaultKind, add_byte_faults, unapplied_kinds
    from harness.stream.polhemus.emulator.server import EmulatorServer, open_port, play_emulator
    from harness.stream.polhemus.emulator.settings import DEFAULT_EMITTERS
    from harness.stream.polhemus.emulator.tcp_port import TcpPort
    from harness.stream.polhemus.emulator.udp_broadcast import UdpPort, parse_udp_address
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "DEFAULT_EMITTERS",
    "EmulatorConfig",
    "EmulatorServer",
    "Fault",
    "FaultKind",
    "LineEmulator",
    "SentMessage",
    "TcpPort",
    "UdpPort",
    "add_byte_faults",
    "open_port",
    "open_transport",
    "parse_udp_address",
    "play_emulator",
    "unapplied_kinds",
]
