"""What the physical simulation must show, beside published figures: the table of `harness bench physics --truth`.

Every row is computed with the default settings. A row that misses its figure says so. Each family of rows has a module.
"""

from collections.abc import Callable, Iterable, Sequence

from harness.bench.physics.first_fix import first_fix_rows
from harness.bench.physics.hall import hall_rows
from harness.bench.physics.orientation import orientation_rows
from harness.bench.physics.single_station import station_rows
from harness.core.progress import ProgressCallback
from harness.results.findings import BenchmarkStatement

SEEDS = tuple(range(1, 21))
"""Seeds of each family. The defaults were chosen with other seeds, from 101 on."""
FAMILIES: dict[str, Callable[[Sequence[int]], Iterable[BenchmarkStatement]]] = {
    "single station": station_rows,
    "first fix": first_fix_rows,
    "hall": hall_rows,
    "orientation": orientation_rows,
}
"""What is measured, and its rows over seeds."""


def truth_rows(
    seeds: Sequence[int] = SEEDS, progress: ProgressCallback = lambda row, done, of: None
) -> list[BenchmarkStatement]:
    """The rows of the table, each over all seeds."""
    out: list[BenchmarkStatement] = []
    for done, (family, rows) in enumerate(FAMILIES.items()):
        progress(family, done, len(FAMILIES))
        out += rows(seeds)
    progress("", len(FAMILIES), len(FAMILIES))
    return out
