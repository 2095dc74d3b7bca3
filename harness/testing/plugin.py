"""The pytest plugin: a project's own test may hold its method to a baseline.

    def test_my_method(harness_gate):
        harness_gate("my_module:MyMethod", baseline="mine")

pytest loads this file in every project of an environment that has the harness; nothing more is imported until a test
asks for it.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("harness", "gates of body-motion methods (fixture harness_gate)")
    text = "where baselines are, below the root of the tests unless absolute (default: results/baselines)"
    group.addoption("--harness-baselines", metavar="DIR", default="results/baselines", help=text)
    text = "keep the runs of gates there and go on with what is finished (default: with the other temporary files)"
    group.addoption("--harness-out", metavar="DIR", help=text)
    text = "keep what each gated method measures now as its baseline; compares nothing"
    group.addoption("--harness-save", action="store_true", help=text)


@pytest.fixture
def harness_gate(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., None]:
    """`harness_gate("my_module:MyMethod", baseline="NAME")` fails unless the method is as good as it was.

    It is run where the baseline was measured and compared with what the baseline has of the method, or of
    `baseline_method`; `metrics` names what must not be worse. With --harness-save it becomes the baseline instead, on
    `scenario` (a shipped one or a file) where there is none yet.
    """
    from harness.compare.margins import GATED_METRICS
    from harness.errors import HarnessError
    from harness.testing.regression_gate import RegressionGate

    root, options = request.config.rootpath, request.config.option
    out = root / options.harness_out if options.harness_out else tmp_path_factory.getbasetemp() / "harness"
    gate = RegressionGate(out, root / options.harness_baselines, command=f"pytest {request.node.nodeid}")

    def held(
        method: str,
        baseline: str,
        *,
        baseline_method: str | None = None,
        scenario: str | None = None,
        metrics: tuple[str, ...] = GATED_METRICS,
    ) -> None:
        __tracebackhide__ = True
        if str(root) not in sys.path:
            sys.path.append(str(root))  # methods may lie there, as where the command line is used
        try:
            if options.harness_save:
                kept = gate.save_baseline(method, baseline, scenario=scenario)
                pytest.skip(f"kept as baseline {kept}: nothing was compared")
            checked = gate.check(method, baseline, against=baseline_method, metrics=metrics)
        except HarnessError as error:
            raise pytest.fail.Exception(f"harness: {error}", pytrace=False) from None
        request.node.user_properties += checked.properties()  # as `record_property`, which warns where it need not
        if not checked.passed:
            pytest.fail(str(checked), pytrace=False)

    return held


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """On GitHub, what gates found, where a reader of the change sees it."""
    if os.environ.get("GITHUB_ACTIONS") != "true":
        return
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        properties = {name: str(value) for name, value in report.user_properties if name.startswith("harness.")}
        if properties:
            from harness.testing.github_annotations import format_annotations

            path, line, _ = report.location
            file = os.path.relpath(config.rootpath / path, os.environ.get("GITHUB_WORKSPACE") or config.rootpath)
            for text in format_annotations(properties, Path(file).as_posix(), (line or 0) + 1):
                terminalreporter.write_line(text)
