"""The demo with one example and two seconds of one clip of each behaviour, for verbs that are only begun or ended."""

import re
from pathlib import Path

from harness.experiment.scenarios import find_scenario
from harness.mocap import synthetic


def short_demo(path: Path) -> Path:
    """Written as a scenario of its own."""
    text = find_scenario("demo").read_text("utf-8")
    for key, take in (("test", "_p1_01"), ("examples", "_p2_01"), ("behaviours", "")):
        names = ", ".join(f'"{behaviour}{take}"' for behaviour in synthetic.BEHAVIOURS)
        text, found = re.subn(rf"(?ms)^{key} = \[.*?\]", f"{key} = [{names}]", text)
        assert found == 1
    text, found = re.subn(r"longest_s = [\d.]+", "longest_s = 2.0", text)
    assert found == 1
    path.write_text(text, encoding="utf-8")
    return path
