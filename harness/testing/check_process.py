"""The contract suite for a method from outside the package, in a process that it may end, hang or crash."""

from collections.abc import Iterator

from harness.experiment.isolation import DEFAULT_ISOLATION, Isolation
from harness.experiment.method_messages import MAX_TEXT
from harness.experiment.method_process import MethodFailure, MethodProcess
from harness.experiment.remote_method import RemoteMethod
from harness.testing.method_checks import RuleResult
from harness.testing.rules import RULES


def check_rules_apart(name: str, isolation: Isolation = DEFAULT_ISOLATION) -> Iterator[RuleResult]:
    """Check all rules in turn; the end of the method's process violates the rule that was checked.

    UnknownName and BadInput as for `registry.resolve`.
    """
    process = MethodProcess(name, isolation, "harness.testing.check_worker")
    method = RemoteMethod(name, process)
    try:
        for rule in RULES:
            yield _check_rule(method, rule)
    finally:
        process.close()


def _check_rule(method: RemoteMethod, rule: str) -> RuleResult:
    try:
        method.process.start()
        method.describe()
        answer, _ = method.process.request({"operation": "rule", "rule": rule}, {}, 10 * MAX_TEXT)
        return method.read(lambda: RuleResult(rule, answer["ok"] is True, str(answer["seen"])))
    except MethodFailure as error:
        lines = str(error).strip().splitlines() or ["no reason"]
        return RuleResult(rule, False, lines[-1])
