"""`live --view browser`: the page's process, its events, and recordings that the page starts."""

import http.client
import json
import multiprocessing
import re
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

from harness.body import Kinematics, build_body
from harness.core import rotations
from harness.live.browser_view import BrowserOutput, _run_process
from harness.live.pose import SessionSetup
from harness.live.shared_memory import PoseRing
from harness.live.viewer import _run_viewer_process
from harness.stream.is900.codec import WireFormat
from harness.stream.recording import RecordingSwitch, read_recording
from harness.view import COMMAND_HEADER
from tests.live.posing import configuration, live_pose

pytestmark = pytest.mark.long
BODY = build_body()
ROOM = rotations.IDENTITY, np.array([0.0, 0.0, 2.5])
SETUP = SessionSetup(BODY.skeleton, ("head", "torso"), 90.0, ROOM, "a session")


@pytest.fixture
def switch() -> RecordingSwitch:
    switch = RecordingSwitch()
    switch.on_configured(WireFormat(("head", "torso"), 40.0))
    return switch


@pytest.fixture
def shown(tmp_path: Path, switch: RecordingSwitch) -> Iterator[BrowserOutput]:
    output = BrowserOutput(SETUP, switch, tmp_path)
    try:
        yield output
    finally:
        output.close()


def connect(output: BrowserOutput) -> http.client.HTTPConnection:
    return http.client.HTTPConnection("127.0.0.1", urlsplit(output.url).port or 0, timeout=20)


def newest(output: BrowserOutput, kind: str) -> dict[str, Any]:
    """The first event of a kind that the page gets."""
    connection = connect(output)
    while True:
        connection.request("GET", "/events")
        found: dict[str, Any] = dict(json.loads(connection.getresponse().read())["messages"])
        if kind in found:
            connection.close()
            content: dict[str, Any] = found[kind]
            return content


def record(output: BrowserOutput, on: bool) -> tuple[int, str]:
    connection = connect(output)
    connection.request("GET", "/")
    token = re.search(r'data-token="([^"]+)"', connection.getresponse().read().decode())
    assert token is not None
    connection.request("POST", "/command/record", json.dumps({"on": on}), {COMMAND_HEADER: token[1]})
    answer = connection.getresponse()
    status, text = answer.status, answer.read().decode()
    connection.close()
    return status, text


def test_the_page_gets_the_newest_pose(shown: BrowserOutput, rng: np.random.Generator) -> None:
    kinematics, qpos = Kinematics(BODY), configuration(rng)
    for number in range(200):
        pose = live_pose(qpos, number, time.monotonic(), kinematics)
        shown.send(pose)
    time.sleep(0.5)
    frame = newest(shown, "frame")
    assert frame["number"] == 199
    joints_m = np.reshape(frame["joints_mm"], (25, 3)) / 1e3
    np.testing.assert_allclose(joints_m, pose.joints_m, atol=6e-4)
    assert frame["stations"] == [{"quality": 1.0, "state": 0, "pose": [0, 0, 2500, 1000, 0, 0, 0]}] * 2


def test_a_line_that_falls_silent_is_reported_within_a_second(shown: BrowserOutput, rng: np.random.Generator) -> None:
    shown.send(live_pose(configuration(rng), 0, time.monotonic()))
    began = time.monotonic()
    while not (status := newest(shown, "status"))["silent"]:
        time.sleep(0.05)
    assert status["lost"] == [True, True]
    assert time.monotonic() - began < 1.5


def test_the_page_starts_and_stops_a_recording(shown: BrowserOutput, switch: RecordingSwitch, tmp_path: Path) -> None:
    status, text = record(shown, True)
    path = Path(json.loads(text)["recording"])
    assert (status, path.parent) == (200, tmp_path)
    assert switch.path == path
    assert record(shown, True)[0] == 422
    status, text = record(shown, False)
    assert (status, json.loads(text)["saved"]) == (200, str(path))
    assert read_recording(path).formats[0].stations == ("head", "torso")
    status, text = record(shown, False)
    assert (status, text) == (422, "No recording runs. Start one first.\n")


def test_a_session_whose_page_has_ended_is_told(shown: BrowserOutput, rng: np.random.Generator) -> None:
    shown._process.kill()
    shown._thread.join(10)
    with pytest.raises(OSError, match="its process ended"):
        shown.send(live_pose(configuration(rng)))


def test_closing_ends_the_page_and_the_recording(shown: BrowserOutput, switch: RecordingSwitch, tmp_path: Path) -> None:
    record(shown, True)
    began = time.monotonic()
    shown.close()
    assert time.monotonic() - began < 5.0
    assert switch.path is None
    assert shown._process.exit_code == 0  # it noticed the end of its pipe, and was not killed
    with pytest.raises(OSError, match="refused"):
        connect(shown).connect()


def test_the_folder_of_recordings_is_made(tmp_path: Path, switch: RecordingSwitch) -> None:
    BrowserOutput(SETUP, switch, tmp_path / "new" / "folder").close()
    assert (tmp_path / "new" / "folder").is_dir()


@pytest.mark.parametrize("unread", [False, True])
def test_the_page_of_a_killed_session_ends_without_a_word(unread: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A killed session leaves a pipe that is broken, or one that is reset because it had not read its end."""
    monkeypatch.setattr("os.nice", lambda _: 0)
    context = multiprocessing.get_context("spawn")
    session, pipe = context.Pipe()
    ring = PoseRing(context, 2)
    ended = Thread(target=_run_process, kwargs={"setup": SETUP, "ring": ring, "pipe": pipe}, daemon=True)
    if unread:
        ended.start()
        assert session.poll(20.0)  # the address, which the session never reads
        session.close()
    else:
        session.close()
        ended.start()
    ended.join(20.0)
    assert not ended.is_alive()


@pytest.mark.parametrize("module", ["harness.live.browser_view", "harness.live.viewer"])
def test_a_viewer_that_fails_after_its_session_was_killed_is_silent(
    module: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its report through the pipe raised BrokenPipeError, whose traceback was printed."""
    monkeypatch.setattr("os.nice", lambda _: 0)
    monkeypatch.setenv("LP_NUM_THREADS", "1")  # the viewer sets it
    session, pipe = multiprocessing.Pipe()
    session.close()

    def fail(*_: object) -> None:
        raise OSError("no screen")

    if module.endswith("browser_view"):
        monkeypatch.setattr("harness.live.browser_process.run_browser", fail)
        _run_process(setup=None, ring=None, pipe=pipe)  # type: ignore[arg-type]  # `fail` takes anything
    else:
        pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")
        monkeypatch.setattr("harness.live.viewer_process.run_viewer", fail)
        _run_viewer_process(config=None, shared=None, pipe=pipe)  # type: ignore[arg-type]  # as above
