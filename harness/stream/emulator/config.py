"""What kind of IS-900 is played, and on what kind of line."""

from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.emulator.faults import Fault, check_firmware

SUPPORTED_BAUD_RATES = (300, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
"""Of the serial line [bit/s] (docs/is900.md 2)."""


@dataclass(frozen=True)
class EmulatorConfig:
    """The defaults are what was seen of a real one (docs/is900.md 6.1), on the line that every client opens."""

    firmware: str = "4.2301"
    """Version, as in the status record; item 40 needs 4.13, item 76 needs 4.26 (docs/is900.md 5.1)."""
    identification: str = "IS900VET"
    """Name in the status record."""
    status_bytes: int = 55
    """Length of the status record; 54 is what VRPN has met too (docs/is900.md 14)."""
    baud: int = 115200
    """Bits per second of the line at power-on."""
    paced: bool = True
    """False sends everything at once, as over Ethernet."""
    queue_records: int = 12
    """Records that wait for the line before the oldest round is dropped (docs/is900.md 14; the size is a choice)."""
    restart_s: float = 0.25
    """Silence after a restart [s]; clients wait 10 to 20 s for a real one (docs/is900.md 4.1)."""
    check_baud: bool = False
    """On a pty: garble both directions while the client has set another rate than the device's."""
    faults: tuple[Fault, ...] = ()
    """What goes wrong, and when."""
    seed: int = 1
    """Of the faults' draws."""

    def __post_init__(self) -> None:
        check_firmware(self.firmware)
        if not (self.identification.isascii() and self.identification.isprintable() and len(self.identification) < 32):
            raise BadInput(f"identification {self.identification!r}.", "Give up to 31 ASCII characters.")
        if self.status_bytes not in (54, 55):
            raise BadInput(f"status records of {self.status_bytes} bytes.", "They have 55 or 54.")
        if self.baud not in SUPPORTED_BAUD_RATES:
            raise BadInput(f"{self.baud} baud.", f"An IS-900 knows {', '.join(map(str, SUPPORTED_BAUD_RATES))}.")
        if self.queue_records < 1:
            raise BadInput(f"queue_records = {self.queue_records}.", "Give 1 at least.")
        if not 0.0 <= self.restart_s <= 3600.0:
            raise BadInput(f"restart_s = {self.restart_s:g}.", "Give a number from 0 to 3600.")
