"""Generator of the model file `models/humanoid24/humanoid24.xml`.

    python -m harness.body.mjcf > models/humanoid24/humanoid24.xml

writes the file from `core.humanoid24` and `body.anatomy`; a test checks that it is up to date.
"""

import sys
import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np

from harness.body import anatomy, humanoid
from harness.core import humanoid24
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton

_HINGE_DAMPING_NMS, _HINGE_ARMATURE_KGM2 = 1.0, 0.01
"""They stabilise an unactuated fall; kinematics do not depend on them."""


def humanoid_mjcf() -> str:
    """The text of humanoid24.xml: the standard skeleton, before scaling."""
    skeleton, limits_deg = humanoid24.standard_skeleton(), np.rad2deg(humanoid24.limits_rad())
    top = ET.Element("mujoco", model="humanoid24")
    ET.SubElement(top, "compiler", angle="degree", autolimits="true")
    ET.SubElement(top, "option", timestep="0.004", integrator="implicitfast")
    _add_appearance(top)
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
    _add_geoms(nodes["root"], "root", skeleton)
    for bone, start_m in enumerate(humanoid.joint_offsets_m(skeleton)):
        name, parent = skeleton.names[bone], skeleton.parents[bone]
        nodes[name] = ET.SubElement(
            nodes["root" if parent < 0 else skeleton.names[parent]], "body", name=name, pos=_text(start_m)
        )
        dofs = skeleton.dof_of_bone[bone]
        for dof in reversed(range(dofs.start, dofs.stop)):  # MuJoCo composes outermost first
            ET.SubElement(
                nodes[name],
                "joint",
                name=skeleton.dof_names[dof],
                axis=_text(skeleton.axes[dof]),
                range=_text(limits_deg[dof]),
            )
        _add_geoms(nodes[name], name, skeleton)
    keys = ET.SubElement(top, "keyframe")
    ET.SubElement(keys, "key", name="tpose", qpos=_text(humanoid.tpose(skeleton)))
    ET.indent(top)
    return ET.tostring(top, encoding="unicode") + "\n"


def _add_geoms(node: ET.Element, bone: str, skeleton: Skeleton) -> None:
    for geom in anatomy.body_geoms(skeleton):
        if geom.bone == bone:
            ET.SubElement(
                node,
                "geom",
                name=geom.name,
                type=geom.kind,
                pos=_text(geom.centre_m),
                quat=_text(geom.bone_from_shape),
                size=_text(geom.size_m[: 2 if geom.kind == "capsule" else 3]),
                mass=_text([geom.mass_kg]),
            )


def _add_appearance(top: ET.Element) -> None:
    """Defaults, colours and light. Geoms collide with the floor but not with each other."""
    default = ET.SubElement(top, "default")
    ET.SubElement(
        default, "joint", type="hinge", damping=_text([_HINGE_DAMPING_NMS]), armature=_text([_HINGE_ARMATURE_KGM2])
    )
    ET.SubElement(default, "geom", contype="1", conaffinity="0", rgba="0.78 0.62 0.52 1")
    ET.SubElement(default, "site", type="box", size="0.018 0.012 0.006", rgba="0.1 0.3 0.9 1")
    visual = ET.SubElement(top, "visual")
    ET.SubElement(visual, "headlight", ambient="0.4 0.4 0.4", diffuse="0.5 0.5 0.5", specular="0.1 0.1 0.1")
    asset = ET.SubElement(top, "asset")
    sky = {"builtin": "gradient", "width": "64", "height": "384", "rgb1": "1 1 1", "rgb2": "0.8 0.86 0.92"}
    tiles = {"builtin": "checker", "width": "64", "height": "64", "rgb1": "0.86 0.88 0.9", "rgb2": "0.76 0.79 0.82"}
    ET.SubElement(asset, "texture", {"name": "sky", "type": "skybox"} | sky)
    ET.SubElement(asset, "texture", {"name": "floor", "type": "2d"} | tiles)
    ET.SubElement(asset, "material", name="floor", texture="floor", texrepeat="20 20")


def _text(numbers: Sequence[float] | Floats) -> str:
    return " ".join(f"{round(float(number), 9) + 0.0:.9g}" for number in numbers)


if __name__ == "__main__":
    sys.stdout.write(humanoid_mjcf())
