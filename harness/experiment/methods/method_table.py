"""The methods of a plan, each found once, with what the manifest says of them."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from harness.core.files import content_key
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.remote_method import NamedMethod, find_method, start_methods
from harness.results import source_hash


@dataclass(frozen=True)
class MethodTable:
    """Methods that can be made, and the limits of their processes."""

    methods: tuple[NamedMethod, ...]
    isolation: Isolation

    @property
    def options(self) -> Mapping[str, str]:
        """Method -> text of its options."""
        return {method.name: method.options for method in self.methods}

    @property
    def training_data(self) -> Mapping[str, str]:
        """Method -> the training data that it declares."""
        return {method.name: method.training_data for method in self.methods}

    @property
    def sources(self) -> str:
        """Hash of the source of the package and of these methods."""
        return content_key([source_hash(), {method.name: method.source_hash for method in self.methods}])


def find_methods(names: Iterable[str], isolation: Isolation) -> MethodTable:
    """The methods of these names; UnknownName, RenamedKey and BadInput for those that do not exist.

    A method that exists and cannot be made is left out: its cells fail and say why, those of others are run.
    """
    distinct, methods = tuple(dict.fromkeys(names)), []
    start_methods(distinct, isolation)  # they get ready at the same time
    for name in distinct:
        with suppress(MethodFailure):
            methods.append(find_method(name, isolation))
    return MethodTable(tuple(methods), isolation)
