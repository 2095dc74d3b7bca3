"""A method of one's own held to a baseline: run where the baseline was measured, and compared with it.

`harness.testing.plugin` does this in a project's own tests.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path

from harness.compare import baseline
from harness.compare.comparison import Comparison, compare_results
from harness.compare.margins import GATED_METRICS, margin_of
from harness.core.fields import build
from harness.core.files import content_key
from harness.errors import BadInput, HarnessError, Outcome, UnknownName
from harness.experiment import engine
from harness.experiment.scenario import Scenario, load_scenario
from harness.report.comparison.wording import format_interval, format_signed, groups_vary
from harness.report.comparison.writer import text
from harness.results.manifest import Manifest
from harness.results.reader import BASELINES, ResultSet, load_results
from harness.results.storage import read_summary

DEFAULT_SCENARIO = "gate"
"""What a method is measured on when its first baseline is made, unless told otherwise."""
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True)
class GateResult:
    """What a comparison with a baseline came to."""

    comparison: Comparison
    first_traceback: str = ""
    """Traceback of the first cell that failed."""

    @property
    def passed(self) -> bool:
        return self.comparison.outcome is Outcome.PASS

    def __str__(self) -> str:
        """As `harness compare` prints it."""
        return "\n\n".join(filter(None, (text(self.comparison), self.first_traceback)))

    def properties(self) -> Iterator[tuple[str, str]]:
        """For a test report: the outcome, then the difference, interval and verdict of each gated line."""
        yield "harness.outcome", self.comparison.outcome.word
        yield "harness.why", self.comparison.why
        for line in self.comparison.differences:
            if line.gated:
                of = f"[{line.group}]" if groups_vary(self.comparison) else ""
                yield f"harness.{line.metric}{of}.difference", f"{format_signed(line, line.difference)} {line.unit}"
                yield f"harness.{line.metric}{of}.interval", format_interval(line)
                yield f"harness.{line.metric}{of}.verdict", line.verdict


@dataclass(frozen=True)
class RegressionGate:
    """Where baselines are and runs go; what a caller runs twice into one folder is resumed."""

    out: Path
    """Each run has a folder of its own there."""
    baselines: Path = BASELINES
    command: str = ""
    """That reproduces the run."""

    def check(
        self, method: str, name: str, *, against: str | None = None, metrics: Sequence[str] = GATED_METRICS
    ) -> GateResult:
        """Run `method` (such as "my_module:MyMethod") on the scenario of baseline `name`, and compare.

        `against` is the method of the baseline that it is held to: by default the one of the same name, or the only
        one. BadInput when there is no such baseline or it does not say which, UnknownName for methods and metrics;
        whatever a run refuses.
        """
        reference = self._read(name)
        known = list(dict.fromkeys(cell.method for cell in reference.cells))
        for metric in metrics:
            margin_of(metric)  # before the run
        held_to = against or (method if method in known else known[0] if len(known) == 1 else None)
        if held_to is None:
            raise BadInput(
                f"Baseline {name} has no {method}, and several others: {', '.join(known)}.",
                'Say which one it is held to with baseline_method="NAME", or keep one of its own.',
            )
        if held_to not in known:
            raise UnknownName(f"method in baseline {name}", held_to, known)
        run = self._run(replace(scenario_from_manifest(reference.manifest), methods=(method,)))
        now = replace(load_results(run), title=f"{method} now")
        comparison = compare_results(reference, now, methods=(held_to, method), metrics=metrics)
        return GateResult(comparison, next(iter(read_summary(run)["failures"].values()), ""))

    def save_baseline(self, method: str, name: str, *, scenario: str | None = None) -> Path:
        """Run `method` and keep what it measures as baseline `name`; returns its folder.

        On the `scenario`, a shipped one or a file; by default that of the baseline which is replaced, or `DEFAULT_SCENARIO`.
        BadInput when the baseline also has other methods, which would be lost.
        """
        exists = (self.baselines / name).is_dir()
        held = {cell.method for cell in self._read(name).cells} - {method} if exists else set()
        if held:
            raise BadInput(
                f"Baseline {name} also has {', '.join(sorted(held))}, which would be lost.",
                "Choose another name, or keep a run of all of them with `harness baseline save --force`.",
            )
        if scenario is None and exists:
            planned = scenario_from_manifest(self._read(name).manifest)
        else:
            planned = load_scenario(scenario or DEFAULT_SCENARIO)
        return baseline.write_baseline(
            self._run(replace(planned, methods=(method,), expected_order=())), name, self.baselines, force=True
        )

    def _read(self, name: str) -> ResultSet:
        folder = self.baselines / name
        if not folder.is_dir():
            raise BadInput(
                f"There is no baseline {name} in {self.baselines}.",
                "The test with `--harness-save` makes it of what the method measures now; "
                f"so does `harness baseline save {name} RUN` of a run.",
            )
        return load_results(folder)

    def _run(self, scenario: Scenario) -> Path:
        out = self.out / f"{scenario.name}-{content_key(repr(scenario))[:12]}"
        with _single_threaded():
            engine.run(scenario, out, jobs=2, command=self.command)
        return out


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Processes that are started meanwhile compute as the command line does, whatever this one has loaded: threads that
    wait for each other cost CPU time, and steps would seem many times as expensive."""
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value


def scenario_from_manifest(manifest: Manifest) -> Scenario:
    """What a run was of, read off its manifest, but for its methods. BadInput when it was no single scenario's."""
    known = {field.name for field in fields(Scenario)}
    content = {name: value for name, value in manifest.inputs.items() if name in known}
    try:
        return build(Scenario, {**content, "methods": []}, "manifest")
    except (TypeError, ValueError, HarnessError) as error:
        raise BadInput(
            f"The baseline's scenario cannot be read off its manifest ({error}).",
            "Save one of `harness run` with this version; those of sweeps are compared with `harness compare`.",
        ) from error
