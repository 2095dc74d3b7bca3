"""`harness plot` as a user meets it."""

from pathlib import Path

import pytest

from tests.command import Command
from tests.planted import MeansPlan, planted_means_run


def test_it_names_the_file_its_size_and_a_caption(
    ranked: Path, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    lines = command("plot", ranked, "--out", "r.svg", "--methods", "ik,expert_map", "--width", "170").lines
    assert lines[0].startswith("figure: r.svg (170 x ")
    assert lines[1].startswith(
        "caption: Mean joint angle error on 8 clips of 8 performers. Lines: 95 % intervals over units."
    )
    assert lines[-1] == "pass"
    assert Path("r.svg").is_file()
    assert "r.svg: it exists" in command("plot", ranked, "--out", "r.svg", code=2).err
    said = command("plot", ranked, "--out", "r.svg", "--force", "--json").content
    assert (said["path"], said["kind"], said["width_mm"], said["outcome"]) == ("r.svg", "ranking", 85.0, "pass")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--kind rankin", "Did you mean 'ranking'?"),
        ("--metric mpjpe_m", "Did you mean 'mpjpe_mm'?"),
        ("--methods ikk", "Did you mean 'ik'?"),
        ("--kind time --clip jumping_p1", "Did you mean 'jumping_p"),
        ("--kind time --control ikk", "Did you mean 'ik'?"),
        ("--kind placement", "It is for a placement study."),
        ("--width 100", "Choose 85 or 170 mm."),
        ("--condition noise=clean", "no condition of the run called 'noise=clean'. Known: none."),
    ],
)
def test_what_is_refused_says_why(words: str, said: str, ranked: Path, tmp_path: Path, command: Command) -> None:
    ended = command("plot", ranked, "--out", tmp_path / "x", *words.split(), code=2)
    assert ended.out == "refused\n"
    assert said in ended.err.splitlines()[0]
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("failing", "code", "word"), [((), 3, "not comparable"), (("late",), 4, "incomplete")])
def test_a_run_without_a_measured_cell_ends_as_the_run_did(
    failing: tuple[str, ...], code: int, word: str, tmp_path: Path, command: Command
) -> None:
    methods = dict.fromkeys(("ik", *failing), 1.0)
    plan = MeansPlan(("jumping",), 1, methods, failing=failing, unmeasured=("ik",))
    out = planted_means_run(tmp_path / "run", plan)
    for verb in ("plot", "table"):
        ended = command(verb, out, code=code)
        assert word in ended.out + ended.err
        assert "no cell was measured" in ended.err
