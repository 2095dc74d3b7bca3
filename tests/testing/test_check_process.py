"""The contract suite survives what a method from outside does to its process."""

from pathlib import Path

import pytest

from harness.experiment.methods import Isolation, close_fork_server
from harness.testing import check_process
from harness.testing.check_process import check_rules_apart
from harness.testing.method_checks import check_rules
from harness.testing.rules import RULES
from tests.command import Command
from tests.experiment.evil_methods import Exits, Honest, method_name

TRAINING_RULE = "the declared training data is consistent"


@pytest.mark.long
def test_a_method_that_ends_its_process_violates_the_rules_instead_of_passing(
    monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """Every rule takes a new process, so that some of each kind are tried."""
    tried = [*list(RULES)[::5], "a fitted method works in another process", TRAINING_RULE]
    monkeypatch.setattr(check_process, "RULES", {rule: RULES[rule] for rule in tried})
    content = command("check", method_name(Exits), "--json", code=1).content
    findings = content["methods"][method_name(Exits)]
    assert content["outcome"] == "regressed"
    assert [finding["rule"] for finding in findings] == tried
    passed = [finding["rule"] for finding in findings if finding["ok"]]
    assert passed == [TRAINING_RULE]  # the only one that runs nothing
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
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    """Python runs `sitecustomize` first; this one breaks a function in every process that is started."""
    (tmp_path / "sitecustomize.py").write_text(BROKEN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    close_fork_server()
    try:
        said = command("check", method_name(Honest), "--json", code=5)
    finally:
        close_fork_server()
    assert said.content["outcome"] == "failed"
