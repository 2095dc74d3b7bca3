"""The pytest plugin: the fixture `harness_gate` compares a method with a baseline in a project's own tests.

    def test_my_method(harness_gate):
        harness_gate("my_module:MyMethod", baseline="mine")

pytest loads this file in every project of an environment that has the harness. Nothing else is imported until a test
uses the fixture.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("harness", "regression gates of body-motion methods (fixture harness_gate)")
    text = "folder of the baselines, relative to the root of the tests (default: results/baselines)"
    group.addoption("--harness-baselines", metavar="DIR", default="results/baselines", help=text)
    text = "folder of the runs, resumed when the tests run again (default: a temporary folder)"
    group.addoption("--harness-out", metavar="DIR", help=text)
    text = "save the current result of each method as its baseline instead of comparing"
    group.addoption("--harness-save", action="store_true", help=text)


@pytest.fixture
def harness_gate(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., None]:
    """`harness_gate("my_module:MyMethod", baseline="NAME")` fails when the method is worse than the baseline.

    The method is run on the baseline's scenario and compared with the same method of the baseline, or with
    `baseline_method`. `metrics` names what must not become worse. With --harness-save the result becomes the baseline
    instead; a new baseline is measured on `scenario` (a shipped one or a file).
    """
    from harness.compare.margins import GATED_METRICS
    from harness.core.working_folder import serve_folder
    from harness.errors import HarnessError
    from harness.testing.regression_gate import RegressionGate

    root, options = request.config.rootpath, request.config.option
    out = root / options.harness_out if options.harness_out else tmp_path_factory.getbasetemp() / "harness"
    gate = RegressionGate(out, root / options.harness_baselines, command=f"pytest {request.node.nodeid}")

    def gate_method(
        method: str,
        baseline: str,
        *,
        baseline_method: str | None = None,
        scenario: str | None = None,
        metrics: tuple[str, ...] = GATED_METRICS,
    ) -> None:
        __tracebackhide__ = True
        serve_folder(str(root))  # as on the command line, methods may lie there
        try:
            if options.harness_save:
                folder = gate.save_baseline(method, baseline, scenario=scenario)
                pytest.skip(f"saved as baseline {folder}; nothing was compared")
            result = gate.check(method, baseline, against=baseline_method, metrics=metrics)
        except HarnessError as error:
            raise pytest.fail.Exception(f"harness: {error}", pytrace=False) from None
        request.node.user_properties += result.properties()  # `record_property` would warn without need
        if not result.passed:
            pytest.fail(str(result), pytrace=False)

    return gate_method


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """On GitHub, print the results of regression gates as annotations beside the tests."""
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
