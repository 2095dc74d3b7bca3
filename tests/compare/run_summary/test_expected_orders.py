"""Expected orders, judged on errors that are written down here."""

from typing import Any

import pytest

from harness.compare.run_summary.expected_orders import ExpectedOrder, evaluate_orders

METHODS = ExpectedOrder("a paper", methods=("new", "old", "ik"), why_not={"old > ik": "because"})
INPUTS = ExpectedOrder("a paper", inputs=("pos+ori", "pos"), method="new")


def row(method: str, error_deg: float | None, clip: str = "walk_01", **other: Any) -> dict[str, Any]:
    fields = {"behaviour": "walking", "inputs": "pos+ori", "performer": "known", "varied": {}}
    return {"method": method, "clip": clip, "joint_angle_mean_deg": error_deg, **fields, **other}


def test_an_order_holds_when_every_mean_is_less_than_the_next() -> None:
    (found,) = evaluate_orders([METHODS], [row("ik", 3.0), row("new", 1.0), row("old", 2.0), row("another", 0.1)])
    assert (found["holds"], found["means_deg"], found["clips"], found["why"]) == (True, [1.0, 2.0, 3.0], 1, [])


def test_every_step_that_goes_wrong_has_its_reason_or_none_is_known() -> None:
    (found,) = evaluate_orders([METHODS], [row("new", 3.0), row("old", 2.0), row("ik", 1.0)])
    assert found["holds"] is False
    assert found["why"] == ["new > old: no reason is known", "old > ik: because"]


@pytest.mark.parametrize(("other_deg", "holds"), [(1.004, False), (1.006, True)])
def test_a_difference_that_tables_do_not_show_is_none(other_deg: float, holds: bool) -> None:
    (found,) = evaluate_orders([METHODS], [row("new", 1.0), row("old", other_deg), row("ik", 3.0)])
    assert found["holds"] is holds


def test_means_are_over_the_clips_that_all_share() -> None:
    easy = [row("new", 9.0, "hard"), row("new", 1.0, "easy"), row("old", 2.0, "easy"), row("ik", 3.0, "easy")]
    (found,) = evaluate_orders([METHODS], [*easy, row("old", None, "hard"), row("ik", 0.0, "other")])
    assert (found["holds"], found["means_deg"]) == (True, [1.0, 2.0, 3.0])
    assert (found["clips"], found["clips_of_any"]) == (1, 3)


def test_performers_varied_values_inputs_and_behaviours_are_judged_apart() -> None:
    settings: list[dict[str, Any]] = [
        {},
        {"performer": "new"},
        {"varied": {"noise": "clean"}},
        {"inputs": "pos"},
        {"behaviour": "boxing"},
    ]
    rows = [row(name, e + n, **s) for n, s in enumerate(settings) for e, name in enumerate(METHODS.names)]
    found = evaluate_orders([METHODS], rows)
    assert [each["means_deg"] for each in found] == [[n, n + 1.0, n + 2.0] for n in range(5)]
    assert [each["performer"] for each in found] == ["known", "new", "known", "known", "known"]
    assert found[2]["varied"] == {"noise": "clean"}


def test_inputs_of_one_method_are_compared() -> None:
    rows = [row("new", 1.0), row("new", 2.0, inputs="pos"), row("ik", 5.0), row("ik", 0.5, inputs="pos")]
    (found,) = evaluate_orders([INPUTS], rows)
    assert (found["means_deg"], found["holds"], found["inputs"]) == ([1.0, 2.0], True, "")


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ([], "new, old, ik not measured"),
        ([row("new", 1.0), row("old", None)], "old, ik not measured"),
        ([row("new", 1.0, "a"), row("old", 2.0, "a"), row("ik", 2.0, "b")], "no clip on which all were measured"),
    ],
)
def test_what_cannot_be_judged_says_why(rows: list[dict[str, Any]], why: str) -> None:
    (found,) = evaluate_orders([METHODS], rows)
    assert (found["holds"], found["means_deg"], found["why"]) == (None, None, [why])


def test_methods_with_different_lags_have_no_order() -> None:
    (found,) = evaluate_orders([METHODS], [row("ik", 3.0), row("new", 1.0, lag=2), row("old", 2.0, lag=0)])
    assert (found["holds"], found["means_deg"]) == (None, None)
    assert found["why"] == ["methods with different lags are not ranked"]
    (found,) = evaluate_orders([METHODS], [row(name, n, lag=2) for n, name in enumerate(METHODS.names)])
    assert found["holds"] is True
