"""The contract suite for methods: `check_method(MyMethod())` in your tests, or `harness check my_module:MyMethod`."""

from collections.abc import Iterator
from typing import NamedTuple

from harness.core.fault_report import find_system_fault
from harness.errors import HarnessError, was_interrupted
from harness.reconstruct import Method
from harness.testing.contract_case import ContractCase, RuleViolation, make_case
from harness.testing.rules import RULES


class MethodContractError(HarnessError):
    """A method violates a rule of the contract."""

    def __init__(self, method: str, rule: str, seen: str) -> None:
        super().__init__(method, rule, seen)
        self.method, self.rule, self.seen = self.args

    def __str__(self) -> str:
        return f"{self.method} violates the rule '{self.rule}': {self.seen}."


class RuleResult(NamedTuple):
    """The result of one rule."""

    rule: str
    ok: bool
    seen: str
    """What was measured, or the fault."""


def check_method(method: Method) -> None:
    """Check all rules; MethodContractError at the first that the method violates."""
    for result in check_rules(method):
        if not result.ok:
            raise MethodContractError(method.name, result.rule, result.seen)


def check_rules(method: Method) -> Iterator[RuleResult]:
    """Check all rules in turn; an exception in the method counts as a violation."""
    case = make_case(method)
    for rule in RULES:
        yield check_rule(case, rule)


def check_rule(case: ContractCase, rule: str) -> RuleResult:
    """Check one rule; an exception in the method counts as a violation. SystemFault where no method is to blame."""
    try:
        return RuleResult(rule, True, RULES[rule](case))
    except RuleViolation as violation:
        return RuleResult(rule, False, str(violation))
    except (Exception, SystemExit) as error:  # a method may raise anything
        if was_interrupted(error):
            raise
        if fault := find_system_fault(error):
            raise fault from (None if fault is error else error)
        return RuleResult(rule, False, f"raised {type(error).__name__}: {error}")
