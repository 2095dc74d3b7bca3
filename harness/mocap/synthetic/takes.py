"""Takes of the motion generator, by behaviour, performer and number, and takes of a rig; generated on demand.

The rig is a rigid mannequin that carries all stations, at rest and swept through the room. Its takes stand in for the
captures of `harness characterize` where no device is at hand. No two stations move against each other, so that any two
are on one rigid bar.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, UnknownName
from harness.mocap.synthetic import boxing, golf, jumping, table_tennis, walking
from harness.mocap.synthetic.articulated_figure import ArticulatedFigure
from harness.mocap.synthetic.curves import minimum_jerk
from harness.mocap.synthetic.performers import Habits, performer_habits, performer_names, performer_skeleton

SOURCE = "built-in performer"
"""Name of the motion source in results; a condition that comparisons require to agree."""
TAKES_PER_PERFORMER = 6

_SYNTHESIZERS: dict[str, Callable[[Skeleton, Habits, np.random.Generator, Floats, int], ArticulatedFigure]] = {
    "walking": walking.synthesize,
    "boxing": boxing.synthesize,
    "jumping": jumping.synthesize,
    "golf": golf.synthesize,
    "table_tennis": table_tennis.synthesize,
}
BEHAVIOURS = tuple(_SYNTHESIZERS)


def take_names(behaviour: str, performers: Sequence[str] = performer_names()) -> tuple[str, ...]:
    """Names of a behaviour's takes by these performers, such as "walking_p1_03"; raises UnknownName."""
    _check_behaviour(behaviour)
    numbers = range(1, TAKES_PER_PERFORMER + 1)
    return tuple(f"{behaviour}_{performer}_{n:02d}" for performer in performers for n in numbers)


def generate(
    behaviour: str, performer: str, take: int, *, seed: int, duration_s: float = 20.0, rate_hz: float = 120.0
) -> Clip:
    """Generate one take of `duration_s` at `rate_hz`; the same arguments give the same bytes.

    Raises UnknownName for the behaviour or performer, and BadInput for a take number below 1 or fewer than two frames.
    """
    _check_behaviour(behaviour)
    if take < 1 or duration_s * rate_hz < 2.0:
        raise BadInput(
            f"Take {take} of {duration_s} s at {rate_hz} Hz cannot be generated.",
            "Takes count from 1 and need two frames.",
        )
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    skeleton = performer_skeleton(performer)
    rng = generator(seed, "performer", behaviour, performer, take)
    figure = _SYNTHESIZERS[behaviour](skeleton, performer_habits(performer), rng, t, take)
    return Clip(
        name=f"{behaviour}_{performer}_{take:02d}",
        subject=performer,
        source=SOURCE,
        behaviour=behaviour,
        skeleton=skeleton,
        rate_hz=rate_hz,
        root_m=figure.root_m,
        world_from_root=rotations.continuous(rotations.from_matrix(figure.pelvis)),
        angles_rad=figure.angles_rad,
    )


def _check_behaviour(behaviour: str) -> None:
    if behaviour not in _SYNTHESIZERS:
        raise UnknownName("behaviour", behaviour, BEHAVIOURS)


RIG = "rig"
"""Behaviour of the takes."""
_PERFORMER = "p1"
_SETTLE_S = 2.0
"""Time in which a sweep begins and ends [s]."""
_REACH_M = np.array([0.35, 0.45, 0.15])
_SWING_RAD = np.array([0.35, 0.30, 0.80])
"""Amplitudes of a sweep along the axes and about them [m, rad]."""
_CYCLES = np.array([[1.0, 0.83, 1.27], [0.91, 1.13, 0.71]])
"""Relative frequencies of positions and angles: no two alike, so that every direction and axis is swept."""
_SLOW_HZ, _FAST_HZ = 0.12, 0.55


@dataclass(frozen=True)
class RigTake:
    """The stretches of a take: seconds at rest, swept slowly, swept fast, and at rest again to be covered."""

    static_s: float
    slow_s: float = 0.0
    fast_s: float = 0.0
    covered_s: float = 0.0
    rate_hz: float = 60.0

    def stretches(self) -> tuple[tuple[str, float, float], ...]:
        """Name, beginning and end [s] of each stretch."""
        out, now_s = [], 0.0
        for name in ("static", "slow", "fast", "covered"):
            length_s = getattr(self, f"{name}_s")
            if length_s:
                out.append((name, now_s, now_s + length_s))
            now_s += length_s
        return tuple(out)


RIG_TAKES = {
    "rig_p1_01": RigTake(70.0, 40.0, 40.0, 40.0),
    "rig_p1_02": RigTake(300.0, rate_hz=10.0),
    "rig_p1_03": RigTake(1200.0, rate_hz=10.0),
    "rig_p1_04": RigTake(1200.0, 60.0, 60.0, 60.0, rate_hz=30.0),
}
"""Takes by name: a short one of all stretches, five minutes and twenty minutes at rest, and a long one of all."""


def stretch_marks(name: str) -> tuple[tuple[float, str], ...]:
    """Beginning [s] and name of each stretch of a take; none for a clip that is no take of the rig."""
    take = RIG_TAKES.get(name)
    return () if take is None else tuple((begin_s, stretch) for stretch, begin_s, _ in take.stretches())


def generate_rig(name: str) -> Clip:
    """Generate a take; UnknownName for another name."""
    if name not in RIG_TAKES:
        raise UnknownName("take of the rig", name, RIG_TAKES)
    take = RIG_TAKES[name]
    duration_s = sum(end_s - begin_s for _, begin_s, end_s in take.stretches())
    time_s = np.arange(round(duration_s * take.rate_hz) + 1) / take.rate_hz
    place, angle = np.zeros((len(time_s), 3)), np.zeros((len(time_s), 3))
    for stretch, begin_s, end_s in take.stretches():
        if stretch in ("slow", "fast"):
            swept = _sweep(time_s - begin_s, end_s - begin_s, _SLOW_HZ if stretch == "slow" else _FAST_HZ)
            place += _REACH_M * swept[0]
            angle += _SWING_RAD * swept[1]
    skeleton = performer_skeleton(_PERFORMER)
    return Clip(
        name=name,
        subject=_PERFORMER,
        source="built-in performer",
        behaviour=RIG,
        skeleton=skeleton,
        rate_hz=take.rate_hz,
        root_m=np.array([0.0, 0.0, 1.0]) + place,
        world_from_root=rotations.continuous(rotations.exp(angle)),
        angles_rad=np.zeros((len(time_s), len(skeleton.axes))),
    )


def _sweep(since_s: Floats, length_s: float, frequency_hz: float) -> Floats:
    """Shares (2, T, 3) of the amplitudes of positions and angles, from rest to rest."""
    inside = np.minimum(minimum_jerk(since_s / _SETTLE_S), minimum_jerk((length_s - since_s) / _SETTLE_S))
    phase = 2.0 * np.pi * frequency_hz * np.clip(since_s, 0.0, length_s)
    out: Floats = inside[:, None] * np.sin(_CYCLES[:, None, :] * phase[:, None])
    return out
