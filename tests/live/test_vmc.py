"""The VMC output: a receiver reconstructs the pose that was sent."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from harness.body import humanoid
from harness.body.kinematics import Kinematics
from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.live.unity import HIPS, UNITY_BONES, UnityPose
from harness.live.vmc import VmcOutput, parse_address
from tests.joint_centres import joint_centres_m
from tests.live.posing import configuration, live_pose

osc_packet = pytest.importorskip("pythonosc.osc_packet", reason="python-osc is not installed (extra `live`)")

UNITY = (
    "Hips Spine Chest UpperChest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand RightShoulder RightUpperArm "
    "RightLowerArm RightHand LeftUpperLeg LeftLowerLeg LeftFoot RightUpperLeg RightLowerLeg RightFoot"
)
"""Unity's HumanBodyBones, by its documentation, without fingers, toes, eyes and jaw."""
Message = tuple[str, list[object]]


@contextmanager
def receiver() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(10.0)
        yield ours


def received(ours: socket.socket, datagrams: int) -> list[Message]:
    """The messages, read by python-osc."""
    found: list[Message] = []
    for _ in range(datagrams):
        data = ours.recv(65536)
        assert len(data) < 1500
        found += [(m.message.address, list(m.message.params)) for m in osc_packet.OscPacket(data).messages]
    return found


def rebuilt(messages: list[Message]) -> dict[str, tuple[Floats, Floats]]:
    """Pose of each Unity bone in world axes, by forward kinematics in Unity's axes."""
    local: dict[str, tuple[Floats, Floats]] = {}
    for address, values in messages:
        if address in ("/VMC/Ext/Bone/Pos", "/VMC/Ext/Root/Pos"):
            name, numbers = str(values[0]), np.array(values[1:], dtype=float)
            assert np.linalg.norm(numbers[3:]) == pytest.approx(1.0, abs=1e-6)
            local[name] = numbers[:3], np.roll(numbers[3:], 1)
    world = {"root": local["root"]}
    for name, (at_m, turn) in local.items():
        if name != "root":
            above_m, above = world[UNITY_BONES[name][1] if name in UNITY_BONES else "root"]
            world[name] = above_m + rotations.rotate(above, at_m), rotations.multiply(above, turn)
    # Unity's x right, y up, z forward are our -y, z, x; to turn an axis over turns quaternions the other way round
    return {
        n: (p[[2, 0, 1]] * [1.0, -1.0, 1.0], q[[0, 3, 1, 2]] * [1.0, -1.0, 1.0, -1.0]) for n, (p, q) in world.items()
    }


def test_a_receiver_rebuilds_the_joints(rng: np.random.Generator) -> None:
    skeleton = humanoid.build_body().skeleton
    with receiver() as ours:
        output = VmcOutput(f"127.0.0.1:{ours.getsockname()[1]}", skeleton)
        try:
            for _ in range(20):
                pose = live_pose(configuration(rng))
                output.send(pose)
                found = rebuilt(received(ours, 2))
                far_end = joint_centres_m(skeleton, pose.estimate.qpos[None])[0, 1:]
                for name, (bone, _) in UNITY_BONES.items():
                    parent = skeleton.parents[skeleton.index(bone)]
                    start_m = pose.root_m if parent < 0 else far_end[parent]
                    np.testing.assert_allclose(found[name][0], start_m, atol=1e-4)
                np.testing.assert_allclose(found[HIPS][0], pose.root_m, atol=1e-4)
        finally:
            output.close()


def test_the_messages_are_those_of_the_protocol(rng: np.random.Generator) -> None:
    with receiver() as ours:
        output = VmcOutput(str(ours.getsockname()[1]), humanoid.build_body().skeleton)
        output.send(live_pose(configuration(rng), at_s=5.0))
        received(ours, 2)
        output.send(live_pose(configuration(rng), at_s=5.5))
        messages = received(ours, 2)
        output.close()
    assert messages[:3] == [
        ("/VMC/Ext/OK", [1, 3, 0, 1]),
        ("/VMC/Ext/T", [0.5]),
        ("/VMC/Ext/Root/Pos", ["root", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    ]
    assert {address for address, _ in messages[3:]} == {"/VMC/Ext/Bone/Pos"}
    assert {str(values[0]) for _, values in messages[3:]} == set(UNITY.split())
    assert all(len(values) == 8 for _, values in messages[3:])


def test_the_t_pose_turns_no_bone() -> None:
    body = humanoid.build_body()
    local = UnityPose(body.skeleton).local(live_pose(humanoid.tpose(body.skeleton)))
    np.testing.assert_allclose(local[:, 3:], np.tile([0.0, 0.0, 0.0, 1.0], (len(local), 1)), atol=1e-9)
    at_m = dict(zip((HIPS, *UNITY_BONES), local[:, :3], strict=True))
    assert at_m["LeftLowerArm"][0] < -0.2  # Unity's x is right
    assert at_m["RightLowerArm"][0] > 0.2
    assert at_m["LeftLowerLeg"][1] < -0.3  # y is up


def test_a_raised_forearm_turns_as_in_unity() -> None:
    """Left elbow bent by 90 deg, the hand ahead: from pointing left (-x) to forward (+z) about y, left-handed: +90."""
    body = humanoid.build_body()
    qpos = np.array(humanoid.tpose(body.skeleton))
    kinematics = Kinematics(body)
    hinge = int(body.model.joint("lradius.rx").qposadr[0])
    qpos[hinge] = np.pi / 2
    unity = UnityPose(body.skeleton)
    local = unity.local(live_pose(qpos, kinematics=kinematics))
    x, y, z, w = local[unity.names.index("LeftLowerArm"), 3:]
    axis = body.skeleton.axes[body.skeleton.dof_names.index("lradius.rx")]  # ours: x forward, y left, z up
    np.testing.assert_allclose([x, y, z], -np.sqrt(0.5) * np.array([-axis[1], axis[2], axis[0]]), atol=1e-9)
    assert w == pytest.approx(np.sqrt(0.5))


@pytest.mark.parametrize(
    "text", ["", "here", "localhost:", "localhost:0", "127.0.0.1:99999", ":x", "127.0.0.1:²", "٣٩"]
)
def test_no_address(text: str) -> None:
    with pytest.raises(BadInput, match="is not an address"):
        parse_address(text)


def test_a_port_alone_is_on_this_computer() -> None:
    assert parse_address("39539") == parse_address(":39539") == ("127.0.0.1", 39539)
    assert parse_address("[::1]:39539") == ("::1", 39539)
    with pytest.raises(BadInput, match="no such host"):
        VmcOutput("no..host:39539", humanoid.build_body().skeleton)
