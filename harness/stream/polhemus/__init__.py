"""What a FASTRAK and an IS-900 share: the protocol of Polhemus, and parts of drivers and emulators."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.polhemus.driver.open_transport import open_transport as open_transport
    from harness.stream.polhemus.emulator.config import EmulatorConfig as EmulatorConfig
    from harness.stream.polhemus.emulator.device_state import SentMessage as SentMessage
    from harness.stream.polhemus.emulator.emulator import LineEmulator as LineEmulator
    from harness.stream.polhemus.emulator.faults import Fault as Fault
    from harness.stream.polhemus.emulator.faults import FaultKind as FaultKind
    from harness.stream.polhemus.emulator.faults import add_byte_faults as add_byte_faults
    from harness.stream.polhemus.emulator.faults import unapplied_kinds as unapplied_kinds
    from harness.stream.polhemus.emulator.server import EmulatorServer as EmulatorServer
    from harness.stream.polhemus.emulator.server import open_port as open_port
    from harness.stream.polhemus.emulator.server import play_emulator as play_emulator
    from harness.stream.polhemus.emulator.settings import DEFAULT_EMITTERS as DEFAULT_EMITTERS
    from harness.stream.polhemus.emulator.tcp_port import TcpPort as TcpPort
    from harness.stream.polhemus.emulator.udp_broadcast import UdpPort as UdpPort
    from harness.stream.polhemus.emulator.udp_broadcast import parse_udp_address as parse_udp_address
else:
    __getattr__, __dir__ = lazy_names(__name__)
