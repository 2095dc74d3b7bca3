"""All streams of `HARNESS_REAL` through the verb that suits them."""

from itertools import pairwise
from pathlib import Path

from harness.bench.foreign.pair_statements import pair_statements
from harness.bench.foreign.streams import matrix_files, real_folder, stream_pairs
from harness.bench.limits import hold_to_limit, state_verdict
from harness.errors import HarnessError
from harness.results.findings import BenchmarkStatement
from harness.stream import PoseFileOptions
from harness.stream.recording import open_poses
from harness.study.trust.characterization import characterize_log

POLHEMUS_HZ = 100.0
"""Rate that the authors of the matrices state [Hz]."""


def bench_foreign() -> list[BenchmarkStatement]:
    """Statements of all streams. NoRealStreams without the folder."""
    folder = real_folder()
    rows = [row for pair in stream_pairs(folder) for row in pair_statements(pair)]
    files = sorted((folder / "hand_eye").glob("*/*.csv"))
    rows += [describe_stream(path) for path in files]
    matrices = matrix_files(folder)
    if matrices:
        rows += _matrix_rows(matrices)
    return rows


def describe_stream(path: Path) -> BenchmarkStatement:
    """What `characterize` shows of a file of one moving body, with its notes."""
    profile = characterize_log(open_poses([path], PoseFileOptions())).profile
    timing, notes = profile.timing.all_stations, [note.partition(": ")[2] for note in profile.limits]
    rate, lost, twice = (timing[f"timing.{key}"] for key in ("rate_hz", "lost_share", "duplicate_share"))
    measured = f"{rate.scaled(1.0, 'Hz')}, lost {100.0 * lost.value:.1f} %, repeated {100.0 * twice.value:.1f} %"
    return state_verdict(f"{path.parent.name} {path.stem}: characterize", "", measured, None, " ".join(notes))


def _matrix_rows(files: list[Path]) -> list[BenchmarkStatement]:
    """Share of repeats of all files of matrices, beside a count of equal rows of text; files that are refused."""
    repeated, poses, equal, refused = 0, 0, 0, []
    for path in files:
        try:
            profile = characterize_log(open_poses([path], PoseFileOptions(rate_hz=POLHEMUS_HZ))).profile
        except HarnessError as error:
            refused.append(f"{path.name}: {error}")
            continue
        repeated += profile.timing.all_stations["timing.duplicate_share"].count
        poses += profile.stretches[0].records
        matrices = path.read_text(encoding="ascii").split("\n\n")
        equal += sum(one.split() == other.split() for one, other in pairwise(matrices))
    text = f"polhemus, {len(files) - len(refused)} of {len(files)} files: samples that repeat the one before"
    share, other = 100.0 * repeated / max(poses, 1), 100.0 * equal / max(poses, 1)
    about = f"{other:.2f} % of the texts of matrices"
    rows = [
        hold_to_limit(f"{text}, difference", abs(share - other), "%", most=0.1, reference=f"{share:.2f} and {about}")
    ]
    return rows + [state_verdict("polhemus: refused", "", reason, None) for reason in refused]
