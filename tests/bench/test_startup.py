"""The times of the demo are those of its steps."""

from pathlib import Path

import pytest

from harness.bench.startup import time_demo
from harness.errors import HarnessError


@pytest.mark.slow
def test_the_second_demo_finds_the_machine_code_of_the_first(tmp_path: Path) -> None:
    cold, warm = (time_demo(tmp_path / name, tmp_path / "machine code", "--jobs", "2") for name in ("cold", "warm"))
    for times in (cold, warm):
        assert 0.0 < times.first_line_s < times.first_result_s < times.report_s
    assert warm.cpu_s < 0.7 * cold.cpu_s
    assert list((tmp_path / "machine code").rglob("*.nbc"))


def test_a_demo_that_fails_is_no_time(tmp_path: Path) -> None:
    with pytest.raises(HarnessError, match="exit code 2"):
        time_demo(tmp_path / "out", tmp_path / "machine code", "--jobs", "0")
