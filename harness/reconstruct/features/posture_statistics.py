"""Statistics of examples on which priors rest: mean and spread of the hinge angles, height of a standing toe."""

from collections.abc import Iterator, Sequence

import numpy as np

from harness.body import Body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.solver.floor_contact import toe_tree
from harness.reconstruct.solver.ground_frame import HINGES
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.kinematic_tree import forward_kinematics_batch, new_state

_SAMPLE = 4096
"""Largest number of frames that are used, evenly spaced."""
_LEAST_DEVIATION = 0.01
"""Floor of the deviations of other performers [m; rad]."""


def mean_posture(body: Body, examples: Sequence[BodyMotion] | MotionDatabase) -> Floats:
    """(55,) circular mean of the examples' hinge angles [rad], with the root of the T-pose; BadInput without examples.

    Angles are averaged as directions, in principal form and within the limits.
    """
    limits, total, count = HingeLimits(body), np.zeros((2, 48)), 0
    for angles in _principal_angles(limits, examples):
        total += [np.sum(np.sin(angles), axis=0), np.sum(np.cos(angles), axis=0)]
        count += len(angles)
    if not count:
        raise BadInput("The mean posture is learnt from examples, and there are none.", "Name some in the scenario.")
    out = np.array(tpose(body.skeleton))
    out[7:] = limits.clip(limits.principal(np.arctan2(*total)))
    return out


def spread_rad(body: Body, examples: Sequence[BodyMotion] | MotionDatabase, centre: Floats) -> Floats:
    """(48,) RMS deviation of the examples' hinge angles from those of a configuration (55,) [rad]."""
    limits, total, count = HingeLimits(body), np.zeros(48), 0
    for angles in _principal_angles(limits, examples):
        away = rotations.wrap_angle(angles - centre[7:])
        total += np.sum(away**2, axis=0)
        count += len(angles)
    return np.sqrt(total / count)


def scaled_spread_rad(
    body: Body, examples: Sequence[BodyMotion] | MotionDatabase, centre: Floats, rms_rad: float, least_rad: float
) -> Floats:
    """(48,) standard deviations in proportion to `spread_rad`, at least `least_rad`, scaled to this RMS [rad]."""
    spread = np.maximum(spread_rad(body, examples, centre), least_rad)
    out: Floats = rms_rad * (spread / np.sqrt(np.mean(spread**2)))
    return out


def posture_of_others(database: MotionDatabase) -> tuple[Floats, Floats]:
    """Mean (52,) posture of the performers, and the mean squared deviation (52,) of each from the mean of the others.

    Performers count by the square root of their frames. With one performer the deviation is that from his own mean.
    """
    sums: dict[str, list[Floats]] = {}
    for run in database.segments:
        posture = database.posture[run.start : run.stop].astype(float)
        found = np.stack([np.ones(posture.shape[1]) * len(posture), posture.sum(axis=0), (posture**2).sum(axis=0)])
        sums.setdefault(run.subject, []).append(found)
    database.release_memory()
    frames, total, squares = np.stack([np.sum(parts, axis=0) for parts in sums.values()], axis=1)
    means, weights = total / frames, np.sqrt(frames)
    mean = np.sum(weights * means, axis=0) / weights.sum(axis=0)
    others = mean
    if len(means) > 1:
        others = (np.sum(weights * means, axis=0) - weights * means) / (weights.sum(axis=0) - weights)
    deviation = squares / frames - 2.0 * others * means + others**2
    return mean, np.sum(weights * deviation, axis=0) / weights.sum(axis=0) + _LEAST_DEVIATION**2


def _principal_angles(limits: HingeLimits, examples: Sequence[BodyMotion] | MotionDatabase) -> Iterator[Floats]:
    """Principal hinge angles (T, 48) [rad], take by take, since a database may be larger than memory."""
    if isinstance(examples, MotionDatabase):
        for run in examples.segments:
            yield limits.principal(examples.posture[run.start : run.stop, HINGES].astype(float))
        examples.release_memory()
    else:
        for take in examples:
            yield limits.principal(take.qpos[:, 7:])


def toe_height_m(body: Body, database: MotionDatabase) -> float:
    """The median height of the lower toe [m]. It is above 0, since the toe's joint lies inside the foot."""
    rows = np.linspace(0, len(database) - 1, min(len(database), _SAMPLE)).astype(np.int64)
    qpos, tree = database.qpos(rows, np.zeros(3)), toe_tree(body)
    at_m, turned = np.empty((len(rows), 2, 3)), np.empty((len(rows), 2, 4))
    forward_kinematics_batch(tree, new_state(tree), qpos, at_m, turned)
    database.release_memory()
    return float(np.median(at_m[..., 2].min(axis=1)))
