"""Export of truth and estimates of a run to other programs: BVH players, OpenSim, 3-D viewers, tables, evo."""

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TypeVar

from harness.core.files import move_into_place, remove_leftovers, temporary_path
from harness.errors import BadInput, UnknownName
from harness.mocap.write.body_model import BodyModel, stick_figure
from harness.mocap.write.bvh import bvh_files
from harness.mocap.write.gltf import glb_files
from harness.mocap.write.opensim import mot_files, sto_files, trc_files
from harness.mocap.write.posed_motion import ExportableCell, PosedMotion, pose_truth_and_estimate
from harness.mocap.write.tables import csv_files, tum_files

_AnyCell = TypeVar("_AnyCell", bound=ExportableCell)
_FORMATS_BY_MOTION: Mapping[str, Callable[[PosedMotion], Mapping[str, str]]] = {
    "bvh": bvh_files,
    "trc": trc_files,
    "mot": mot_files,
    "sto": sto_files,
    "csv": csv_files,
    "tum": tum_files,
}
"""Format -> texts of the files of one motion by their endings."""
EXPORT_FORMATS = (*_FORMATS_BY_MOTION, "glb")
"""Formats of files. `glb` (glTF 2.0) holds truth and estimate in one file, each of the others in files of its own."""


def export_motion(
    cells: Iterable[_AnyCell],
    fmt: str,
    folder: Path,
    *,
    force: bool = False,
    model: Callable[[_AnyCell, PosedMotion], BodyModel] = stick_figure,
    progress: Callable[[str], None] = lambda stem: None,
) -> list[Path]:
    """Write every cell in one of FORMATS; returns the files.

    Names are `CLIP-METHOD-INPUTS.truth.*` and `.estimate.*`, or `CLIP-METHOD-INPUTS.glb`. The warm-up seconds, which
    scores leave out, are written too. Either all files are written or none. A cell without a finite estimate is left
    out. `model` gives the surface and the stations of a body for `glb`. Raises UnknownName for another format, and
    BadInput if a file exists (unless `force`), and if there is nothing to write.
    """
    if fmt not in EXPORT_FORMATS:
        raise UnknownName("export format", fmt, EXPORT_FORMATS)
    ready: dict[Path, Path] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for cell in cells:
            stem = _file_stem(cell, {path.name for path in ready})
            motions = {kind: motion for kind, motion in pose_truth_and_estimate(cell).items() if len(motion)}
            if not motions:
                continue
            if fmt == "glb":
                contents = glb_files({kind: (motion, model(cell, motion)) for kind, motion in motions.items()})
            else:
                contents = _files_by_motion(motions, _FORMATS_BY_MOTION[fmt])
            for ending, content in contents.items():
                path = folder / f"{stem}{ending}"
                ready[path] = _write_unfinished(path, content, force)
            progress(stem)
        for path, unfinished in ready.items():
            move_into_place(unfinished, path)
    finally:
        for unfinished in folder.glob(temporary_path(folder / "*").name):
            unfinished.unlink()
    if not ready:
        raise BadInput("No cell of this run has an estimate to export.", "Run the scenario first.")
    return list(ready)


def _files_by_motion(
    motions: Mapping[str, PosedMotion], write: Callable[[PosedMotion], Mapping[str, str]]
) -> dict[str, bytes]:
    """Contents of the files of each motion by their endings."""
    return {
        f".{kind}{ending}": text.encode("utf-8")
        for kind, motion in motions.items()
        for ending, text in write(motion).items()
    }


def _file_stem(cell: ExportableCell, taken: set[str]) -> str:
    stem = re.sub(r"[^\w.+@-]", "_", f"{cell.clip}-{cell.method}-{cell.inputs}")
    return f"{stem}-{cell.key[:8]}" if any(name.startswith(f"{stem}.") for name in taken) else stem


def _write_unfinished(path: Path, content: bytes, force: bool) -> Path:
    """Write the content under a temporary name, so that all files can be renamed at once."""
    if path.exists() and not force:
        raise BadInput(f"{path} exists.", "Name another folder with --out, or replace it with --force.")
    remove_leftovers(path)
    unfinished = temporary_path(path)
    unfinished.write_bytes(content)
    return unfinished
