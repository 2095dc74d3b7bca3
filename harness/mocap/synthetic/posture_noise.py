"""Posture noise: offsets and drift of hinges that targets of hands and feet do not determine.

How a bend is shared along back and neck, and how the hands hang, differs between performers, a little between takes,
and drifts within a take. Trackers observe little of it, so a reconstruction cannot recover it exactly.
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
"""Standard deviations of a take's offset and of the drift within the take, for each hinge [deg]."""


def sample_posture_offsets(
    rng: np.random.Generator, t: Floats, habits: Habits, looseness: float = 1.0
) -> PostureOffsets:
    """The offsets of one take; `looseness` scales the take's offset and the drift, not the performer's posture."""
    out: dict[str, Floats] = {}
    for part, hinges in _OFFSET_STD_DEG.items():
        for side in ("l", "r") if part in ("wrist", "hand") else ("",):
            posture = habits.posture_rad[side + part]
            columns = [
                posture[k]
                + looseness
                * np.deg2rad(fixed * np.clip(rng.normal(), -2.0, 2.0) + smooth_noise(rng, t, _DRIFT_PERIOD_S, drift))
                for k, (fixed, drift) in enumerate(hinges)
            ]
            out[side + part] = np.stack(columns, axis=-1)
    return out
