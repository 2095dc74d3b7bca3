"""Takes of the motion generator, by behaviour, performer and number; they are generated on demand."""

from collections.abc import Callable, Sequence

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.seeds import generator
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, UnknownName
from harness.mocap.synthetic import boxing, golf, jumping, table_tennis, walking
from harness.mocap.synthetic.articulated_figure import ArticulatedFigure
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
