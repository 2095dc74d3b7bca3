"""`live --view browser`: the page's process, its events, and recordings that the page starts."""

import http.client
import json
import multiprocessing
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from itertools import cycle
from pathlib import Path
from threading import Thread
from types import MappingProxyType
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

import numpy as np
import pytest

from harness.body import Kinematics, build_body, tpose
from harness.calibrate import read_calibration
from harness.core import rotations
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import BodyMotion
from harness.experiment import CalibrationSession, prepare_playback
from harness.live.browser_view import BrowserOutput, _run_process
from harness.live.pose import SessionSetup
from harness.live.session import LiveOptions, run_session
from harness.live.session_control import SessionControl
from harness.live.shared_memory import PoseRing
from harness.live.stated_uncertainty import bone_reach_m, describe_uncertainty
from harness.live.viewer import _run_viewer_process
from harness.simulate import simulate_tracker
from harness.stream import TrackerFrame
from harness.stream.polhemus.codec import WireFormat
from harness.stream.recording import RecordingSwitch, read_recording
from harness.view import COMMAND_HEADER
from tests.live.posing import configuration, live_pose
from tests.live.streams import Paced

pytestmark = pytest.mark.long
BODY = build_body()
ROOM = np.array([0.0, 0.0, 2.5]), rotations.IDENTITY
SETUP = SessionSetup(BODY.skeleton, ("head", "torso"), 90.0, "a session")


@pytest.fixture
def switch() -> RecordingSwitch:
    switch = RecordingSwitch()
    switch.on_configured(WireFormat(("head", "torso"), 40.0))
    return switch


@pytest.fixture
def shown(tmp_path: Path, switch: RecordingSwitch) -> Iterator[BrowserOutput]:
    output = BrowserOutput(SETUP, SessionControl(switch), tmp_path)
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


def command(output: BrowserOutput, name: str, content: dict[str, Any], **headers: str) -> tuple[int, str]:
    """Status and text of the answer to a command with the token of the address, unless `headers` have another."""
    headers = {COMMAND_HEADER: urlsplit(output.url).fragment} | {
        key.replace("_", "-"): text for key, text in headers.items()
    }
    connection = connect(output)
    connection.request("POST", f"/command/{name}", json.dumps(content), headers)
    answer = connection.getresponse()
    status, text = answer.status, answer.read().decode()
    connection.close()
    return status, text


def ask(
    output: BrowserOutput, method: str, path: str, headers: Mapping[str, str] = MappingProxyType({})
) -> tuple[int, str]:
    """Status of the answer to a request without a body, and its headers and text."""
    with closing(connect(output)) as connection:
        connection.request(method, path, headers=headers)
        answer = connection.getresponse()
        return answer.status, f"{answer.getheaders()} {answer.read().decode()}"


def record(output: BrowserOutput, on: bool) -> tuple[int, str]:
    return command(output, "record", {"on": on})


def wait_for_frame(shown: BrowserOutput, number: int) -> dict[str, Any]:
    """What the page receives once its newest frame is this one; a busy machine may need seconds."""
    until_s = time.monotonic() + 20.0
    while (frame := newest(shown, "frame"))["number"] != number:
        assert time.monotonic() < until_s, f"frame {frame['number']} instead of {number}"
        time.sleep(0.05)
    return frame


def test_the_page_gets_the_newest_pose(shown: BrowserOutput, rng: np.random.Generator) -> None:
    kinematics, qpos = Kinematics(BODY), configuration(rng)
    for number in range(200):
        pose = replace(live_pose(qpos, number, time.monotonic(), kinematics), room=ROOM)
        shown.send(pose)
    frame = wait_for_frame(shown, 199)
    joints_m = np.reshape(frame["joints_mm"], (25, 3)) / 1e3
    np.testing.assert_allclose(joints_m, pose.joints_m, atol=6e-4)
    assert frame["stations"] == [[0, 0, 2500, 1000, 0, 0, 0]] * 2
    shown.send(live_pose(qpos, 200, time.monotonic(), kinematics))
    assert wait_for_frame(shown, 200)["stations"] == [None, None], "where the room is not known"


def test_the_page_gets_the_stated_uncertainty(shown: BrowserOutput, rng: np.random.Generator) -> None:
    assert newest(shown, "status")["uncertainty"] == "", "before the first pose"
    pose = live_pose(configuration(rng), 0, time.monotonic())
    sigma_rad = rng.uniform(0.02, 0.1, 48)
    for number, stated in enumerate((None, sigma_rad)):
        estimate = replace(pose.estimate, angle_sigma_rad=stated)
        shown.send(replace(pose, number=number, estimate=estimate))
        reach_mm = wait_for_frame(shown, number)["reach_mm"]
        until_s, text = time.monotonic() + 20.0, describe_uncertainty(BODY.skeleton, stated)
        while (said := newest(shown, "status")["uncertainty"]) != text:
            assert time.monotonic() < until_s, said
            time.sleep(0.05)
        assert (reach_mm is None) == (stated is None)
    np.testing.assert_allclose(reach_mm, 1e3 * bone_reach_m(BODY.skeleton, sigma_rad), atol=0.5)


def test_a_line_that_falls_silent_is_reported_within_a_second(shown: BrowserOutput, rng: np.random.Generator) -> None:
    shown.send(live_pose(configuration(rng), 0, time.monotonic()))
    began = time.monotonic()
    while not (status := newest(shown, "status"))["why"].startswith("no data for"):
        time.sleep(0.05)
    assert (status["session"], status["stations"]) == ("LOST", ["LOST", "LOST"])
    assert time.monotonic() - began < 1.5


def test_the_page_starts_and_stops_a_recording(shown: BrowserOutput, switch: RecordingSwitch, tmp_path: Path) -> None:
    status, text = record(shown, True)
    path = tmp_path / json.loads(text)["recording"]
    assert (status, switch.path) == (200, path)
    assert record(shown, True)[0] == 422
    status, text = record(shown, False)
    assert (status, json.loads(text)["saved"]) == (200, str(path))
    assert read_recording(path).formats[0].stations == ("head", "torso")
    status, text = record(shown, False)
    assert (status, text) == (422, "No recording runs. Start one first.\n")


def test_the_page_learns_that_a_recording_has_failed(shown: BrowserOutput, switch: RecordingSwitch) -> None:
    record(shown, True)
    switch.on_configured(WireFormat(("head",), 40.0))  # a device that comes back with other stations
    until_s = time.monotonic() + 20.0
    while "Record other stations" not in newest(shown, "status").get("failure", ""):
        assert time.monotonic() < until_s
        time.sleep(0.05)
    assert newest(shown, "status")["recording"] == ""


@pytest.mark.parametrize("name", ["record", "heading", "calibrate"])
def test_others_can_look_and_not_command(
    shown: BrowserOutput, switch: RecordingSwitch, tmp_path: Path, name: str
) -> None:
    """Another user of the computer opens the page: nothing that they can read has the token."""
    host, token = urlsplit(shown.url).netloc, urlsplit(shown.url).fragment
    assert len(token) >= 32
    content = {"on": True, "kind": "tpose"}
    for path in ("/", "/live.js", "/viewer.css", "/body.json", "/events"):
        status, answer = ask(shown, "GET", path)
        assert status == 200
        assert token not in answer
    for method in ("GET", "HEAD", "PUT", "OPTIONS"):
        assert ask(shown, method, f"/command/{name}", {COMMAND_HEADER: token})[0] in (404, 501)
    for wrong in ("", "x", token[:-1], token + "x", token.swapcase()):
        assert command(shown, name, content, **{COMMAND_HEADER: wrong})[0] == 403
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1", f"https://{host}", f"http://{host}.evil"):
        assert command(shown, name, content, Origin=origin)[0] == 403
    for site in ("cross-site", "same-site", "none"):
        assert command(shown, name, content, Sec_Fetch_Site=site)[0] == 403
    assert command(shown, name, content, Host="evil.example")[0] == 403
    assert command(shown, name, {**content, "more": 70_000 * "x"})[0] == 413
    assert switch.path is None
    assert not list(tmp_path.iterdir())
    own = {"Origin": f"http://{host}", "Sec_Fetch_Site": "same-origin"}
    assert command(shown, "record", {"on": True}, **own)[0] == 200


def test_the_browser_gets_the_token_from_a_file_of_this_user(
    shown: BrowserOutput, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All users of a computer can read the command line of a browser."""
    opened: list[str] = []

    def open_browser(url: str) -> bool:
        opened.append(url)
        return True

    monkeypatch.setattr("webbrowser.open", open_browser)
    assert shown.open_browser()
    path = Path(url2pathname(urlsplit(opened[0]).path))
    assert urlsplit(shown.url).fragment not in opened[0]
    assert shown.url in path.read_text()
    assert os.name != "posix" or path.stat().st_mode & 0o077 == 0
    shown.close()
    assert not path.exists()


class Standing:
    """A method of a body in T-pose."""

    def begin(self, calibration: Calibration) -> "Standing":
        return self

    def step(self, frame: TrackerFrame) -> Estimate:
        return Estimate(tpose(BODY.skeleton), Status.SOLVED)


def test_a_calibration_from_the_page_is_used_and_saved(tmp_path: Path) -> None:
    """A performer stands in T-pose half a metre aside, and the session does not know where its tracker hangs."""
    worn = prepare_playback("demo", clip="boxing_p1_01", stations=4, noise="clean")
    names, skeleton = tuple(worn.scenario.stations), worn.body.skeleton
    upright = np.array(tpose(skeleton))
    upright[1] += 0.5
    take = BodyMotion("stand", "p1", "test", "", 40.0, np.tile(upright, (400, 1)))
    standing = simulate_tracker(
        worn.body, take, worn.scenario.nominal_mounts, worn.tracker, worn.scenario.noise_model, seed=1
    )
    calibrations = {"tpose": CalibrationSession("demo", names, "tpose", skeleton=skeleton)}
    control, states, numbers = SessionControl(), list[dict[str, Any]](), list[int]()
    output = BrowserOutput(SessionSetup(skeleton, names, 40.0, "a session", calibrations), control, tmp_path)
    stream = Paced(cycle(standing.frames), 0.025, stations=names)
    wrong = replace(worn.calibration, tracker_origin_m=np.array([3.0, 0.0, 2.0]))
    arguments = (stream, worn.body, Standing(), wrong, [output], LiveOptions(40.0))
    session = Thread(target=run_session, args=arguments, kwargs={"control": control})
    session.start()
    try:
        assert command(output, "calibrate", {"kind": "kneeling"}) == (
            422,
            "No calibration 'kneeling'. There are: tpose.\n",
        )
        assert command(output, "calibrate", {}) == (422, "No calibration runs. Start one first.\n")
        assert command(output, "calibrate", {"kind": "tpose"})[0] == 200
        assert command(output, "calibrate", {"kind": "tpose"}) == (422, "A calibration runs. Stop it first.\n")
        while not states or states[-1]["stage"] not in ("done", "failed"):
            states.append(newest(output, "calibration"))
            numbers.append(newest(output, "frame")["number"])
        time.sleep(1.0)  # the page gets the frames a moment later
        stations = newest(output, "frame")["stations"]
        assert command(output, "calibrate", {"kind": "tpose"})[0] == 200
        assert command(output, "calibrate", {})[0] == 200
        while newest(output, "calibration")["stage"] != "failed":
            time.sleep(0.05)
        assert newest(output, "calibration")["lines"] == ["stopped before the last pose"]
    finally:
        stream.close()
        session.join()
    done, posing = states[-1], [state for state in states if state["stage"] == "posing"]
    assert done["lines"][1].endswith("This session uses it from now on."), done
    assert posing[0]["number"] == posing[0]["poses"] == 1
    assert posing[0]["instruction"].startswith("Stand upright, arms straight out")
    assert len(posing[0]["wanted_mm"]) == 75
    shares = [state["still_share"] for state in posing]
    assert shares == sorted(shares)
    assert max(shares) > 0.5
    assert numbers[-1] > numbers[0] + 40, "frames go on meanwhile"
    (path,) = tmp_path.iterdir()
    kept = read_calibration(path).calibration
    assert kept.stations == names
    expected_m = worn.calibration.tracker_origin_m - [0.0, 0.5, 0.0]
    np.testing.assert_allclose(kept.tracker_origin_m, expected_m, atol=0.03)
    hand_m = np.array(stations[0][:3]) / 1e3
    simulated_m = rotations.rotate(kept.world_from_tracker, standing.frames[0].position_m[0]) + kept.tracker_origin_m
    np.testing.assert_allclose(hand_m, simulated_m, atol=0.01)


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
    BrowserOutput(SETUP, SessionControl(switch), tmp_path / "new" / "folder").close()
    assert (tmp_path / "new" / "folder").is_dir()


@pytest.mark.parametrize("unread", [False, True])
def test_the_page_of_a_killed_session_ends_without_a_word(unread: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A killed session leaves a pipe that is broken, or one that is reset because it had not read its end."""
    monkeypatch.setattr("os.nice", lambda _: 0)
    context = multiprocessing.get_context("spawn")
    session, pipe = context.Pipe()
    ring = PoseRing(context, 2)
    ended = Thread(target=_run_process, kwargs={"setup": SETUP, "ring": ring, "folder": ".", "pipe": pipe}, daemon=True)
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
        _run_process(setup=None, ring=None, folder=".", pipe=pipe)  # type: ignore[arg-type]  # `fail` takes anything
    else:
        pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")
        monkeypatch.setattr("harness.live.viewer_process.run_viewer", fail)
        _run_viewer_process(config=None, shared=None, pipe=pipe)  # type: ignore[arg-type]  # as above
