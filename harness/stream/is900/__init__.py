"""The IS-900: the driver of a device, and an emulator of one."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.is900.driver.config import DriverConfig
    from harness.stream.is900.driver.is900 import Is900, open_tracker
    from harness.stream.is900.driver.transport import open_transport
    from harness.stream.is900.emulator.config import EmulatorConfig
    from harness.stream.is900.emulator.device import Device
    from harness.stream.is900.emulator.device_state import SentMessage
    from harness.stream.is900.emulator.emulator import Emulator
    from harness.stream.is900.emulator.faults import Fault, FaultKind, add_byte_faults, unapplied_kinds
    from harness.stream.is900.emulator.server import EmulatorServer, open_port, play_samples, serve_emulator
    from harness.stream.is900.emulator.settings import DEFAULT_EMITTERS
    from harness.stream.is900.emulator.tcp_port import TcpPort
    from harness.stream.is900.emulator.udp_broadcast import UdpPort, parse_udp_address
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "DEFAULT_EMITTERS",
    "Device",
    "DriverConfig",
    "Emulator",
    "EmulatorConfig",
    "EmulatorServer",
    "Fault",
    "FaultKind",
    "Is900",
    "SentMessage",
    "TcpPort",
    "UdpPort",
    "add_byte_faults",
    "open_port",
    "open_tracker",
    "open_transport",
    "parse_udp_address",
    "play_samples",
    "serve_emulator",
    "unapplied_kinds",
]
