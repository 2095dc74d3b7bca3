"""`inspect` of an MCF file: coverage and dilution of precision, by place and by station of a performer."""

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.commands.flags import output_file, refuse_flags, repeat_flags
from harness.commands.output import print_result, this_command
from harness.errors import Outcome, UnknownName
from harness.report.coverage.content import (
    CoverageContent,
    CoverageRow,
    PlanView,
    StationRow,
)
from harness.simulate.physics import (
    Constellation,
    ConstellationSettings,
    EmitterCoverage,
    emitter_coverage,
    grid_m,
    load_constellation,
    plan_axes_m,
)

if TYPE_CHECKING:
    from harness.body import Mount
    from harness.core.motion import Clip

HEIGHTS_M = (0.3, 1.0, 1.7)
"""Heights of the plan views above the floor: shin, hanging hand and head [m] [choice]."""
SIDE_M = 2.0
"""Side of the cube on the floor below the middle of the emitters, whose coverage is summed up [m] [choice]."""
_POINTS = 11
DEFAULT_STATIONS = "liu2011"


def inspect_constellation(args: argparse.Namespace) -> Outcome:
    """Print the coverage of the emitters in a file, and write its page."""
    refuse_flags(args, ["unit"], f"with {args.file.name}", "An MCF file is in metres.")
    if args.clip is None:
        refuse_flags(args, ["stations", "rate"], "without --clip", "It is for the performer that --clip names.")
    page = args.out or output_file(str(Path("results") / "coverage" / f"{args.file.stem}.html"))
    from harness.core.files import require_writable
    from harness.core.progress import report_step, show_steps
    from harness.report.coverage.page import coverage_page
    from harness.report.kit import render_text, write_page

    if args.out is not None:
        require_writable(args.out, "a page", force=args.force)
    constellation = _load(args.file)
    with show_steps("parts"):
        report_step("coverage")
        content = _content(args, constellation)
        shown = coverage_page(content)
        write_page(shown, page)
    said = {
        "emitters": len(constellation),
        "rows": [asdict(row) for row in content.rows],
        "clip": content.clip,
        "stations": [asdict(row) for row in content.stations],
        "page": str(page),
    }
    following = [] if args.clip else ["inspect", args.file, "--clip", "walking_p1_01", *repeat_flags(args, "mocap")]
    return print_result(args, said, render_text(shown), f"page: {page}", following=following)


def _load(path: Path) -> Constellation:
    """The constellation in a file; a bare name that no file has is a shipped one."""
    from harness.core.input_file import names_input_file
    from harness.core.ranges import check_words
    from harness.simulate.physics import constellation_path, read_mcf

    check_words(path)
    if path.parent == Path() and not names_input_file(path):
        path = constellation_path(path.stem)
    return load_constellation(ConstellationSettings(emitters=read_mcf(path)))


def _content(args: argparse.Namespace, constellation: Constellation) -> CoverageContent:
    from harness.simulate import TrackerConfig
    from harness.simulate.physics import Inertial, Schedule

    extent_m = np.ptp(constellation.position_m, axis=0)
    schedule = Schedule(Inertial().rate_hz, len(constellation))
    floor_m = TrackerConfig().origin_m[2]
    x_m, y_m = plan_axes_m(constellation)
    views = []
    for height_m in HEIGHTS_M:
        found = emitter_coverage(constellation, grid_m(x_m, y_m, np.array([floor_m - height_m])))
        shape = len(x_m), len(y_m)
        views.append(PlanView(height_m, x_m, y_m, found.emitters.reshape(shape), found.dilution.reshape(shape)))
    stations = _station_rows(args, constellation) if args.clip is not None else ("", ())
    return CoverageContent(
        name=args.file.stem,
        emitters=f"{len(constellation)} emitters on {' x '.join(f'{each:.2f}' for each in extent_m)} m",
        reach=f"{constellation.range_m:g} m within {np.rad2deg(constellation.cone_rad):.0f} deg of each axis",
        turn=f"{schedule.turn_slots * schedule.slot_s:.3f} s for a turn of the {schedule.turn_slots} nearest",
        emitter_m=constellation.position_m,
        half_m=SIDE_M / 2,
        views=views,
        rows=_place_rows(constellation, floor_m),
        clip=stations[0],
        stations=stations[1],
        command=this_command(),
    )


def _place_rows(constellation: Constellation, floor_m: float) -> list[CoverageRow]:
    """Coverage of the cube on the floor below the middle of the emitters, and of squares at heights in it."""
    middle_m = 0.5 * (np.min(constellation.position_m, axis=0) + np.max(constellation.position_m, axis=0))
    across_m = np.linspace(-SIDE_M / 2, SIDE_M / 2, _POINTS)

    def row(place: str, heights_m: object) -> CoverageRow:
        depths_m = floor_m - np.asarray(heights_m, dtype=float)
        grid = grid_m(middle_m[0] + across_m, middle_m[1] + across_m, depths_m)
        found: EmitterCoverage = emitter_coverage(constellation, grid)
        return CoverageRow(place, found.share, found.fix_share, found.median_emitters, found.median_dilution)

    whole = row(f"0 to {SIDE_M:g} m", np.linspace(0.0, SIDE_M, _POINTS))
    return [whole, *(row(f"{height_m:g} m", [height_m]) for height_m in HEIGHTS_M)]


def _station_rows(args: argparse.Namespace, constellation: Constellation) -> tuple[str, list[StationRow]]:
    """The name of the clip, and the coverage of each station of its performer."""
    from harness.body import retarget_to_own_body
    from harness.commands.viewed_motion import open_clip
    from harness.simulate import TrackerConfig, exact_calibration
    from harness.simulate.physics import station_coverage

    mounts = _mounts(args.stations or DEFAULT_STATIONS)
    clip: Clip = open_clip(args.clip, args.mocap, args.rate)
    body, motion = retarget_to_own_body(clip)
    found = station_coverage(constellation, body, motion, exact_calibration(body, mounts, TrackerConfig()))
    rows = [
        StationRow(name, found.shares(row), found.fix_share(row), found.median_dilution(row))
        for row, name in enumerate(found.stations)
    ]
    return clip.name, rows


def _mounts(name: str) -> "list[Mount]":
    """The nominal mounts of a set of stations; UnknownName."""
    from harness.experiment.scenarios import Station, read_station_sets

    sets = read_station_sets()
    if name not in sets:
        raise UnknownName("set of stations", name, sets)
    return [Station(**table).nominal_mount(station) for station, table in sets[name].items()]
