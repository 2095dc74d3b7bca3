"""`harness validate` and `harness characterize` of poses of other programs, as a user meets them."""

import re
from pathlib import Path

import numpy as np
import pytest

from harness.core import rotations
from harness.core.seeds import generator
from harness.errors import Outcome
from tests.bench.foreign.test_foreign import write_pair
from tests.command import Command
from tests.measure.foreign_streams import Source, foreign_pair, resting_times


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    source = Source(gap_s=((12.0, 18.0), (40.0, 46.0)), capture_inverted=True, truth_inverted=True)
    files = write_pair(tmp_path_factory.mktemp("pair"), *foreign_pair(generator(4, "pair"), source))
    return files.capture, files.truth


def test_two_files_of_one_body_are_validated(pair: tuple[Path, Path], tmp_path: Path, command: Command) -> None:
    capture, truth = pair
    refused = command("validate", capture, "--truth", truth, code=Outcome.NOT_COMPARABLE.exit_code)
    assert "--least-matched" in refused.err
    words = ("validate", capture, "--truth", truth, "--least-matched", "0.6", "--out", tmp_path / "unit.toml")
    said = command(*words)
    for text in (
        "scale error",
        "Times of a file of poses count from",
        "Poses of both are body-from-world and were inverted",
        "% of the variance",
        "unevenly",
    ):
        assert text in said.out
    found = command("validate", capture, "--truth", truth, "--least-matched", "0.6", "--json").content
    (late_ms,) = re.findall(r"Unix times the capture is ([\d,.]+) ms late", said.out.replace("\n  ", " "))
    assert float(late_ms.replace(",", "")) == pytest.approx(3700.0, abs=10.0)
    assert found["numbers"]["scale"]["low"] < -0.06 < found["numbers"]["scale"]["high"]
    assert 0.7 < found["matched_share"] < 0.85
    assert min(found["explained"]["phone"].values()) > 0.98
    assert "unit.toml" in said.out


def test_options_of_the_reference_override_its_evidence(
    pair: tuple[Path, Path], tmp_path: Path, command: Command
) -> None:
    """The reference without its header, in inches."""
    rows = np.loadtxt(pair[1], delimiter=",", skiprows=1)
    rows[:, 1:4] /= 0.0254
    np.savetxt(tmp_path / "bare.txt", rows, fmt="%.9f")
    known = "--truth-columns", "time,x,y,z,qx,qy,qz,qw", "--truth-unit", "in", "--least-matched", "0.6", "--json"
    said = [
        command("validate", pair[0], "--truth", truth, *words).content["numbers"]["scale"]["value"]
        for truth, words in ((pair[1], known[4:]), (tmp_path / "bare.txt", known))
    ]
    assert said[0] == pytest.approx(said[1], abs=1e-6)
    refused = command("validate", pair[0], "--truth", tmp_path / "bare.txt", "--least-matched", "0.6", code=2).err
    assert "Assumed without evidence: length unit of bare.txt: " in refused
    assert "(--truth-unit)" in refused
    assert "--truth-up 'w'" in command("validate", pair[0], "--truth", pair[1], "--truth-up", "w", code=2).err
    np.savetxt(tmp_path / "untimed.txt", rows[:, 1:], fmt="%.9f")
    assert "--truth-rate HZ" in command("validate", pair[0], "--truth", tmp_path / "untimed.txt", code=2).err


def test_noise_of_the_reference_widens_the_intervals(pair: tuple[Path, Path], command: Command) -> None:
    words = ("validate", pair[0], "--truth", pair[1], "--least-matched", "0.6", "--json")
    plain, known = command(*words).content, command(*words, "--truth-noise", "2,0.4").content
    widths = [
        found["numbers"]["time_offset_position_s"]["high"] - found["numbers"]["time_offset_position_s"]["low"]
        for found in (plain, known)
    ]
    assert widths[0] < widths[1]
    assert "no pair of numbers" in command(*words, "--truth-noise", "2", code=2).err


def test_stations_that_are_not_there_and_flags_of_others_are_refused(pair: tuple[Path, Path], command: Command) -> None:
    assert "It has phone" in command("validate", pair[0], "--truth", pair[1], "--stations", "head", code=2).err
    assert "--minutes" in command("characterize", pair[0], "--minutes", "3", code=2).err
    assert "--rigid" in command("characterize", pair[0], "--length", "300,0.1", code=2).err
    assert "without --surveyed" in command("characterize", pair[0], "--surveyed-noise", "1", code=2).err


def test_another_offset_of_a_motion_that_repeats_is_named(tmp_path: Path, command: Command) -> None:
    """Two cycles of 30 s, whose halves turn alike; the reference is 0.51 s ahead."""
    rng, files = generator(5, "cycles"), (tmp_path / "a.csv", tmp_path / "b.csv")
    for file, ahead_s, rate_hz in ((files[0], 0.0, 60.0), (files[1], 0.51, 50.0)):
        time_s = np.arange(60.0 * rate_hz) / rate_hz
        phase = 2.0 * np.pi / 30.0 * (time_s + ahead_s)
        waves = [[np.sin(k * phase + 1.7 * k * k + i) for i in range(3)] for k in (1, 3, 7)]
        turn = np.moveaxis(np.sum(waves, axis=0), 0, -1)
        place = np.stack([np.sin(3.0 * phase + i) + 0.4 * np.sin(11.0 * phase + 2.0 * i) for i in range(3)], axis=-1)
        place = 0.5 * place + 0.001 * rng.normal(size=place.shape)
        quaternion = rotations.multiply(rotations.exp(0.4 * turn), rotations.exp(0.001 * rng.normal(size=turn.shape)))
        rows = np.column_stack([time_s, place, np.roll(quaternion, -1, axis=1)])
        np.savetxt(file, rows, delimiter=",", header="time,x,y,z,qx,qy,qz,qw", comments="")
    out = " ".join(command("validate", files[0], "--truth", files[1]).out.split())
    assert re.search(r"The motion repeats: a time offset of ((15|30|45)\.51|−(14|29|44)\.49) s fits", out)


def test_rests_on_surveyed_points(tmp_path: Path, command: Command) -> None:
    rng = generator(3, "survey")
    points_m = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.8]])
    np.savetxt(tmp_path / "points.txt", points_m, header="x y z")
    time_s = resting_times(rng, 60.0)
    leg, along = np.divmod(time_s / 12.0, 1.0)
    first = np.minimum(leg.astype(int), 4)
    moved = np.clip((along - 0.75) / 0.25, 0.0, 1.0)[:, None]
    place = points_m[first] + moved * (points_m[np.minimum(first + 1, 4)] - points_m[first])
    place = place + np.array([1.0, 2.0, 0.5]) + 0.0004 * rng.normal(size=place.shape)
    turn = np.roll(rotations.exp(0.001 * rng.normal(size=place.shape)), -1, axis=1)
    np.savetxt(tmp_path / "probe.csv", np.column_stack([time_s, place, turn]), delimiter=",", fmt="%.6f")
    words = ("characterize", tmp_path / "probe.csv", "--surveyed", tmp_path / "points.txt", "--surveyed-noise", "0.2")
    said = command(*words)
    assert "point 5" in said.out
    assert "surveyed points (type B)" in said.out
    assert "expanded uncertainty" in said.out
    (tmp_path / "points.txt").write_text("0 0 0\n1 0\n")
    assert (
        "line 2" in command("characterize", tmp_path / "probe.csv", "--surveyed", tmp_path / "points.txt", code=2).err
    )


@pytest.mark.parametrize(("name", "share"), [("falcon_5/odometry", 0.6), ("prime_sense_1/camera", 0.6)])
def test_real_pairs_are_validated(name: str, share: float, real: Path, command: Command) -> None:
    capture = real / "hand_eye" / f"{name}.csv"
    found = command(
        "validate", capture, "--truth", capture.with_name("vicon.csv"), "--least-matched", share, "--json"
    ).content
    offset_ms = 1e3 * found["numbers"]["time_offset_orientation_s"]["value"]
    assert offset_ms == pytest.approx({"falcon_5": -277.0, "prime_sense_1": -1382.6}[name.split("/")[0]], abs=2.0)
