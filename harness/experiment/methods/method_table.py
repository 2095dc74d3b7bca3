"""The methods of a plan, each found once, with what the manifest says of them."""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from harness.core.files import content_key
from harness.experiment.methods.isolation import Isolation
from harness.experiment.methods.method_process import MethodFailure
from harness.experiment.methods.remote_method import NamedMethod, find_method, start_methods
from harness.results import source_hash


@dataclass(frozen=True)
class MethodTable:
    """The methods of these names; UnknownName, RenamedKey and BadInput for those that do not exist.

    A method that exists and cannot be made is left out: its cells fail and say why, those of others are run.
    """

    names: tuple[str, ...]
    isolation: Isolation

    def __post_init__(self) -> None:
        start_methods(self.names, self.isolation)  # they get ready at the same time
        self._found()

    def _found(self) -> list[NamedMethod]:
        found = []
        for name in self.names:
            with suppress(MethodFailure):
                found.append(find_method(name, self.isolation))
        return found

    @property
    def options(self) -> Mapping[str, str]:
        """Method -> text of its options."""
        return {method.name: method.options for method in self._found()}

    @property
    def training_data(self) -> Mapping[str, str]:
        """Method -> the training data that it declares."""
        return {method.name: method.training_data for method in self._found()}

    @property
    def sources(self) -> str:
        """Hash of the source of the package and of these methods."""
        return content_key([source_hash(), {method.name: method.source_hash for method in self._found()}])
