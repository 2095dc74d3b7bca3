"""One cell of a run: one method on one clip with one choice of inputs, as a record and as a folder.

On disk a cell is `cells/<key>/cell.json` and `frames.npz`, written under another name and renamed when whole:
a folder that is there is finished.
"""

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
from harness.core.files import flush, move_into_place, read_json, temporary_path, to_json, to_json_types
from harness.errors import BadFile, ShapeError
from harness.score.metrics import FRAME_METRICS, VERSIONS
from harness.score.score import Scores

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
"""What a row of the summary says about its cell first, in this order."""
EXTRA_IDENTITY = ("scenario", "performer", "varied")
"""What it says besides."""
TRAILING_COLUMNS = (*EXTRA_IDENTITY, "key", "source_hash", "health", "calibration_errors")
"""What a row has after the metrics."""
_TEXTS = (
    *(*IDENTITY, *EXTRA_IDENTITY, "key", "defined_by", "health", "calibration_errors", "bone_m", "estimate_bone_m"),
    *("source_hash", "reproduce", "notes"),
)
_FLOATS = ("time_s", "truth_qpos", "estimate_qpos", "step_ms", "step_cpu_ms", "reference_cpu_ms", "quality")
_INTS = ("frame_index", "status")
_BOOLS = ("position_valid", "orientation_valid", "suspect")
_ERROR_PREFIX = "error."
_ADVICE = "Delete the cell's folder and run again; finished cells are kept."


@dataclass(frozen=True, eq=False)
class Cell:
    """F matched frames of S stations, and what they scored."""

    key: str
    """Hash of everything that defines the cell, see `results.cell_key`."""
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
    """Counts of what the stream lost, repeated or doubted."""
    bone_m: Floats
    """(B, 3) bone vectors of the true body, so that poses can be drawn again [m]."""
    source_hash: str
    """Of the package that computed it."""
    reproduce: str
    """Command line."""
    notes: tuple[str, ...]
    time_s: Floats
    """(F,) time of the true frame that each estimate is of [s]."""
    truth_qpos: Floats
    """(F, 55)."""
    estimate_qpos: Floats
    """(F, 55)."""
    frame_index: Ints
    """(F,) which of the true frames."""
    status: Ints
    """(F,) see `core.estimate.Status`."""
    step_ms: Floats
    """(F,) wall time [ms]; NaN where not timed."""
    quality: Floats
    """(F, S) 0 lost to 1 best."""
    position_valid: Bools
    """(F, S)."""
    orientation_valid: Bools
    """(F, S)."""
    suspect: Bools
    """(F, S)."""
    performer: str = ""
    """"known" if another take of the performer, or the rest of this one, is among the examples, "new" if none is, ""
    when there are no examples at all."""
    varied: Mapping[str, Any] = field(default_factory=dict)
    """Scenario key -> value, of the keys that the scenario varies."""
    scenario: str = ""
    """Its name."""
    step_cpu_ms: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) CPU time of each step [ms]; NaN, as by default, where not timed."""
    reference_cpu_ms: Floats = field(default_factory=lambda: np.empty(0))
    """(F,) CPU time of the work of `experiment.reference_workload` right after each step [ms]; NaN, as by default, where not done."""
    calibration_errors: Mapping[str, float] = field(default_factory=dict)
    """How far what calibration found is from the truth, by name (see `harness.experiment.simulated_calibration`); empty where it is exact."""
    estimate_bone_m: Floats = field(default_factory=lambda: np.empty((0, 3)))
    """(B, 3) bone vectors of the body that the method believed in [m]; by default those of the true one."""

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
        freeze(self, np.int64, frame_index=(frames,), status=(frames,))
        freeze(self, bool, **dict.fromkeys(_BOOLS, (frames, stations)))
        for name in ("stations", "notes"):
            object.__setattr__(self, name, tuple(getattr(self, name)))

    @property
    def metrics(self) -> Mapping[str, float | None]:
        """By name; None is "not measured"."""
        return self.scores.metrics

    @property
    def errors(self) -> Mapping[str, Floats]:
        """(F,) each: the metrics that have a value in every frame."""
        return self.scores.per_frame

    def __len__(self) -> int:
        return len(self.time_s)


def cell_folder(out: Path, key: str) -> Path:
    return out / "cells" / key


def has_cell(out: Path, key: str) -> bool:
    """Whether a run has finished this cell."""
    return cell_folder(out, key).is_dir()


def write_cell(out: Path, cell: Cell) -> Path:
    """Add a finished cell to a run; one that is there already stays as it is."""
    folder = cell_folder(out, cell.key)
    beside = temporary_path(folder)
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir(parents=True)
    content = {name: getattr(cell, name) for name in _TEXTS}
    content |= {"metrics": cell.scores.metrics, "per_joint": cell.scores.per_joint, "metric_versions": VERSIONS}
    columns = {name: getattr(cell, name) for name in (*_FLOATS, *_INTS, *_BOOLS)}
    columns |= {_ERROR_PREFIX + name: values.astype(np.float32) for name, values in cell.scores.per_frame.items()}
    columns["scored"] = cell.scores.scored
    whole = {"cell.json": to_json(content).encode(), "frames.npz": _npz_bytes(columns)}
    for name, data in whole.items():
        (beside / name).write_bytes(data)
    for name in whole:  # when both are written: the disk is asked once for most of it
        flush(beside / name)
    try:
        move_into_place(beside, folder)
    except OSError:
        if not folder.is_dir():
            raise
        shutil.rmtree(beside)  # another process finished the same cell first
    return folder


def _npz_bytes(columns: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    """As `np.savez` has it. Only what is no measured number is compressed: of those deflate saves a tenth, in ten times
    the time of all the rest of writing a cell."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, values in columns.items():
            one = io.BytesIO()
            np.lib.format.write_array(one, values, allow_pickle=False)
            how = zipfile.ZIP_STORED if values.dtype.kind == "f" else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), one.getbuffer(), how)
    return packed.getvalue()


def read_cell(folder: Path) -> Cell:
    """A finished cell; BadFile when a file of it is missing, cut or not what it should be."""
    text, frames = folder / "cell.json", folder / "frames.npz"
    content = read_json(text, "a cell of a run")
    try:
        with open(frames, "rb") as file, np.load(file, allow_pickle=False) as columns:
            arrays = {name: columns[name] for name in columns.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise BadFile(frames, f"cannot be read ({error})", "the frames of a cell", _ADVICE) from error
    try:
        per_frame = {name: arrays[_ERROR_PREFIX + name].astype(float) for name in FRAME_METRICS}
        scores = Scores(content["metrics"], per_frame, content["per_joint"], arrays["scored"])
        return Cell(
            scores=scores,
            **{name: content[name] for name in _TEXTS},
            **{name: arrays[name] for name in (*_FLOATS, *_INTS, *_BOOLS)},
        )
    except (KeyError, TypeError, ValueError) as error:
        found = f"no {error}" if isinstance(error, KeyError) else str(error)
        raise BadFile(folder, found, "a cell of this version of the harness", _ADVICE) from error
    except ShapeError as error:
        raise BadFile(frames, str(error), "arrays that agree", _ADVICE) from error


def read_row(folder: Path) -> dict[str, Any]:
    """The row of a finished cell, without its frames; BadFile."""
    text = folder / "cell.json"
    content = read_json(text, "a cell of a run")
    try:
        first, rest = ({name: content[name] for name in names} for names in (IDENTITY, TRAILING_COLUMNS))
        return {**first, **content["metrics"], **rest}
    except (KeyError, TypeError) as error:
        raise BadFile(text, f"no {error}", "a cell of this version of the harness", _ADVICE) from error


def as_row(cell: Cell) -> dict[str, Any]:
    """The cell in one row: identity, then every metric, then its key and the notes that it carries."""
    first, rest = (
        {name: to_json_types(getattr(cell, name)) for name in names} for names in (IDENTITY, TRAILING_COLUMNS)
    )
    return {**first, **cell.metrics, **rest}


def varied_text(varied: Mapping[str, Any]) -> str:
    """As tables have it: "noise=clean worn=head+torso"; empty when nothing is varied."""
    return " ".join(f"{key}={_short(value)}" for key, value in varied.items())


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, list | tuple) and value and all(isinstance(name, str) for name in value):
        return "+".join(value)
    return value if isinstance(value, str) else json.dumps(to_json_types(value), separators=(",", ":"))
