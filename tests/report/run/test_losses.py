"""Where a method loses: planted errors are named by joint, phase of motion and reading, an even spread is not."""

import re
from pathlib import Path

import pytest

from harness.report.run.data import read_summary_only
from harness.report.run.losses import decompose_losses, loss_blocks, loss_sentence
from tests.planted import Plan, planted_run
from tests.products import run_verb
from tests.report.drawing import drawn_figures

pytestmark = pytest.mark.long
TWO = {"good": 1.0, "other": 1.0}


def run_of_eight(out: Path, **changes: object) -> Path:
    """The folder of a run of two methods and eight performers who jump."""
    plan = {"behaviours": ("jumping",), "methods": TWO, "takes": 8, "duration_s": 2.0, **changes}
    return planted_run(out / "run", Plan(**plan))  # type: ignore[arg-type]


def test_an_error_of_one_elbow_while_it_is_straight_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = run_of_eight(tmp_path, straight_elbow_deg={"other": 60.0})
    (loss,) = decompose_losses(read_summary_only(out))
    assert (loss.method, loss.reference, loss.joint) == ("other", "good", "left elbow")
    for parts in (loss.joints, [part for part in loss.phases if "°/s" not in part.name]):
        assert sum(part.share.value for part in parts) == pytest.approx(
            1.0 if parts is loss.joints else loss.bones["lradius"]
        )
    assert loss.bones["lradius"] == pytest.approx(1.0, abs=0.25)
    phase = loss.largest("phases")
    assert phase is not None
    assert phase.name == "the arm is straight (less than 30°)"
    assert 0.0 < phase.share.low <= phase.share.value <= phase.share.high
    sentence = loss_sentence(out)
    assert re.match(
        r"Why: other loses \d+ % of its \d\.\d\d° to good at the left elbow while the arm is straight", sentence
    )
    (figure,) = drawn_figures(lambda: loss_blocks([loss])).values()
    figure.draw_without_rendering()
    body, bars = figure.subfigs
    assert all(label.get_window_extent().x0 >= body.bbox.x1 for label in bars.axes[0].get_yticklabels())
    capsys.readouterr()
    run_verb("report", out)
    assert sentence in capsys.readouterr().out
    page = (out / "report.html").read_text(encoding="utf-8")
    assert page.index(sentence) < page.index("<section")
    assert "Where other loses to good" in page


def test_an_error_of_all_hinges_alike_is_not_named(tmp_path: Path) -> None:
    out = run_of_eight(tmp_path, methods={"good": 1.0, "other": 3.0})
    (loss,) = decompose_losses(read_summary_only(out))
    assert loss.is_different
    assert (loss.joint, loss.largest("joints"), loss.largest("phases")) == ("", None, None)
    assert sum(part.share.value for part in loss.joints) == pytest.approx(1.0)
    assert sum(part.share.value for part in loss.phases) == pytest.approx(1.0)
    assert re.search(
        r"other loses its \d\.\d\d° to good at no single joint \(most at the \w+: \d+ %\)", loss_sentence(out)
    )


def test_an_error_without_readings_of_a_station_is_named(tmp_path: Path) -> None:
    lost = {"station": "right_hand", "from_s": 2.0, "to_s": 2.4}
    out = run_of_eight(tmp_path, methods={"good": 1.0, "other": 3.0}, components={"lost": [lost]}, duration_s=4.0)
    (loss,) = decompose_losses(read_summary_only(out))
    reading = loss.largest("readings")
    assert reading is not None
    assert reading.name == "right_hand has no reading"
    assert reading.even_share < 0.5 * reading.share.value
    assert "of the time in which right_hand has no reading." in loss_sentence(out)


def test_equal_methods_have_no_loss_to_explain(tmp_path: Path) -> None:
    assert loss_sentence(run_of_eight(tmp_path)).endswith("so there is no loss to explain.")


def test_few_performers_tell_nothing(tmp_path: Path) -> None:
    out = run_of_eight(tmp_path, takes=5, straight_elbow_deg={"other": 60.0})
    (loss,) = decompose_losses(read_summary_only(out))
    assert not any(part.is_named for part in (*loss.joints, *loss.phases, *loss.readings))
    assert loss_sentence(out) == "Where other loses cannot be told from 5 performers: it takes at least 6."
