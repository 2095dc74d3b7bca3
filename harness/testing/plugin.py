"""The pytest plugin: the fixture `harness_gate` compares a method with a baseline in a project's own tests.

    def test_my_method(harness_gate):
        harness_gate("my_module:MyMethod", baseline="mine")

On GitHub it annotates the code with what the gates found.

pytest loads this file in every project of an environment that has the harness. Nothing else is imported until a test
uses the fixture.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

_LEVELS = {"worse": "error", "cannot tell": "warning"}


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
    from harness.core.working_folder import serve_folder
    from harness.errors import HarnessError
    from harness.testing.regression_gate import RegressionGate

    root, options = request.config.rootpath, request.config.option
    out = root / options.harness_out if options.harness_out else tmp_path_factory.getbasetemp() / "harness"
    baselines = root / options.harness_baselines

    def gate_method(
        method: str,
        baseline: str,
        *,
        baseline_method: str | None = None,
        scenario: str | None = None,
        metrics: tuple[str, ...] | None = None,
    ) -> None:
        __tracebackhide__ = True
        serve_folder(str(root))  # as on the command line, methods may lie there
        try:
            with _gate_progress(request.config, method) as progress:
                gate = RegressionGate(out, baselines, f"pytest {request.node.nodeid}", progress)
                if options.harness_save:
                    folder = gate.save_baseline(method, baseline, scenario=scenario)
                else:
                    result = gate.check(method, baseline, against=baseline_method, metrics=metrics)
        except HarnessError as error:
            raise pytest.fail.Exception(f"harness: {error}", pytrace=False) from None
        if options.harness_save:
            saved = f"{method} was saved as baseline {folder}; nothing was compared"
            request.node.user_properties.append(("harness.saved", saved))
            pytest.skip(saved)
        request.node.user_properties += result.properties()  # `record_property` would warn without need
        if not result.passed:
            pytest.fail(str(result), pytrace=False)

    return gate_method


@contextmanager
def _gate_progress(config: pytest.Config, method: str) -> Iterator[Callable[[str, int, int], None]]:
    """Say that a gate runs, which takes minutes; yields what shows its progress where pytest prints to a terminal."""
    from harness.core.progress import ProgressBar

    plugin = config.pluginmanager.get_plugin
    capture, terminal = plugin("capturemanager"), plugin("terminalreporter")
    if capture is None or terminal is None:  # a worker of pytest-xdist prints nothing
        yield lambda last, done, planned: None
        return
    bar = ProgressBar("cells")

    def show(last: str, done: int, planned: int) -> None:
        with capture.global_and_fixture_disabled():
            bar(last, done, planned)

    with capture.global_and_fixture_disabled():
        terminal.ensure_newline()
        terminal.write_line(f"harness: running {method}, which takes minutes")
    try:
        yield show
    finally:
        with capture.global_and_fixture_disabled():
            bar.__exit__()


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print which baselines were saved; on GitHub, print the results of regression gates beside the tests."""
    for report in terminalreporter.getreports("skipped"):
        for name, value in getattr(report, "user_properties", ()):
            if name == "harness.saved":
                terminalreporter.write_line(f"harness: {value}")
    if os.environ.get("GITHUB_ACTIONS") != "true":
        return
    for report in (*terminalreporter.getreports("passed"), *terminalreporter.getreports("failed")):
        properties = {name: str(value) for name, value in report.user_properties if name.startswith("harness.")}
        if properties:
            path, line, _ = report.location
            file = os.path.relpath(config.rootpath / path, os.environ.get("GITHUB_WORKSPACE") or config.rootpath)
            for text in format_annotations(properties, Path(file).as_posix(), (line or 0) + 1):
                terminalreporter.write_line(text)


def format_annotations(properties: Mapping[str, str], file: str, line: int) -> Iterator[str]:
    """GitHub annotations of a gate: a line for each metric that is worse or undecided.

    Without any, one line says why nothing was compared. `properties` are named as in `GateResult.properties`.
    """
    annotated = False
    for name, verdict in properties.items():
        metric = name.removeprefix("harness.").removesuffix(".verdict")
        if name.endswith(".verdict") and verdict in _LEVELS:
            difference, interval = (properties[f"harness.{metric}.{key}"] for key in ("difference", "interval"))
            yield _annotation(
                _LEVELS[verdict], file, line, f"{metric} {verdict}", f"{difference}, 95 % interval {interval}"
            )
            annotated = True
    if not annotated and properties.get("harness.outcome", "pass") != "pass":
        yield _annotation("error", file, line, properties["harness.outcome"], properties["harness.why"])


def _annotation(level: str, file: str, line: int, title: str, message: str) -> str:
    return f"::{level} file={_escape(file, ':,')},line={line},title={_escape(title, ':,')}::{_escape(message)}"


def _escape(text: str, signs: str = "") -> str:
    return "".join(f"%{ord(sign):02X}" if sign in f"%\r\n{signs}" else sign for sign in text)
