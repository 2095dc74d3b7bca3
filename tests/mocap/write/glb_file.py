"""Reads a binary glTF file as the specification says, without the code that writes it."""

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from harness.core.arrays import Floats

_DTYPES: dict[int, np.dtype[Any]] = {5126: np.dtype("<f4"), 5123: np.dtype("<u2")}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class GlbFile:
    """The JSON content and the buffer of a file."""

    content: dict[str, Any]
    data: bytes

    def array(self, accessor: int) -> np.ndarray[Any, Any]:
        """(N, W) values of an accessor."""
        fields = self.content["accessors"][accessor]
        view = self.content["bufferViews"][fields["bufferView"]]
        width = _WIDTHS[fields["type"]]
        start = view["byteOffset"] + fields.get("byteOffset", 0)
        values: np.ndarray[Any, Any] = np.frombuffer(
            self.data, _DTYPES[fields["componentType"]], fields["count"] * width, start
        )
        assert values.nbytes <= view["byteLength"]
        out: np.ndarray[Any, Any] = values.reshape(-1, width)
        return out

    def node(self, name: str) -> int:
        (number,) = [n for n, node in enumerate(self.content["nodes"]) if node["name"] == name]
        return number

    def world(self, node: int, time_s: float | None = None) -> Floats:
        """(4, 4) pose of a node at a time of the animation, or outside of it."""
        parents = {child: n for n, each in enumerate(self.content["nodes"]) for child in each.get("children", ())}
        pose = self._local(node, time_s)
        while node in parents:
            node = parents[node]
            pose = self._local(node, time_s) @ pose
        return pose

    def vertices(self, time_s: float) -> Floats:
        """(V, 3) vertices of all nodes with a mesh at a time of the animation."""
        points = []
        for number, node in enumerate(self.content["nodes"]):
            if "mesh" in node:
                (primitive,) = self.content["meshes"][node["mesh"]]["primitives"]
                pose = self.world(number, time_s)
                points.append(self.array(primitive["attributes"]["POSITION"]) @ pose[:3, :3].T + pose[:3, 3])
        return np.concatenate(points)

    def _local(self, node: int, time_s: float | None) -> Floats:
        fields = self.content["nodes"][node]
        place = {"translation": fields.get("translation", [0, 0, 0]), "rotation": fields.get("rotation", [0, 0, 0, 1])}
        if time_s is not None:
            place |= {path: self._animated(sampler, path, time_s) for path, sampler in self._samplers(node).items()}
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_quat(place["rotation"]).as_matrix()
        pose[:3, 3] = place["translation"]
        return pose

    def _samplers(self, node: int) -> dict[str, Any]:
        (animation,) = self.content["animations"]
        return {
            channel["target"]["path"]: animation["samplers"][channel["sampler"]]
            for channel in animation["channels"]
            if channel["target"]["node"] == node
        }

    def _animated(self, sampler: dict[str, Any], path: str, time_s: float) -> Floats:
        times, values = self.array(sampler["input"])[:, 0].astype(float), self.array(sampler["output"]).astype(float)
        if path == "rotation":
            out: Floats = Slerp(times, Rotation.from_quat(values))(time_s).as_quat()
            return out
        return np.array([np.interp(time_s, times, column) for column in values.T])


def read_glb(path: Path) -> GlbFile:
    """Read the header and both chunks; AssertionError where they break the rules of chapter 4."""
    data = path.read_bytes()
    assert struct.unpack("<4sII", data[:12]) == (b"glTF", 2, len(data))
    chunks, at = [], 12
    while at < len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        assert length % 4 == 0
        chunks.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    assert [kind for kind, _ in chunks] == [b"JSON", b"BIN\0"]
    return GlbFile(json.loads(chunks[0][1]), chunks[1][1])
