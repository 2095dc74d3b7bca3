"""An emulated IS-900 with its line."""

from typing import ClassVar

from harness.stream.is900.emulator.device import Device
from harness.stream.polhemus.emulator.device import CommandDevice
from harness.stream.polhemus.emulator.emulator import LineEmulator


class Emulator(LineEmulator):
    """An IS-900 and the line as a host sees them. Calls must have increasing times."""

    device_type: ClassVar[type[CommandDevice]] = Device
