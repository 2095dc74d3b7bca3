"""The rest of a command line, after its name: a station and fields between commas, or what is wrong with them."""

import math
from dataclasses import dataclass

from harness.stream.emulator.settings import STATION_NAMES

MISSING, NOT_A_NUMBER, OUT_OF_RANGE, UNKNOWN_COMMAND = -1, -2, -3, -99
"""Error codes (docs/is900.md 6.4)."""
_MAX_MAGNITUDE = 1e6
"""No place, angle or rate that a device could mean is larger [choice]."""


class CommandError(Exception):
    """A command that gets an error record."""

    def __init__(self, code: int, field: int = 1) -> None:
        super().__init__(code, field)
        self.code, self.field = code, field


@dataclass(frozen=True)
class CommandArgument:
    """Such as `1,2,11,0` of `O1,2,11,0`."""

    text: str

    @property
    def fields(self) -> list[str]:
        """Between commas, without blanks; the first one is the station where the command has one."""
        return [field.strip() for field in self.text.split(",")]

    @property
    def sets(self) -> bool:
        """Whether something follows the first field."""
        return "," in self.text

    def station(self) -> str:
        """Stations may be named in either case (docs/is900.md 3)."""
        name = self.fields[0].upper()
        if not name:
            raise CommandError(MISSING)
        if len(name) != 1 or name not in STATION_NAMES:
            raise CommandError(OUT_OF_RANGE)
        return name

    def numbers(self, count: int | None = None, after: int = 1, largest: float = _MAX_MAGNITUDE) -> list[float]:
        """The fields after so many others, as many as `count`; none is larger in size."""
        texts = self.fields[after:]
        if count is not None and len(texts) > count:
            raise CommandError(OUT_OF_RANGE, after + count + 1)
        if count is not None and len(texts) < count:
            raise CommandError(MISSING, after + len(texts) + 1)
        return [_parse_number(text, after + k + 1, largest) for k, text in enumerate(texts)]

    def codes(self) -> list[int]:
        """The fields after the first: whole numbers."""
        values = self.numbers()
        for place, value in enumerate(values):
            if value != int(value):
                raise CommandError(OUT_OF_RANGE, place + 2)
        return [int(value) for value in values]

    def integer(self, low: int, high: int, after: int = 1) -> int:
        """The one field after so many others: a whole number within these."""
        (value,) = self.numbers(1, after, largest=high)
        if value != int(value) or not low <= value <= high:
            raise CommandError(OUT_OF_RANGE, after + 1)
        return int(value)

    def require_empty(self) -> None:
        """The command has no argument."""
        if self.text.strip():
            raise CommandError(UNKNOWN_COMMAND)


def _parse_number(text: str, field: int, largest: float) -> float:
    if not text:
        raise CommandError(MISSING, field)
    try:
        value = float(text) if "_" not in text else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CommandError(NOT_A_NUMBER, field)
    if abs(value) > largest:
        raise CommandError(OUT_OF_RANGE, field)
    return value
