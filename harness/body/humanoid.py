"""The 24-bone MuJoCo humanoid: `models/humanoid24/humanoid24.xml` scaled to a skeleton, with trackers as sites.

    python -m harness.body.humanoid > models/humanoid24/humanoid24.xml

writes that file anew from `core.humanoid24` and `body.anatomy`; a test holds it up to date.
"""

import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import mujoco
import numpy as np

from harness.body import anatomy, mounts
from harness.core import humanoid24, skeleton
from harness.core.arrays import Floats, Ints
from harness.core.share import share_folder
from harness.core.skeleton import Skeleton
from harness.errors import BadInput

_HINGE_DAMPING_NMS, _HINGE_ARMATURE_KGM2 = 1.0, 0.01
"""What keeps an unpowered fall tame; kinematics do not see them."""


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
        return build, (self.skeleton, self.mounts)


def build(own: Skeleton | None = None, trackers: Iterable[mounts.Mount] = ()) -> Body:
    """The humanoid with this skeleton (the standard one by default) and these trackers.

    Bones, hinge axes, geoms and masses follow the skeleton; equal input gives equal bytes. BadInput unless the
    skeleton has the 24 bones and 48 hinges of `core.humanoid24`; errors of `mounts.place` for the trackers.
    """
    fitted = humanoid24.standard_skeleton() if own is None else own
    standard = humanoid24.standard_skeleton()
    if (fitted.names, fitted.parents, fitted.hinges) != (standard.names, standard.parents, standard.hinges):
        raise BadInput(
            f"A skeleton of {fitted.bone_count} bones and {len(fitted.axes)} hinges is not the humanoid's.",
            "Take its 24 bones first, in the order of core.humanoid24.BONES: skeleton.subset(BONES).",
        )
    return _built(fitted.bone_m.tobytes(), fitted.axes.tobytes(), tuple(trackers))


@lru_cache(maxsize=32)
def _built(bone_m: bytes, axes: bytes, trackers: tuple[mounts.Mount, ...]) -> Body:
    standard = humanoid24.standard_skeleton()
    own = Skeleton(
        standard.names,
        standard.parents,
        np.frombuffer(bone_m).reshape(-1, 3),
        standard.hinges,
        np.frombuffer(axes).reshape(-1, 3),
    )
    spec = mujoco.MjSpec.from_file(str(share_folder("models") / "humanoid24" / "humanoid24.xml"))
    for name, start_m in zip(own.names, _starts_m(own), strict=True):
        spec.body(name).pos = start_m
    for name, axis in zip(own.dof_names, own.axes, strict=True):
        spec.joint(name).axis = axis
    for shape in anatomy.shapes(own):
        geom = spec.geom(shape.name)
        geom.pos, geom.quat, geom.size, geom.mass = shape.centre_m, shape.bone_from_shape, shape.size_m, shape.mass_kg
    for mount in trackers:
        mount_m, bone_from_station = mounts.place(own, mount)
        spec.body(mount.bone).add_site(name=mount.station, pos=mount_m, quat=bone_from_station)
    spec.key("tpose").qpos = tpose(own)
    return Body(own, trackers, spec.compile())


def tpose(own: Skeleton) -> Floats:
    """(55,) configuration: legs upright, soles on the floor, arms to the sides, facing x."""
    angles = np.zeros(len(own.axes))
    for side in "lr":
        thigh = own.bone_m[own.index(f"{side}femur")]
        angles[own.dof_names.index(f"{side}femur.rz")] = -np.arctan2(thigh[1], -thigh[2])
    pose = skeleton.forward(own, np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0, 0.0]]), angles[None])
    ankles_m = pose.end_m[0, [own.index("ltibia"), own.index("rtibia")], 2]
    height_m = anatomy.sole_below_ankle_m(own) - float(np.min(ankles_m))
    return humanoid24.pack(np.array([0.0, 0.0, height_m]), np.array([1.0, 0.0, 0.0, 0.0]), angles)


def mjcf() -> str:
    """The text of humanoid24.xml: the standard skeleton, before scaling."""
    own, limits_deg = humanoid24.standard_skeleton(), np.rad2deg(humanoid24.limits_rad())
    top = ET.Element("mujoco", model="humanoid24")
    ET.SubElement(top, "compiler", angle="degree", autolimits="true")
    ET.SubElement(top, "option", timestep="0.004", integrator="implicitfast")
    _look(top)
    world = ET.SubElement(top, "worldbody")
    ET.SubElement(world, "light", pos="0 0 4", dir="0 0 -1", type="directional")
    ET.SubElement(world, "camera", name="front", pos="3.6 1.3 1.3", mode="targetbody", target="upperback", fovy="36")
    ET.SubElement(
        world,
        "geom",
        {"name": "floor", "type": "plane", "size": "10 10 0.1", "material": "floor"}
        | {"rgba": "1 1 1 1", "contype": "0", "conaffinity": "1"},
    )
    nodes = {"root": ET.SubElement(world, "body", name="root", pos="0 0 1")}
    ET.SubElement(nodes["root"], "freejoint", name="root")
    _add_flesh(nodes["root"], "root", own)
    for bone, start_m in enumerate(_starts_m(own)):
        name, parent = own.names[bone], own.parents[bone]
        nodes[name] = ET.SubElement(
            nodes["root" if parent < 0 else own.names[parent]], "body", name=name, pos=_text(start_m)
        )
        where = own.dof_of_bone[bone]
        for dof in reversed(range(where.start, where.stop)):  # MuJoCo composes outermost first
            ET.SubElement(
                nodes[name],
                "joint",
                name=own.dof_names[dof],
                axis=_text(own.axes[dof]),
                range=_text(limits_deg[dof]),
            )
        _add_flesh(nodes[name], name, own)
    keys = ET.SubElement(top, "keyframe")
    ET.SubElement(keys, "key", name="tpose", qpos=_text(tpose(own)))
    ET.indent(top)
    return ET.tostring(top, encoding="unicode") + "\n"


def _add_flesh(node: ET.Element, bone: str, own: Skeleton) -> None:
    for shape in anatomy.shapes(own):
        if shape.bone == bone:
            ET.SubElement(
                node,
                "geom",
                name=shape.name,
                type=shape.kind,
                pos=_text(shape.centre_m),
                quat=_text(shape.bone_from_shape),
                size=_text(shape.size_m[: 2 if shape.kind == "capsule" else 3]),
                mass=_text([shape.mass_kg]),
            )


def _look(top: ET.Element) -> None:
    """Defaults, colours and light. Flesh meets the floor but not itself."""
    default = ET.SubElement(top, "default")
    ET.SubElement(
        default, "joint", type="hinge", damping=_text([_HINGE_DAMPING_NMS]), armature=_text([_HINGE_ARMATURE_KGM2])
    )
    ET.SubElement(default, "geom", contype="1", conaffinity="0", rgba="0.78 0.62 0.52 1")
    ET.SubElement(default, "site", type="box", size="0.018 0.012 0.006", rgba="0.1 0.3 0.9 1")
    visual = ET.SubElement(top, "visual")
    ET.SubElement(visual, "headlight", ambient="0.4 0.4 0.4", diffuse="0.5 0.5 0.5", specular="0.1 0.1 0.1")
    asset = ET.SubElement(top, "asset")
    colours = {"rgb1": "0.86 0.88 0.9", "rgb2": "0.76 0.79 0.82"}
    ET.SubElement(asset, "texture", name="floor", type="2d", builtin="checker", width="64", height="64", attrib=colours)
    ET.SubElement(asset, "material", name="floor", texture="floor", texrepeat="20 20")


def _starts_m(own: Skeleton) -> list[Floats]:
    """Where each bone's body lies in its parent's: at the parent's far end."""
    return [np.zeros(3) if parent < 0 else own.bone_m[parent] for parent in own.parents]


def _text(numbers: Sequence[float] | Floats) -> str:
    return " ".join(f"{round(float(number), 6) + 0.0:g}" for number in numbers)


if __name__ == "__main__":
    sys.stdout.write(mjcf())
