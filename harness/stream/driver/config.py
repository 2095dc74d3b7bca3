"""What the user wants of the device, and the time constants of the driver."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from harness.errors import BadInput
from harness.stream.codec.items import BAUD_RATES, STANDARD_LIST, record_type
from harness.stream.codec.records import RecordFormat

QUALITY_ITEMS = (40, 76)
"""Items that say how well a station is tracked (docs/is900.md 7)."""

Alignment = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Origin, a point on +X and a point on +Y of the frame that a station is to report in [m]."""


@dataclass(frozen=True)
class DriverConfig:
    """The set-up asked for; BadInput where it contradicts itself."""

    items: tuple[int, ...] = STANDARD_LIST
    """Output list of every station (docs/is900.md 5.1)."""
    centimetres: bool = True
    """Else inches, on the wire alone."""
    milliseconds: bool = True
    """Else microseconds, likewise."""
    stations: tuple[str, ...] | None = None
    """Names; the first is the first active station of the device, and so on. None: all, by their characters."""
    rate_hz: float | None = None
    """Rounds per second that the device is known to run at. None: as it says itself, else measured."""
    baud: int | None = None
    """Of a serial port. None: each of `BAUD_RATES` is tried."""
    boresight: bool = False
    """Whether every station's heading is zeroed where it points at set-up."""
    alignment: Alignment | Mapping[str, Alignment] | None = None
    """The frame to report in: of all stations, or by station name; None leaves it as it is."""
    quality: Literal["record", "mp"] = "record"
    """Where lost stations show: in the records (items 40, 76), or in the answers to `MP`, asked for once a second."""

    def __post_init__(self) -> None:
        record_type(self.items)
        if self.quality not in ("record", "mp"):
            raise BadInput(f"Quality {self.quality!r} is not known.", "Take 'record' or 'mp'.")
        if self.quality == "record" and not set(QUALITY_ITEMS) & set(self.items):
            raise BadInput(
                f"The output list {_join_commas(self.items)} has no item 40, so a lost station would not show.",
                "Add 40 to it, or take quality 'mp' (--quality mp).",
            )
        if self.rate_hz is not None and not 0.0 < self.rate_hz <= 1000.0:
            raise BadInput(f"A rate of {self.rate_hz} Hz.", "An IS-900 runs at up to 180 Hz.")
        if self.baud is not None and self.baud <= 0:
            raise BadInput(f"{self.baud} baud.", f"An IS-900 speaks at {_join_commas(BAUD_RATES)}.")
        if self.stations is not None and len(set(self.stations)) < len(self.stations):
            raise BadInput(f"Stations {_join_commas(self.stations)}: a name twice.", "Each has a name of its own.")

    @property
    def settings(self) -> RecordFormat:
        """How numbers will be written."""
        return RecordFormat(0.01 if self.centimetres else 0.0254, 1e-3 if self.milliseconds else 1e-6)

    def alignment_of(self, station: str) -> Alignment | None:
        """The frame of a station, by its name."""
        return self.alignment.get(station) if isinstance(self.alignment, Mapping) else self.alignment


@dataclass(frozen=True)
class DriverTiming:
    """How long the driver waits for what [s]."""

    quiet_s: float = 0.1
    """So long without a byte after `c`, and the device has stopped. Ten times a character at 9600 baud is 0.01 s, and
    USB adapters hold bytes back for 0.016 s."""
    answer_s: float = 1.0
    """VRPN allows as much for `S` (docs/is900.md 11.1); InterSense's library 2 s for lists."""
    stalled_s: float = 0.5
    """Nothing, or no record, for so long: the device is asked how it is."""
    silent_s: float = 2.0
    """No record for so long: the line is opened anew. VRPN's watchdog bites after as much."""
    retry_s: float = 0.25
    """Between two attempts to come back; a device should stream again within 2 s of its return."""
    tracking_s: float = 1.0
    """Between two `MP`, where records do not tell quality."""
    rezero_s: float = 3600.0
    """Between two `MZ`. After an hour a step of a 32-bit millisecond clock is 0.25 ms, after a day 8 ms
    (docs/is900.md 8)."""
    garbage_s: float = 1.0
    """Garbage is told anew after so long without any."""
    measure_s: float = 1.0
    """For a rate that the device does not tell."""
    poll_s: float = 0.05
    """The longest single wait, so that closing is prompt; nothing for so long, and an unfinished frame is given up: USB
    adapters hold bytes back for 0.016 s, and what is only late shall not be torn."""


def _join_commas(values: tuple[object, ...]) -> str:
    return ",".join(map(str, values))
