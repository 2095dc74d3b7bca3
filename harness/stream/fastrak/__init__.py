"""The Polhemus FASTRAK: the driver of a device, and an emulator of one (docs/device.md, FASTRAK)."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.fastrak.driver import Fastrak as Fastrak
    from harness.stream.fastrak.driver import FastrakConfig as FastrakConfig
    from harness.stream.fastrak.emulator import FastrakEmulator as FastrakEmulator
    from harness.stream.fastrak.emulator import FastrakEmulatorConfig as FastrakEmulatorConfig
else:
    __getattr__, __dir__ = lazy_names(__name__)
