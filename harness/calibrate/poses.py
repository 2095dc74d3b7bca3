"""The eight calibration poses (Liu et al. 2011; docs/papers.md A3, E; docs/calibration.md).

T-pose, arms forward, arms down, arms bent, left leg up, right leg up, squat, and a bow with a twist. The paper shows
no list of its poses; the angles are ours [choice]. Each pose also rotates, bends or leans the trunk and the head, so
that every joint of the spine and neck is bent about each of its axes. Pelvis and standing feet stay in place. Every
angle is within the model's limits and easy to hold; the trunk leans so that the weight is over the feet.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from harness.body import pose_from_qpos, sole_heights_m
from harness.core import humanoid24
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton


@dataclass(frozen=True)
class CalibrationPose:
    """A pose that the performer imitates."""

    name: str
    instruction: str
    """One sentence to the performer."""
    angles_deg: Mapping[str, float]
    """Hinge name, such as "lhumerus.rz", to its angle [deg]; all other hinges are 0."""


def pose_angles_rad(pose: CalibrationPose, skeleton: Skeleton) -> Floats:
    """(48,) hinge angles of a pose, in the skeleton's order [rad]."""
    return np.deg2rad([pose.angles_deg.get(name, 0.0) for name in skeleton.dof_names])


def pose_configuration(pose: CalibrationPose, skeleton: Skeleton) -> Floats:
    """(55,) configuration of a body in the pose: upright at the origin, facing x, its lower sole on the floor."""
    qpos = humanoid24.pack(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), pose_angles_rad(pose, skeleton))
    qpos[2] = -float(np.min(sole_heights_m(skeleton, pose_from_qpos(skeleton, qpos[None]))))
    return qpos


_LEGS = {"lfemur.rz": -20.0, "rfemur.rz": 20.0}
"""Hinges that bring the thighs upright; in the rest pose each is 20 deg off."""
_ARMS_DOWN = {
    **{"lhumerus.rx": -29.0, "lhumerus.ry": 17.0, "lhumerus.rz": 58.0},
    **{"rhumerus.rx": -29.0, "rhumerus.ry": -17.0, "rhumerus.rz": -58.0},
}


def _pose(name: str, instruction: str, angles_deg: Mapping[str, float]) -> CalibrationPose:
    return CalibrationPose(name, instruction, MappingProxyType({**_LEGS, **angles_deg}))


POSES: tuple[CalibrationPose, ...] = (
    _pose("T-pose", "Stand upright, arms straight out to the sides, palms down, feet below the hips.", {}),
    _pose(
        "arms forward",
        "Turn the chest to the left, arms straight forward of it, palms down, and look a little to the right.",
        {
            **{"lowerback.ry": 15.0, "upperback.ry": 10.0, "thorax.ry": 5.0},
            **{"lowerneck.ry": -15.0, "upperneck.ry": -20.0, "head.ry": -10.0},
            **{"lhumerus.rx": 74.0, "lhumerus.ry": -26.0, "lhumerus.rz": 34.0},
            **{"rhumerus.rx": 74.0, "rhumerus.ry": 26.0, "rhumerus.rz": -34.0},
        },
    ),
    _pose(
        "arms down",
        "Let the arms hang, round the upper back, chin to the chest.",
        {
            **{"upperback.rx": 10.0, "thorax.rx": 20.0, "lowerneck.rx": 20.0, "upperneck.rx": 15.0, "head.rx": 10.0},
            **_ARMS_DOWN,
        },
    ),
    _pose(
        "arms bent",
        "Upper arms out to the sides, forearms straight up, chest turned to the right, and look up.",
        {
            **{"lowerback.ry": -15.0, "upperback.ry": -10.0, "thorax.ry": -5.0},
            **{"lowerneck.rx": -15.0, "upperneck.rx": -15.0, "head.rx": -10.0},
            **{"lhumerus.ry": 60.0, "lradius.rx": 90.0, "rhumerus.ry": -60.0, "rradius.rx": 90.0},
        },
    ),
    _pose(
        "left leg up",
        "Left thigh level, shin hanging, straight arms half raised to the sides, leaning to the right over the "
        "standing leg, head upright.",
        {
            **{"lfemur.rx": -80.0, "ltibia.rx": 90.0},
            **{"lowerback.rz": 20.0, "upperback.rz": 12.0, "thorax.rz": 6.0},
            **{"lowerneck.rz": -15.0, "upperneck.rz": -15.0, "head.rz": -8.0},
            **{"lhumerus.rx": 23.0, "lhumerus.ry": 9.0, "lhumerus.rz": -42.0},
            **{"rhumerus.rx": 23.0, "rhumerus.ry": -9.0, "rhumerus.rz": 42.0},
        },
    ),
    _pose(
        "right leg up",
        "Right leg lifted forward and out, knee nearly straight, elbows raised, hands before the chest, leaning to the "
        "left over the standing leg, head upright.",
        {
            **{"rfemur.rx": -30.0, "rfemur.rz": -5.0, "rtibia.rx": 20.0},
            **{"lowerback.rz": -20.0, "upperback.rz": -15.0, "thorax.rz": -8.0},
            **{"lowerneck.rz": 15.0, "upperneck.rz": 15.0, "head.rz": 8.0},
            **{"lhumerus.ry": -20.0, "lradius.rx": 110.0, "rhumerus.ry": 20.0, "rradius.rx": 110.0},
        },
    ),
    _pose(
        "squat",
        "Half squat, knees apart, trunk upright, upper arms forward, forearms up, palms turned inward, chin down.",
        {
            **{"lfemur.rx": -60.0, "lfemur.rz": -5.0, "ltibia.rx": 100.0, "lfoot.rx": -40.0},
            **{"rfemur.rx": -60.0, "rfemur.rz": 5.0, "rtibia.rx": 100.0, "rfoot.rx": -40.0},
            **{"lowerneck.rx": 10.0, "upperneck.rx": 10.0, "head.rx": 5.0},
            **{"lhumerus.rx": 60.0, "lhumerus.rz": 90.0, "lradius.rx": 90.0, "lwrist.ry": 40.0},
            **{"rhumerus.rx": 60.0, "rhumerus.rz": -90.0, "rradius.rx": 90.0, "rwrist.ry": 40.0},
        },
    ),
    _pose(
        "twist and bow",
        "Legs straight, bow and turn the chest and the face to the left, arms along the trunk, palms turned forward.",
        {
            **{"lowerback.rx": 35.0, "upperback.rx": 20.0, "thorax.rx": 5.0},
            **{"lowerback.ry": 15.0, "upperback.ry": 10.0, "thorax.ry": 5.0},
            **{"lowerneck.ry": 10.0, "upperneck.ry": 10.0, "head.ry": 10.0},
            **_ARMS_DOWN,
            **{"lwrist.ry": -60.0, "rwrist.ry": -60.0},
        },
    ),
)
"""The eight poses in order. The first, the T-pose, defines the origin of the calibrated world."""
