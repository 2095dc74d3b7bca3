"""Rest before and after a motion: pieces of cubic splines that join it in position and velocity.

The motion rests at its first point, moves away from it and passes it again with its first velocity. It comes to rest at
its last point in the same way. So a performer rests in a pose of the motion itself. On the way there, no coordinate
goes farther from that pose than 4/27 of its velocity times the duration.

Pieces are coefficients (4, P, ...) in falling powers of the time since the beginning of each, as scipy's `PPoly` has
them.
"""

import numpy as np
from scipy.interpolate import PPoly

from harness.core.arrays import Floats
from harness.errors import BadInput

START_S, STOP_S = 0.4, 0.3
"""Duration from rest to the first velocity, and from the last velocity to rest [s] [choice]."""


def with_rest_before(spline: PPoly, rest_s: float) -> PPoly:
    """A cubic spline that begins `rest_s` earlier and rests until `START_S` before its old beginning [s].

    Its own pieces stay as they are, to the bit. BadInput for a rest that is not longer than `START_S`.
    """
    if not rest_s > START_S:
        raise BadInput(f"A rest of {rest_s:g} s is too short.", f"The start of the motion takes {START_S:g} s.")
    begin_s = float(spline.x[0])
    pieces = np.concatenate([rest_piece(spline(begin_s)), start_piece(spline), spline.c], axis=1)
    return PPoly.construct_fast(
        pieces, np.concatenate([[begin_s - rest_s, begin_s - START_S], spline.x]), spline.extrapolate
    )


def with_rest_after(spline: PPoly, rest_s: float) -> PPoly:
    """A cubic spline that ends `rest_s` later and rests from `STOP_S` after its old end [s].

    Its own pieces stay as they are, to the bit. BadInput for a rest that is not longer than `STOP_S`.
    """
    if not rest_s > STOP_S:
        raise BadInput(f"A rest of {rest_s:g} s is too short.", f"The stop of the motion takes {STOP_S:g} s.")
    end_s = float(spline.x[-1])
    pieces = np.concatenate([stop_piece(spline), rest_piece(spline(end_s))], axis=1)
    return extend(spline, pieces, np.array([end_s + STOP_S, end_s + rest_s]))


def extend(spline: PPoly, pieces: Floats, ends_s: Floats) -> PPoly:
    """A spline with P more pieces (4, P, ...) at its end, which end at these times (P,) [s]."""
    c, x = np.concatenate([spline.c, pieces], axis=1), np.concatenate([spline.x, ends_s])
    return PPoly.construct_fast(c, x, spline.extrapolate)


def start_piece(spline: PPoly) -> Floats:
    """A piece of `START_S` from rest at a spline's first point to that point with its velocity."""
    place, speed = spline(spline.x[0]), spline(spline.x[0], 1)
    # velocity times duration times u^2 (u - 1) with u from 0 to 1
    return _piece(speed / START_S**2, -speed / START_S, np.zeros_like(place), place)


def stop_piece(spline: PPoly) -> Floats:
    """A piece of `STOP_S` from a spline's last point with its velocity to rest at that point."""
    place, speed = spline(spline.x[-1]), spline(spline.x[-1], 1)
    # velocity times duration times u (1 - u)^2 with u from 0 to 1
    return _piece(speed / STOP_S**2, -2.0 * speed / STOP_S, speed, place)


def rest_piece(place: Floats) -> Floats:
    """A piece that stays at a point (...)."""
    still = np.zeros_like(place)
    return _piece(still, still, still, place)


def _piece(*coefficients: Floats) -> Floats:
    out: Floats = np.stack(coefficients)[:, None]
    return out
