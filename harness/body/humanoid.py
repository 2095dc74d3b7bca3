"""The 24-bone MuJoCo humanoid."""

from dataclasses import dataclass

import mujoco

from harness.core.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class Body:
    """A compiled model and the skeleton that it was scaled to."""

    skeleton: Skeleton
    model: mujoco.MjModel
