"""The contract suite for a method from outside the package, in a process that it may end, hang or crash.

Rules and method run together in that process, because rules look at both.
"""

from collections.abc import Callable, Iterator
from contextlib import closing
from functools import cached_property

from harness.errors import SystemFault
from harness.experiment.methods import (
    DEFAULT_ISOLATION,
    MAX_TEXT,
    Arrays,
    Header,
    Isolation,
    Message,
    MethodFailure,
    MethodProcess,
    MethodWorker,
    RemoteMethod,
    serve,
)
from harness.testing.contract_case import ContractCase, make_case
from harness.testing.method_checks import RuleResult, check_rule
from harness.testing.rules import RULES

_REFERENCE = "mean_pose"
"""Method of the package that satisfies every rule."""
_SEE_DOCTOR = "Something is wrong with this computer or installation: does `harness doctor` pass?"


def check_rules_apart(name: str, isolation: Isolation = DEFAULT_ISOLATION) -> Iterator[RuleResult]:
    """Check all rules in turn; the end of the method's process violates the rule that was checked.

    A rule that the method violates is checked with a method of the package too, in another process: SystemFault when
    that one violates it as well. UnknownName and BadInput as for `registry.resolve`.
    """
    tested, reference = (
        RemoteMethod(each, MethodProcess(each, isolation, "harness.testing.check_process"))
        for each in (name, _REFERENCE)
    )
    with closing(tested.process), closing(reference.process):
        for rule in RULES:
            result = _check_rule(tested, rule)
            if not result.ok and not (control := _check_rule(reference, rule)).ok:
                raise SystemFault(f"No method can be checked: {rule}: {_REFERENCE} {control.seen}.", _SEE_DOCTOR)
            yield result


def _check_rule(method: RemoteMethod, rule: str) -> RuleResult:
    try:
        method.process.start()
        method.describe()
        answer, _ = method.process.request({"operation": "rule", "rule": rule}, {}, 10 * MAX_TEXT)
        return method.read(lambda: RuleResult(rule, answer["ok"] is True, str(answer["seen"])))
    except MethodFailure as error:
        lines = str(error).strip().splitlines() or ["no reason"]
        return RuleResult(rule, False, lines[-1])


class CheckWorker(MethodWorker):
    """Also answers the request `rule`."""

    def operations(self) -> dict[str, Callable[[Header, Arrays], Message]]:
        return {**super().operations(), "rule": self._check_rule}

    @cached_property
    def _case(self) -> ContractCase:
        if self.method is None:
            raise RuntimeError("the method was not described")
        return make_case(self.method)

    def _check_rule(self, header: Header, arrays: Arrays) -> Message:
        return check_rule(self._case, header["rule"])._asdict(), {}


def main(*descriptors: str) -> None:
    """Serve a method to a check."""
    serve(CheckWorker(), *descriptors)
