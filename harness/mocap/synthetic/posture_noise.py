"""A performer's manner: the offsets and small play of joints that no plan of hands and feet decides.

How a bend is shared out along the back and neck, and how hands hang, differs from person to person, a little from take
to take, and drifts all the time. No tracker sees most of it, so this is what keeps reconstruction honest.
"""

from collections.abc import Mapping

import numpy as np

from harness.core.arrays import Floats
from harness.mocap.synthetic.curves import smooth_noise
from harness.mocap.synthetic.performers import Habits

PostureOffsets = Mapping[str, Floats]
"""(T, D) offsets of a bone's D hinges [rad]."""

_DRIFT_PERIOD_S = 1.8
_OFFSET_STD_DEG: dict[str, tuple[tuple[float, float], ...]] = {
    "lowerback": ((0.8, 0.5), (0.4, 0.4), (0.5, 0.5)),
    "upperback": ((0.8, 0.5), (0.4, 0.4), (0.5, 0.5)),
    "thorax": ((0.7, 0.5), (0.4, 0.4), (0.5, 0.4)),
    "lowerneck": ((1.0, 0.8), (0.6, 0.7), (0.6, 0.6)),
    "upperneck": ((1.0, 0.8), (0.6, 0.7), (0.6, 0.6)),
    "head": ((0.6, 0.5), (0.4, 0.5), (0.4, 0.5)),
    "wrist": ((1.8, 1.5),),
    "hand": ((1.8, 1.5), (1.8, 1.5)),
}
"""Standard deviation of the take's own offset and of the drift within it, for each hinge [deg]."""


def sample_posture_offsets(
    rng: np.random.Generator, t: Floats, habits: Habits, looseness: float = 1.0
) -> PostureOffsets:
    """The offsets of one take; `looseness` scales the take's own part and the drift."""
    out: dict[str, Floats] = {}
    for part, hinges in _OFFSET_STD_DEG.items():
        for side in ("l", "r") if part in ("wrist", "hand") else ("",):
            usual = habits.posture_rad[side + part]
            columns = [
                usual[k]
                + looseness
                * np.deg2rad(fixed * np.clip(rng.normal(), -2.0, 2.0) + smooth_noise(rng, t, _DRIFT_PERIOD_S, drift))
                for k, (fixed, drift) in enumerate(hinges)
            ]
            out[side + part] = np.stack(columns, axis=-1)
    return out
