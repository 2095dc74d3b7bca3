"""Height of a toe that stands on the floor, from examples."""

import numpy as np

from harness.body.humanoid import Body
from harness.reconstruct.database import MotionDatabase
from harness.reconstruct.solver.floor_contact import toe_tree
from harness.reconstruct.solver.kinematic_tree import forward_kinematics_batch, new_state

_SAMPLE = 4096
"""Largest number of frames that are used, evenly spaced."""


def toe_height_m(body: Body, database: MotionDatabase) -> float:
    """The median height of the lower toe [m]. It is above 0, since the toe's joint lies inside the foot."""
    rows = np.linspace(0, len(database) - 1, min(len(database), _SAMPLE)).astype(np.int64)
    qpos, tree = database.qpos(rows, np.zeros(3)), toe_tree(body)
    at_m, turned = np.empty((len(rows), 2, 3)), np.empty((len(rows), 2, 4))
    forward_kinematics_batch(tree, new_state(tree), qpos, at_m, turned)
    database.release_memory()
    return float(np.median(at_m[..., 2].min(axis=1)))
