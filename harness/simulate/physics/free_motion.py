"""True motion of free stations, without a body: for benchmarks and tests."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, PPoly

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.rest_pieces import STOP_S, with_rest_after, with_rest_before

FACING_UP: Floats = np.array([0.0, 1.0, 0.0, 0.0])
"""`tracker_from_station` of a station whose z axis points up; the tracker's points down."""
_REST_S = STOP_S + 1.0
_FIRST_KNOTS, _SAMPLES_PER_KNOT = 64, 16


class FreeMotionSource:
    """Cubic splines through samples of position and orientation of S stations (`TrackerMotionSource`).

    Times are (N,) [s], positions (N, S, 3) [m] and orientations `tracker_from_station` (N, S, 4). The motion begins
    `warm_up_s` before the first sample with a rest at it, and ends with a rest at the last one. BadInput for fewer than
    two samples, or a warm-up that is too short.
    """

    def __init__(
        self,
        stations: Sequence[str],
        time_s: Floats,
        position_m: Floats,
        tracker_from_station: Floats,
        *,
        warm_up_s: float,
    ) -> None:
        if len(time_s) < 2:
            raise BadInput(f"{len(time_s)} sample(s) are no motion.", "Give at least two.")
        self.stations = tuple(stations)
        knots = np.concatenate([position_m, rotations.continuous(tracker_from_station)], axis=2)
        taken: PPoly = CubicSpline(time_s, knots)
        self._spline = with_rest_after(with_rest_before(taken, warm_up_s), _REST_S)
        self.begins_s, self.ends_s = float(self._spline.x[0]), float(self._spline.x[-1])

    def sample_motion(self, time_s: Floats) -> TrackerMotion:
        """Motion at the ticks (T+1,) of the next block [s]; BadInput outside `begins_s` to `ends_s`."""
        if not (time_s.min() >= self.begins_s - 1e-9 and time_s.max() <= self.ends_s + 1e-9):
            raise BadInput(
                f"A time between {time_s.min():.3f} and {time_s.max():.3f} s lies outside the motion.",
                f"It runs from {self.begins_s:g} to {self.ends_s:.3f} s.",
            )
        place, speed = self._spline(time_s), self._spline(time_s, 1)
        # With p the splined quaternion, n its length and q = p/n: 2 conj(q) p'/n has the angular velocity as its
        # vector; the change of n adds to its scalar alone. 2 p' conj(q)/n is the same in the tracker's axes.
        length = np.sqrt(np.sum(place[..., 3:] ** 2, axis=-1, keepdims=True))
        turn = place[..., 3:] / length
        spin = 2.0 * rotations.multiply(speed[..., 3:] / length, rotations.inverse(turn))
        return TrackerMotion(time_s, place[..., :3], turn, speed[..., :3], spin[..., 1:])

    def performer_m(self, time_s: Floats) -> Floats:
        """(F, 3) place of the first station at F times [s]."""
        out: Floats = self._spline(time_s)[:, 0, :3]
        return out

    def qpos(self, time_s: Floats) -> Floats | None:
        """None: no body is in the room."""
        return None


def random_motion(
    seed: int,
    name: str,
    *,
    seconds: float,
    size_m: float,
    speed_m_s: float,
    warm_up_s: float,
    centre_m: Sequence[float] = (0.0, 0.0, 0.0),
    tilt_rad: float = 0.4,
) -> FreeMotionSource:
    """Smooth random motion of a station `name` inside a cube of edge `size_m`, `seconds` long, with this mean speed.

    Position and orientation are uniform cubic B-splines. Their control points are uniform in the cube around `centre_m`
    in the tracker's frame [m], and rotations by N(0, `tilt_rad`) about each axis from facing up. Another speed follows
    the same path; at 0 the station stays at its beginning. BadInput for a cube or a time that is not above 0.
    """
    if not (size_m > 0.0 and seconds > 0.0 and 0.0 <= speed_m_s < np.inf):
        raise BadInput(
            f"A cube of {size_m:g} m, {seconds:g} s and {speed_m_s:g} m/s give no motion.",
            "Choose a size and a time above 0 and a speed of 0 or more.",
        )
    knots = _FIRST_KNOTS
    while True:  # a path that is long enough; its beginning does not depend on the number of knots
        path = _random_path(seed, name, knots, size_m, np.array(centre_m, dtype=float), tilt_rad)
        at = np.arange((knots - 3) * _SAMPLES_PER_KNOT + 1) / _SAMPLES_PER_KNOT
        steps_m = np.sqrt(np.sum(np.diff(path(at)[:, :3], axis=0) ** 2, axis=1))
        length_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        if length_m[-1] >= speed_m_s * seconds:
            break
        knots *= 2
    end = float(np.interp(speed_m_s * seconds, length_m, at))
    count = int(np.ceil(end * _SAMPLES_PER_KNOT)) + 2
    samples = path(np.linspace(0.0, end, count))
    turn = samples[:, None, 3:] / np.sqrt(np.sum(samples[:, None, 3:] ** 2, axis=-1, keepdims=True))
    return FreeMotionSource((name,), np.linspace(0.0, seconds, count), samples[:, None, :3], turn, warm_up_s=warm_up_s)


def _random_path(seed: int, name: str, knots: int, size_m: float, centre_m: Floats, tilt_rad: float) -> BSpline:
    """B-spline (7,) of position and quaternion on parameters from 0 to `knots` - 3."""
    places = generator(seed, "physics", "free motion", name, "position").random((knots, 3))
    tilts = generator(seed, "physics", "free motion", name, "orientation").standard_normal((knots, 3))
    turns = rotations.continuous(rotations.multiply(FACING_UP, rotations.exp(tilt_rad * tilts)))
    control = np.concatenate([centre_m + size_m * (places - 0.5), turns], axis=1)
    return BSpline(np.arange(knots + 4.0) - 3.0, control, 3)
