"""The 24-bone MuJoCo humanoid: `models/humanoid24/humanoid24.xml` scaled to a skeleton, with trackers as sites."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import mujoco
import numpy as np

from harness.body import anatomy, mounts
from harness.core import humanoid24, skeleton
from harness.core.arrays import Floats, Ints
from harness.core.package_data import data_folder
from harness.core.skeleton import Skeleton
from harness.errors import BadInput


@dataclass(frozen=True, eq=False)
class Body:
    """A compiled model and the skeleton that it was scaled to. Shared: treat `model` as read-only.

    Travels to worker processes as its ingredients and is built again there.
    """

    skeleton: Skeleton
    mounts: tuple[mounts.Mount, ...]
    """Trackers, each a site named by its station."""
    model: mujoco.MjModel

    @cached_property
    def bone_body_ids(self) -> Ints:
        """(24,) the model's body of each bone; the body "root" is not among them."""
        return np.array([self.model.body(name).id for name in self.skeleton.names], dtype=np.int64)

    @cached_property
    def limits_rad(self) -> Floats:
        """(48, 2) lowest and highest hinge angle, in the skeleton's order [rad]."""
        out: Floats = self.model.jnt_range[1:][humanoid24.QPOS_OF_DOF]
        return out

    def __reduce__(self) -> tuple[Any, ...]:
        return build_body, (self.skeleton, self.mounts)


def build_body(own: Skeleton | None = None, trackers: Iterable[mounts.Mount] = ()) -> Body:
    """The humanoid with this skeleton (the standard one by default) and these trackers.

    Bones, hinge axes, geoms and masses follow the skeleton; equal input gives equal bytes. BadInput as
    `require_humanoid` says or for a station worn twice; errors of `mounts.locate_mount` for the trackers.
    """
    fitted = humanoid24.standard_skeleton() if own is None else own
    require_humanoid(fitted)
    worn = tuple(trackers)
    stations = [mount.station for mount in worn]
    for station in stations:
        if stations.count(station) > 1:
            raise BadInput(f"Station {station!r} is worn twice.", "Give each tracker its own name.")
    return _compile(fitted.bone_m.tobytes(), fitted.axes.tobytes(), worn)


def require_humanoid(own: Skeleton) -> None:
    """BadInput unless the skeleton has the 24 bones and 48 hinges of the humanoid."""
    standard = humanoid24.standard_skeleton()
    if (own.names, own.parents, own.hinges) != (standard.names, standard.parents, standard.hinges):
        raise BadInput(
            f"A skeleton of {own.bone_count} bones and {len(own.axes)} hinges is not the humanoid's.",
            "Take its 24 bones first, in the order of core.humanoid24.BONES: skeleton.subset(BONES).",
        )


@lru_cache(maxsize=32)
def _compile(bone_m: bytes, axes: bytes, trackers: tuple[mounts.Mount, ...]) -> Body:
    standard = humanoid24.standard_skeleton()
    own = Skeleton(
        standard.names,
        standard.parents,
        np.frombuffer(bone_m).reshape(-1, 3),
        standard.hinges,
        np.frombuffer(axes).reshape(-1, 3),
    )
    spec = mujoco.MjSpec.from_file(str(data_folder("models") / "humanoid24" / "humanoid24.xml"))
    for name, start_m in zip(own.names, joint_offsets_m(own), strict=True):
        spec.body(name).pos = start_m
    for name, axis in zip(own.dof_names, own.axes, strict=True):
        spec.joint(name).axis = axis
    for shape in anatomy.body_geoms(own):
        geom = spec.geom(shape.name)
        geom.pos, geom.quat, geom.size, geom.mass = shape.centre_m, shape.bone_from_shape, shape.size_m, shape.mass_kg
    for mount in trackers:
        mount_m, bone_from_station = mounts.locate_mount(own, mount)
        spec.body(mount.bone).add_site(name=mount.station, pos=mount_m, quat=bone_from_station)
    spec.key("tpose").qpos = tpose(own)
    return Body(own, trackers, spec.compile())


def tpose(own: Skeleton) -> Floats:
    """(55,) configuration: legs upright, soles on the floor, arms to the sides, facing x."""
    angles = np.zeros(len(own.axes))
    for side in "lr":
        thigh = own.bone_m[own.index(f"{side}femur")]
        angles[own.dof_names.index(f"{side}femur.rz")] = -np.arctan2(thigh[1], -thigh[2])
    pose = skeleton.forward_kinematics(own, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), angles[None])
    ankles_m = pose.end_m[0, [own.index("ltibia"), own.index("rtibia")], 2]
    height_m = anatomy.sole_below_ankle_m(own) - float(np.min(ankles_m))
    return humanoid24.pack(np.array([0.0, 0.0, height_m]), np.array([1.0, 0.0, 0.0, 0.0]), angles)


def joint_offsets_m(own: Skeleton) -> list[Floats]:
    """(24) where each bone's joint lies in its parent's frame: at the parent's far end [m]."""
    return [np.zeros(3) if parent < 0 else own.bone_m[parent] for parent in own.parents]
