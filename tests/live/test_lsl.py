"""The LSL output, as a receiver of its streams gets it."""

import time

import numpy as np
import pytest

from harness.body import Kinematics, build_body
from harness.errors import BadInput, MissingExtra
from harness.live.lsl import LslOutput, import_pylsl
from tests.joint_centres import joint_centres_m
from tests.live.posing import configuration, live_pose

try:
    pylsl = import_pylsl()
except MissingExtra as missing:
    pytest.skip(f"no Lab Streaming Layer here: {missing}", allow_module_level=True)


def test_samples_arrive_with_their_times(rng: np.random.Generator) -> None:
    body = build_body()
    name = f"test-{rng.integers(1 << 60)}"
    output = LslOutput(name, body.skeleton, 75.0)
    inlets = {}
    for kind in ("qpos", "joints"):
        (found,) = pylsl.resolve_byprop("name", f"{name}-{kind}", timeout=30.0)
        inlets[kind] = pylsl.StreamInlet(found)
        inlets[kind].open_stream(timeout=30.0)
    kinematics = Kinematics(body)
    sent = [live_pose(configuration(rng), n, time.monotonic(), kinematics) for n in range(5)]
    for pose in sent:
        output.send(pose)
    for pose in sent:
        qpos, stamp_s = inlets["qpos"].pull_sample(timeout=30.0)
        np.testing.assert_array_equal(qpos, pose.estimate.qpos)
        assert stamp_s == pytest.approx(pose.measured_s + pylsl.local_clock() - time.monotonic(), abs=0.01)
        joints, _ = inlets["joints"].pull_sample(timeout=30.0)
        centres_m = joint_centres_m(body.skeleton, pose.estimate.qpos[None])[0]
        np.testing.assert_allclose(np.reshape(joints, (25, 3)), centres_m, atol=1e-9)
    info = inlets["qpos"].info(timeout=30.0)
    channel = info.desc().child("channels").child("channel")
    assert (channel.child_value("label"), channel.child_value("unit")) == ("root.x", "metres")
    assert info.channel_count() == 55
    assert info.nominal_srate() == 75.0
    for inlet in inlets.values():
        inlet.close_stream()
    output.close()


def test_a_stream_has_a_name() -> None:
    with pytest.raises(BadInput, match="needs a name"):
        LslOutput(" ", build_body().skeleton, 75.0)
