"""The process in which `check_process` checks a method. Rules and method run together, because rules look at both."""

from collections.abc import Callable
from functools import cached_property

from harness.experiment.method_messages import Arrays, Header, Message
from harness.experiment.method_worker import MethodWorker, serve
from harness.testing.contract_case import ContractCase, make_case
from harness.testing.method_checks import check_rule


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
        return check_rule(self._case, header["rule"]).as_dict(), {}


def main(*descriptors: str) -> None:
    """Serve a method to a check."""
    serve(CheckWorker(), *descriptors)
