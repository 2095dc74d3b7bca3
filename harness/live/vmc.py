"""The pose as Virtual Motion Capture protocol: OSC over UDP, which Unity, Blender, Unreal and Godot have receivers for.

The messages are those of protocol.vmc.info ("Marionette" specification, V2.7): `/VMC/Ext/OK`, `/VMC/Ext/T`,
`/VMC/Ext/Root/Pos` and a `/VMC/Ext/Bone/Pos` for each bone: name, position x, y, z [m], quaternion x, y, z, w.
"""

import socket
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, MissingExtra
from harness.live.pose import LivePose
from harness.live.unity import UnityPose

_BONES_PER_BUNDLE = 12
"""Bones in a datagram: below 1500 bytes, which the protocol advises and networks carry whole."""
_POSE_BYTES = 28
"""Bytes of the seven floats at the end of a message."""


class VmcOutput:
    """An `Output`. The avatar's root stays in the world's origin; the hips carry the way through the room."""

    def __init__(self, address: str, own: Skeleton) -> None:
        """`address` is HOST:PORT, or a port of this computer; BadInput, MissingExtra."""
        if find_spec("pythonosc") is None:
            raise MissingExtra("--vmc", "python-osc", "live")
        host, port = parse_address(address)
        self.name, self.description = f"--vmc {host}:{port}", f"VMC protocol: to UDP port {port} of {host}"
        self._pose = UnityPose(own)
        self._datagrams = _VmcDatagrams(self._pose.names)
        self._to: Any
        try:
            family, _, _, _, self._to = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise BadInput(f"--vmc {address}: no such host ({error}).", "Name one as HOST:PORT.") from error
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._began_s: float | None = None

    def send(self, pose: LivePose) -> None:
        if self._began_s is None:
            self._began_s = pose.measured_s
        seen = pose.estimate.status is not Status.LOST
        for datagram in self._datagrams.fill(seen, pose.measured_s - self._began_s, self._pose.local(pose)):
            with suppress(BlockingIOError):  # the line is full: the next pose is better than an old one
                self._socket.sendto(datagram, self._to)

    def close(self) -> None:
        self._socket.close()


class _VmcDatagrams:
    """Bundles that are built once; of a pose only the numbers change, which stay where the first build put them."""

    def __init__(self, names: Sequence[str]) -> None:
        from pythonosc.osc_message_builder import OscMessageBuilder

        def message(address: str, *arguments: str | int | float) -> bytes:
            built = OscMessageBuilder(address)
            for value in arguments:
                built.add_arg(value)
            return bytes(built.build().dgram)

        nowhere = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        first = [
            message("/VMC/Ext/OK", 1, 3, 0, 1),  # loaded, calibrated, no mixed reality, tracked
            message("/VMC/Ext/T", 0.0),
            message("/VMC/Ext/Root/Pos", "root", *nowhere),
        ]
        bones = [message("/VMC/Ext/Bone/Pos", name, *nowhere) for name in names]
        self._bundles: list[NDArray[np.uint8]] = []
        self._numbers: list[NDArray[np.int64]] = []
        for at in range(0, len(bones), _BONES_PER_BUNDLE):
            before = first if at == 0 else []
            data, ends = _bundle([*before, *bones[at : at + _BONES_PER_BUNDLE]])
            self._bundles.append(data)
            self._numbers.append(ends[len(before) :, None] + np.arange(-_POSE_BYTES, 0))
        self._tracked, self._time = (int(end) - 4 for end in _bundle(first)[1][:2])

    def fill(self, tracked: bool, time_s: float, bones: Floats) -> list[bytes]:
        """The datagrams of a pose: whether trackers are seen, time since the start [s], bones (B, 7)."""
        first, at = self._bundles[0], 0
        first[self._tracked : self._tracked + 4] = np.frombuffer(int(tracked).to_bytes(4, "big"), np.uint8)
        first[self._time : self._time + 4] = np.array([time_s], ">f4").view(np.uint8)
        numbers = bones.astype(">f4").view(np.uint8)
        for data, places in zip(self._bundles, self._numbers, strict=True):
            data[places] = numbers[at : at + len(places)]
            at += len(places)
        return [data.tobytes() for data in self._bundles]


def _bundle(messages: Sequence[bytes]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """An OSC 1.0 bundle for at once: its name, time tag 1, each message after its size; and where each message ends."""
    sized = [len(message).to_bytes(4, "big") + message for message in messages]
    head = b"#bundle\0" + (1).to_bytes(8, "big")
    ends = len(head) + np.cumsum([len(part) for part in sized])
    return np.frombuffer(b"".join([head, *sized]), np.uint8).copy(), ends


def parse_address(text: str) -> tuple[str, int]:
    """HOST:PORT, or a port alone for this computer; BadInput."""
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdecimal()) or not 0 < int(port) < 65536:
        raise BadInput(f"--vmc {text}: no address.", "Give HOST:PORT, such as 127.0.0.1:39539, where receivers listen.")
    return host.strip("[]") or "127.0.0.1", int(port)
