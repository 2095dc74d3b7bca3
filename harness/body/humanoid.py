"""The 24-bone MuJoCo humanoid: `models/humanoid24/humanoid24.xml` scaled to a skeleton, with trackers as sites."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from harness.body import anatomy, mounts
from harness.core import humanoid24
from harness.core.arrays import Floats, Ints, immutable
from harness.core.package_data import data_folder
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.core.working_folder import plain_import
from harness.errors import BadInput

with plain_import():
    import mujoco


@dataclass(frozen=True, eq=False)
class Body:
    """A compiled model and the skeleton that it was scaled to. It is shared: treat `model` as read-only.

    Pickling stores the skeleton and the mounts; the model is compiled again when it is loaded.
    """

    skeleton: Skeleton
    mounts: tuple[mounts.Mount, ...]
    """Mounts of the stations; each is a site of the model with the station's name."""
    model: mujoco.MjModel

    @cached_property
    def bone_body_ids(self) -> Ints:
        """(24,) index of each bone's body in the model; the body "root" is not included."""
        return immutable([self.model.body(name).id for name in self.skeleton.names], np.int64)

    @cached_property
    def limits_rad(self) -> Floats:
        """(48, 2) lower and upper limit of each hinge angle, in the skeleton's order [rad]."""
        return immutable(self.model.jnt_range[1:][humanoid24.QPOS_OF_DOF])

    def __reduce__(self) -> tuple[Any, ...]:
        return build_body, (self.skeleton, self.mounts)


def build_body(skeleton: Skeleton | None = None, trackers: Iterable[mounts.Mount] = ()) -> Body:
    """Build the humanoid for a skeleton (the standard one by default), with the mounts of trackers.

    Bones, hinge axes, geoms and masses follow the skeleton; equal input gives equal bytes. Raises BadInput for another
    skeleton (`require_humanoid`) and for a station with two mounts, and the errors of `mounts.locate_mount`.
    """
    skeleton = humanoid24.standard_skeleton() if skeleton is None else skeleton
    require_humanoid(skeleton)
    station_mounts = tuple(trackers)
    stations = [mount.station for mount in station_mounts]
    for station in stations:
        if stations.count(station) > 1:
            raise BadInput(f"Station {station!r} has two mounts.", "Give each station its own name.")
    return _compile(skeleton.bone_m.tobytes(), skeleton.axes.tobytes(), station_mounts)


def require_humanoid(skeleton: Skeleton) -> None:
    """Raise BadInput unless the skeleton has the 24 bones and 48 hinges of the humanoid."""
    standard = humanoid24.standard_skeleton()
    if (skeleton.names, skeleton.parents, skeleton.hinges) != (standard.names, standard.parents, standard.hinges):
        raise BadInput(
            f"A skeleton of {skeleton.bone_count} bones and {len(skeleton.axes)} hinges is not the humanoid's.",
            "Select its 24 bones in the order of core.humanoid24.BONES: skeleton.subset(BONES).",
        )


@lru_cache(maxsize=32)
def _compile(bone_m: bytes, axes: bytes, trackers: tuple[mounts.Mount, ...]) -> Body:
    standard = humanoid24.standard_skeleton()
    skeleton = Skeleton(
        standard.names,
        standard.parents,
        np.frombuffer(bone_m).reshape(-1, 3),
        standard.hinges,
        np.frombuffer(axes).reshape(-1, 3),
    )
    return Body(skeleton, trackers, body_spec(skeleton, trackers).compile())


def body_spec(skeleton: Skeleton, trackers: Iterable[mounts.Mount] = ()) -> mujoco.MjSpec:
    """The humanoid scaled to a skeleton, before it is compiled, so that a caller can change its own copy.

    The skeleton must be the humanoid's (`require_humanoid`). Raises the errors of `mounts.locate_mount`.
    """
    spec = mujoco.MjSpec.from_file(str(data_folder("models") / "humanoid24" / "humanoid24.xml"))
    for name, start_m in zip(skeleton.names, joint_offsets_m(skeleton), strict=True):
        spec.body(name).pos = start_m
    for name, axis in zip(skeleton.dof_names, skeleton.axes, strict=True):
        spec.joint(name).axis = axis
    for part in anatomy.body_geoms(skeleton):
        geom = spec.geom(part.name)
        geom.pos, geom.quat, geom.size, geom.mass = part.centre_m, part.bone_from_shape, part.size_m, part.mass_kg
    for mount in trackers:
        mount_m, bone_from_station = mounts.locate_mount(skeleton, mount)
        spec.body(mount.bone).add_site(name=mount.station, pos=mount_m, quat=bone_from_station)
    spec.key("tpose").qpos = tpose(skeleton)
    return spec


def tpose(skeleton: Skeleton) -> Floats:
    """(55,) configuration of the T-pose: legs upright, soles on the floor, arms to the sides, facing x."""
    angles = np.zeros(len(skeleton.axes))
    for side in "lr":
        thigh = skeleton.bone_m[skeleton.index(f"{side}femur")]
        angles[skeleton.dof_names.index(f"{side}femur.rz")] = -np.arctan2(thigh[1], -thigh[2])
    pose = forward_kinematics(skeleton, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), angles[None])
    ankles_m = pose.end_m[0, [skeleton.index("ltibia"), skeleton.index("rtibia")], 2]
    height_m = anatomy.sole_below_ankle_m(skeleton) - float(np.min(ankles_m))
    return humanoid24.pack(np.array([0.0, 0.0, height_m]), np.array([1.0, 0.0, 0.0, 0.0]), angles)


def joint_offsets_m(skeleton: Skeleton) -> list[Floats]:
    """(24) position of each bone's joint in its parent's frame, at the parent's far end [m]."""
    return [np.zeros(3) if parent < 0 else skeleton.bone_m[parent] for parent in skeleton.parents]
