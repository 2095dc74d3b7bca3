"""Conventions that all of OpenSim's files share: x forward, y up, z right."""

import numpy as np

from harness.core.arrays import Floats

OPENSIM_FROM_WORLD: Floats = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from world axes (x forward, y left, z up) to OpenSim's ground."""


def rotation_in_opensim(world_from_body: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of bodies whose own axes also become x forward, y up, z right in the rest pose."""
    out: Floats = OPENSIM_FROM_WORLD @ world_from_body @ OPENSIM_FROM_WORLD.T
    return out
