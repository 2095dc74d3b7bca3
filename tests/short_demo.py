"""The demo with one example of each behaviour and two seconds of each clip, for verbs that are only begun or ended."""

import re
from pathlib import Path

from harness.experiment.scenario import find_scenario
from harness.mocap import synthetic


def short_demo(path: Path) -> Path:
    """Written as a scenario of its own."""
    examples = ", ".join(f'"{behaviour}_p2_01"' for behaviour in synthetic.BEHAVIOURS)
    text, found = re.subn(
        r"(?s)examples = \[.*?\]", f"examples = [{examples}]", find_scenario("demo").read_text("utf-8")
    )
    text, also = re.subn(r"longest_s = [\d.]+", "longest_s = 2.0", text)
    assert (found, also) == (1, 1)
    path.write_text(text, encoding="utf-8")
    return path
