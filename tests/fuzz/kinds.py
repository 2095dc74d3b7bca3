"""The kinds of files that the program reads: how to make a sound one, what changes it, and what reads it."""

import io
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.body import build_body
from harness.calibrate import CalibrationFile, read_calibration, write_calibration
from harness.commands.status import _status_lines
from harness.compare import compare_runs, write_baseline
from harness.core.calibration import Calibration
from harness.core.files import content_key, to_json_types, write_text
from harness.core.humanoid24 import standard_skeleton
from harness.core.options import expand_alternatives, split_outside_brackets
from harness.core.package_data import data_folder
from harness.experiment import cell_names, find_playback, prepare_playback, read_status
from harness.experiment.scenarios import Scenario, expand_clips, expand_sweep, find_scenario, load_scenario, load_sweep
from harness.mocap import MotionLibrary, inspect_file, read_c3d
from harness.reconstruct import MotionDatabase, make_method, without_options
from harness.report.comparison.page import comparison_text
from harness.report.kit import render_html
from harness.report.paper.page import paper_page, paper_text
from harness.report.placement.page import placement_page, placement_text
from harness.report.run.data import read_run
from harness.report.run.page import write_run_page
from harness.report.run.text import run_table
from harness.report.sweep.data import read_sweep
from harness.report.sweep.page import sweep_text, write_sweep_page
from harness.results import INDEX_FILE, load_run, read_summary
from harness.results.findings import read_findings, read_placement
from harness.simulate.physics import read_mcf
from harness.stream import LineEvent, PoseFileOptions, StreamSummary, format_csv_row, frame_rows, measure_sampling
from harness.stream.polhemus import DEFAULT_EMITTERS
from harness.stream.recording import (
    PoseLogStream,
    RecordingStream,
    RecordingWriter,
    open_poses,
    record_capture,
    write_pose_recording,
)
from harness.study.placement.config import base_scenario, load_placement_study
from harness.study.placement.placement_study import run_placement
from tests.fuzz.changes import BYTES, JSON, TEXT, TOML, Change
from tests.fuzz.containers import DATABASE, NPZ, RECORDING
from tests.fuzz.mending import mend_baseline, mend_calibration, mend_findings, mend_index, mend_run
from tests.mocap.c3d_bytes import c3d_bytes
from tests.mocap.sample_files import amass_arrays, amc_text, asf_text, bvh_text, clip, mvnx_text
from tests.mocap.test_fuzz import _c3d
from tests.planted import MeansPlan, Plan, planted_run, planted_sweep
from tests.reconstruct.database.test_motion_database import make_take
from tests.report.paper import findings as paper_findings
from tests.stream.poses import pose_files

OPTIONS = "dynamic_map[neighbours=40|60]+ik, local_pca[neighbours=100], kernel_cca[jump_m=0.5,outputs=angles]+ik"


@dataclass(frozen=True)
class Kind:
    """One kind of file."""

    name: str
    make: Callable[[Path], object]
    """Writes sound files into an empty folder."""
    targets: tuple[str, ...]
    """Patterns of the files that are changed."""
    changes: tuple[Change, ...]
    read: Callable[[Path], object]
    """Reads the folder as the program does."""
    words: str = ""
    """A command line that reads it, with {} for the folder."""
    mend: Callable[[Path], None] | None = None
    """Computes the digests of a changed folder again, so that readers go on behind them."""
    share: float = 1.0
    """Number of files of this kind, relative to others; less where reading takes seconds."""


def _write(name: str, data: str | bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


def _inspect(name: str) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        inspection = inspect_file(folder / name, rate_hz=120.0 if name.endswith(".amc") else None)
        return inspection.as_dict(), inspection.lines()

    return read


def _make_acclaim(folder: Path) -> None:
    write_text(folder / "91.asf", asf_text(standard_skeleton()))
    write_text(folder / "91_01.amc", amc_text(clip(8)))


def _make_bvh(folder: Path) -> None:
    write_text(folder / "91_01.bvh", bvh_text(clip(6)))


def _npz() -> bytes:
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **amass_arrays(clip(6)))
    return out.getvalue()


def _make_library(folder: Path) -> None:
    _make_acclaim(folder)
    write_text(folder / "91_02.bvh", bvh_text(clip(4)))
    rows = ["91_01.amc,91,01,walking,8,120,", "91_02.bvh,91,02,boxing,4,120,a note"]
    write_text(folder / "manifest.csv", "\n".join(["path,subject,trial,behaviour,frames,fps,note", *rows]) + "\n")


def _read_library(folder: Path) -> object:
    library = MotionLibrary(folder)
    return [(entry.line(), entry.as_dict()) for entry in library.entries()], library.load("91_01")


def _plan(scenario: Scenario) -> object:
    for method in scenario.methods:
        make_method(method)
    return cell_names(scenario), content_key(to_json_types(scenario.vary))


def _read_scenario(folder: Path) -> object:
    return _plan(expand_clips(load_scenario(folder / "x.toml"), None))


def _read_sweep(folder: Path) -> object:
    sweep, path = load_sweep(folder / "x.toml")
    return [_plan(scenario) for scenario in expand_sweep(sweep, path)]


def _read_placement(folder: Path) -> object:
    study = load_placement_study(folder / "x.toml")

    def load(name: str) -> Scenario:
        return load_scenario(find_scenario(name, folder))

    return [base_scenario(study, load, condition) for condition in (None, *study.condition)]


def _read_options(folder: Path) -> object:
    text = (folder / "x.txt").read_bytes().decode("utf-8", "replace")[:2000]
    names = (name for part in split_outside_brackets(text, ",") for name in expand_alternatives(part))
    return [(make_method(name), without_options(name)) for name in names]


def _copy_shipped(name: str) -> Callable[[Path], object]:
    return lambda folder: shutil.copy(data_folder("scenarios") / name, folder / "x.toml")


def _read_calibration(folder: Path) -> object:
    content = read_calibration(folder / "x.toml")
    return content.select(content.calibration.stations)


def _make_calibration(folder: Path) -> None:
    calibration = Calibration(
        kind="poses",
        stations=("head", "torso"),
        bones=("head", "thorax"),
        mount_m=np.full((2, 3), 0.1),
        bone_from_station=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)),
        world_from_tracker=np.array([1.0, 0.0, 0.0, 0.0]),
        tracker_origin_m=np.zeros(3),
    )
    write_calibration(folder / "x.toml", CalibrationFile(calibration, standard_skeleton(), {"a": {"b": [1.5, "c"]}}))


def _make_recording(folder: Path) -> None:
    playback = prepare_playback("builtin_walking", stations=2, rate_hz=30.0)
    simulation = playback.simulation
    note = {"scenario": "builtin_walking", "clip": str(playback.clip_evaluation.part), "seed": 1}
    record_capture(folder / "x.rec", simulation.wire_format, simulation.wire, note, seconds=0.5)
    with RecordingWriter(folder / "x.rec", note) as writer:
        writer.on_event(LineEvent("unplugged", 1.35, 101.35, "the port is gone"))
        writer.on_configured(simulation.wire_format, 2.0, 102.0)


def _read_recording(folder: Path) -> object:
    stream = RecordingStream(folder / "x.rec")
    summary = StreamSummary(stream.stations)
    for frame in stream:
        summary.add(frame)
        for row in frame_rows(frame, stream.stations, stream.wall_s(frame.received_s)):
            format_csv_row(row)
    recording, playback = stream.recording, find_playback(stream)
    lines = [f"{event['monotonic_s']:.3f} s: {event['text']}" for event in recording.events]
    return str(summary), summary.as_dict(), recording.damage, recording.note, stream.counts, lines, playback.scenario


def _read_poses(name: str) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        found = open_poses([folder / name], None if name.endswith(".rec") else PoseFileOptions(untimed=True))
        frames = sum(1 for _ in PoseLogStream(found.log))
        sampling = [measure_sampling(body) for body in found.log.bodies]
        return frames, sampling, [str(finding) for finding in found.log.findings], found.marks, found.damage

    return read


def _make_pose_recording(folder: Path) -> None:
    path = pose_files.write(folder / "x.csv", pose_files.motive())
    write_pose_recording(folder / "x.rec", open_poses([path]).log, {"plan": "ab"}, [(1.0, "static")])
    path.unlink()


def _pose_kind(name: str, content: str | bytes) -> Kind:
    return Kind(f"poses {name}", _write("x.csv", content), ("*",), TEXT, _read_poses("x.csv"), "inspect {}/x.csv")


def _make_run(folder: Path) -> None:
    methods = {"ik": 1.5, "best_match": 3.0}
    planted_run(folder / "x", Plan(behaviours=("walking",), methods=methods, duration_s=1.5))


def _read_run(folder: Path) -> object:
    run = load_run(folder / "x")
    read_run(folder / "x")
    return run.results, [len(cell) for cell in run.cells()], comparison_text(compare_runs(folder / "x", folder / "x"))


def _read_summary(folder: Path) -> object:
    return run_table(read_summary(folder / "x")), read_run(folder / "x")


def _write_page(folder: Path) -> object:
    return write_run_page(folder / "x", rendered=False)


def _read_index(folder: Path) -> object:
    status, page = read_status(folder / "x"), write_sweep_page(folder / "x")
    return _status_lines(status), sweep_text(read_sweep(folder / "x")), page


def _make_markers(folder: Path) -> None:
    points = np.full((30, 2, 3), 0.8)
    points[:, :, 0] += np.arange(30.0)[:, None] / 1000.0
    (folder / "91_01.c3d").write_bytes(c3d_bytes(points))


def _make_baseline(folder: Path) -> None:
    _make_run(folder)
    write_baseline(folder / "x", "b", folder)
    shutil.rmtree(folder / "x")


def _read_baseline(folder: Path) -> object:
    return comparison_text(compare_runs(folder / "b", folder / "b"))


def _make_sweep(folder: Path) -> None:
    planted_sweep(folder / "x", MeansPlan(clips=2, failing=("dynamic_map",)))


def _make_paper(folder: Path) -> None:
    paper_findings.write_study(folder, paper_findings.kim())


def _read_paper(folder: Path) -> object:
    findings = read_findings(folder / "findings.json")
    return paper_text(findings), render_html(paper_page(findings), with_charts=False)


def _make_placement(folder: Path) -> None:
    (folder / "findings.json").write_bytes(_placement_findings())


@cache
def _placement_findings() -> bytes:
    from tests.study.placement.test_placement_study import ALL_MODES, written

    with TemporaryDirectory() as folder:
        run_placement(written(Path(folder), ALL_MODES), Path(folder) / "out")
        return (Path(folder) / "out" / "findings.json").read_bytes()


def _read_placement_findings(folder: Path) -> object:
    findings = read_placement(folder / "findings.json")
    return placement_text(findings), render_html(placement_page(findings), with_charts=False)


def _make_database(folder: Path) -> None:
    takes = [make_take("walking", number, 0.5) for number in (1, 2)]
    MotionDatabase.build(build_body(), takes, folder=folder / "x")


def _read_database(folder: Path) -> object:
    database = MotionDatabase.open(folder / "x")
    return np.asarray(database.posture).sum(), database.segments


_COMPARE = "compare {0}/x {0}/x"
_RUN_FILES = ("x/manifest.json", "x/summary.json")
_BASELINE_FILES = ("b/cells.json", "b/manifest.json")

_COMPARE_B = "compare {0}/b {0}/b"
_JSON_OF_RUN = ("x/*.json", "x/cells/*/cell.json")

KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("asf", _make_acclaim, ("91.asf",), TEXT, _inspect("91_01.amc"), "inspect {}/91_01.amc --rate 120"),
        Kind("amc", _make_acclaim, ("91_01.amc",), TEXT, _inspect("91_01.amc"), "inspect {}/91_01.amc --rate 120"),
        Kind(
            "bvh", _write("91_01.bvh", bvh_text(clip(6))), ("*",), TEXT, _inspect("91_01.bvh"), "inspect {}/91_01.bvh"
        ),
        Kind(
            "mvnx",
            _write("91_01.mvnx", mvnx_text(clip(6))),
            ("*",),
            TEXT,
            _inspect("91_01.mvnx"),
            "inspect {}/91_01.mvnx",
        ),
        Kind("amass", _write("91_01.npz", _npz()), ("*",), NPZ, _inspect("91_01.npz"), "inspect {}/91_01.npz"),
        Kind("c3d bytes", _write("x.c3d", _c3d()), ("*",), BYTES, lambda folder: read_c3d(folder / "x.c3d")),
        Kind("c3d", _make_markers, ("*",), BYTES, _inspect("91_01.c3d"), "inspect {}/91_01.c3d", share=0.02),
        Kind(
            "constellation",
            _write("x.mcf", b"".join(emitter.line() for emitter in DEFAULT_EMITTERS)),
            ("*",),
            TEXT,
            lambda folder: read_mcf(folder / "x.mcf"),
            "inspect {0}/x.mcf --out {0}/x.html --force",
        ),
        Kind("library index", _make_library, ("manifest.csv",), TEXT, _read_library, "mocap list --mocap {}"),
        Kind(
            "scenario",
            _copy_shipped("demo.toml"),
            ("*",),
            TOML,
            _read_scenario,
            "run {0}/x.toml --methods nothing --out {0}/out",
        ),
        Kind("sweep", _copy_shipped("sweeps/noise_and_rate.toml"), ("*",), TOML, _read_sweep),
        Kind("placement", _copy_shipped("placement/walking.toml"), ("*",), TOML, _read_placement),
        Kind("method options", _write("x.txt", OPTIONS), ("*",), TEXT, _read_options),
        Kind("calibration", _make_calibration, ("*",), TOML, _read_calibration, mend=mend_calibration),
        Kind("recording", _make_recording, ("*",), RECORDING, _read_recording, "replay {}/x.rec --frames"),
        *(
            _pose_kind(name, pose_files.SAMPLES[name])
            for name in ("tum", "euroc", "no names", "tabs", "quotes", "dates")
        ),
        *(_pose_kind(name, pose_files.UNTIMED[name]) for name in ("matrices", "kitti")),
        _pose_kind("of optitrack", pose_files.motive(range(5))),
        _pose_kind("of vicon", pose_files.vicon_tracker()),
        _pose_kind("of qualisys", pose_files.qualisys(range(5))),
        _pose_kind("of dtrack", pose_files.dtrack()),
        Kind("pose recording", _make_pose_recording, ("*",), RECORDING, _read_poses("x.rec"), "inspect {}/x.rec"),
        Kind("cell", _make_run, ("x/cells/*/cell.json",), JSON, _read_run, _COMPARE, mend_run),
        Kind("frames of a cell", _make_run, ("x/cells/*/frames.npz",), NPZ, _read_run, _COMPARE, mend_run),
        Kind(
            "manifest and summary",
            _make_run,
            ("x/manifest.json", "x/summary.json"),
            JSON,
            _read_summary,
            "compare {0}/x {0}/x",
            mend_run,
        ),
        Kind("run page", _make_run, _JSON_OF_RUN, JSON, _write_page, "report {}/x", mend_run, 0.02),
        Kind("index", _make_sweep, (f"x/{INDEX_FILE}",), DATABASE, _read_index, "status {}/x", mend_index),
        Kind("baseline", _make_baseline, _BASELINE_FILES, JSON, _read_baseline, _COMPARE_B, mend_baseline),
        Kind("paper findings", _make_paper, ("*",), JSON, _read_paper, mend=mend_findings),
        Kind("placement findings", _make_placement, ("*",), JSON, _read_placement_findings, "report {}", mend_findings),
        Kind("motion database", _make_database, ("x/*.json",), JSON, _read_database),
        Kind("database arrays", _make_database, ("x/*.npy",), BYTES, _read_database),
    )
}
