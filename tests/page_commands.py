"""Commands of a page of docs/ as a reader types them: blocks marked `sh`, and the answers below them, marked `text`."""

import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

_FENCE = re.compile(r"^```(sh|text)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass
class ShellBlock:
    """Lines for a shell, and lines of the answer that they print."""

    commands: str
    answer: list[str] = field(default_factory=list)

    def harness_commands(self) -> list[str]:
        """What follows `harness` in each line."""
        return re.findall(r"^harness (.*?)(?: +(?:#|\|\|).*)?$", self.commands, re.MULTILINE)


def page_sections(text: str) -> dict[str, list[ShellBlock]]:
    """Heading of level 2 -> its blocks in order; sections without commands are left out."""
    found: dict[str, list[ShellBlock]] = {}
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        blocks: list[ShellBlock] = []
        for kind, body in _FENCE.findall(section):
            if kind == "sh":
                blocks.append(ShellBlock(body))
            else:
                blocks[-1].answer += body.splitlines()
        if blocks:
            found[section.splitlines()[0].strip()] = blocks
    return found


def run_block(block: ShellBlock, folder: Path) -> str:
    """Type the block into bash in a folder and return what it prints; RuntimeError where a command fails.

    `harness` is that of this environment. No library of motion is there.
    """
    environment = {name: value for name, value in os.environ.items() if name != "HARNESS_MOCAP"}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    command = ["bash", "-e", "-c", block.commands]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)  # noqa: S603
    if done.returncode != 0:
        raise RuntimeError(
            f"{block.commands}\nexit code {done.returncode}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        )
    return done.stdout


def has_answer(output: str, answer: str, tolerance: float = 0.05) -> bool:
    """Whether an output has the words of a line one after another, and its numbers to a relative tolerance."""
    wanted, printed = _tokens(answer), _tokens(output)
    return any(
        all(_alike(a, b, tolerance) for a, b in zip(wanted, printed[start:], strict=False))
        for start in range(len(printed) - len(wanted) + 1)
    )


def _tokens(text: str) -> list[str]:
    return re.findall(r"[-+−]?\d[\d,]*(?:\.\d+)?|[^\W\d]+|[^\w\s]", text)


def _alike(a: str, b: str, tolerance: float) -> bool:
    numbers = [re.sub("−", "-", token).replace(",", "") for token in (a, b)]
    if all(re.fullmatch(r"[-+]?\d+(\.\d+)?", number) for number in numbers):
        return math.isclose(float(numbers[0]), float(numbers[1]), rel_tol=tolerance, abs_tol=0.01)
    return a == b
