"""Live output by the Virtual Motion Capture protocol: OSC over UDP; Unity, Blender, Unreal and Godot have receivers.

The messages are those of protocol.vmc.info ("Marionette" specification, V2.7): `/VMC/Ext/OK`, `/VMC/Ext/T`,
`/VMC/Ext/Root/Pos` and a `/VMC/Ext/Bone/Pos` for each bone: name, position x, y, z [m], quaternion x, y, z, w.

Unity's axes are left-handed: x right, y up, z forward. In VRM avatars, and so in the VMC protocol, every rotation is
the identity in the T-pose, and bones keep their distances. docs/device.md has the table of bones.
"""

import socket
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from harness.body import tpose
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats, Ints
from harness.core.estimate import Status
from harness.core.network import resolve_host
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.errors import BadInput, MissingExtra
from harness.live.pose import LivePose

HIPS = "Hips"
"""Unity's root bone, which is the root of the model."""
UNITY_BONES: dict[str, tuple[str, str]] = {
    "Spine": ("lowerback", HIPS),
    "Chest": ("upperback", "Spine"),
    "UpperChest": ("thorax", "Chest"),
    "Neck": ("lowerneck", "UpperChest"),
    "Head": ("head", "Neck"),
    **{
        f"{side}{bone}": (f"{letter}{model_bone}", parent if parent in ("UpperChest", HIPS) else f"{side}{parent}")
        for side, letter in (("Left", "l"), ("Right", "r"))
        for bone, model_bone, parent in (
            ("Shoulder", "clavicle", "UpperChest"),
            ("UpperArm", "humerus", "Shoulder"),
            ("LowerArm", "radius", "UpperArm"),
            ("Hand", "hand", "LowerArm"),
            ("UpperLeg", "femur", HIPS),
            ("LowerLeg", "tibia", "UpperLeg"),
            ("Foot", "foot", "LowerLeg"),
        )
    },
}
"""Bone of the model with the same rotation, and parent in Unity, by the name in Unity's HumanBodyBones.

The rotations of the wrist bones are part of Hand, and the hip joints do not rotate. Unity has one bone for lowerneck
and upperneck: `Neck` turns as both do on average, and points at the joint of the head.
"""


def unity_vector(v: Floats) -> Floats:
    """Vectors (..., 3) in world axes (x forward, y left, z up) in Unity's axes (x right, y up, z forward)."""
    return np.stack([-v[..., 1], v[..., 2], v[..., 0]], axis=-1)


def unity_quaternion(q: Floats) -> Floats:
    """Quaternions (..., 4), w first, in Unity's axes and order x, y, z, w; mirrored axes invert rotations."""
    return np.stack([q[..., 2], -q[..., 3], -q[..., 1], q[..., 0]], axis=-1)


class UnityPose:
    """Local positions and rotations of Unity's bones for one body."""

    def __init__(self, skeleton: Skeleton) -> None:
        self.names = (HIPS, *UNITY_BONES)
        rest = forward_kinematics(skeleton, *(part[None] for part in humanoid24.unpack(tpose(skeleton))))
        bones = [skeleton.index(bone) for bone, _ in UNITY_BONES.values()]
        start_m = np.concatenate([rest.start_m[0, :1], rest.start_m[0, bones]])
        self._neck, self._head = self.names.index("Neck"), self.names.index("Head")
        self._upper_neck = skeleton.index("upperneck")
        self._bones = np.array(bones, dtype=np.int64)
        self._parents: Ints = np.array([self.names.index(p) for _, p in UNITY_BONES.values()], dtype=np.int64)
        tpose_from_world = rotations.from_matrix(np.swapaxes(rest.world_from_bone[0], -1, -2))
        self._bone_from_tpose, self._upper_neck_from_tpose = tpose_from_world[bones], tpose_from_world[self._upper_neck]
        self._offset_m = start_m[1:] - start_m[self._parents]

    def local(self, pose: LivePose) -> Floats:
        """(20, 7) position x, y, z [m] and quaternion x, y, z, w of each bone in its parent, in Unity's axes.

        Only the position of the hips changes. A bent neck is shorter than `Neck`, by 2 mm on average in CMU's clips.
        """
        start_m, world_from_bone = pose.bones
        rotation = rotations.multiply(world_from_bone[self._bones], self._bone_from_tpose)
        rotation = np.concatenate([pose.world_from_root[None], rotation])
        upper = rotations.multiply(world_from_bone[self._upper_neck], self._upper_neck_from_tpose)
        lower_m, head_m = start_m[self._bones[[self._neck - 1, self._head - 1]]]
        rotation[self._neck] = _aim(
            _midway(rotation[self._neck], upper), self._offset_m[self._head - 1], head_m - lower_m
        )
        above = rotations.inverse(rotation[self._parents])
        out = np.empty((len(rotation), 7))
        out[:, :3] = unity_vector(np.concatenate([pose.root_m[None], self._offset_m]))
        out[:, 3:] = unity_quaternion(np.concatenate([rotation[:1], rotations.multiply(above, rotation[1:])]))
        return out


def _midway(p: Floats, q: Floats) -> Floats:
    """The rotation (4,) halfway from one to another."""
    both = p + np.copysign(1.0, p @ q) * q
    out: Floats = both / np.linalg.norm(both)
    return out


def _aim(world_from_bone: Floats, along: Floats, world_along: Floats) -> Floats:
    """The rotation (4,) nearest to one that turns a vector of the bone (3,) into a direction of the world (3,)."""
    now = rotations.rotate(world_from_bone, along)
    turn = np.append(np.linalg.norm(now) * np.linalg.norm(world_along) + now @ world_along, np.cross(now, world_along))
    size = np.linalg.norm(turn)
    if size < 1e-9:  # the directions are opposite, or there is none
        return world_from_bone
    return rotations.multiply(turn / size, world_from_bone)


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
