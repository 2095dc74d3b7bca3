"""What `characterize` and `validate` share: their unit file with its page, and the departures from another."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.output import print_caveat
from harness.core.progress import show_steps

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from harness.measure.reports.departures import Departure
    from harness.measure.unit_file import UnitFile
    from harness.report.kit.page import Page


def add_unit_flags(verb: argparse.ArgumentParser, out: str) -> None:
    """Add `--out` with this help, `--force` and `--expect`; `read_expected` and `write_unit` read them."""
    verb.add_argument("--out", type=Path, metavar="FILE", help=out)
    verb.add_argument("--force", action="store_true", help="replace a unit file that exists")
    text = "earlier unit file to compare with (default: the noise preset `default`)"
    verb.add_argument("--expect", type=Path, metavar="FILE", help=text)


def read_expected(args: argparse.Namespace) -> "UnitFile | None":
    """The unit file of `--expect`; None without one. Also checks that the one of `--out` can be written."""
    from harness.core.files import require_writable
    from harness.measure.unit_file import UNIT_FILE, read_unit_file

    if args.out is not None:
        require_writable(args.out, UNIT_FILE, force=args.force)
    expected = None if args.expect is None else read_unit_file(args.expect)
    print_caveat(args.expect, expected.caveat if expected else "")
    return expected


def write_unit(
    args: argparse.Namespace, make: "Callable[[], UnitFile]", page: "Page"
) -> tuple[list[str], dict[str, str]]:
    """Write the unit file of `--out` and its page: lines that say so, and content; nothing without `--out`."""
    from harness.measure.unit_file import write_unit_file
    from harness.report.kit.page_html import write_page

    if args.out is None:
        return [], {}
    write_unit_file(args.out, make(), force=args.force)
    with show_steps("parts of the report"):
        report = write_page(page, args.out.with_suffix(".html"))
    lines = [f"unit file: {args.out}", f"report: {report}"]
    return lines, {"unit_file": str(args.out), "page": str(report)}


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
