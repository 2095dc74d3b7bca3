"""Who is in colour: the leader and the control, why it is the control, and that no two lines look alike."""

import pytest

from harness.report.kit.error_lines import Highlights, choose_highlights
from harness.report.kit.style import COLOURS, MUTED, STYLES


@pytest.mark.parametrize(
    ("ranked", "wanted", "control"),
    [
        (["map", "pca", "ik"], "ik", "ik"),
        (["map", "pca", "ik (pos)"], "ik", "ik (pos)"),
        (["map", "pca", "ik:previous"], "ik", "pca"),
        (["ik", "pca"], "ik", "pca"),
        (["map", "pca", "mean"], "mean", "mean"),
        (["map"], "ik", None),
    ],
)
def test_the_control_is_the_wanted_method_or_the_second(ranked: list[str], wanted: str, control: str | None) -> None:
    assert choose_highlights(ranked, wanted) == Highlights(ranked[0], control)


def test_only_leader_and_control_have_a_colour_and_come_first() -> None:
    others = [f"m{n}" for n in range(STYLES)]
    styles = Highlights("best", "ik").styles([*others, "ik", "best"])
    assert list(styles)[:2] == ["best", "ik"]
    assert [style["color"] for style in styles.values()] == [COLOURS[1], COLOURS[0], *[MUTED] * STYLES]
    looks = {(s["color"], str(s["linestyle"]), s.get("marker")) for s in styles.values()}
    assert len(looks) == len(styles)


def test_the_description_says_which_lines_are_coloured_and_why() -> None:
    text = Highlights("map", "ik").description
    assert text.startswith("Blue: map, the lowest mean error over all clips. Orange, dashed: ik, the control: inverse")
    assert Highlights("map", "pca").description.endswith("Orange, dashed: pca, the control.")
    assert "Orange" not in Highlights("map", None).description
