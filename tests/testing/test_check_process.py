"""The contract suite survives what a method from outside does to its process."""

import json
from pathlib import Path

import pytest

from harness.cli import main
from harness.experiment.isolation import Isolation
from harness.experiment.worker_process import close_fork_server
from harness.testing.check_process import check_rules_apart
from harness.testing.method_checks import check_rules
from harness.testing.rules import RULES
from tests.experiment.evil_methods import Exits, Honest, method_name


@pytest.mark.long
def test_a_method_that_ends_its_process_violates_the_rules_instead_of_passing(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["check", method_name(Exits), "--json"]) == 1
    content = json.loads(capsys.readouterr().out)
    findings = content["methods"][method_name(Exits)]
    assert content["outcome"] == "regressed"
    assert [finding["rule"] for finding in findings] == list(RULES)
    passed = [finding["rule"] for finding in findings if finding["ok"]]
    assert passed == ["the declared training data is consistent"]  # the only one that runs nothing
    assert findings[0]["seen"].endswith("ended with exit code 0.")


@pytest.mark.long
def test_the_findings_are_those_of_this_process() -> None:
    apart = list(check_rules_apart(method_name(Honest), Isolation()))
    assert apart == list(check_rules(Honest()))


BROKEN = """
import harness.core.rotations

def about_z(angle_rad):
    raise RuntimeError("the installation is broken")

harness.core.rotations.about_z = about_z
"""


@pytest.mark.long
def test_a_rule_that_no_method_can_satisfy_is_a_fault_of_the_system(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Python runs `sitecustomize` first; this one breaks a function in every process that is started."""
    (tmp_path / "sitecustomize.py").write_text(BROKEN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    close_fork_server()
    try:
        assert main(["check", method_name(Honest), "--json"]) == 5
    finally:
        close_fork_server()
    assert json.loads(capsys.readouterr().out)["outcome"] == "failed"
