"""Benchmarks by name, and what `harness bench` makes of their targets."""

from collections.abc import Callable
from pathlib import Path

import pytest

from harness.bench import benchmarks
from harness.bench.cpu_time import hold_cpu_to_limit
from harness.bench.limits import hold_to_limit, state_verdict
from harness.bench.startup import DemoTimes, demo_rows
from harness.errors import MissingExtra, Outcome, UnknownName
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.results.findings import BenchmarkStatement
from tests.command import Command


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


@pytest.mark.parametrize("name", ["leak", "load", "serve", "view"])
def test_a_benchmark_of_the_checkout_is_refused_with_its_command(name: str, command: Command) -> None:
    assert f"python -m tests.benchmarks {name}" in command("bench", name, code=Outcome.REFUSED.exit_code).err


MET, MISSED, UNKNOWN = (hold_to_limit("a", value, "x", most=1.0) for value in (1.0, 2.0, float("nan")))
INFORMATION = hold_to_limit("d", 2.0, "x")


@pytest.mark.parametrize(
    ("rows", "outcome", "last"),
    [
        ([MET, INFORMATION], Outcome.PASS, "0 of 1 target missed"),
        ([MET, MISSED, UNKNOWN, INFORMATION], Outcome.REGRESSED, "1 of 3 targets missed, 1 without a verdict"),
        ([MET, UNKNOWN], Outcome.NOT_COMPARABLE, "0 of 2 targets missed, 1 without a verdict"),
        ([INFORMATION], Outcome.PASS, "no target: the figures are for information"),
        ([], Outcome.NOT_COMPARABLE, "no target: the figures are for information"),
    ],
)
def test_a_missed_target_is_said_in_its_row_and_in_the_last_line(
    rows: list[BenchmarkStatement], outcome: Outcome, last: str, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setitem(benchmarks.BENCHMARKS, "stream", lambda seed, large, runs: rows)
    *lines, summary, word = command("bench", "stream", code=outcome.exit_code).lines
    assert (summary, word) == (last, outcome.word)
    assert [line.split()[-1] for line in lines if " missed" in line] == ["missed"] * rows.count(MISSED)
    content = command("bench", "stream", "--json", code=outcome.exit_code).content
    assert [row["verdict"] for row in content["rows"]] == [row.verdict for row in rows]


def test_a_missing_reference_leaves_all_benchmarks_incomplete_unless_a_target_is_missed(
    monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    for rows, outcome in ([MET], Outcome.INCOMPLETE), ([MISSED], Outcome.REGRESSED):
        made: dict[str, Callable[[int, bool, int], list[BenchmarkStatement]]] = {
            "index": benchmarks.BENCHMARKS["index"],
            "stream": lambda seed, large, runs, rows=rows: rows,  # type: ignore[misc]
        }
        monkeypatch.setattr(benchmarks, "BENCHMARKS", made)
        monkeypatch.setattr(benchmarks, "find_spec", lambda module: None)
        assert "index was not run." in command("bench", code=outcome.exit_code).out


def test_cpu_time_is_held_to_a_limit_in_units_of_the_reference_workload() -> None:
    none, endless = (hold_cpu_to_limit("work", cpu_s, 5.0, "a file") for cpu_s in (0.0, 1e6))
    assert (none.verdict, endless.verdict, none.unit) == ("met", "missed", "units")
    assert none.reference.startswith("0 s CPU; 1,000 reference runs 0.")
    assert none.reference.endswith("; a file")


def test_the_demo_is_held_to_ratios_of_the_same_run() -> None:
    times = DemoTimes(1.0, 30.0, 80.0, 160.0), DemoTimes(0.5, 10.0, 40.0, 70.0)
    rows = {row.text: row for row in demo_rows(*times, 0.5)}
    held = {name: (row.value, row.verdict) for name, row in rows.items() if row.target}
    assert held == {
        "demo, cold: first line / harness --help": (2.0, "met"),
        "demo, cold: first result / report": (0.375, "missed"),
        "demo, cold / warm: CPU time of all processes": (pytest.approx(16 / 7), "missed"),
    }
    assert rows["demo, cold: report"].measured == "80 s"
    busy = [(row.verdict, row.why) for row in demo_rows(*times, 0.5, doubt="overbooked") if row.target]
    assert busy == [("no verdict", "overbooked"), ("no verdict", "overbooked"), ("missed", "")]


@pytest.mark.long
@pytest.mark.parametrize("what", ["physics", "lab"])
def test_a_missed_row_of_a_truth_table_ends_with_1(
    what: str,
    error_models: ErrorModelComparison,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    command: Command,
) -> None:
    rows = [state_verdict("rest", "1 to 2 mm", "1.5 mm", True, "1.5 mm (Gilson et al. 2006)"), MISSED]
    monkeypatch.setattr("harness.bench.physics.truth.truth_rows", lambda *_: rows)
    monkeypatch.setattr("harness.bench.physics.error_statistics.compare_error_models", lambda *_: error_models.models)
    monkeypatch.setattr("harness.bench.lab.truth.lab_truth_rows", lambda *_: rows)
    lines = command("bench", what, "--truth", "--seeds", "1", "--out", tmp_path, code=Outcome.REGRESSED.exit_code).lines
    assert lines[-2:] == ["1 of 2 targets missed", "regressed"]
    assert lines[1].split("  ")[-1].strip() == "1.5 mm (Gilson et al. 2006)"
    assert (tmp_path / "report.html").exists() == (what == "physics")
