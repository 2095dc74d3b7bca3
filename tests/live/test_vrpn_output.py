"""The VRPN output: a client sees the joints of each pose, and the stations of the tracker."""

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from threading import Event, Thread

import numpy as np
import pytest

from harness.body import Kinematics, build_body
from harness.core.estimate import Estimate, Status
from harness.errors import BadInput
from harness.live.outputs import OutputOptions
from harness.live.pose import SessionSetup
from harness.live.vrpn_output import VrpnOutput
from harness.stream.vrpn import VrpnTracker
from tests.live.posing import configuration, live_pose


def setup() -> SessionSetup:
    return SessionSetup(build_body().skeleton, ("head", "torso"), 100.0, "test")


@contextmanager
def repeated(send: Callable[[], None]) -> Iterator[None]:
    """Call this about 100 times a second."""
    stopped = Event()

    def run() -> None:
        while not stopped.wait(0.01):
            send()

    thread = Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stopped.set()
        thread.join()


def test_a_client_sees_the_joints(rng: np.random.Generator) -> None:
    output = VrpnOutput("Body@:0", setup())
    described = re.fullmatch(
        r"VRPN: Body@127\.0\.0\.1:(\d+) with the sensors 0 head, 1 torso; (Body-joints@127\.0\.0\.1:\1) with the "
        r"joints from 0 lowerback to 23 rfoot",
        output.description,
    )
    assert described
    kinematics, qpos = Kinematics(build_body()), configuration(rng)
    pose = live_pose(qpos, kinematics=kinematics)
    expected_m, expected = pose.bones
    lost = replace(pose, estimate=Estimate(qpos, Status.LOST))

    def send() -> None:
        output.send(lost)
        output.send(replace(pose, measured_s=time.monotonic()))

    before_s = time.time()
    with repeated(send), VrpnTracker(f"vrpn:{described[2]}") as client:
        frames = list(islice(client, 5))
        measured_s = client.measured_unix_s(frames[-1])
    output.close()
    assert len(client.stations) == 24
    np.testing.assert_array_equal(frames[-1].position_m, expected_m)
    np.testing.assert_allclose(frames[-1].tracker_from_station, expected, atol=1e-9)
    assert before_s - 1.0 < measured_s[0] < time.time() + 1.0
    assert client.counts["clock_resets"] == 0, "a lost pose was sent, whose time is another"


def test_anywhere_needs_something_that_is_served() -> None:
    with pytest.raises(BadInput, match="--anywhere without --lsl or --vrpn"):
        OutputOptions(anywhere=True)
    assert OutputOptions(vrpn="Body", anywhere=True).anywhere
    with pytest.raises(BadInput, match="reachable from other computers"):
        VrpnOutput("Body@0.0.0.0:0", setup())
