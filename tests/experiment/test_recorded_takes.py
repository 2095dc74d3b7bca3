"""Recordings scored against the motion that they were played from."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from harness.commands.replay import format_score_table
from harness.core.estimate import Status
from harness.errors import BadInput, UnknownName
from harness.experiment.evaluation import Evaluation, check_methods, evaluate_each
from harness.experiment.observed_take import ObservedTake, simulated_take
from harness.experiment.playback import Playback, prepare_playback
from harness.experiment.recorded_takes import find_playback, frame_numbers, recorded_take
from harness.experiment.scenarios.scenario_reader import find_scenario
from harness.stream.is900 import Device
from harness.stream.polhemus.codec import (
    BINARY,
    CENTIMETRES,
    STANDARD_LIST,
    STOP,
    STREAM,
    ZERO_CLOCK,
    WireFormat,
    station_command,
)
from harness.stream.recording import RecordingStream, RecordingWriter, record_capture
from tests.stream.wire import frames_equal

CLIP, METHODS = "boxing_p1_01", ("ik:previous", "best_match")
NOTE = {"scenario": "demo", "clip": CLIP, "rate_hz": 40.0}


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    """The demo, with fewer examples to learn from."""
    text = find_scenario("demo").read_text(encoding="utf-8")
    fewer = re.sub(r"examples = \[[^]]*\]", 'examples = ["boxing_p1_02", "boxing_p2_01"]', text)
    assert fewer != text
    path = tmp_path_factory.mktemp("scenario") / "small.toml"
    path.write_text(fewer, encoding="utf-8")
    return prepare_playback(path, clip=CLIP, stations=4)


@pytest.fixture(scope="module")
def simulated(played: Playback, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("simulated") / "a.rec"
    record_capture(path, played.simulation.wire_format, played.simulation.wire, NOTE)
    return path


def emulated(
    played: Playback,
    path: Path,
    turns_s: Sequence[float],
    names: Sequence[str] = (),
    items: tuple[int, ...] = STANDARD_LIST,
) -> Path:
    """What a device says that is set up anew before each of these stretches of time, looked at every 10 ms."""
    wire = WireFormat(tuple(names) or played.samples.stations, played.tracker.rate_hz, items)
    device, now_s = Device(played.samples), 0.0
    with RecordingWriter(path) as writer:
        for turn_s in turns_s:
            device.receive(STOP, now_s)
            for station in wire.characters.decode():
                device.receive(station_command("O", station, wire.items), now_s)
            device.receive(BINARY + CENTIMETRES + ZERO_CLOCK, now_s)
            device.advance(now_s)
            writer.on_configured(wire, now_s, now_s)
            device.receive(STREAM, now_s)
            for at_s in (now_s + 0.01 * np.arange(1, round(100.0 * turn_s))).tolist():
                if data := device.advance(at_s):
                    writer.on_received(data, at_s, at_s)
            now_s += turn_s + 1.0
    return path


def score_methods(stream: RecordingStream, playback: Playback, methods: Sequence[str]) -> list[Evaluation]:
    return evaluate_each(methods, recorded_take(stream, playback))


def recorded(path: Path, playback: Playback) -> ObservedTake:
    return recorded_take(RecordingStream(path), playback)


def errors(judged: Sequence[Evaluation]) -> list[dict[str, float | None]]:
    """All that was measured but how long it took."""
    timed = ("step_", "fps")
    return [{n: v for n, v in one.metrics.items() if not n.startswith(timed)} for one in judged]


@pytest.mark.parametrize("rate_hz", [40.0, 100.0])
def test_a_recorded_simulation_has_its_frames_bit_by_bit(rate_hz: float, tmp_path: Path) -> None:
    """Times of reception as well, and where the line is too slow, so that records are late and lost."""
    simulation = prepare_playback("demo", clip=CLIP, stations=4, rate_hz=rate_hz).simulation
    assert bool(simulation.health["records_dropped"]) == (rate_hz == 100.0)
    record_capture(tmp_path / "a.rec", simulation.wire_format, simulation.wire, {})
    frames = list(RecordingStream(tmp_path / "a.rec"))
    assert len(frames) == len(simulation.frames)
    assert all(frames_equal(one, other) for one, other in zip(frames, simulation.frames, strict=True))


def test_a_recording_scores_as_the_simulation_does(played: Playback, simulated: Path) -> None:
    cells = simulated_take(played.clip_evaluation, "pos+ori")
    for one, whole in zip(
        *(evaluate_each(METHODS, take) for take in (recorded(simulated, played), cells)), strict=True
    ):
        assert not (one.answers.status == Status.LOST).all()
        np.testing.assert_array_equal(one.answers.qpos, whole.answers.qpos)
        assert errors([one]) == errors([whole])
        assert one.scores.matched == one.scores.expected == whole.scores.expected
        assert one.metrics["mpjpe_mm"] is not None


def test_each_recorded_frame_has_the_truth_of_its_own_row(played: Playback, simulated: Path) -> None:
    take = recorded(simulated, played)
    np.testing.assert_array_equal(take.truth_row, np.arange(len(played.simulation.frames)))
    np.testing.assert_array_equal(take.truth_qpos, played.simulation.truth_qpos)
    for one in evaluate_each(METHODS, take):
        assert one.answers.qpos.shape == (len(take.frames), 55)
        assert set(one.answers.status.tolist()) <= set(map(int, Status))


def test_frames_on_the_way_back_have_no_truth(played: Playback, tmp_path: Path) -> None:
    loop_s = played.samples.device_loop_s
    take = recorded(emulated(played, tmp_path / "b.rec", [1.2 * loop_s]), played)
    assert (take.truth_row == -1).any()
    assert take.truth_row.max() < len(take.truth_qpos)


def test_scores_at_1x_and_max_are_equal(played: Playback, tmp_path: Path) -> None:
    path, simulation = tmp_path / "a.rec", played.simulation
    record_capture(path, simulation.wire_format, simulation.wire, NOTE, seconds=2.5)
    at_once, in_time = (score_methods(RecordingStream(path, speed), played, METHODS) for speed in ("max", 1.0))
    assert errors(at_once) == errors(in_time)
    assert [one.scores.matched for one in at_once] == [one.scores.matched for one in in_time] == [60, 60]
    assert all(value is not None for value in errors(at_once)[0].values())


def test_later_laps_fold_back_and_the_way_back_is_not_judged(played: Playback, tmp_path: Path) -> None:
    samples = played.samples
    path = emulated(played, tmp_path / "a.rec", [2.2 * samples.loop_s])
    (judged,) = score_methods(RecordingStream(path), played, ["best_match"])
    warm_up, rest = round(played.tracker.rate_hz), round(0.2 * len(samples))
    assert judged.scores.expected == pytest.approx(2 * samples.take_frames - warm_up + rest, abs=2)
    assert judged.scores.matched == judged.scores.expected
    (once,) = score_methods(
        RecordingStream(emulated(played, tmp_path / "b.rec", [samples.loop_s])), played, ["best_match"]
    )
    assert judged.metrics["mpjpe_mm"] == pytest.approx(once.metrics["mpjpe_mm"], rel=0.1)


def test_a_device_that_was_set_up_anew_plays_from_the_beginning(played: Playback, tmp_path: Path) -> None:
    path = emulated(played, tmp_path / "a.rec", [3.0, 2.0])
    (judged,) = score_methods(RecordingStream(path), played, ["best_match"])
    assert judged.scores.matched == judged.scores.expected == pytest.approx(40 * (3 - 1 + 2), abs=4)
    (once,) = score_methods(RecordingStream(emulated(played, tmp_path / "b.rec", [3.0])), played, ["best_match"])
    assert judged.metrics["mpjpe_mm"] == pytest.approx(once.metrics["mpjpe_mm"], rel=0.3)


def test_a_device_whose_stations_had_no_names_wore_the_first_of_the_scenarios(played: Playback, tmp_path: Path) -> None:
    stream = RecordingStream(emulated(played, tmp_path / "a.rec", [3.0], names="1234"))
    rehearsal = find_playback(stream, scenario="demo", clip=CLIP)
    assert rehearsal.samples.stations == played.samples.stations
    named = emulated(played, tmp_path / "b.rec", [3.0])
    told = [score_methods(s, rehearsal, ["ik:previous"]) for s in (stream, RecordingStream(named))]
    assert errors(told[0]) == errors(told[1])


def test_too_little_is_not_measured(played: Playback, tmp_path: Path) -> None:
    """All of it is warm-up."""
    path, simulation = tmp_path / "a.rec", played.simulation
    record_capture(path, simulation.wire_format, simulation.wire, NOTE, seconds=0.5)
    (judged,) = score_methods(RecordingStream(path), played, ["ik:previous"])
    assert (judged.scores.matched, judged.scores.expected) == (0, 0)
    assert set(judged.metrics.values()) == {None}
    assert "not measured" in format_score_table([judged])


@pytest.mark.parametrize("other", [{"clip": "walking_p1_01"}, {"seed": 2, "noise": "default"}])
def test_another_motion_is_refused(other: dict[str, str], simulated: Path) -> None:
    stream = RecordingStream(simulated)
    with pytest.raises(BadInput, match=r"of another motion: .* frames belong to this one"):
        score_methods(stream, find_playback(stream, scenario="demo", **other), ["ik:previous"])  # type: ignore[arg-type]


def test_records_without_time_stamps_are_found_by_their_positions(played: Playback, tmp_path: Path) -> None:
    """As those of a FASTRAK, through more than a loop."""
    seconds = [played.samples.loop_s + 3.0]
    stamped = RecordingStream(emulated(played, tmp_path / "a.rec", seconds, items=(40, 2, 11, 21, 1)))
    bare = RecordingStream(emulated(played, tmp_path / "b.rec", seconds, items=(40, 2, 11, 1)))
    known, found = recorded_take(stamped, played), recorded_take(bare, played)
    assert len(found.loops) == len(known.loops) == 2
    for one, other in zip(found.loops, known.loops, strict=True):
        rows, here, there = np.intersect1d(one.rows, other.rows, return_indices=True)
        assert len(rows) > 0.98 * len(other.rows)
        off = (one.index[here] - other.index[there]).tolist()
        assert set(off) <= {-1, 0, 1}
        assert off.count(0) > 0.9 * len(off)
    assert found.has_records


def test_another_motion_without_time_stamps_is_refused(played: Playback, tmp_path: Path) -> None:
    stream = RecordingStream(emulated(played, tmp_path / "a.rec", [2.0], items=(40, 2, 11, 1)))
    other = find_playback(stream, scenario="demo", clip="walking_p1_01")
    with pytest.raises(BadInput, match="of another motion"):
        score_methods(stream, other, ["ik:previous"])
    lost = RecordingStream(emulated(played, tmp_path / "b.rec", [1.0], items=(40, 11, 1)))
    with pytest.raises(BadInput, match="of another motion"):
        score_methods(lost, played, ["ik:previous"])


def test_names_that_do_not_exist_are_refused(played: Playback, simulated: Path, tmp_path: Path) -> None:
    stream = RecordingStream(simulated)
    with pytest.raises(UnknownName, match="no method called 'il'"):
        check_methods(["ik", "il"])
    with pytest.raises(UnknownName, match="no method called 'il'"):
        score_methods(stream, played, ["il"])
    with pytest.raises(UnknownName, match="no scenario called 'dem'"):
        find_playback(stream, scenario="dem")
    bare = tmp_path / "a.rec"
    record_capture(bare, played.simulation.wire_format, played.simulation.wire, {})
    with pytest.raises(BadInput, match=r"Nothing says what .*a\.rec was played from"):
        find_playback(RecordingStream(bare))


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.5, 0.7])
def test_frames_of_a_capture_are_numbered_whatever_their_phase(shift: float, rng: np.random.Generator) -> None:
    """One frame is lost, and each stamp is off by up to a fifth of the period."""
    expected = np.delete(np.arange(400), 7)
    number, begin_s = frame_numbers((expected + shift + rng.uniform(-0.2, 0.2, 399)) / 40.0, 40.0)
    np.testing.assert_array_equal(number - number[0], expected)
    assert begin_s + number[0] / 40.0 == pytest.approx(shift / 40.0, abs=0.1 / 40.0)
