"""Export of truth and estimates of a run to other programs: BVH players, OpenSim, tables, evo."""

import re
from collections.abc import Callable, Iterable
from pathlib import Path

from harness.core.fault_report import is_system_fault
from harness.core.files import move_into_place, temporary_path
from harness.errors import BadInput, UnknownName
from harness.mocap.write.bvh import bvh_files
from harness.mocap.write.csv_table import csv_files
from harness.mocap.write.posed_motion import ExportableCell, PosedMotion, pose_truth_and_estimate
from harness.mocap.write.trc import trc_files
from harness.mocap.write.tum import tum_files

FORMATS: dict[str, Callable[[PosedMotion], dict[str, str]]] = {
    "bvh": bvh_files,
    "trc": trc_files,
    "csv": csv_files,
    "tum": tum_files,
}


def export(cells: Iterable[ExportableCell], fmt: str, folder: Path, *, force: bool = False) -> list[Path]:
    """Write every cell in one of FORMATS as `CLIP-METHOD-INPUTS.truth.*` and `.estimate.*`; returns the files.

    The warm-up seconds, which scores leave out, are written too. Either all files are written or none. A cell without
    a finite estimate is left out. Raises UnknownName for another format, and BadInput if a file exists (unless
    `force`), if the folder cannot be written, and if there is nothing to write.
    """
    if fmt not in FORMATS:
        raise UnknownName("export format", fmt, FORMATS)
    ready: dict[Path, Path] = {}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for cell in cells:
            stem = _file_stem(cell, {path.name for path in ready})
            for kind, motion in pose_truth_and_estimate(cell).items():
                if len(motion):
                    for ending, text in FORMATS[fmt](motion).items():
                        path = folder / f"{stem}.{kind}{ending}"
                        ready[path] = _write_unfinished(path, text, force)
        for path, unfinished in ready.items():
            move_into_place(unfinished, path)
    except OSError as error:
        if is_system_fault(error):
            raise
        raise BadInput(f"{folder} cannot be written ({error.strerror}).", "Name another folder with --out.") from error
    finally:
        for unfinished in folder.glob(temporary_path(folder / "*").name):
            unfinished.unlink()
    if not ready:
        raise BadInput("No cell of this run has an estimate to export.", "Run the scenario first.")
    return list(ready)


def _file_stem(cell: ExportableCell, taken: set[str]) -> str:
    stem = re.sub(r"[^\w.+@-]", "_", f"{cell.clip}-{cell.method}-{cell.inputs}")
    return f"{stem}-{cell.key[:8]}" if any(name.startswith(f"{stem}.") for name in taken) else stem


def _write_unfinished(path: Path, text: str, force: bool) -> Path:
    """Write the text under a temporary name, so that all files can be renamed at once."""
    if path.exists() and not force:
        raise BadInput(f"{path} exists.", "Name another folder with --out, or replace it with --force.")
    unfinished = temporary_path(path)
    unfinished.write_text(text, encoding="utf-8", newline="")
    return unfinished
