"""The device configuration that a user requests, and the time constants of the driver."""

from dataclasses import dataclass
from typing import ClassVar

from harness.errors import BadInput
from harness.stream.polhemus.codec.items import (
    BAUD_RATES,
    MOST_DEVICE_HZ,
    STATION_CHARACTERS,
    DeviceFamily,
    record_type,
)
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.records import RecordFormat


@dataclass(frozen=True)
class LineConfig:
    """The requested configuration of a device. Raises BadInput where it is contradictory."""

    items: tuple[int, ...] = (2, 4, 1)
    """Output list of every station (docs/is900.md 5.1)."""
    centimetres: bool = True
    """Whether positions on the wire are in centimetres; False is inches. Frames are in metres either way."""
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
    family: ClassVar[DeviceFamily] = "is900"

    def __post_init__(self) -> None:
        record_type(self.items)
        if self.rate_hz is not None and not 0.0 < self.rate_hz <= 1000.0:
            raise BadInput(
                f"A rate of {self.rate_hz} Hz is not possible.",
                f"The device runs at up to {MOST_DEVICE_HZ[self.family]:g} Hz.",
            )
        if self.baud is not None and self.baud <= 0:
            raise BadInput(f"{self.baud} baud is not possible.", f"It uses {join_commas(BAUD_RATES)}.")
        if self.stations is not None and len(set(self.stations)) < len(self.stations):
            raise BadInput(f"Stations {join_commas(self.stations)}: a name occurs twice.", "Give each its own name.")
        if self.characters is None and self.stations and _are_characters(self.stations):
            ascending = sorted(self.stations, key=STATION_CHARACTERS.decode().index)
            object.__setattr__(self, "stations", tuple(ascending))
            object.__setattr__(self, "characters", "".join(ascending))
        if self.characters is not None:
            WireFormat(
                self.stations or (),
                1.0,
                self.items,
                characters=self.characters.encode("ascii", "replace"),
                family=self.family,
            )

    @property
    def metres_per_unit(self) -> float:
        """Unit of positions on the wire [m]."""
        return 0.01 if self.centimetres else 0.0254

    @property
    def settings(self) -> RecordFormat:
        """Number format that the device will be configured for."""
        return RecordFormat(self.metres_per_unit)


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


def join_commas(values: tuple[object, ...]) -> str:
    """Return values as text, separated by commas."""
    return ",".join(map(str, values))
