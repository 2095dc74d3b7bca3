"""Export of the motion of a run, with the bodies and stations of its cells."""

from collections.abc import Callable, Sequence
from pathlib import Path

from harness.body import body_geoms, locate_mount
from harness.core.fields import build
from harness.errors import BadInput
from harness.experiment.scenarios.scenario import Station
from harness.mocap.write import BodyModel, MountedStation, PosedMotion, export_motion
from harness.results import Cell, select_cells


def export_run(
    run: Path,
    fmt: str,
    folder: Path,
    *,
    clips: Sequence[str] = (),
    methods: Sequence[str] = (),
    force: bool = False,
    progress: Callable[[str], None] = lambda stem: None,
) -> list[Path]:
    """Write the true and the estimated motion of a run's cells to files; returns the files.

    `clips` and `methods` choose the cells (see `results.reader.select_cells`), `fmt` is one of
    `mocap.write.export.FORMATS`. Raises the errors of both.
    """
    return export_motion(
        select_cells(run, clips=clips, methods=methods), fmt, folder, force=force, model=body_model, progress=progress
    )


def body_model(cell: Cell, motion: PosedMotion) -> BodyModel:
    """The body of a cell, and its stations at their nominal mounts on that body; BadInput if the cell names none."""
    try:
        stations = {name: build(Station, table, name) for name, table in cell.defined_by["stations"].items()}
    except (KeyError, AttributeError, TypeError, ValueError) as error:
        found = f"The cell {cell.key} does not say where its stations sit ({error})."
        raise BadInput(found, "Run the scenario again with this version.") from error
    mounts = [station.nominal_mount(name) for name, station in stations.items()]
    places = [(mount, locate_mount(motion.skeleton, mount)) for mount in mounts]
    return BodyModel(
        body_geoms(motion.skeleton),
        [MountedStation(mount.station, mount.bone, position_m, turn) for mount, (position_m, turn) in places],
    )
