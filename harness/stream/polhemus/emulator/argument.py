"""The argument of a command line, which follows its name: a station and fields between commas."""

import math
from dataclasses import dataclass

from harness.stream.polhemus.emulator.settings import STATION_NAMES

MISSING, NOT_A_NUMBER, OUT_OF_RANGE, UNKNOWN_COMMAND = -1, -2, -3, -99
"""Error codes (docs/is900.md 6.4)."""
_MAX_MAGNITUDE = 1e6
"""No position, angle or rate that a device could mean is larger [choice]."""


class CommandError(Exception):
    """An error in a command, which the device answers with an error record."""

    def __init__(self, code: int, field: int = 1) -> None:
        super().__init__(code, field)
        self.code, self.field = code, field


@dataclass(frozen=True)
class CommandArgument:
    """The argument of a command, such as `1,2,11,0` of `O1,2,11,0`. Methods raise CommandError for an invalid field."""

    text: str
    stations: str = STATION_NAMES
    """Characters of the stations that the device knows."""

    @property
    def fields(self) -> list[str]:
        """The fields between commas, without blanks. The first is the station if the command has one."""
        return [field.strip() for field in self.text.split(",")]

    @property
    def sets(self) -> bool:
        """Whether a field follows the first one."""
        return "," in self.text

    def station(self) -> str:
        """Return the station, which may be given in either case (docs/is900.md 3)."""
        name = self.fields[0].upper()
        if not name:
            raise CommandError(MISSING)
        if len(name) != 1 or name not in self.stations:
            raise CommandError(OUT_OF_RANGE)
        return name

    def numbers(self, count: int | None = None, start: int = 1, max_magnitude: float = _MAX_MAGNITUDE) -> list[float]:
        """Return the fields from index `start` on, exactly `count` of them, each of at most this magnitude."""
        texts = self.fields[start:]
        if count is not None and len(texts) > count:
            raise CommandError(OUT_OF_RANGE, start + count + 1)
        if count is not None and len(texts) < count:
            raise CommandError(MISSING, start + len(texts) + 1)
        return [_parse_number(text, start + k + 1, max_magnitude) for k, text in enumerate(texts)]

    def codes(self) -> list[int]:
        """Return the fields after the first as integers."""
        values = self.numbers()
        for index, value in enumerate(values):
            if value != int(value):
                raise CommandError(OUT_OF_RANGE, index + 2)
        return [int(value) for value in values]

    def integer(self, low: int, high: int, start: int = 1) -> int:
        """Return the only field from index `start` on, an integer from `low` to `high`."""
        (value,) = self.numbers(1, start, max_magnitude=high)
        if value != int(value) or not low <= value <= high:
            raise CommandError(OUT_OF_RANGE, start + 1)
        return int(value)

    def require_empty(self) -> None:
        """Raise CommandError unless the argument is empty."""
        if self.text.strip():
            raise CommandError(UNKNOWN_COMMAND)


def _parse_number(text: str, field: int, max_magnitude: float) -> float:
    if not text:
        raise CommandError(MISSING, field)
    try:
        value = float(text) if "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CommandError(NOT_A_NUMBER, field)
    if abs(value) > max_magnitude:
        raise CommandError(OUT_OF_RANGE, field)
    return value
