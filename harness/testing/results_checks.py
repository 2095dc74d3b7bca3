"""Checks that results cannot mislead: runs that repeat, edited files, copies of test clips, methods that fail."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from harness.compare import compare_runs
from harness.errors import BadFile, Outcome
from harness.experiment import run
from harness.experiment.methods import Isolation
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap import find_shared_motion, synthetic
from harness.results import load_run

_METHODS = ("ik:previous", "harness.testing.results_checks:Exit")
_METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "jitter_m_s3")
_SHORT_S = 2.0


@dataclass(frozen=True)
class Exit:
    """A method that ends its process when it is trained."""

    name: str = "exit"
    summary: str = "ends its process"
    needs_examples: bool = False

    def fit(self, body: Any, examples: Any, rng: Any) -> Any:
        import os

        os._exit(0)


def check_results() -> Iterator[tuple[str, bool, str]]:
    """Name, success and detail of each check; they take some seconds in a temporary folder."""
    yield "a copy of a test clip is found by its content", *_find_copy()
    with _short_run() as (first, second, outcome):
        failed = outcome is Outcome.INCOMPLETE and len(load_run(first).records) == 1
        yield "a method that ends its process fails its own cell only", failed, f"the run is {outcome.word}"
        comparison = compare_runs(first, second, methods=("ik:previous", "ik:previous"), metrics=_METRICS)
        word = comparison.outcome.word
        yield "two runs of the same code are level", comparison.outcome is Outcome.PASS, f"the comparison is {word}"
        yield "an edited result is refused", *_edit(first)


def _find_copy() -> tuple[bool, str]:
    """Whether a trimmed, renamed take is found, and another take is not."""
    take, other = (synthetic.generate("walking", "p1", number, seed=1, duration_s=6.0) for number in (1, 2))
    runs = [range(len(take.angles_rad))]
    trimmed = replace(
        take, name="trimmed", root_m=take.root_m[7:], world_from_root=take.world_from_root[7:],
        angles_rad=take.angles_rad[7:],
    )  # fmt: skip
    found = find_shared_motion(take, runs, trimmed, [range(len(trimmed.angles_rad))])
    different = find_shared_motion(take, runs, other, [range(len(other.angles_rad))])
    if found is None:
        return False, "a take without its first 7 frames is not found"
    length_s = found.second_s[1] - found.second_s[0]
    return different is None, f"{length_s:.1f} s of a trimmed take found; another take shares " + (
        "none" if different is None else "some"
    )


@contextmanager
def _short_run() -> Iterator[tuple[Path, Path, Outcome]]:
    """Folders of two runs of one short scenario, and the outcome of the first."""
    with TemporaryDirectory(prefix="harness-doctor-") as folder:
        first, second = Path(folder) / "first", Path(folder) / "second"
        isolated = Isolation(every_method=True)
        outcome = run(_short_scenario(), first, isolation=isolated)
        run(_short_scenario(), second, isolation=isolated)
        yield first, second, outcome


def _short_scenario() -> Scenario:
    demo = load_scenario("demo")
    motion = replace(demo.motion, test=("walking_p1_01",), behaviours=("walking",), longest_s=_SHORT_S)
    return replace(demo, motion=motion, methods=_METHODS, expected_order=(), name="doctor")


def _edit(folder: Path) -> tuple[bool, str]:
    """Whether the folder is refused after one digit of a cell was changed."""
    (cell,) = folder.glob("cells/*/cell.json")
    text = cell.read_text(encoding="utf-8")
    place = text.rindex(next(digit for digit in reversed(text) if digit in "12345678"))
    cell.write_text(text[:place] + "9" + text[place + 1 :], encoding="utf-8")
    try:
        load_run(folder)
    except BadFile as error:
        return True, error.found
    return False, "it was read"
