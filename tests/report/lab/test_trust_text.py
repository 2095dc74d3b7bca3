"""The text of a trust study."""

from dataclasses import replace

from harness.report.lab.trust_content import TrustReport
from harness.report.lab.trust_text import EXPLORATORY, format_trust
from tests.report.fabricate_trust import fabricate_trust


def test_the_text_has_every_table_and_ends_with_the_reason() -> None:
    lines = format_trust(fabricate_trust()).splitlines()
    assert lines[0].startswith("our IS-900, spring: plan aaaaaaaaaaaa, scenario lab, simulated with unit.toml (cccc")
    assert lines[1] == "7 captures of 7 clips, 4 arms, 5 seeds"
    assert lines[-1] == "local_pca, all and dynamic_map, all contradict; and 1 more."
    (beyond,) = [line for line in lines if "beyond the margin" in line]
    assert " ".join(beyond.split()) == (
        "joint_angle_mean_deg dynamic_map, all beyond the margin 2.15 3.02 +0.87 +0.71 to +1.03 0.5"
    )
    (pair,) = [line for line in lines if "contradict " in line and "+0.170" in line]
    assert pair.split()[-1] == "0.030"
    assert "Kendall's tau-b: 0.67, 95 % interval 0.33 to 1.00" in lines
    assert "lost in walking_p1_01.rec: 12 bytes at byte 4,096" in lines
    (head,) = [line for line in lines if line.startswith("head ") and "|" in line]
    assert head.split("  ")[-1].strip() == "0.1 % | 0.0 %"
    (turned,) = [line for line in lines if line.startswith("head ") and "[mrad]" in line]
    assert " ".join(turned.split()) == "head orientation error [mrad] 3.100 0.700 0.004 50 and 50 of 2.4 s"
    assert any("3 blocks of 900 samples" in line for line in lines)
    assert max(map(len, lines)) <= 130


def test_an_exploratory_study_says_so_first() -> None:
    assert format_trust(fabricate_trust(exploratory=True)).splitlines()[0] == EXPLORATORY
    assert "EXPLORATORY" not in format_trust(fabricate_trust())


def test_failed_cells_are_named_with_the_last_line_of_their_reason() -> None:
    report = fabricate_trust()
    failed = replace(
        report.findings, failures={"ik, all on golf_p1_01, device": "Traceback\n  x\nZeroDivisionError: y\n"}
    )
    assert "failed: ik, all on golf_p1_01, device: ZeroDivisionError: y" in format_trust(TrustReport(failed, ""))


def test_a_study_that_compared_nothing_has_no_empty_tables() -> None:
    report = fabricate_trust()
    empty = replace(
        report.findings,
        health=(),
        distances=(),
        equivalences=(),
        pairs=(),
        rank_correlations=(),
        notes=(),
        unit_digest="",
    )
    text = format_trust(TrustReport(empty, ""))
    assert "Equivalence" not in text
    assert "simulated with noise unit.toml" in text
