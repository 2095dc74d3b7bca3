"""Bodies with other proportions than the standard ones, and clips that need no library."""

import numpy as np
import pytest

from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import Skeleton


@pytest.fixture
def lanky(rng: np.random.Generator) -> Skeleton:
    """A skeleton whose bones all differ from the standard ones in length (within 15 %) and direction."""
    standard = humanoid24.standard_skeleton()
    turns = rotations.exp(rng.normal(scale=0.1, size=(24, 3)))
    return standard.with_bones(rng.uniform(0.87, 1.15, size=(24, 1)) * rotations.rotate(turns, standard.bone_m))


def random_qpos(rng: np.random.Generator, frames: int) -> Floats:
    """(frames, 55) random configurations within the joint limits."""
    low, high = humanoid24.limits_rad().T
    turns = rng.normal(size=(frames, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    return humanoid24.pack(rng.normal(size=(frames, 3)), turns, rng.uniform(low, high, size=(frames, 48)))


def clip_on(skeleton: Skeleton, qpos: Floats, rate_hz: float = 60.0) -> Clip:
    """A clip of these configurations."""
    root_m, turns, angles_rad = humanoid24.unpack(qpos)
    return Clip("made_up", "made", "test", "", skeleton, rate_hz, root_m, turns, angles_rad)
