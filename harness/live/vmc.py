"""Live output by the Virtual Motion Capture protocol: OSC over UDP; Unity, Blender, Unreal and Godot have receivers.

The messages are those of protocol.vmc.info ("Marionette" specification, V2.7): `/VMC/Ext/OK`, `/VMC/Ext/T`,
`/VMC/Ext/Root/Pos` and a `/VMC/Ext/Bone/Pos` for each bone: name, position x, y, z [m], quaternion x, y, z, w.
"""

import socket
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.network import resolve_host
from harness.core.skeleton import Skeleton
from harness.errors import BadInput, MissingExtra
from harness.live.pose import LivePose
from harness.live.unity import UnityPose

_BONES_PER_BUNDLE = 12
"""Bones in a datagram: below 1500 bytes, as the protocol advises, so that networks do not fragment it."""
_POSE_BYTES = 28
"""Size of the seven floats at the end of a message."""


class VmcOutput:
    """An `Output` to a VMC receiver. The avatar's root stays at the origin; the hips move through the room."""

    def __init__(self, address: str, skeleton: Skeleton) -> None:
        """Open the socket; `address` is HOST:PORT, or a port of this computer.

        Raises BadInput for another address or an unknown host, MissingExtra without python-osc.
        """
        if find_spec("pythonosc") is None:
            raise MissingExtra("--vmc", "python-osc", "live")
        host, port = parse_address(address)
        self.name, self.description = f"--vmc {host}:{port}", f"VMC protocol: to UDP port {port} of {host}"
        self._pose = UnityPose(skeleton)
        self._datagrams = _VmcDatagrams(self._pose.names)
        try:
            family, self._receiver = resolve_host(host, port, socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise BadInput(f"--vmc {address}: no such host ({error}).", "Give HOST:PORT.") from error
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._start_s: float | None = None

    def send(self, pose: LivePose) -> None:
        if self._start_s is None:
            self._start_s = pose.measured_s
        tracked = pose.estimate.status is not Status.LOST
        for datagram in self._datagrams.fill(tracked, pose.measured_s - self._start_s, self._pose.local(pose)):
            with suppress(BlockingIOError):  # the buffer is full; a newer pose follows
                self._socket.sendto(datagram, self._receiver)

    def close(self) -> None:
        self._socket.close()


class _VmcDatagrams:
    """OSC bundles that are built once; a pose overwrites their numbers in place."""

    def __init__(self, names: Sequence[str]) -> None:
        from pythonosc.osc_message_builder import OscMessageBuilder

        def message(address: str, *arguments: str | int | float) -> bytes:
            builder = OscMessageBuilder(address)
            for value in arguments:
                builder.add_arg(value)
            return bytes(builder.build().dgram)

        identity = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        header = [
            message("/VMC/Ext/OK", 1, 3, 0, 1),  # loaded, calibrated, no mixed reality, tracked
            message("/VMC/Ext/T", 0.0),
            message("/VMC/Ext/Root/Pos", "root", *identity),
        ]
        bones = [message("/VMC/Ext/Bone/Pos", name, *identity) for name in names]
        self._bundles: list[NDArray[np.uint8]] = []
        self._numbers: list[NDArray[np.int64]] = []
        for at in range(0, len(bones), _BONES_PER_BUNDLE):
            head = header if at == 0 else []
            data, ends = _bundle([*head, *bones[at : at + _BONES_PER_BUNDLE]])
            self._bundles.append(data)
            self._numbers.append(ends[len(head) :, None] + np.arange(-_POSE_BYTES, 0))
        self._tracked, self._time = (int(end) - 4 for end in _bundle(header)[1][:2])

    def fill(self, tracked: bool, time_s: float, bones: Floats) -> list[bytes]:
        """The datagrams of a pose.

        `tracked` is False for a LOST estimate; `time_s` is the time since the start [s]; `bones` (B, 7) are position
        and quaternion of each bone.
        """
        first, at = self._bundles[0], 0
        first[self._tracked : self._tracked + 4] = np.frombuffer(int(tracked).to_bytes(4, "big"), np.uint8)
        first[self._time : self._time + 4] = np.array([time_s], ">f4").view(np.uint8)
        numbers = bones.astype(">f4").view(np.uint8)
        for data, offsets in zip(self._bundles, self._numbers, strict=True):
            data[offsets] = numbers[at : at + len(offsets)]
            at += len(offsets)
        return [data.tobytes() for data in self._bundles]


def _bundle(messages: Sequence[bytes]) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
    """An OSC 1.0 bundle (tag, time 1 for immediately, each message after its size), and the end of each message."""
    sized = [len(message).to_bytes(4, "big") + message for message in messages]
    head = b"#bundle\0" + (1).to_bytes(8, "big")
    ends = len(head) + np.cumsum([len(part) for part in sized])
    return np.frombuffer(b"".join([head, *sized]), np.uint8).copy(), ends


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of HOST:PORT, or of a port of this computer; BadInput for another text."""
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdecimal() and len(port) <= 5) or not 0 < int(port) < 65536:
        raise BadInput(
            f"--vmc {text} is not an address.", "Give HOST:PORT, such as 127.0.0.1:39539, where receivers listen."
        )
    return host.strip("[]") or "127.0.0.1", int(port)
