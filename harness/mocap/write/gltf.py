"""Writer of glTF 2.0 files (`.glb`) for 3-D viewers: animated bodies with the stations that they wear.

A file holds one scene with a node for each motion, "truth" and "estimate", which can be hidden in a viewer. Below each
lie the bones as a tree of nodes: their translations are fixed, their rotations and the root's place are animated.
glTF has y up, z forward and x left, in metres, and quaternions (x, y, z, w); the top node of each motion turns the
world's axes into these. Times begin at zero. Viewers interpolate between frames, also across a gap.
"""

from collections.abc import Mapping

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.mocap.write.body_model import BodyModel, MountedStation, merge_meshes, tessellate_box, tessellate_shape
from harness.mocap.write.gltf_builder import GltfBuilder
from harness.mocap.write.posed_motion import PosedMotion

GLTF_FROM_WORLD: Floats = np.array([0.5, -0.5, -0.5, -0.5])
"""Quaternion (w, x, y, z) from world axes (x forward, y left, z up) to glTF's (x left, y up, z forward)."""
STATION_SIZE_M: Floats = np.array([0.04, 0.03, 0.02])
"""Sides of the box that stands for a station: along the bone, across it, outward [m]."""
_COLOURS = {"truth": "0072b2", "estimate": "d55e00"}
_STATION_COLOUR = "23282f"
_OPACITY = {"truth": 1.0, "estimate": 0.7}


def glb_files(bodies: Mapping[str, tuple[PosedMotion, BodyModel]]) -> dict[str, bytes]:
    """Content of the file by its ending, with the motions "truth" and "estimate" and their models."""
    gltf = GltfBuilder()
    box, material = tessellate_box(STATION_SIZE_M), _add_material(gltf, "station", _STATION_COLOUR, 1.0)
    station = gltf.add_mesh("station", box.position_m, box.normal, box.triangles, material)
    trees = [_BodyTree(gltf, kind, motion, model, station) for kind, (motion, model) in bodies.items()]
    samplers = [sampler for tree in trees for sampler in tree.samplers]
    channels = [
        {"sampler": number, "target": target}
        for number, target in enumerate(target for tree in trees for target in tree.targets)
    ]
    gltf.add("animations", name="motion", samplers=samplers, channels=channels)
    gltf.add("scenes", name="motion", nodes=[tree.top for tree in trees])
    return {".glb": gltf.to_bytes()}


class _BodyTree:
    """The nodes of one motion, and its part of the animation."""

    def __init__(self, gltf: GltfBuilder, kind: str, motion: PosedMotion, model: BodyModel, station: int) -> None:
        self._gltf, self._kind, self._motion, self._model, self._station = gltf, kind, motion, model, station
        self._material = _add_material(gltf, kind, _COLOURS[kind], _OPACITY[kind])
        self._times = gltf.add_floats(motion.time_s - motion.time_s[0])
        self._world_from_root = rotations.to_matrix(motion.world_from_root)
        self.samplers: list[dict[str, object]] = []
        self.targets: list[dict[str, object]] = []
        root = self._add_bone(-1)
        extras = {"start_s": float(motion.time_s[0]), "rate_hz": motion.rate_hz}
        self.top = gltf.add("nodes", name=kind, rotation=_xyzw(GLTF_FROM_WORLD), children=[root], extras=extras)

    def _add_bone(self, bone: int) -> int:
        """Add the node of a bone (-1: the root) and all below it; outside the animation it has its first pose."""
        skeleton, motion, gltf = self._motion.skeleton, self._motion, self._gltf
        name, parent = ("root", -1) if bone < 0 else (skeleton.names[bone], skeleton.parents[bone])
        children = [self._add_bone(child) for child, above in enumerate(skeleton.parents) if above == bone]
        children += [self._add_station(place) for place in self._model.stations if place.bone == name]
        fields: dict[str, object] = {"children": children} if children else {}
        if shapes := [tessellate_shape(shape) for shape in self._model.shapes if shape.bone == name]:
            mesh = merge_meshes(shapes)
            arrays = mesh.position_m, mesh.normal, mesh.triangles
            fields["mesh"] = gltf.add_mesh(f"{self._kind} {name}", *arrays, self._material)
        animated = {}
        if bone < 0:
            animated["translation"] = motion.joints_m[:, 0]
        elif parent >= 0:
            fields["translation"] = skeleton.bone_m[parent].tolist()
        if bone < 0 or skeleton.hinges[bone]:
            animated["rotation"] = self._local_rotation(bone)[:, [1, 2, 3, 0]]
        fields |= {path: values[0].tolist() for path, values in animated.items()}
        node = gltf.add("nodes", name=f"{self._kind} {name}", **fields)
        for path, values in animated.items():
            output = gltf.add_floats(values)
            self.samplers.append({"input": self._times, "output": output, "interpolation": "LINEAR"})
            self.targets.append({"node": node, "path": path})
        return node

    def _add_station(self, place: MountedStation) -> int:
        return self._gltf.add(
            "nodes",
            name=f"{self._kind} station {place.name}",
            mesh=self._station,
            translation=place.position_m.tolist(),
            rotation=_xyzw(place.bone_from_station),
        )

    def _local_rotation(self, bone: int) -> Floats:
        """(F, 4) quaternions (w, x, y, z) of a bone in its parent's frame, without jumps of sign."""
        if bone < 0:
            return rotations.continuous(self._motion.world_from_root)
        parent, turns = self._motion.skeleton.parents[bone], self._motion.world_from_bone
        above = self._world_from_root if parent < 0 else turns[:, parent]
        return rotations.continuous(rotations.from_matrix(np.swapaxes(above, -1, -2) @ turns[:, bone]))


def _add_material(gltf: GltfBuilder, name: str, colour: str, opacity: float) -> int:
    """Add a matt material; glTF takes colours as linear intensities (sRGB: IEC 61966-2-1)."""
    srgb = np.array([int(colour[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    look = {"baseColorFactor": [*linear.tolist(), opacity], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    blend = {"alphaMode": "BLEND"} if opacity < 1.0 else {}
    return gltf.add("materials", name=name, pbrMetallicRoughness=look, **blend)


def _xyzw(quaternion: Floats) -> list[float]:
    w, x, y, z = (float(value) for value in quaternion)
    return [x, y, z, w]
