"""The regression gate for users' methods: run a method on a baseline's scenario and compare it with the baseline.

`harness.testing.plugin` offers it as a fixture for pytest.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path

from harness.compare import Comparison, compare_results, margin_of, write_baseline
from harness.core.fields import build
from harness.core.files import content_key
from harness.core.progress import ProgressCallback
from harness.core.working_folder import THREAD_VARIABLES
from harness.errors import BadInput, HarnessError, Outcome, UnknownName
from harness.experiment import run as run_scenario
from harness.experiment.scenarios import Scenario, load_scenario
from harness.report.comparison.page import comparison_text
from harness.report.comparison.wording import groups_vary, line_interval
from harness.results import Manifest, ResultSet, load_results, read_summary
from harness.results.files import BASELINES

DEFAULT_SCENARIO = "gate"
"""Scenario on which a new baseline is measured by default."""


@dataclass(frozen=True)
class GateResult:
    """Result of a comparison with a baseline."""

    comparison: Comparison
    first_traceback: str = ""
    """Traceback of the first cell that failed."""

    @property
    def passed(self) -> bool:
        return self.comparison.outcome is Outcome.PASS

    def __str__(self) -> str:
        """The text that `harness compare` prints, and the traceback."""
        return "\n\n".join(filter(None, (comparison_text(self.comparison), self.first_traceback)))

    def properties(self) -> Iterator[tuple[str, str]]:
        """Properties for a test report: the outcome, then difference, interval and verdict of each gated line."""
        yield "harness.outcome", self.comparison.outcome.word
        yield "harness.why", self.comparison.why
        for line in self.comparison.differences:
            if line.gated:
                group = f"[{line.group}]" if groups_vary(self.comparison) else ""
                yield f"harness.{line.metric}{group}.difference", f"{line_interval(line).number} {line.unit}"
                yield f"harness.{line.metric}{group}.interval", line_interval(line).ends
                yield f"harness.{line.metric}{group}.verdict", line.verdict


@dataclass(frozen=True)
class RegressionGate:
    """Folders of baselines and runs; a run that is repeated in the same folder is resumed."""

    out: Path
    """Folder of the runs, with a folder for each."""
    baselines: Path = BASELINES
    command: str = ""
    """The command that reproduces the run, for its manifest."""
    progress: ProgressCallback = lambda cell, done, planned: None
    """Called as cells end."""

    def check(
        self, method: str, name: str, *, against: str | None = None, metrics: Sequence[str] | None = None
    ) -> GateResult:
        """Run `method` (such as "my_module:MyMethod") on the scenario of baseline `name`, and compare.

        `against` is the method of the baseline to compare with: by default the one of the same name, or the only one.
        BadInput when the baseline does not exist or has several other methods; UnknownName for unknown methods and
        metrics; also raises what `harness.run` raises.
        """
        reference = self._read(name)
        methods = list(dict.fromkeys(cell.method for cell in reference.cells))
        for metric in metrics or ():
            margin_of(metric)  # refuses an unknown metric before the run
        baseline_method = against or (method if method in methods else methods[0] if len(methods) == 1 else None)
        if baseline_method is None:
            raise BadInput(
                f"Baseline {name} has no {method} but several others: {', '.join(methods)}.",
                'Name the one to compare with by baseline_method="NAME", or save a baseline of the method.',
            )
        if baseline_method not in methods:
            raise UnknownName(f"method in baseline {name}", baseline_method, methods)
        run = self._run(replace(scenario_from_manifest(reference.manifest), methods=(method,)))
        current = replace(load_results(run), title=f"{method} now")
        comparison = compare_results(reference, current, methods=(baseline_method, method), metrics=metrics)
        return GateResult(comparison, next(iter(read_summary(run)["failures"].values()), ""))

    def save_baseline(self, method: str, name: str, *, scenario: str | None = None) -> Path:
        """Run `method` and save its result as baseline `name`; returns the baseline's folder.

        `scenario` is a shipped one or a file; by default that of the baseline which is replaced, or `DEFAULT_SCENARIO`.
        BadInput when the baseline also has other methods, which would be lost.
        """
        exists = (self.baselines / name).is_dir()
        others = {cell.method for cell in self._read(name).cells} - {method} if exists else set()
        if others:
            raise BadInput(
                f"Baseline {name} also has {', '.join(sorted(others))}, which would be lost.",
                "Choose another name, or save a run of all of them with `harness baseline save --force`.",
            )
        if scenario is None and exists:
            planned = scenario_from_manifest(self._read(name).manifest)
        else:
            planned = load_scenario(scenario or DEFAULT_SCENARIO)
        return write_baseline(
            self._run(replace(planned, methods=(method,), expected_order=())), name, self.baselines, force=True
        )

    def _read(self, name: str) -> ResultSet:
        folder = self.baselines / name
        if not folder.is_dir():
            raise BadInput(
                f"There is no baseline {name} in {self.baselines}.",
                "Run the test with `--harness-save` to save the method's current result as that baseline, "
                f"or save a finished run with `harness baseline save {name} RUN`.",
            )
        return load_results(folder)

    def _run(self, scenario: Scenario) -> Path:
        out = self.out / f"{scenario.name}-{content_key(repr(scenario))[:12]}"
        with _single_threaded():
            run_scenario(scenario, out, jobs=2, command=self.command, progress=self.progress)
        return out


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Let processes that are started meanwhile use one thread for linear algebra, as the command line does.

    Threads that wait for each other cost CPU time, and steps would appear many times as expensive.
    """
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            del os.environ[name]
            if value is not None:
                os.environ[name] = value


def scenario_from_manifest(manifest: Manifest) -> Scenario:
    """Read the scenario of a run from its manifest, without methods. BadInput unless it is of a single scenario."""
    known = {field.name for field in fields(Scenario)}
    content = {name: value for name, value in manifest.inputs.items() if name in known}
    try:
        return build(Scenario, {**content, "methods": []}, "manifest")
    except (TypeError, ValueError, HarnessError) as error:
        raise BadInput(
            f"The baseline's scenario cannot be read from its manifest ({error}).",
            "Save a baseline of a `harness run` with this version. Compare baselines of sweeps with `harness compare`.",
        ) from error
