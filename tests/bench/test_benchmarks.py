"""Benchmarks by name: one whose reference is not installed is an error that names the extra."""

import pytest

from harness.bench import benchmarks
from harness.errors import MissingExtra, UnknownName


@pytest.mark.parametrize(("name", "package"), [("index", "faiss-cpu"), ("ik", "mink"), ("methods", "mink")])
def test_a_missing_reference_is_an_error_that_names_the_extra(
    name: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(benchmarks, "find_spec", lambda module: None)
    with pytest.raises(MissingExtra, match=rf"{package}; .*tracker-harness\[bench\]"):
        benchmarks.run_benchmarks([name], seed=1, progress=lambda *step: None)


def test_an_unknown_benchmark_is_refused_before_any_runs() -> None:
    steps: list[str] = []
    with pytest.raises(UnknownName, match="indexes"):
        benchmarks.run_benchmarks(["index", "indexes"], seed=1, progress=lambda name, done, planned: steps.append(name))
    assert not steps
