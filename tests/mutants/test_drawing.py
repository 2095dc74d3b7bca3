"""The draw, the list of equivalent mutations, and the order of the test files."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.mutants.campaign import Result, share_caught
from tests.mutants.drawing import PACKAGES, all_mutations, draw
from tests.mutants.equivalent import FILE, Equivalent, read_equivalents, reason_of, unmatched
from tests.mutants.operators import Mutation, mutations
from tests.mutants.relevance import Suite

SOURCE = "x = 1\ny = (2, 3, 4, 5, 6, 7, 8, 9)\nz = a + b\n"
POSSIBLE = mutations("a.py", SOURCE)
ROOT = Path(__file__).parents[2]


def drawn(seed: int, count: int = 2) -> list[Mutation]:
    return draw(POSSIBLE, count, np.random.default_rng(seed))


def test_a_seed_draws_the_same_again_and_another_one_others() -> None:
    assert drawn(3) == drawn(3)
    assert len({tuple(map(str, drawn(seed))) for seed in range(20)}) > 5


def test_lines_are_equally_likely_and_give_one_mutation_each() -> None:
    """The line with eight constants is drawn as often as the two with one mutation: 1,000 of 3,000 times, sd 26."""
    counts = Counter(drawn(seed, 1)[0].number for seed in range(3000))
    assert set(counts) == {1, 2, 3}
    assert all(abs(count - 1000) < 130 for count in counts.values())
    assert sorted(m.number for m in drawn(1, 99)) == [1, 2, 3]


def entry(mutation: Mutation) -> Equivalent:
    return Equivalent(mutation.file, mutation.operator, mutation.line, mutation.mutant, "no reader")


def test_an_equivalent_mutation_is_known_by_its_text_not_by_its_line_number() -> None:
    moved = mutations("a.py", "\n\n" + SOURCE)
    known = entry(POSSIBLE[0])
    assert reason_of(moved[0], [known]) == "no reader"
    assert reason_of(moved[1], [known]) == ""
    assert unmatched([known], moved) == []
    assert unmatched([known], mutations("a.py", SOURCE.replace("x = 1", "x = 4"))) == [known]
    assert unmatched([known], mutations("b.py", SOURCE)) == [known]


def test_the_share_leaves_equivalent_mutations_out() -> None:
    one, two, three = POSSIBLE[:3]
    results = [Result(one, "tests/test_a.py::test_a"), Result(two), Result(three, equivalent="no reader")]
    assert share_caught(results) == 0.5
    assert share_caught(results[2:]) == 1.0


def test_entries_need_a_reason(tmp_path: Path) -> None:
    path = tmp_path / "equivalent.toml"
    path.write_text('[[equivalent]]\nfile = "a"\noperator = "b"\nline = "c"\nmutant = "d"\n')
    with pytest.raises(TypeError, match="reason"):
        read_equivalents(path)


@pytest.mark.long
def test_every_entry_matches_a_mutation_of_this_checkout() -> None:
    possible = all_mutations(ROOT)
    assert {m.file.split("/")[1] for m in possible} == set(PACKAGES)
    assert unmatched(read_equivalents(FILE), possible) == []
    assert all(len(each.reason) > 20 for each in read_equivalents(FILE))


def test_files_that_import_the_module_come_first_then_its_package() -> None:
    suite, module = Suite(ROOT), "harness/reconstruct/methods/local_pca.py"
    direct, mirrored, *others = suite.batches(module, near=False)
    assert direct[0] == "tests/reconstruct/methods/test_local_pca.py"
    assert "tests/reconstruct/methods/test_dynamic_map.py" in direct
    assert "tests/reconstruct/methods/test_ik.py" not in direct
    assert {Path(file).parent.as_posix() for file in mirrored} == {"tests/reconstruct/methods"}
    every = {file for batch in (mirrored, *others) for file in batch}
    assert {"tests/test_prose.py", "tests/stream/test_inputs.py"} <= every
    assert not any(file.startswith("tests/mutants") for file in every)
    near = {file for batch in suite.batches(module, near=True) for file in batch}
    assert near == {file for file in every if file.startswith("tests/reconstruct/")}
