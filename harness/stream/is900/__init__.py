"""The IS-900: the driver of a device, and an emulator of one."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.is900.driver.config import DriverConfig as DriverConfig
    from harness.stream.is900.driver.is900 import Is900 as Is900
    from harness.stream.is900.driver.is900 import open_tracker as open_tracker
    from harness.stream.is900.emulator.device import Device as Device
    from harness.stream.is900.emulator.emulator import Emulator as Emulator
else:
    __getattr__, __dir__ = lazy_names(__name__)
