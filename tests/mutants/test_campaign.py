"""A campaign on a small checkout, and copies in which no earlier code survives."""

from pathlib import Path

import pytest

from tests.mutants.campaign import RedReference, Result, run_campaign
from tests.mutants.checkout_copy import CheckoutCopy
from tests.mutants.equivalent import Equivalent
from tests.mutants.operators import Mutation, mutations

ROOT = Path(__file__).parents[2]
MODULE = "harness/score/small.py"
SOURCE = "def raised(x):\n    return x + 1\n\n\ndef spare(x):\n    return x + 2\n"
TEST = "from harness.score.small import raised\n\n\ndef test_sum():\n    assert raised(1) == 2\n"


def small_checkout(folder: Path, test: str = TEST) -> Path:
    """A package of one module, its test, and the plugin that pytest loads with the real package."""
    files = {MODULE: SOURCE, "harness/testing/plugin.py": "", "tests/score/test_small.py": test}
    files |= {f"{name}/__init__.py": "" for name in ("harness", "harness/score", "harness/testing")}
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def sums() -> list[Mutation]:
    """The mutations of both sums: one that a test notices, and one that none does."""
    return [m for m in mutations(MODULE, SOURCE) if m.operator == "plus_minus"]


@pytest.mark.long
@pytest.mark.parametrize("jobs", [1, 2])
def test_a_campaign_tells_caught_from_surviving_and_leaves_the_checkout_alone(tmp_path: Path, jobs: int) -> None:
    checkout, reported = small_checkout(tmp_path), list[Result]()
    noticed, unnoticed = sums()
    known = Equivalent(MODULE, "constant", "return x + 2", "return x + 3", "nobody calls it")
    same = next(m for m in mutations(MODULE, SOURCE) if known.matches(m))
    drawn = [noticed, unnoticed, same]
    results = run_campaign(checkout, drawn, [known], jobs=jobs, near=False, report=reported.append)
    assert [result.mutation for result in results] == drawn
    assert [result.outcome for result in results] == [
        "caught by tests/score/test_small.py::test_sum",
        "SURVIVED",
        "equivalent: nobody calls it",
    ]
    assert set(reported) == set(results)
    assert (checkout / MODULE).read_text() == SOURCE
    assert not list(checkout.rglob("__pycache__"))


@pytest.mark.long
def test_tests_that_fail_without_a_mutation_end_the_campaign(tmp_path: Path) -> None:
    checkout = small_checkout(tmp_path, TEST.replace("== 2", "== 3"))
    with pytest.raises(RedReference, match=r"The tests fail without a mutation: .*test_small\.py::test_sum"):
        run_campaign(checkout, sums(), [], jobs=1, near=True, report=lambda result: None)


@pytest.mark.long
def test_a_test_that_hangs_ends_at_the_limit(tmp_path: Path) -> None:
    test = "import time\n\n\ndef test_wait():\n    time.sleep(60)\n"
    (tmp_path / "copy").mkdir()
    copy = CheckoutCopy.make(small_checkout(tmp_path / "checkout", test), tmp_path / "copy")
    run = copy.run_tests(["tests/score/test_small.py"], limit_s=4.0)
    assert (run.passed, run.reason) == (False, "timeout")
    assert run.seconds < 30.0


def test_a_package_from_elsewhere_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    checkout = small_checkout(tmp_path / "checkout")
    (tmp_path / "copy").mkdir()
    monkeypatch.setattr(CheckoutCopy, "_environment", lambda self: {"PYTHONPATH": str(ROOT)})
    monkeypatch.setattr(CheckoutCopy, "python", lambda self, *arguments: str(ROOT / "harness" / "__init__.py"))
    with pytest.raises(RuntimeError, match="not from the copy"):
        CheckoutCopy.make(checkout, tmp_path / "copy")


@pytest.mark.long
def test_no_bytecode_of_earlier_source_is_used(tmp_path: Path) -> None:
    """All changes have the size of the source and come within a second, which bytecode files cannot tell apart."""
    (tmp_path / "copy").mkdir()
    copy = CheckoutCopy.make(small_checkout(tmp_path / "checkout"), tmp_path / "copy")
    ask = "-c", "from harness.score.small import raised; print(raised(5))"
    answers = [copy.python(*ask)]
    for mutation in (sums()[0], next(m for m in mutations(MODULE, SOURCE) if m.operator == "constant")):
        with copy.mutated(mutation):
            answers.append(copy.python(*ask))
        answers.append(copy.python(*ask))
    assert answers == ["6", "4", "6", "7", "6"]


@pytest.mark.long
def test_no_compiled_code_of_earlier_source_is_used(tmp_path: Path) -> None:
    """A compiled function is compiled anew for a mutation, and loaded again without it."""
    (tmp_path / "copy").mkdir()
    copy, module = CheckoutCopy.make(ROOT, tmp_path / "copy"), "harness/reconstruct/features/pose_space.py"
    ask = (
        "-c",
        "import numpy as np; from harness.reconstruct.features.pose_space import smooth; "
        "print(smooth(np.array([1.0]), np.array([10.0]), np.array([100.0]), 0.3, 0.4)[0])",
    )
    minus = "return share * now + share_before * before - share_earlier * earlier"
    (mutation,) = [m for m in mutations(module, (ROOT / module).read_text()) if m.mutant == minus]
    answers = [float(copy.python(*ask))]
    with copy.mutated(mutation):
        answers.append(float(copy.python(*ask)))
    answers.append(float(copy.python(*ask)))
    assert answers == pytest.approx([0.6 + 2.8 + 12.0, 0.6 + 2.8 - 12.0, 0.6 + 2.8 + 12.0])
