"""One cell: one method on one clip with one choice of inputs, as a record and as a folder.

On disk a cell is `cells/<key>/cell.json` and `frames.npz`. The folder is written under a temporary name and renamed
when it is complete, so that a folder that exists is finished. cell.json has its own digest and that of frames.npz.
"""

import hashlib
import io
import json
import shutil
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.estimate import MAX_POSE_VALUE, QPOS_SIZE, check_sigma, find_impossible_pose, has_pose
from harness.core.files import flush_together, move_into_place, temporary_path, to_json, to_json_types
from harness.core.input_file import MEGABYTE
from harness.core.npz_file import read_npz
from harness.errors import BadFile, ShapeError
from harness.results.files.content_types import (
    check_cell_types,
    find_cell_fault,
    find_impossible_errors,
    find_impossible_metric,
    find_impossible_sigma,
)
from harness.results.files.digests import check_file, check_key, insert_digest, read_result_json
from harness.score import FRAME_METRICS, VERSIONS, Scores

IDENTITY = (
    "method",
    "behaviour",
    "clip",
    "motion_source",
    "stations",
    "mount",
    "rate_hz",
    "inputs",
    "split",
    "calibration",
    "noise",
    "seed",
)
"""First columns of a cell's row, in this order."""
EXTRA_IDENTITY = ("scenario", "performer", "varied")
"""Further columns that identify a cell."""
TRAILING_COLUMNS = (*EXTRA_IDENTITY, "key", "source_hash", "health", "calibration_errors")
"""Columns that follow the metrics in a row."""
OPTIONAL_COLUMNS: Mapping[str, Any] = {"lag": 0, "sigma_scores": {}}
"""Last columns of a row, and their values where a stored row or cell lacks them: versions before them had neither."""
SIGMA_ARRAY = "angle_sigma_rad"
"""Array of frames.npz that only cells of methods with standard deviations have, (F, 48) float32."""
_TEXTS = (
    *(*IDENTITY, *EXTRA_IDENTITY, "key", "defined_by", "health", "calibration_errors", "bone_m", "estimate_bone_m"),
    *("source_hash", "reproduce", "notes"),
)
_FLOATS = ("time_s", "truth_qpos", "estimate_qpos", "step_ms", "step_cpu_ms", "reference_cpu_ms", "quality")
_INTS = ("frame_index", "status", "origin")
_BOOLS = ("position_valid", "orientation_valid", "suspect")
MAX_FRAMES_BYTES = 1024 * MEGABYTE
"""Largest frames.npz that is read: some 600,000 frames."""
_ERROR_PREFIX = "error."
_ADVICE = "Delete the cell's folder and run again; finished cells are kept."


@dataclass(frozen=True, eq=False)
class Cell:
    """A finished cell: F matched frames of S stations, and their scores."""

    key: str
    """Hash of everything that defines the cell, see `results.storage.cell_key`."""
    method: str
    behaviour: str
    clip: str
    motion_source: str
    stations: tuple[str, ...]
    mount: str
    rate_hz: float
    inputs: str
    split: str
    calibration: str
    noise: str
    seed: int
    defined_by: Mapping[str, Any]
    """Everything that two results must agree on to be comparable."""
    scores: Scores
    health: Mapping[str, Any]
    """Counts of records that the stream lost, repeated or marked as suspect."""
    bone_m: Floats
    """(B, 3) bone vectors of the true body, from which poses can be drawn again [m]."""
    source_hash: str
    """Hash of the source of the package that computed the cell."""
    reproduce: str
    """Command line that reproduces the cell."""
    notes: tuple[str, ...]
    time_s: Floats
    """(F,) time of the true frame of each estimate [s]."""
    truth_qpos: Floats
    """(F, 55) true MuJoCo configurations."""
    estimate_qpos: Floats
    """(F, 55) estimated MuJoCo configurations."""
    frame_index: Ints
    """(F,) index of the true frame of each estimate."""
    status: Ints
    """(F,) status of each estimate, see `core.estimate.Status`."""
    origin: Ints
    """(F,) origin of each estimate, see `core.estimate.Origin`."""
    step_ms: Floats
    """(F,) wall time of each step [ms]; NaN where not timed."""
    quality: Floats
    """(F, S) quality of each reading, 0 (lost) to 1 (best)."""
    position_valid: Bools
    """(F, S) whether the position was usable."""
    orientation_valid: Bools
    """(F, S) whether the orientation was usable."""
    suspect: Bools
    """(F, S) whether order, time or plausibility of the reading is in doubt."""
    performer: str = ""
    """"known" if the examples include another take of the performer or the rest of this one, "new" if they do not,
    "" without examples."""
    varied: Mapping[str, Any] = field(default_factory=dict)
    """Scenario key -> value, of the keys that the scenario varies."""
    scenario: str = ""
    """Name of the scenario."""
    step_cpu_ms: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) CPU time of each step [ms]; NaN (the default) where not timed."""
    reference_cpu_ms: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) CPU time of the work of `experiment.methods.method_run` right after each step [ms]; NaN (the default)
    after steps that it did not follow."""
    calibration_errors: Mapping[str, float] = field(default_factory=dict)
    """Errors of the calibration by name (see `harness.experiment.simulated_calibration`); empty if it is exact."""
    estimate_bone_m: Floats = field(default_factory=lambda: np.empty((0, 3)))
    """(B, 3) bone vectors of the body that the method was given [m]; by default those of the true body."""
    angle_sigma_rad: Floats | None = None
    """(F, 48) standard deviations of the estimated hinge angles [rad]; None from a method that states none."""

    def __post_init__(self) -> None:
        frames, stations = len(self.time_s), len(self.stations)
        if not len(self.estimate_bone_m):
            object.__setattr__(self, "estimate_bone_m", self.bone_m)
        for name in ("step_cpu_ms", "reference_cpu_ms"):
            if not len(getattr(self, name)):
                object.__setattr__(self, name, np.full(frames, np.nan))
        freeze(self, bone_m=("B", 3), estimate_bone_m=("B", 3))
        freeze(self, time_s=(frames,), quality=(frames, stations))
        freeze(self, step_ms=(frames,), step_cpu_ms=(frames,), reference_cpu_ms=(frames,))
        freeze(self, truth_qpos=(frames, "Q"), estimate_qpos=(frames, "Q"))
        freeze(self, np.int64, frame_index=(frames,), status=(frames,), origin=(frames,))
        freeze(self, bool, **dict.fromkeys(_BOOLS, (frames, stations)))
        if self.angle_sigma_rad is not None:
            freeze(self, angle_sigma_rad=(frames, self.estimate_qpos.shape[1] - 7))
        for name in ("stations", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def lag(self) -> int:
        """Number of later frames that the method used for each estimate; 0 for a causal one."""
        return lag_of(self.defined_by)

    @property
    def sigma_scores(self) -> Mapping[str, float]:
        """Scores of the standard deviations by name (see `score.uncertainty`); empty without them."""
        return self.scores.sigma

    @property
    def metrics(self) -> Mapping[str, float | None]:
        """Metrics by name; None is "not measured"."""
        return self.scores.metrics

    @property
    def errors(self) -> Mapping[str, Floats]:
        """Metrics that have a value in every frame, (F,) each."""
        return self.scores.per_frame

    def __len__(self) -> int:
        return len(self.time_s)


def cell_folder(out: Path, key: str) -> Path:
    """The folder of a cell, finished or not."""
    return out / "cells" / key


def has_cell(out: Path, key: str) -> bool:
    """Whether the cell is finished."""
    return cell_folder(out, key).is_dir()


def write_cell(out: Path, cell: Cell) -> Path:
    """Write a finished cell into a folder; one that exists already stays as it is.

    ValueError for values that `read_cell` would refuse; nothing is written then. The cell reaches the disk whole or not
    at all. Its name does so with later ones, when the index gets its digest.
    """
    folder = cell_folder(out, cell.key)
    beside = temporary_path(folder)
    shutil.rmtree(beside, ignore_errors=True)
    content = {name: getattr(cell, name) for name in _TEXTS}
    content |= {"metrics": cell.scores.metrics, "per_joint": cell.scores.per_joint, "metric_versions": VERSIONS}
    if cell.sigma_scores:
        content["sigma_scores"] = cell.sigma_scores
    columns = {name: getattr(cell, name) for name in (*_FLOATS, *_INTS, *_BOOLS)}
    if cell.angle_sigma_rad is not None:
        columns[SIGMA_ARRAY] = cell.angle_sigma_rad.astype(np.float32)
    largest = np.finfo(np.float32).max
    per_frame = {name: np.minimum(values, largest).astype(np.float32) for name, values in cell.scores.per_frame.items()}
    columns |= {_ERROR_PREFIX + name: values for name, values in per_frame.items()}
    columns["scored"] = cell.scores.scored
    frames = _npz_bytes(columns)
    fault = find_cell_fault(to_json_types(content)) or _find_impossible_content(content)
    if fault := fault or _find_impossible_frames(columns) or _find_excess(len(frames)):
        raise ValueError(f"{cell.method} on {cell.clip} cannot be stored: {fault}")
    content["frames_sha256"] = hashlib.sha256(frames).hexdigest()
    files = {"cell.json": insert_digest(to_json(content)).encode(), "frames.npz": frames}
    try:
        beside.mkdir(parents=True)
        for name, data in files.items():
            (beside / name).write_bytes(data)
        flush_together(beside / name for name in files)
        move_into_place(beside, folder, flush_name=False)
    except OSError:
        if not folder.is_dir():  # else another process finished the same cell first
            raise
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return folder


def _npz_bytes(columns: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    """Content of an npz file, as `np.savez` writes it.

    Floats are not compressed: deflate would save a tenth of them, in ten times the time that the rest of writing takes.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, values in columns.items():
            array = io.BytesIO()
            np.lib.format.write_array(array, values, allow_pickle=False)
            method = zipfile.ZIP_STORED if values.dtype.kind == "f" else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), array.getbuffer(), method)
    return packed.getvalue()


def read_content(folder: Path) -> dict[str, Any]:
    """Read cell.json of a finished cell, and check both files of the cell against their digests.

    BadFile when a file is missing or does not fit its digest, when the cell belongs into another folder, and when a
    metric has an impossible value.
    """
    text, expected = folder / "cell.json", "a cell of a run"
    content = read_result_json(text, expected, _ADVICE)
    check_file(folder / "frames.npz", content.get("frames_sha256"), "the frames of a cell", _ADVICE)
    check_key(text, content.get("key"), folder.name, expected, _ADVICE)
    if not isinstance(content.get("metrics"), dict):
        raise BadFile(text, "no metrics", f"{expected} of this version of the harness", _ADVICE)
    if found := _find_impossible_content(content):
        raise BadFile(text, found, "possible values", _ADVICE)
    return content


def read_cell(folder: Path) -> Cell:
    """Read a finished cell; BadFile when one of its files is missing, damaged, edited or malformed."""
    frames, content = folder / "frames.npz", read_content(folder)
    check_cell_types(folder / "cell.json", content, _ADVICE)
    arrays = read_npz(frames, "the frames of a cell", _ADVICE, limit_bytes=MAX_FRAMES_BYTES)
    if fault := _find_wrong_array(arrays) or _find_impossible_frames(arrays):
        raise BadFile(frames, fault, "the frames of a cell of this version of the harness", _ADVICE)
    try:
        per_frame = {name: arrays[_ERROR_PREFIX + name].astype(float) for name in FRAME_METRICS}
        sigma = content.get("sigma_scores", {})
        scores = Scores(content["metrics"], per_frame, content["per_joint"], arrays["scored"], sigma)
        return Cell(
            scores=scores,
            **{name: content[name] for name in _TEXTS},
            **dict[str, Any]({name: arrays[name] for name in (*_FLOATS, *_INTS, *_BOOLS)}),
            angle_sigma_rad=arrays.get(SIGMA_ARRAY),
        )
    except (KeyError, TypeError, ValueError) as error:
        found = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise BadFile(folder, found, "a cell of this version of the harness", _ADVICE) from error
    except ShapeError as error:
        raise BadFile(frames, str(error), "arrays that agree", _ADVICE) from error


def _find_wrong_array(arrays: Mapping[str, np.ndarray[Any, Any]]) -> str:
    """The first array that is missing, of another type, or of another number of frames; "" if there is none."""
    errors = tuple(_ERROR_PREFIX + name for name in FRAME_METRICS)
    sigma = (SIGMA_ARRAY,) if SIGMA_ARRAY in arrays else ()
    for names, kinds in (((*_FLOATS, *errors, *sigma), "f"), (_INTS, "iu"), ((*_BOOLS, "scored"), "b")):
        for name in names:
            if name not in arrays:
                return f"no {name!r}"
            if arrays[name].dtype.kind not in kinds or arrays[name].shape[:1] != arrays["time_s"].shape[:1]:
                return f"{name} of {arrays[name].dtype} {arrays[name].shape}"
    return ""


def _find_excess(size: int) -> str:
    return f"{size} bytes of frames, more than {MAX_FRAMES_BYTES}" if size > MAX_FRAMES_BYTES else ""


def _find_impossible_content(content: Mapping[str, Any]) -> str:
    """The first metric with an impossible value; "" if there is none."""
    return find_impossible_metric(content["metrics"]) or find_impossible_sigma(content.get("sigma_scores", {}))


def _find_impossible_frames(arrays: Mapping[str, np.ndarray[Any, Any]]) -> str:
    """What no time, pose, standard deviation or error of a frame can be; "" if nothing is."""
    if not np.all(np.abs(arrays["time_s"]) < MAX_POSE_VALUE):
        return f"a value of time_s that is not a number below {MAX_POSE_VALUE:g}"
    scored = arrays["estimate_qpos"][arrays["scored"]]  # others may be anything: a method answered NaN there
    for name, qpos in (("truth_qpos", arrays["truth_qpos"]), ("estimate_qpos", scored)):
        if qpos.ndim != 2 or qpos.shape[1] != QPOS_SIZE or not has_pose(qpos).all():
            return f"a frame of {name} that is no pose"
        if found := find_impossible_pose(qpos):
            return f"{found} ({name})"
    try:
        check_sigma(arrays.get(SIGMA_ARRAY, np.ones((1, 1))))
    except ValueError as error:
        return str(error)
    return find_impossible_errors({name: arrays[_ERROR_PREFIX + name].astype(float) for name in FRAME_METRICS})


def read_row(folder: Path) -> dict[str, Any]:
    """Read the row of a finished cell, without its frames; BadFile as for `read_content`."""
    content = read_content(folder)
    check_cell_types(folder / "cell.json", content, _ADVICE)
    return row_of_content(folder, content)


def lag_of(row: Mapping[str, Any]) -> int:
    """Lag of the method of a row or of a cell's conditions [frames]; those of older versions are of causal methods."""
    return int(row.get("lag", OPTIONAL_COLUMNS["lag"]))


def row_of_content(folder: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    """The row of a cell from the content of its cell.json; BadFile when columns are missing."""
    try:
        first, rest = ({name: content[name] for name in names} for names in (IDENTITY, TRAILING_COLUMNS))
        optional = {
            "lag": lag_of(content["defined_by"]),
            "sigma_scores": content.get("sigma_scores", OPTIONAL_COLUMNS["sigma_scores"]),
        }
        return {**first, **content["metrics"], **rest, **optional}
    except (KeyError, TypeError) as error:
        expected = "a cell of this version of the harness"
        raise BadFile(folder / "cell.json", f"no {error}", expected, _ADVICE) from error


def as_row(cell: Cell) -> dict[str, Any]:
    """The row of a cell: identity, then every metric, then the trailing and the optional columns."""
    first, rest = (
        {name: to_json_types(getattr(cell, name)) for name in names}
        for names in (IDENTITY, (*TRAILING_COLUMNS, *OPTIONAL_COLUMNS))
    )
    return {**first, **cell.metrics, **rest}


def varied_text(varied: Mapping[str, Any]) -> str:
    """Text of varied values, such as "noise=clean worn=head+torso"; empty when nothing is varied."""
    return " ".join(f"{key}={_short(value)}" for key, value in varied.items())


def setting_text(row: Mapping[str, Any]) -> str:
    """Text of the varied values of a row of a cell or of a summary, as `varied_text`."""
    return varied_text(row["varied"])


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple) and value and all(isinstance(name, str) for name in value):
        return "+".join(value)
    return value if isinstance(value, str) else json.dumps(to_json_types(value), separators=(",", ":"))
