"""C3D files written byte by byte, with the counts that a test names."""

import struct
from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats

INTEL, DEC, MIPS = 84, 85, 86
_BLOCK = 512


def c3d_bytes(
    points: Floats,
    *,
    processor: int = INTEL,
    scale: float = -1.0,
    analog: tuple[int, int] = (0, 0),
    first: int = 1,
    last: int | None = None,
    frames: int | None = None,
    long_frames: float | None = None,
    trial: tuple[int, int] | None = None,
    residual: Floats | float = 0.0,
    rest: bytes | None = None,
    units: str = "m",
    numbers: dict[str, float] | None = None,
    labels: Sequence[str] = (),
) -> bytes:
    """Frames of markers (T, M, 3) in metres; negative `scale` for floats.

    `analog` is the number of channels and of their samples in a frame, `last` the header's last frame, `frames` the
    parameter POINT:FRAMES, `rest` what follows the last frame (by default the padding of its block), and `numbers`
    are other values of POINT's parameters. `labels` are bar_1, bar_2, ... by default.
    """
    count, markers = points.shape[:2]
    big, code = (">", ">f4") if processor == MIPS else ("<", "<f4")

    def real(values: Floats | Sequence[float]) -> bytes:
        data = np.asarray(values, np.float32)
        if processor != DEC:
            return data.astype(code).tobytes()
        return (4.0 * data).astype("<f4").view("<u2").reshape(-1, 2)[:, ::-1].tobytes()

    def words(*values: int) -> bytes:
        return struct.pack(f"{big}{len(values)}H", *(value % 0x10000 for value in values))

    def parameter(group: int, name: str, size: int, shape: tuple[int, ...], data: bytes) -> bytes:
        body = struct.pack("bB", size, len(shape)) + bytes(shape) + data + b"\0"
        return struct.pack("bb", len(name), group) + name.encode() + words(2 + len(body)) + body

    labels = labels or [f"bar_{marker + 1}" for marker in range(markers)]
    width = max(map(len, labels))
    point = {"RATE": 100.0, "SCALE": scale} | (numbers or {})
    block = b"".join(
        [
            *(struct.pack("bb", len(g), -i) + g.encode() + words(3) + b"\0" for i, g in ((1, "POINT"), (2, "TRIAL"))),
            parameter(1, "USED", 2, (), words(int(point.pop("USED", markers)))),
            parameter(1, "LABELS", -1, (width, markers), "".join(label.ljust(width) for label in labels).encode()),
            parameter(1, "UNITS", -1, (len(units),), units.encode()),
            parameter(1, "X_SCREEN", -1, (2,), b"+X"),
            parameter(1, "Y_SCREEN", -1, (2,), b"+Z"),
            *(parameter(1, name, 4, (), real([value])) for name, value in point.items()),
            parameter(1, "FRAMES", 2, (), words(min(count, 0xFFFF) if frames is None else frames)),
            b"" if long_frames is None else parameter(1, "LONG_FRAMES", 4, (), real([long_frames])),
            *(
                parameter(2, f"ACTUAL_{name}_FIELD", 2, (2,), words(value, value // 0x10000))
                for name, value in zip(("START", "END"), trial or (), strict=bool(trial))
            ),
        ]
    )
    blocks = -(-(len(block) + 6) // _BLOCK)
    data_start = 2 + blocks
    channels, samples = analog
    header = bytes([2, 0x50]) + words(
        markers, channels * samples, first, min(first + count - 1, 0xFFFF) if last is None else last, 10
    )
    header += real([scale]) + words(data_start, samples) + real([100.0])
    values = np.zeros((count, 4 * markers + channels * samples))
    values[:, : 4 * markers] = np.concatenate(
        [points / (1.0 if scale < 0.0 else scale), np.broadcast_to(residual, (count, markers))[..., None]], axis=2
    ).reshape(count, -1)
    values[:, 4 * markers :] = 77.0
    data = real(values) if scale < 0.0 else np.rint(values).astype(f"{big}i2").tobytes()
    parameters = (bytes([1, 0x50, blocks, processor]) + block + b"\0\0").ljust(blocks * _BLOCK, b"\0")
    return header.ljust(_BLOCK, b"\0") + parameters + data + (bytes(-len(data) % _BLOCK) if rest is None else rest)
