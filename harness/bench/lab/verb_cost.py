"""Cost of a lab's verb on one capture, in a process of its own.

    python -m harness.bench.lab.verb_cost VERB CAPTURE SEED

prints the processor time [s] and the peak memory [bytes] of the whole process as JSON. SEED is that of the planted
boxing, of which `validate` needs the true motion.
"""

import json
import sys
import time
from pathlib import Path

from harness.bench.peak_memory import peak_bytes
from harness.core.child_process import run_python

BOXING_KIND = "none_validated"
"""Kind of the planted captures that are validated."""


def measure_verb(verb: str, capture: Path, seed: int = 0) -> tuple[float, int]:
    """The cost of `characterize` or `validate` for a capture: CPU time [s] and peak memory [bytes].

    They are those of all threads, with the start of the process. RuntimeError when it fails.
    """
    output = run_python("harness.bench.lab.verb_cost", verb, str(capture), str(seed))
    cpu_s, peak_bytes = json.loads(output.splitlines()[-1])
    return cpu_s, peak_bytes


def run_verb(verb: str, capture: Path, seed: int) -> None:
    """Run the library behind a verb in this process."""
    from harness.stream.recording import CaptureReader

    if verb == "characterize":
        from harness.study.trust.characterization import characterize_capture

        characterize_capture(CaptureReader(capture))
    else:
        from harness.bench.lab.validated_captures import planted_truth
        from harness.study.trust.capture_readings import read_capture
        from harness.study.trust.validation import validate_capture

        validate_capture(read_capture(CaptureReader(capture)), planted_truth(BOXING_KIND, seed))


if __name__ == "__main__":
    run_verb(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]))
    print(json.dumps([time.process_time(), peak_bytes()]))
