"""A finished or unfinished run, loaded from its folder."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.errors import BadInput, MissingExtra
from harness.results.cell import Cell
from harness.results.reader import CellResult, ResultSet, load_results
from harness.results.storage import read_cells

if TYPE_CHECKING:
    from pandas import DataFrame

_IDENTITY = ("scenario", "behaviour", "clip", "performer", "seed", "method", "inputs", "split", "noise")


@dataclass(frozen=True)
class LoadedRun:
    """The results of a run or sweep: a record of each cell, and the arrays of each frame on request."""

    folder: Path
    results: ResultSet
    """Everything that comparisons use: the records, the manifest, the number of planned cells, the failed ones."""

    @property
    def records(self) -> tuple[CellResult, ...]:
        """One record for each finished cell, in the order of the tables: its identity, conditions and metrics."""
        return self.results.cells

    def cells(self, **identity: Any) -> Iterator[Cell]:
        """The finished cells with their arrays over F frames, read from the disk one at a time.

        `identity` chooses cells by equal fields, such as method="ik" or clip="walking_p1_01". BadInput for a field that
        cells do not have.
        """
        for name in identity:
            if name not in Cell.__dataclass_fields__:
                raise BadInput(f"Cells have no field {name!r}.", "Choose by clip, method, inputs, seed or noise.")
        cells = read_cells(self.folder)
        return (cell for cell in cells if all(getattr(cell, name) == value for name, value in identity.items()))

    def to_pandas(self) -> "DataFrame":
        """A table with a row for each record: identity, `vary.KEY` for varied keys, metrics (NaN: not measured).

        MissingExtra when pandas is not installed.
        """
        try:
            from pandas import DataFrame
        except ImportError:
            raise MissingExtra("A table of a run", "pandas", "pandas") from None
        return DataFrame(
            {name: getattr(record, name) for name in _IDENTITY}
            | {f"vary.{key}": value for key, value in record.varied.items()}
            | {name: float("nan") if value is None else value for name, value in record.metrics.items()}
            for record in self.records
        )


def load_run(folder: Path | str) -> LoadedRun:
    """Load the folder of a run or sweep, finished or not; BadFile when it holds none or is damaged."""
    return LoadedRun(Path(folder), load_results(folder))
