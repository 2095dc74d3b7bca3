"""Axes, unit of length and quaternions of a reference: what speaks against those of the package, with the likely cause.

A tracker's scale error is a few thousandths. A larger one, or a mirrored motion, is a mistake in the reference's file.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput

MOST_SCALE_ERROR = 0.2
"""Largest relative error of positions that counts as one of a tracker [choice]."""
MOST_TURN_RAD = math.radians(15.0)
"""Largest median error of orientations with which a registration is believed [choice]."""
MOST_PLACE_M = 0.05
"""Largest median error of a station's positions with which a registration is believed [m] [choice]."""
MOST_PLACE_SHARE = 0.3
"""Largest such error of a source of unknown noise, relative to the extent of the motion: odometry drifts [choice]."""
MOST_HEADING_RAD = math.radians(30.0)
"""Largest heading error that counts as one of a tracker [rad] [choice]."""
MOST_CLOCK_ERROR = 500e-6
"""Largest relative error of a clock's rate that counts as one of a device; quartz errs by less than 200e-6 [choice]."""
MOST_PLAIN_CLOCK_ERROR = 0.01
"""Largest relative error between two sources of unknown clocks; a larger one is a wrong rate [choice]."""
UNITS_M = {
    "micrometres": 1e-6, "millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "decimetres": 0.1, "feet": 0.3048,
    "kilometres": 1e3,
}  # fmt: skip
_CONFUSIONS = {f"{unit} instead of metres": metres for unit, metres in UNITS_M.items()} | {
    "inches instead of centimetres": 2.54
}
"""Unit of a file instead of the one in which it was read -> ratio of both."""
_MIRRORED_GAIN = 4.0
"""Factor by which a mirrored fit must leave less than an unmirrored one to be believed [choice]."""
_LEFT_HANDED = "The axes of one are left-handed (Unity exports such), or one axis of its file is negated."
_TO_RIGHT_HANDED = "To mirror a file, negate z of its positions, and x and y of its quaternions."


def require_same_hand(reported_m: Sequence[Floats], reference_m: Sequence[Floats]) -> None:
    """Raise BadInput if positions (N, 3) of stations are those of the reference's bodies (N, 3) in a mirror.

    The best similarity with and without a reflection is that of Umeyama 1991.
    """
    first, second = _centred(reported_m), _centred(reference_m)
    cross = first.T @ second
    spread = np.linalg.svd(cross, compute_uv=False)
    if np.linalg.det(cross) >= 0.0:
        return
    total = float(np.sum(first**2) * np.sum(second**2))
    mirrored, turned = (1.0 - (spread[0] + spread[1] + sign * spread[2]) ** 2 / total for sign in (1.0, -1.0))
    if _MIRRORED_GAIN * mirrored < turned:
        raise BadInput(f"Positions of capture and reference are mirror images. {_LEFT_HANDED}", _TO_RIGHT_HANDED)


def _centred(values: Sequence[Floats]) -> Floats:
    joined: Floats = np.concatenate(values)
    centred: Floats = joined - joined.mean(axis=0)
    return centred


def require_scale(factor: float) -> None:
    """Raise BadInput unless reported lengths are those of the reference to a fifth; `factor` is their ratio."""
    if abs(factor - 1.0) <= MOST_SCALE_ERROR:
        return
    if not math.isfinite(factor):
        raise BadInput("The positions show no scale.", "Move through the room, and give the reference in metres.")
    if factor <= 0.0:
        raise BadInput(
            f"Positions of the capture are {factor:.4g} times those of the reference.",
            f"Likely cause: positions or quaternions of one are of left-handed axes. {_TO_RIGHT_HANDED}",
        )
    units = {("reference", unit): ratio for unit, ratio in _CONFUSIONS.items()}
    units |= {("capture", unit): 1.0 / ratio for unit, ratio in _CONFUSIONS.items()}
    whose, unit = min(units, key=lambda key: abs(math.log(factor / units[key])))
    which = f"the {whose}"
    cause = f"{which} is in {unit}, the nearest unit ({units[whose, unit]:.4g})"
    if abs(factor / units[whose, unit] - 1.0) > MOST_SCALE_ERROR:
        cause, which = "one of both is scaled, by no usual unit of length", "both"
    raise BadInput(
        f"Lengths of the capture are {factor:.4g} times those of the reference. Likely cause: {cause}.",
        f"Give {which} in metres. A scale error above {100.0 * MOST_SCALE_ERROR:g} % is not measured.",
    )


def require_orientations(residual_rad: Sequence[Floats]) -> None:
    """Raise BadInput if errors of orientations (N, 3), rotation vectors, are large in the middle."""
    middle_rad = float(np.median(np.linalg.norm(np.concatenate(residual_rad), axis=1)))
    if not middle_rad <= MOST_TURN_RAD:
        raise BadInput(
            f"Orientations of capture and reference disagree by {math.degrees(middle_rad):.0f} deg in the middle.",
            "Quaternions of one may be of left-handed axes, inverted, or in another order than was read.",
        )


def require_positions(
    residual_m: Mapping[str, Floats], factor: float, heading_rad: float, extent_m: float = 0.0
) -> None:
    """Raise BadInput if positions do not follow the reference; `residual_m` holds errors (N, 3) by station.

    `factor` is the ratio of reported lengths to those of the reference, `heading_rad` the heading error, `extent_m` the
    RMS distance of the reference's positions from their mean, for a source of unknown noise.
    """
    most_m = max(MOST_PLACE_M, MOST_PLACE_SHARE * extent_m) * max(1.0, abs(factor))
    size_m = {name: float(np.median(np.linalg.norm(rest, axis=1))) for name, rest in residual_m.items() if len(rest)}
    far = [name for name, middle_m in size_m.items() if not middle_m <= most_m]
    found_m = max(size_m.values(), default=0.0)
    if far and len(far) < len(size_m):
        raise BadInput(
            f"Positions of {', '.join(far)} disagree with the reference by {found_m:.2g} m in the middle; those of the "
            "other stations agree.",
            "Likely cause: bodies of the reference are in different units, of different times, or exchanged.",
        )
    if far or not abs(heading_rad) <= MOST_HEADING_RAD:
        raise BadInput(
            f"Positions of capture or reference disagree with their orientations, by {found_m:.2g} m in the middle "
            f"and a heading of {math.degrees(heading_rad):.0f} deg.",
            "Likely cause: positions or quaternions were converted to other axes or a left-handed frame and the others "
            "were not, one axis has another scale, or they are of different times.",
        )


def require_clock(ratio: float, deviation: float, most: float = MOST_CLOCK_ERROR) -> None:
    """Raise BadInput if the device's clock is faster or slower than the reference's by more than a clock errs.

    `ratio` is the relative error of its rate, `deviation` the standard deviation of that, `most` the
    largest one that counts as a clock's.
    """
    if abs(ratio) - 2.0 * deviation > most:
        raise BadInput(
            f"The clock of the capture runs {1.0 + ratio:.5f} times as fast as that of the reference.",
            "Likely cause: the frame rate of the reference is another one than its file says (29.97 Hz is not 30 Hz), "
            "or frames were left out. Correct its times.",
        )
