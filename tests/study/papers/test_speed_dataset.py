"""Databases have exactly the frames that were asked for, and no held-out take; a library gives what it has."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.experiment import benchmark_clips
from harness.mocap import synthetic
from harness.reconstruct.database import MotionDatabase
from harness.results import manifest
from harness.study.papers import speed_dataset
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.speed_dataset import build_speed_dataset, list_test_clips, missing_clips, truncate_motions
from tests.mocap.sample_files import clip, write_clip

WORN = benchmark_clips.load_clean_scenario()


@pytest.fixture
def library(tmp_path: Path) -> PaperStudy:
    """Three walks of 3 s and more, two of them judged, and one swing of golf."""
    folder = tmp_path / "library"
    rows = ["path,subject,trial,behaviour,frames,fps"]
    for name, behaviour, frames in (
        ("91_01", "walking", 360),
        ("91_02", "walking", 480),
        ("92_01", "walking", 420),
        ("93_01", "golf", 360),
    ):
        motion = clip(frames, name=name)
        rng, time_s = generator(1, name), np.arange(frames)[:, None] / 120.0  # another motion in each clip
        rate_hz, phase_rad = rng.uniform(0.5, 2.0, (2, motion.angles_rad.shape[1]))
        write_clip(folder, replace(motion, angles_rad=0.2 * np.sin(2.0 * np.pi * rate_hz * time_s + phase_rad)))
        rows.append(f"{name[:2]}/{name}.amc,{name[:2]},{name[3:]},{behaviour},{frames},120")
    (folder / "manifest.csv").write_text("\n".join(rows) + "\n")
    motion_of = replace(WORN.motion, test=("91_01", "91_02@0.2-0.6"), behaviours=("walking",), examples=())
    golf = replace(WORN.motion, test=("93_01",), behaviours=("golf",), examples=())
    runs = {"walks": replace(WORN, motion=motion_of), "swings": replace(WORN, motion=golf)}
    (tmp_path / "study").mkdir()
    return PaperStudy(tmp_path / "study", "cmu", 1, runs, library=folder)


def test_built_in_frames_are_counted_by_behaviour(tmp_path: Path) -> None:
    study, frames = PaperStudy(tmp_path, "builtin", 1, {}), {"golf": 850, "boxing": 40}
    assert missing_clips(study, frames) == ""
    database, clips = build_speed_dataset(study, frames, WORN, tmp_path / "databases")
    counted = {b: sum(len(run) for run in database.segments if run.behaviour == b) for b in synthetic.BEHAVIOURS}
    assert {behaviour: count for behaviour, count in counted.items() if count} == frames
    assert len(clips) == 2
    assert not {trial.take for trial in clips} & {run.take for run in database.segments}
    assert len(clips[0].simulation.frames) == pytest.approx(speed_dataset.MAX_TEST_S * benchmark_clips.RATE_HZ, abs=2)


def test_a_database_is_built_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = speed_dataset.build_database(tmp_path, {"seed": 1}, lambda: benchmark_clips.make_take_factories(50, 1))
    asked: list[str] = []

    def takes() -> list[BodyMotion]:
        asked.append("again")
        return [benchmark_clips.generate_take(0, 1, frames=60)]

    again = speed_dataset.build_database(tmp_path, {"seed": 1}, takes)
    np.testing.assert_array_equal(first.posture, again.posture)
    assert not asked
    assert len(speed_dataset.build_database(tmp_path, {"seed": 2}, takes)) == 60
    monkeypatch.setattr(manifest, "source_hash", lambda: "edited")
    assert len(speed_dataset.build_database(tmp_path, {"seed": 1}, takes)) == 60
    assert asked == ["again", "again"]


@pytest.mark.parametrize(("count", "lengths"), [(0, []), (5, [5]), (10, [10]), (15, [10, 5]), (99, [10, 20])])
def test_as_many_frames_as_there_are(count: int, lengths: list[int]) -> None:
    takes = [benchmark_clips.generate_take(which, 1, frames=frames) for which, frames in enumerate((10, 20))]
    assert [len(take) for take in truncate_motions(takes, count)] == lengths


def test_a_library_gives_what_it_has_and_keeps_the_longest_judged_clip(library: PaperStudy) -> None:
    assert list_test_clips(library) == {"walking": {"91_01", "91_02"}, "golf": {"93_01"}}
    database, clips = build_speed_dataset(library, {"walking": 10_000}, WORN, library.out / "databases")
    assert [trial.take for trial in clips] == ["91_02"]
    assert {run.take for run in database.segments} == {"91_01", "92_01"}
    assert len(database) == pytest.approx((360 + 420) / 3, abs=4)
    assert len(build_speed_dataset(library, {"walking": 70}, WORN, library.out / "databases")[0]) == 70
    assert len(list((library.out / "databases").iterdir())) == 2


def test_what_a_library_lacks_is_named(library: PaperStudy) -> None:
    assert missing_clips(library, {"walking": 5}) == ""
    assert "golf" in missing_clips(library, {"golf": 5})
    assert "table_tennis" in missing_clips(library, {"table_tennis": 5})
    together = {"walking": 5, "golf": 5, "table_tennis": 5_000}
    assert missing_clips(library, together) == ""
    database, clips = build_speed_dataset(library, together, WORN, library.out / "databases")
    assert {trial.take for trial in clips} == {"91_02", "93_01"}
    assert {run.take for run in database.segments} == {"91_01", "92_01"}
    assert isinstance(database, MotionDatabase)
