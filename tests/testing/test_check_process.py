"""The contract suite survives what a method from outside does to its process."""

import json

import pytest

from harness.cli import main
from harness.experiment.isolation import Isolation
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
    assert not any(finding["ok"] for finding in findings)
    assert findings[0]["seen"].endswith("ended with exit code 0.")


@pytest.mark.long
def test_the_findings_are_those_of_this_process() -> None:
    apart = list(check_rules_apart(method_name(Honest), Isolation()))
    assert apart == list(check_rules(Honest()))
