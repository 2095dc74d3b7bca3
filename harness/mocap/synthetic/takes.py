"""Takes of the built-in performer: named, seeded, made on demand."""

from collections.abc import Callable

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, UnknownName
from harness.mocap.synthetic import boxing, golf, jumping, table_tennis, walking
from harness.mocap.synthetic.articulated_figure import Figure
from harness.mocap.synthetic.performers import Habits, habits, performers, skeleton

SOURCE = "built-in performer"
TAKES_EACH = 6

_MOVES: dict[str, Callable[[Skeleton, Habits, np.random.Generator, Floats, int], Figure]] = {
    "walking": walking.move,
    "boxing": boxing.move,
    "jumping": jumping.move,
    "golf": golf.move,
    "table_tennis": table_tennis.move,
}
BEHAVIOURS = tuple(_MOVES)


def take_names(behaviour: str) -> tuple[str, ...]:
    """Names of the takes, such as "walking_p1_03"; UnknownName."""
    _known(behaviour)
    return tuple(f"{behaviour}_{who}_{n:02d}" for who in performers() for n in range(1, TAKES_EACH + 1))


def generate(
    behaviour: str, performer: str, take: int, *, seed: int, duration_s: float = 20.0, rate_hz: float = 120.0
) -> Clip:
    """One take; the same arguments give the same bytes. UnknownName; BadInput for a take below 1 or no duration."""
    _known(behaviour)
    if take < 1 or duration_s * rate_hz < 2.0:
        raise BadInput(f"take {take} of {duration_s} s at {rate_hz} Hz.", "Takes count from 1 and need two frames.")
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    body = skeleton(performer)
    rng = generator(seed, "performer", behaviour, performer, take)
    figure = _MOVES[behaviour](body, habits(performer), rng, t, take)
    return Clip(
        name=f"{behaviour}_{performer}_{take:02d}",
        subject=performer,
        source=SOURCE,
        behaviour=behaviour,
        skeleton=body,
        rate_hz=rate_hz,
        root_m=figure.root_m,
        world_from_root=rotations.continuous(rotations.from_matrix(figure.pelvis)),
        angles_rad=figure.angles_rad,
    )


def _known(behaviour: str) -> None:
    if behaviour not in _MOVES:
        raise UnknownName("behaviour", behaviour, BEHAVIOURS)
