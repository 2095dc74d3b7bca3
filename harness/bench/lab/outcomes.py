"""What a lab's verbs find in planted captures: computed in processes, and stored as one small file for each capture."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.bench.lab.captures import NO_FAULTS, PLANTED_FAULTS, planted_capture
from harness.bench.lab.validated_captures import registration_errors, validate_planted
from harness.core.progress import ProgressCallback
from harness.errors import HarnessError
from harness.experiment.workers import TaskExecutor
from harness.measure.reports import Departure
from harness.results import source_hash
from harness.results.files import check_key, read_record, write_record
from harness.stream.recording import CaptureReader
from harness.study.trust.characterization import characterize_capture

_STORED = "an outcome of `harness bench lab --truth`"
_ADVICE = "Remove the file; the outcome is then computed again."


@dataclass(frozen=True)
class StoredNumber:
    """A measured parameter with its 95 % interval."""

    key: str
    value: float
    low: float | None
    high: float | None
    """Ends of the interval; None where it has no end."""

    def contains(self, value: float) -> bool:
        """Whether the interval contains a value."""
        return (self.low is None or self.low <= value) and (self.high is None or value <= self.high)


@dataclass(frozen=True)
class StoredCheck(StoredNumber):
    """A measured number that was compared with an expected one."""

    station: str
    """Station that was measured; "" is all together."""
    expected: float
    p_holm: float
    is_named: bool


@dataclass(frozen=True)
class CaptureOutcome:
    """What was found in one capture."""

    kind: str
    seed: int
    source: str
    """Hash of the source of the package that found it."""
    checks: tuple[StoredCheck, ...] = ()
    parameters: tuple[StoredNumber, ...] = ()
    """Parameters that were measured."""
    errors: dict[str, float] = field(default_factory=dict)
    """Errors of the registration of a capture without a fault (see `registration_errors`)."""
    exchanged: tuple[str, ...] = ()
    """Stations that are not where they are said to be, each with the body that carries it: "head: thorax"."""
    failure: str = ""
    """Message with which the verb refused the capture; "" if it did not."""

    @property
    def named(self) -> tuple[StoredCheck, ...]:
        """The departures that are named."""
        return tuple(check for check in self.checks if check.is_named)

    @property
    def names_nothing(self) -> bool:
        """Whether nothing was found to be wrong."""
        return not self.named and not self.exchanged and not self.failure


def collect_outcomes(
    tasks: Sequence[tuple[str, int]], out: Path, executor: TaskExecutor, progress: ProgressCallback
) -> dict[tuple[str, int], CaptureOutcome]:
    """The outcome of each kind and seed, from the files in `out` or computed and stored there.

    Outcomes that another version of the source stored are computed again. Raises BadFile for a damaged file.
    """
    found = {task: outcome for task in tasks if (outcome := _read_outcome(outcome_path(out, *task))) is not None}
    missing = [task for task in tasks if task not in found]
    for index, future in executor(find_outcome, [(*task, out) for task in missing]):
        found[missing[index]] = future.result()
        kind, seed = missing[index]
        progress(f"{kind} {seed}", len(found), len(tasks))
    return {task: found[task] for task in tasks}


def outcome_path(out: Path, kind: str, seed: int) -> Path:
    """File of an outcome."""
    return out / "captures" / kind / f"{seed:04d}.json"


def find_outcome(kind: str, seed: int, out: Path) -> CaptureOutcome:
    """Record a planted capture in a temporary folder, let the verb analyse it, and store the outcome."""
    with TemporaryDirectory(prefix="harness-lab-") as folder:
        try:
            outcome = _analyse(kind, seed, Path(folder))
        except HarnessError as error:
            outcome = CaptureOutcome(kind, seed, source_hash(), failure=str(error).replace(folder, "FOLDER"))
    path = outcome_path(out, kind, seed)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_record(path, outcome)
    return outcome


def _analyse(kind: str, seed: int, folder: Path) -> CaptureOutcome:
    if PLANTED_FAULTS[kind].verb == "validate":
        against = validate_planted(kind, seed, folder)
        exchanged = tuple(f"{station}: {body}" for station, body in sorted(against.exchanged.items()))
        errors = registration_errors(against, seed) if kind in NO_FAULTS else {}
        checks = stored_checks(against.report.checks)
        return CaptureOutcome(kind, seed, source_hash(), checks, errors=errors, exchanged=exchanged)
    found = characterize_capture(CaptureReader(planted_capture(kind, seed, folder)))
    parameters = tuple(
        StoredNumber(key, one.value, _finite(one.low), _finite(one.high))
        for key, one in found.profile.parameters.items()
        if one.is_measured
    )
    return CaptureOutcome(kind, seed, source_hash(), stored_checks(found.checks), parameters)


def stored_checks(checks: Sequence[Departure]) -> tuple[StoredCheck, ...]:
    """The checks as they are stored."""
    out = []
    for one in checks:
        measured, expected = one.measured, one.expected.value
        numbers = (one.key, measured.value, _finite(measured.low), _finite(measured.high))
        out.append(StoredCheck(*numbers, one.station, expected, one.p_holm, one.is_named))
    return tuple(out)


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _read_outcome(path: Path) -> CaptureOutcome | None:
    """A stored outcome of this version of the source; None without one. BadFile for one of another kind or seed."""
    if not path.exists():
        return None
    outcome = read_record(CaptureOutcome, path, _STORED, _ADVICE)
    check_key(path, f"{outcome.kind}/{outcome.seed:04d}", f"{path.parent.name}/{path.stem}", _STORED, _ADVICE)
    return outcome if outcome.source == source_hash() else None
