"""What every reconstructor must do: `check_method(MyMethod())` in your tests, or `harness check my_module:MyMethod`."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from harness.errors import HarnessError, was_interrupted
from harness.reconstruct.contract import Method
from harness.testing.contract_case import make_case
from harness.testing.rules import RULES
from harness.testing.rules.assertions import RuleViolation


class MethodContractError(HarnessError):
    """A rule of the contract that a method does not keep."""

    def __init__(self, method: str, rule: str, seen: str) -> None:
        super().__init__(method, rule, seen)
        self.method, self.rule, self.seen = self.args

    def __str__(self) -> str:
        return f"{self.method} breaks the rule that {self.rule}: {self.seen}."


@dataclass(frozen=True)
class RuleResult:
    """One rule, whether the method keeps it, and what was seen."""

    rule: str
    ok: bool
    seen: str

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def check_method(method: Method) -> None:
    """Every rule; MethodBroken at the first that does not hold."""
    for finding in check_rules(method):
        if not finding.ok:
            raise MethodContractError(method.name, finding.rule, finding.seen)


def check_rules(method: Method) -> Iterator[RuleResult]:
    """Every rule, one after another, whatever the method raises."""
    trial = make_case(method)
    for rule, check in RULES.items():
        try:
            yield RuleResult(rule, True, check(trial))
        except RuleViolation as broken:
            yield RuleResult(rule, False, str(broken))
        except (Exception, SystemExit) as error:  # a method may raise anything: that is the finding
            if was_interrupted(error):
                raise
            yield RuleResult(rule, False, f"raised {type(error).__name__}: {error}")
