"""The device configuration that a user requests, and the time constants of the driver."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from harness.errors import BadInput
from harness.stream.is900.codec.items import (
    BAUD_RATES,
    STANDARD_LIST,
    STATION_CHARACTERS,
    position_range_m,
    record_type,
)
from harness.stream.is900.codec.reader import WireFormat
from harness.stream.is900.codec.records import RecordFormat

QUALITY_ITEMS = (40, 76)
"""Items that report how well a station is tracked (docs/is900.md 7)."""

Alignment = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]
"""Origin, a point on +X and a point on +Y of the frame that a station reports in [m]."""


@dataclass(frozen=True)
class DriverConfig:
    """The requested configuration of the device. Raises BadInput where it is contradictory."""

    items: tuple[int, ...] = STANDARD_LIST
    """Output list of every station (docs/is900.md 5.1)."""
    centimetres: bool = True
    """Whether positions on the wire are in centimetres; False is inches. Frames are in metres either way."""
    milliseconds: bool = True
    """Whether times on the wire are in milliseconds; False is microseconds. Frames are in seconds either way."""
    stations: tuple[str, ...] | None = None
    """Station names: the first is the first active station of the device, and so on. None takes all, named by their
    characters. Names that are characters, such as "1" and "3", mean these stations.
    """
    characters: str | None = None
    """Characters of the device's stations that these names belong to, ascending, such as "13". None takes the first
    active ones.
    """
    rate_hz: float | None = None
    """Rounds per second of the device, if known. None takes the rate that the device reports, or else measures it."""
    baud: int | None = None
    """Baud rate of a serial port [bit/s]. None tries each of `BAUD_RATES`."""
    boresight: bool = False
    """Whether the heading of every station is set to zero at its present direction during configuration."""
    alignment: Alignment | Mapping[str, Alignment] | None = None
    """The frame to report in: one for all stations, or one for each station name. None leaves it unchanged."""
    keep_settings: bool = False
    """Whether the device keeps what other programs have set: tip offsets, alignments, boresight reference angles,
    filters and boresight. Otherwise they are at their defaults during the session. At its end they are put back, except
    boresight.
    """
    reach_m: float | None = None
    """Largest coordinate of any station in the tracker's frame [m], if known. A list of a shorter range is refused."""
    stylus_bytes: int = 1
    """Length of item 16, for a list that has it: 1 in both manuals, 2 in two programs (docs/is900.md 14)."""
    quality: Literal["record", "mp"] = "record"
    """Where lost stations show: "record" in items 40 and 76, "mp" in the replies to `MP`, polled once a second."""

    def __post_init__(self) -> None:
        record_type(self.items)
        if self.quality not in ("record", "mp"):
            raise BadInput(f"Quality {self.quality!r} is not known.", "Use 'record' or 'mp'.")
        if self.quality == "record" and not set(QUALITY_ITEMS) & set(self.items):
            raise BadInput(
                f"The output list {_join_commas(self.items)} has no item 40, so a lost station would not show.",
                "Add 40 to it, or use quality 'mp' (--quality mp).",
            )
        range_m = position_range_m(self.items)
        if range_m is not None and self.reach_m is not None and self.reach_m >= range_m:
            raise BadInput(
                f"The output list {_join_commas(self.items)} carries positions up to {range_m:g} m from the tracker's "
                f"origin on each axis, but the stations reach {self.reach_m:.2f} m.",
                f"Use a list with item 2, such as --items {_join_commas(STANDARD_LIST)} (the default). "
                "If the line is then too slow, use fewer stations or a lower rate.",
            )
        if self.rate_hz is not None and not 0.0 < self.rate_hz <= 1000.0:
            raise BadInput(f"A rate of {self.rate_hz} Hz is not possible.", "An IS-900 runs at up to 180 Hz.")
        if self.baud is not None and self.baud <= 0:
            raise BadInput(f"{self.baud} baud is not possible.", f"An IS-900 uses {_join_commas(BAUD_RATES)}.")
        if self.stations is not None and len(set(self.stations)) < len(self.stations):
            raise BadInput(f"Stations {_join_commas(self.stations)}: a name occurs twice.", "Give each its own name.")
        if self.characters is None and self.stations and _are_characters(self.stations):
            ascending = sorted(self.stations, key=STATION_CHARACTERS.decode().index)
            object.__setattr__(self, "stations", tuple(ascending))
            object.__setattr__(self, "characters", "".join(ascending))
        if self.characters is not None:
            WireFormat(self.stations or (), 1.0, self.items, characters=self.characters.encode("ascii", "replace"))

    @property
    def settings(self) -> RecordFormat:
        """Number format that the device will be configured for."""
        return RecordFormat(
            0.01 if self.centimetres else 0.0254, 1e-3 if self.milliseconds else 1e-6, stylus_bytes=self.stylus_bytes
        )

    def alignment_of(self, station: str) -> Alignment | None:
        """Return the reporting frame of the station with this name, or None."""
        return self.alignment.get(station) if isinstance(self.alignment, Mapping) else self.alignment


@dataclass(frozen=True)
class DriverTiming:
    """Time constants of the driver [s]."""

    quiet_s: float = 0.1
    """Silence after `c` that shows that the device has stopped. Ten characters at 9600 baud take 0.01 s, and USB
    adapters hold bytes back for up to 0.016 s.
    """
    answer_s: float = 1.0
    """Longest wait for a reply. VRPN waits this long for `S` (docs/is900.md 11.1); InterSense's library waits 2 s for
    lists.
    """
    stalled_s: float = 0.5
    """Time without a byte, or without a record, after which the driver queries the state of the device."""
    silent_s: float = 2.0
    """Time without a record after which the driver reopens the line. VRPN's watchdog waits as long."""
    retry_s: float = 0.25
    """Interval between two attempts to reconnect. A device should stream again within 2 s of its return."""
    tracking_s: float = 1.0
    """Interval between two `MP` queries, where records do not report quality."""
    rezero_s: float = 3600.0
    """Interval between two `MZ` commands. The step of a 32-bit millisecond clock is 0.25 ms after an hour and 8 ms
    after a day (docs/is900.md 8).
    """
    garbage_s: float = 1.0
    """Time without garbage after which new garbage is reported again."""
    measure_s: float = 1.0
    """Duration of the rate measurement of a device that does not report its rate."""
    poll_s: float = 0.05
    """Longest single wait, so that closing is prompt. After this long without a byte an overdue frame is closed. It
    exceeds the 0.016 s for which USB adapters hold bytes back, so that late bytes do not split a frame.
    """


def _are_characters(names: tuple[str, ...]) -> bool:
    """Whether these are characters of stations; letters alone may as well be names."""
    return set(names) <= set(STATION_CHARACTERS.decode()) and any(name.isdigit() for name in names)


def _join_commas(values: tuple[object, ...]) -> str:
    return ",".join(map(str, values))
