"""The IS-900: the driver of a device, and an emulator of one."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.is900.driver.config import DriverConfig
    from harness.stream.is900.driver.is900 import Is900, open_tracker
    from harness.stream.is900.emulator.device import Device
    from harness.stream.is900.emulator.emulator import Emulator
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = ["Device", "DriverConfig", "Emulator", "Is900", "open_tracker"]
