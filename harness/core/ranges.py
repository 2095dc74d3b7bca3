"""Ranges of numbers, declared in the annotation of a field: `share: Annotated[float, Range(0.0, 1.0)] = 0.1`.

`core.fields` checks them where it reads a value from a file or an option, and `check_ranges` when a record is made.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from harness.errors import BadInput


@dataclass(frozen=True)
class Range:
    """The numbers that a field may have, both ends included; for a tuple, the numbers that each entry may have."""

    low: float
    high: float
    ascending: bool = False
    """Whether the entries of a tuple must not descend."""

    def accepts(self, value: Any) -> bool:
        """Whether a number, or each entry of a tuple, is in the range; NaN never is, None always."""
        if value is None:
            return True
        numbers = value if isinstance(value, tuple) else (value,)
        if self.ascending and any(a > b for a, b in itertools.pairwise(numbers)):
            return False
        return all(self.low <= number <= self.high for number in numbers)

    def __str__(self) -> str:
        """The range in words, such as "a number from 0 to 1"."""
        kind = "two ascending numbers" if self.ascending else "a number"
        return f"{kind} " + (f"from {self.low:g} to {self.high:g}" if math.isfinite(self.high) else f"{self.low:g} or more")


def check_ranges(record: object, **more: Range) -> None:
    """BadInput unless each number of a dataclass lies in the range of its field; `more` has ranges by name."""
    for name, allowed in [*declared_ranges(type(record)).items(), *more.items()]:
        value = getattr(record, name)
        if not allowed.accepts(value):
            raise BadInput(f"{type(record).__name__}.{name} = {value}.", f"Give {allowed}.")


@cache
def declared_ranges(kind: type) -> dict[str, Range]:
    """The ranges of a dataclass by field."""
    hints = get_type_hints(kind, include_extras=True)
    return {name: allowed for name, hint in hints.items() for allowed in _ranges_in(hint)}


def _ranges_in(hint: Any) -> Iterator[Range]:
    if get_origin(hint) is Annotated:
        yield from (extra for extra in get_args(hint)[1:] if isinstance(extra, Range))
