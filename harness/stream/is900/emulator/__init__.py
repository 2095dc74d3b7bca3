"""Emulator: an IS-900 that plays readings in real time, for drivers and third-party programs (docs/device.md,
Emulator).

`Device` is the device without input or output. `Emulator` adds a serial line and its faults. `serve_emulator` serves it
at a port.
"""

from harness.stream.is900.emulator.config import EmulatorConfig
from harness.stream.is900.emulator.device import Device
from harness.stream.is900.emulator.device_state import Message, SentMessage
from harness.stream.is900.emulator.emulator import Emulator
from harness.stream.is900.emulator.faults import Fault
from harness.stream.is900.emulator.server import EmulatorServer, serve_emulator

__all__ = [
    "Device",
    "Emulator",
    "EmulatorConfig",
    "EmulatorServer",
    "Fault",
    "Message",
    "SentMessage",
    "serve_emulator",
]
