"""What emitters must fulfil, whether they come from a file, a scenario or code."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.stream.codec.replies import Emitter

FEWEST, MOST = 3, 200
"""Numbers of emitters of a constellation. A position needs three ranges; no known constellation has 200."""
SAME_PLACE_M = 1e-3
"""Emitters closer than this are at one place [m]."""
LARGEST_M = 1000.0
"""Largest coordinate of an emitter [m] [choice]."""
NORMAL_TOLERANCE = 0.005 * 3.0**0.5 + 1e-9
"""Difference of a normal's length from 1 that two decimals can cause."""
_LARGEST_NUMBER = 10**9


@dataclass(frozen=True)
class EmitterFault:
    """Why emitters cannot be used."""

    index: int | None
    """Index of the emitter at fault; None for the number of emitters."""
    found: str
    expected: str


def find_emitter_fault(emitters: Sequence[Emitter]) -> EmitterFault | None:
    """The first fault of J emitters; None if they can be used."""
    for index, emitter in enumerate(emitters):
        if fault := _own_fault(index, emitter) or _repetition(index, emitter, emitters[:index]):
            return fault
        if index == MOST:
            return EmitterFault(index, f"more than {MOST} emitters", f"{FEWEST} to {MOST}")
    if len(emitters) < FEWEST:
        count = f"{len(emitters)} emitter{'s'[: len(emitters) != 1]}"
        return EmitterFault(None, count, f"{FEWEST} or more: a position needs as many ranges")
    return None


def _own_fault(index: int, emitter: Emitter) -> EmitterFault | None:
    if not 1 <= emitter.number <= _LARGEST_NUMBER or not 0 <= emitter.identity <= _LARGEST_NUMBER:
        found = f"emitter {emitter.number} with the identity {emitter.identity}"
        return EmitterFault(index, found, f"a number from 1 and an identity from 0, up to {_LARGEST_NUMBER:,}")
    if not all(abs(value) <= LARGEST_M for value in emitter.position_m):  # not so for NaN
        found = f"emitter {emitter.number} at {_point(emitter.position_m)} m"
        return EmitterFault(index, found, f"coordinates up to {LARGEST_M:g} m")
    length = float(np.sqrt(np.sum(np.square(emitter.normal))))
    if not abs(length - 1.0) <= NORMAL_TOLERANCE:
        found = f"emitter {emitter.number} with the normal {_point(emitter.normal)}, of length {length:.3f}"
        return EmitterFault(index, found, "a unit vector")
    return None


def _repetition(index: int, emitter: Emitter, before: Sequence[Emitter]) -> EmitterFault | None:
    for other in before:
        if other.number == emitter.number:
            return EmitterFault(index, f"a second emitter {emitter.number}", "a number of its own for each emitter")
        if np.sum(np.square(np.subtract(other.position_m, emitter.position_m))) <= SAME_PLACE_M**2:
            found = f"emitter {emitter.number} at the place of emitter {other.number}"
            return EmitterFault(index, found, f"emitters more than {1e3 * SAME_PLACE_M:g} mm apart")
    return None


def _point(vector: Sequence[float]) -> str:
    return f"({', '.join(f'{value:.4g}' for value in vector)})"
