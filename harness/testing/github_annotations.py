"""What GitHub shows beside the code, from the properties that a gate gave a test's report.

https://docs.github.com/actions/reference/workflow-commands-for-github-actions: `::error file=F,line=N,title=T::text`.
"""

from collections.abc import Iterator, Mapping

_LEVELS = {"worse": "error", "cannot tell": "warning"}


def format_annotations(properties: Mapping[str, str], file: str, line: int) -> Iterator[str]:
    """A line for each metric that is worse or cannot be told; for what could not be compared at all, one that says why.

    `properties` as `gate.Checked.properties` names them; none of them, no line.
    """
    told = False
    for name, verdict in properties.items():
        metric = name.removeprefix("harness.").removesuffix(".verdict")
        if name.endswith(".verdict") and verdict in _LEVELS:
            difference, interval = (properties[f"harness.{metric}.{what}"] for what in ("difference", "interval"))
            yield _annotation(
                _LEVELS[verdict], file, line, f"{metric} {verdict}", f"{difference}, 95 % interval {interval}"
            )
            told = True
    if not told and properties.get("harness.outcome", "pass") != "pass":
        yield _annotation("error", file, line, properties["harness.outcome"], properties["harness.why"])


def _annotation(level: str, file: str, line: int, title: str, message: str) -> str:
    return f"::{level} file={_escape(file, ':,')},line={line},title={_escape(title, ':,')}::{_escape(message)}"


def _escape(text: str, signs: str = "") -> str:
    return "".join(f"%{ord(sign):02X}" if sign in f"%\r\n{signs}" else sign for sign in text)
