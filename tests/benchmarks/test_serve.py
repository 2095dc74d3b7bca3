"""What `python -m tests.benchmarks serve` makes of the notes of emulator and client."""

import os

import numpy as np
import pytest

from tests.benchmarks.serve import ServedRun, record_delays, served_rows


def test_a_record_is_there_when_its_last_byte_is_read() -> None:
    sent, written_s = b"aaaabbbbccccdddd", np.array([1.0, 2.0, 3.0, 4.0])
    delays_s = record_delays(sent, written_s, b"bbbbccccdd", [3, 6, 10], [2.1, 3.5, 4.5])
    np.testing.assert_allclose(delays_s, [1.5, 1.5])
    np.testing.assert_allclose(record_delays(sent, written_s, b"aaaa", [4], [1.25]), [0.25])
    for wrong in (b"bbbbcccd", b""):
        with pytest.raises(RuntimeError, match="did not receive"):
            record_delays(sent, written_s, wrong, [8], [2.0])


def test_rows_have_the_median_over_runs_and_all_missing_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "getloadavg", lambda: (0.0, 0.0, 0.0))
    runs = [
        ServedRun(np.full(10, delay), timer, n, np.full(5, 0.5))
        for delay, timer, n in ((3.0, 1.0, 0), (1.0, 0.5, 4), (9.0, 1.0, 1))
    ]
    above, missing = served_rows(runs)
    assert above.value == 2.0  # of 2, 0.5 and 8
    assert (
        "median of 3 runs; p50 3.00, p99 3.00 ms; timer p99 1.00 ms late; without recorder 0.50 and" in above.reference
    )
    assert (missing.value, missing.target, missing.verdict) == (5.0, "0", "missed")
    assert above.verdict == "missed"
    monkeypatch.setattr(os, "getloadavg", lambda: (99.0, 0.0, 0.0))
    above, missing = served_rows(runs)
    assert (above.verdict, missing.verdict) == ("no verdict", "missed")
