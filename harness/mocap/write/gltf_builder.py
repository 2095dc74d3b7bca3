"""Builder of binary glTF 2.0 files (`.glb`): arrays, meshes, nodes and animations in one buffer.

Section numbers are those of the specification (Khronos Group, glTF 2.0).
"""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats, Ints
from harness.core.package_data import VERSION

_MAGIC, _CONTAINER_VERSION, _JSON_CHUNK, _BINARY_CHUNK = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_ALIGNMENT = 4
"""Chunks, and the data of accessors, begin at multiples of this number of bytes (4.4, 3.6.2.4)."""
_FLOAT, _UNSIGNED_SHORT = 5126, 5123
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
MAX_VERTICES = 65_535
"""Number of vertices of one mesh, because indices have 16 bits and the last one is reserved (3.7.2.1)."""


class GltfBuilder:
    """The content of one file. Each `add` method returns the index of what it added."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._content: dict[str, Any] = {"asset": {"version": "2.0", "generator": f"tracker-harness {VERSION}"}}

    def add(self, kind: str, **fields: Any) -> int:
        """Add an object to the list `kind`, such as "nodes", with fields as the specification names them."""
        objects: list[dict[str, Any]] = self._content.setdefault(kind, [])
        objects.append(fields)
        return len(objects) - 1

    def add_floats(self, values: Floats, *, target: int | None = None) -> int:
        """Add an accessor of 32-bit floats: numbers (N,), or vectors (N, 3) or (N, 4). It states its bounds."""
        array = np.asarray(values, dtype="<f4")
        width = 1 if array.ndim == 1 else array.shape[1]
        rows = array.reshape(-1, width)
        return self._add_accessor(
            array,
            target,
            componentType=_FLOAT,
            count=len(array),
            type=_TYPES[width],
            min=rows.min(axis=0).tolist(),
            max=rows.max(axis=0).tolist(),
        )

    def add_mesh(self, name: str, position_m: Floats, normal: Floats, triangles: Ints, material: int) -> int:
        """Add a mesh of V vertices: positions and normals (V, 3), and triangles (N, 3).

        ValueError above MAX_VERTICES vertices.
        """
        if len(position_m) > MAX_VERTICES:
            raise ValueError(f"{len(position_m)} vertices in {name}")
        attributes = {
            "POSITION": self.add_floats(position_m, target=_VERTEX_BUFFER),
            "NORMAL": self.add_floats(normal, target=_VERTEX_BUFFER),
        }
        indices = self._add_accessor(
            np.asarray(triangles, dtype="<u2").ravel(),
            _INDEX_BUFFER,
            componentType=_UNSIGNED_SHORT,
            count=triangles.size,
            type="SCALAR",
        )
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        return self.add("meshes", name=name, primitives=[primitive])

    def to_bytes(self) -> bytes:
        """The file: a header, the JSON text, and the buffer."""
        content = {**self._content, "buffers": [{"byteLength": len(self._data)}]}
        text = _pad(json.dumps(content, separators=(",", ":"), allow_nan=False).encode("utf-8"), b" ")
        data = _pad(bytes(self._data), b"\0")
        chunks = b"".join(
            struct.pack("<II", len(chunk), kind) + chunk for kind, chunk in ((_JSON_CHUNK, text), (_BINARY_CHUNK, data))
        )
        return struct.pack("<III", _MAGIC, _CONTAINER_VERSION, 12 + len(chunks)) + chunks

    def _add_accessor(self, array: NDArray[Any], target: int | None, **fields: Any) -> int:
        data = array.tobytes()
        view = {"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)}
        self._data += _pad(data, b"\0")
        view_index = self.add("bufferViews", **view, **({} if target is None else {"target": target}))
        return self.add("accessors", bufferView=view_index, **fields)


def _pad(data: bytes, filler: bytes) -> bytes:
    return data + filler * (-len(data) % _ALIGNMENT)
