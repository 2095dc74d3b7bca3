"""Write truth and estimates of a run for other programs: BVH players, OpenSim, tables, evo."""

import os
import re
from collections.abc import Callable, Iterable
from pathlib import Path

from harness.errors import BadInput, UnknownName
from harness.mocap.export_bvh import bvh_files
from harness.mocap.export_csv import csv_files
from harness.mocap.export_motion import Exportable, Motion, truth_and_estimate
from harness.mocap.export_trc import trc_files
from harness.mocap.export_tum import tum_files

FORMATS: dict[str, Callable[[Motion], dict[str, str]]] = {
    "bvh": bvh_files,
    "trc": trc_files,
    "csv": csv_files,
    "tum": tum_files,
}


def export(cells: Iterable[Exportable], fmt: str, folder: Path, *, force: bool = False) -> list[Path]:
    """Write every cell in one of FORMATS, `CLIP-METHOD-INPUTS.truth.*` and `.estimate.*`; returns the files.

    A cell without a finite estimate has nothing to write and is left out. Raises UnknownName for another format, and
    BadInput when a file exists (unless `force`), when the folder cannot be written and when there is nothing to write.
    """
    if fmt not in FORMATS:
        raise UnknownName("export format", fmt, FORMATS)
    written: list[Path] = []
    try:
        for cell in cells:
            stem = _stem(cell, {path.name for path in written})
            for kind, motion in truth_and_estimate(cell).items():
                if len(motion):
                    for ending, text in FORMATS[fmt](motion).items():
                        written.append(_write(folder / f"{stem}.{kind}{ending}", text, force))
    except OSError as error:
        raise BadInput(f"{folder} cannot be written ({error.strerror}).", "Name another folder with --out.") from error
    if not written:
        raise BadInput("No cell of this run has an estimate to export.", "Run the scenario first.")
    return written


def _stem(cell: Exportable, taken: set[str]) -> str:
    stem = re.sub(r"[^\w.+@-]", "_", f"{cell.clip}-{cell.method}-{cell.inputs}")
    return f"{stem}-{cell.key[:8]}" if any(name.startswith(f"{stem}.") for name in taken) else stem


def _write(path: Path, text: str, force: bool) -> Path:
    if path.exists() and not force:
        raise BadInput(f"{path} exists.", "Name another folder with --out, or write over it with --force.")
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_name(f".unfinished-{os.getpid()}-{path.name}")
    beside.write_text(text, encoding="utf-8", newline="")
    os.replace(beside, path)
    return path
