"""Further bars of the constellation `hall`: its pattern goes on where the performer walks farther than it reaches.

Bars of three emitters stand in a lattice, and bars along x and along y alternate (`models/constellations/README.md`).
An emitter has the same number in every take, so that the survey's errors of a session are its own.
"""

import math

from harness.errors import BadInput
from harness.stream.polhemus.codec import Emitter

SHIPPED = 4, 3
"""Columns along x and rows along y that `hall.mcf` has."""
MOST = 12, 13
"""Most columns and rows: 29 m by 40 m [choice]."""
STEP_M = 2.4384, 3.048
"""From a bar's middle to the next along x and y [m]."""
SPACING_M = 0.9144
"""From an emitter to the next on a bar [m] (docs/is900.md 13.1)."""
MARGIN_M = 0.75
"""Least distance from the path of the performer's root to the edge of the bars' cells [m] [choice]."""
_FIRST_NUMBER, _FIRST_IDENTITY = 37, 6037


def further_bars(half_m: tuple[float, float]) -> tuple[Emitter, ...]:
    """Emitters that `hall.mcf` lacks below a path that reaches so far from the middle along x and y [m]; BadInput."""
    wanted = tuple(_cells(*axis) for axis in zip(half_m, SHIPPED, STEP_M, strict=True))
    if wanted[0] > MOST[0] or wanted[1] > MOST[1]:
        raise BadInput(
            f"The path covers {2.0 * half_m[0]:.0f} m by {2.0 * half_m[1]:.0f} m: `hall` has at most "
            f"{MOST[0] * STEP_M[0]:.0f} m by {MOST[1] * STEP_M[1]:.0f} m.",
            "Take a part of the clip, or name a constellation.file.",
        )
    out: list[Emitter] = []
    for place, (column, row) in enumerate(_places()):
        if abs(column) <= wanted[0] / 2 and abs(row) <= wanted[1] / 2:
            along_y = round(row + column + (sum(SHIPPED) - 2) / 2) % 2
            for n in range(3):
                shift_m, number = (n - 1) * SPACING_M, 3 * place + n
                at_m = column * STEP_M[0] + shift_m * (1 - along_y), row * STEP_M[1] + shift_m * along_y, 0.0
                out.append(Emitter(_FIRST_NUMBER + number, at_m, (0.0, 0.0, 1.0), _FIRST_IDENTITY + number))
    return tuple(out)


def _cells(half_m: float, shipped: int, step_m: float) -> int:
    """Columns or rows that a path needs: those shipped, and as many more on both sides."""
    return shipped + 2 * max(math.ceil((half_m + MARGIN_M) / step_m - shipped / 2), 0)


def _places() -> list[tuple[float, float]]:
    """Places of all bars that are not shipped, in steps from the middle, the nearest first."""
    columns, rows = ([n - (most - 1) / 2 for n in range(most)] for most in MOST)
    places = [(c, r) for c in columns for r in rows if abs(c) > SHIPPED[0] / 2 or abs(r) > SHIPPED[1] / 2]
    return sorted(places, key=lambda at: (math.hypot(at[0] * STEP_M[0], at[1] * STEP_M[1]), at))
