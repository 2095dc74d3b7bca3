"""What `characterize` and `validate` share: their unit file with its page, and the departures from another."""

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.flags import output_file
from harness.commands.output import print_caveat
from harness.core.progress import show_steps

if TYPE_CHECKING:
    from collections.abc import Iterable

    from harness.measure import UnitFile
    from harness.measure.reports import Departure
    from harness.report.kit import Page


@dataclass(frozen=True)
class UnitOptions:
    """The unit files that a verb reads and writes, as `add_unit_flags` asks for them."""

    out: Path | None
    """Unit file to write; None writes nothing."""
    expect: Path | None
    """Earlier unit file to compare with; None is the preset."""
    force: bool
    """Whether `out` may be replaced."""

    @property
    def name(self) -> str:
        """Name of the unit that is written; "" where nothing is."""
        return self.out.stem if self.out else ""


def add_unit_flags(verb: argparse.ArgumentParser, out: str) -> None:
    """Add `--out` with this help, `--force` and `--expect`, the flags of `UnitOptions`."""
    verb.add_argument("--out", type=output_file, metavar="FILE", help=out)
    verb.add_argument("--force", action="store_true", help="replace a unit file that exists")
    text = "earlier unit file to compare with (default: the noise preset `default`)"
    verb.add_argument("--expect", type=Path, metavar="FILE", help=text)


def read_expected(options: UnitOptions) -> "UnitFile | None":
    """The unit file to compare with; None without one. Also checks that the one of `out` can be written."""
    from harness.core.files import require_writable
    from harness.measure import UNIT_FILE, read_unit_file

    if options.out is not None:
        require_writable(options.out, UNIT_FILE, force=options.force)
    if options.expect is None:
        return None
    expected = read_unit_file(options.expect)
    print_caveat(options.expect, expected.caveat)
    return expected


def write_unit(options: UnitOptions, unit: "UnitFile", page: "Page") -> tuple[list[str], dict[str, str]]:
    """Write a unit file and its page: lines that say so, and content; nothing without `out`."""
    from harness.measure import write_unit_file
    from harness.report.kit import write_page

    if options.out is None:
        return [], {}
    write_unit_file(options.out, unit, force=options.force)
    with show_steps("parts of the report"):
        report = write_page(page, options.out.with_suffix(".html"))
    lines = [f"unit file: {options.out}", f"report: {report}"]
    return lines, {"unit_file": str(options.out), "page": str(report)}


def departure_content(checks: "Iterable[Departure]", *p_values: str) -> list[dict[str, Any]]:
    """Departures from what was expected, as content, with these p values."""
    return [
        {
            "key": check.key,
            "station": check.station,
            "measured": check.measured.as_dict(),
            "expected": check.expected.as_dict(),
            **{name: getattr(check, name) for name in p_values},
        }
        for check in checks
    ]
