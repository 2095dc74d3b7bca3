"""Configuration of the emulated IS-900 and its line."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.errors import BadInput
from harness.stream.polhemus.codec.items import EXTENDED_ITEMS, ITEMS, STATION_CHARACTERS
from harness.stream.polhemus.emulator.faults import Fault, check_firmware

PERIOD_S = 8.0
"""Duration of a cycle [s]."""
BUTTON_BITS = 6
"""Buttons 1 to 4, the pressed joystick and the trigger have bits 0 to 5 (docs/is900.md 5.1)."""
CENTRE, SWING = 127, 128
"""Joystick value at rest, and its greatest distance from there; the extremes are cut to 0 and 255."""

ControlPattern = Callable[[Floats], tuple[Ints, Ints]]
"""Converts times (N,) [s] to button bits (N,) and joystick values (N, 2), left to right and rear to front."""


def _still(time_s: Floats) -> tuple[Ints, Ints]:
    """Press nothing and leave the joystick at its centre."""
    return np.zeros(len(time_s), np.int64), np.full((len(time_s), 2), CENTRE)


def _cycle(time_s: Floats) -> tuple[Ints, Ints]:
    """Press each button for a second in turn, and none for two. Move the joystick sideways, then back and forth."""
    phase_s = time_s % PERIOD_S
    pressed = phase_s.astype(np.int64)
    buttons = np.where(pressed < BUTTON_BITS, 1 << pressed, 0)
    swing = SWING * np.sin(2.0 * np.pi * phase_s / (0.5 * PERIOD_S))
    sideways = phase_s < 0.5 * PERIOD_S
    offset = np.stack([np.where(sideways, swing, 0.0), np.where(sideways, 0.0, swing)], axis=-1)
    return buttons, np.clip(np.rint(CENTRE + offset), 0, 255).astype(np.int64)


CONTROL_PATTERNS: dict[str, ControlPattern] = {"cycle": _cycle, "still": _still}
"""Patterns by name."""


def check_control_pattern(name: str) -> None:
    """Raise BadInput unless there is a pattern of this name."""
    if name not in CONTROL_PATTERNS:
        raise BadInput(f"controls {name!r} are not known.", f"Use {' or '.join(CONTROL_PATTERNS)}.")


SUPPORTED_BAUD_RATES = (300, 1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
"""Baud rates of the serial line [bit/s] (docs/is900.md 2)."""


@dataclass(frozen=True)
class EmulatorConfig:
    """Properties of the emulated device and line. Raises BadInput for impossible ones.

    The defaults are those of a real device that was observed (docs/is900.md 6.1), on the line that every client opens.
    """

    firmware: str = "4.2301"
    """Version, as in the status record; item 40 needs 4.13, item 76 needs 4.26 (docs/is900.md 5.1)."""
    identification: str = "IS900VET"
    """Name in the status record."""
    status_bytes: int = 55
    """Length of the status record; VRPN has met 54 too (docs/is900.md 14)."""
    baud: int = 115200
    """Baud rate of the line at power-on [bit/s]."""
    paced: bool = True
    """Whether the line takes time; False sends everything at once, as over Ethernet."""
    queue_records: int = 12
    """Number of records that wait for the line before the oldest round is dropped (docs/is900.md 14; the size is a
    choice)."""
    restart_s: float = 0.25
    """Silence after a restart [s]; clients wait 10 to 20 s for a real device (docs/is900.md 4.1)."""
    check_baud: bool = False
    """On a pty: corrupt both directions while the client has set another baud rate than the device."""
    characters: str = ""
    """Characters of the stations that are plugged in, ascending, such as "135"; "" for the first ones. Wired devices
    share receivers, so that numbers may be missing (docs/is900.md 14)."""
    stylus_bytes: int = 1
    """Length of item 16: 1 in both manuals; two programs expect 2 (docs/is900.md 14)."""
    controls: str = "cycle"
    """Pattern of buttons and joystick, one of `CONTROL_PATTERNS`: "cycle" moves all of them, "still" none."""
    udp: bool = False
    """Whether the device broadcasts UDP packets after power-on; the command `MEthUdp` switches them on and off."""
    udp_port: int = 5001
    """Port of these packets after power-on; `MEthUdpPort` changes it (docs/is900.md 9)."""
    faults: tuple[Fault, ...] = ()
    """Faults that are injected."""
    seed: int = 1
    """Seed of the faults' random draws."""
    known_items: ClassVar[frozenset[int]] = frozenset(ITEMS) - EXTENDED_ITEMS
    """Items that the device knows, where its firmware has them."""
    usual_items: ClassVar[tuple[int, ...]] = ()
    """Output list that this project's driver requests; empty for that of a scenario."""
    known_stations: ClassVar[str] = STATION_CHARACTERS.decode()
    """Characters of the stations that the device can have."""
    fastrak: ClassVar[bool] = False
    """Whether `B` turns all of an orientation, lengths in commands have the unit of records, and positions lie in a
    hemisphere, as on a FASTRAK."""
    hemisphere: tuple[float, float, float] = (1.0, 0.0, 0.0)
    """Hemisphere vector of each station after power-on (`H`)."""

    def __post_init__(self) -> None:
        check_firmware(self.firmware)
        check_control_pattern(self.controls)
        if not (self.identification.isascii() and self.identification.isprintable() and len(self.identification) < 32):
            raise BadInput(
                f"identification {self.identification!r} is not possible.", "Give up to 31 ASCII characters."
            )
        if self.baud not in SUPPORTED_BAUD_RATES:
            raise BadInput(f"{self.baud} baud.", f"An IS-900 supports {', '.join(map(str, SUPPORTED_BAUD_RATES))}.")
        for name, possible, advice in (
            ("status_bytes", self.status_bytes in (54, 55), "Status records have 55 or 54 bytes."),
            ("stylus_bytes", self.stylus_bytes in (1, 2), "Item 16 has 1 or 2 bytes."),
            ("queue_records", self.queue_records >= 1, "Give at least 1."),
            ("udp_port", 0 < self.udp_port < 65536, "Give a number from 1 to 65535."),
            ("restart_s", 0.0 <= self.restart_s <= 3600.0, "Give a number from 0 to 3600."),
        ):
            if not possible:
                raise BadInput(f"{name} = {getattr(self, name):g} is not possible.", advice)

    def station_characters(self, stations: int) -> str:
        """Return the characters of this many stations. Raises BadInput when they do not fit."""
        known = self.known_stations
        characters = self.characters or known[:stations]
        if len(characters) != stations or "".join(c for c in known if c in characters) != characters:
            raise BadInput(
                f"characters = {characters!r} do not fit {stations} stations.",
                f"The device has {known}: wear at most {len(known)} stations, and give each one of these, ascending.",
            )
        return characters
