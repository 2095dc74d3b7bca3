"""The VMC output: a receiver reconstructs the pose that was sent."""

import socket
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np
import pytest

from harness.body import Body, Kinematics, build_body, retarget_to_own_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.live.pose import LivePose
from harness.live.vmc import HIPS, UNITY_BONES, UnityPose, VmcOutput, parse_address
from harness.mocap import SyntheticSource
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


@pytest.fixture(scope="module")
def real_poses() -> tuple[Body, list[Floats]]:
    """Poses of clips of the built-in performer, on the performer's own body."""
    body, poses = None, list[Floats]()
    for clip in ("walking_p1_01", "boxing_p1_01", "golf_p1_01"):
        body, motion = retarget_to_own_body(SyntheticSource(1).load(clip))
        poses += list(motion.qpos[:: len(motion.qpos) // 7])
    assert body is not None
    return body, poses


def sent(body: Body, poses: Sequence[Floats]) -> Iterator[tuple[LivePose, list[Message]]]:
    """Each pose and the messages that a receiver gets."""
    kinematics = Kinematics(body)
    with receiver() as ours, closing(VmcOutput(f"127.0.0.1:{ours.getsockname()[1]}", body.skeleton)) as output:
        for qpos in poses:
            pose = live_pose(qpos, kinematics=kinematics)
            output.send(pose)
            yield pose, received(ours, 2)


def test_a_receiver_rebuilds_the_joints(rng: np.random.Generator, real_poses: tuple[Body, list[Floats]]) -> None:
    """A bent neck is shorter than its one bone in Unity; the head lies in its direction, and turns as ours."""
    body, poses = real_poses
    skeleton = body.skeleton
    lower, upper = (skeleton.bone_m[skeleton.index(name)] for name in ("lowerneck", "upperneck"))
    for pose, messages in sent(body, [*poses, *(configuration(rng) for _ in range(8))]):
        found = rebuilt(messages)
        far_end = joint_centres_m(skeleton, pose.estimate.qpos[None])[0, 1:]
        for name, (bone, _) in UNITY_BONES.items():
            parent = skeleton.parents[skeleton.index(bone)]
            start_m = pose.root_m if parent < 0 else far_end[parent]
            if name == "Head":
                neck_m = start_m - found["Neck"][0]
                start_m = found["Neck"][0] + neck_m / np.linalg.norm(neck_m) * np.linalg.norm(lower + upper)
            np.testing.assert_allclose(found[name][0], start_m, atol=1e-4)
        np.testing.assert_allclose(found[HIPS][0], pose.root_m, atol=1e-4)
        turned = rotations.multiply(found["Head"][1], rest_orientation(body, "head"))
        assert rotations.angle_between_rad(turned, pose.bones[1][skeleton.index("head")]) < 1e-3


def rest_orientation(body: Body, bone: str) -> Floats:
    """`world_from_bone` (4,) in the T-pose."""
    pose = live_pose(tpose(body.skeleton), kinematics=Kinematics(body))
    out: Floats = pose.bones[1][body.skeleton.index(bone)]
    return out


def test_bones_keep_their_distances(rng: np.random.Generator, real_poses: tuple[Body, list[Floats]]) -> None:
    """The head's position moved by up to 28 mm, as the upper neck bent, and receivers stretched the neck."""
    body, poses = real_poses
    fixed = []
    for _, messages in sent(body, [*poses, *(configuration(rng) for _ in range(8))]):
        local = {str(values[0]): values[1:4] for address, values in messages if address == "/VMC/Ext/Bone/Pos"}
        fixed.append([at_m for name, at_m in local.items() if name != HIPS])
    assert np.ptp(np.array(fixed, float), axis=0).max() == 0.0


def test_the_neck_turns_as_both_of_its_bones() -> None:
    """A twist of the two bones about the neck by 20 and 40 deg is one of 30 deg below the head, which turned by 40."""
    body = build_body()
    qpos = np.array(tpose(body.skeleton))
    for bone, angle_deg in (("lowerneck", 20.0), ("upperneck", 20.0)):
        qpos[int(body.model.joint(f"{bone}.ry").qposadr[0])] = np.deg2rad(angle_deg)
    unity = UnityPose(body.skeleton)
    local = dict(zip(unity.names, unity.local(live_pose(qpos, kinematics=Kinematics(body))), strict=True))
    turn_deg = {name: 2.0 * np.rad2deg(np.arccos(min(abs(local[name][6]), 1.0))) for name in ("Neck", "Head")}
    assert turn_deg["Neck"] == pytest.approx(30.0, abs=1.0)
    assert turn_deg["Head"] == pytest.approx(10.0, abs=1.0)


def test_the_messages_are_those_of_the_protocol(rng: np.random.Generator) -> None:
    with receiver() as ours:
        output = VmcOutput(str(ours.getsockname()[1]), build_body().skeleton)
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
    body = build_body()
    local = UnityPose(body.skeleton).local(live_pose(tpose(body.skeleton)))
    np.testing.assert_allclose(local[:, 3:], np.tile([0.0, 0.0, 0.0, 1.0], (len(local), 1)), atol=1e-9)
    at_m = dict(zip((HIPS, *UNITY_BONES), local[:, :3], strict=True))
    assert at_m["LeftLowerArm"][0] < -0.2  # Unity's x is right
    assert at_m["RightLowerArm"][0] > 0.2
    assert at_m["LeftLowerLeg"][1] < -0.3  # y is up


def test_a_raised_forearm_turns_as_in_unity() -> None:
    """Left elbow bent by 90 deg, the hand ahead: from pointing left (-x) to forward (+z) about y, left-handed: +90."""
    body = build_body()
    qpos = np.array(tpose(body.skeleton))
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
        VmcOutput("no..host:39539", build_body().skeleton)
