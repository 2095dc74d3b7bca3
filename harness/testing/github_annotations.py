"""GitHub annotations beside the code, made of the properties that the regression gate adds to a test report.

https://docs.github.com/actions/reference/workflow-commands-for-github-actions: `::error file=F,line=N,title=T::text`.
"""

from collections.abc import Iterator, Mapping

_LEVELS = {"worse": "error", "cannot tell": "warning"}


def format_annotations(properties: Mapping[str, str], file: str, line: int) -> Iterator[str]:
    """Yield a line for each metric that is worse or undecided, or one line that says why nothing could be compared.

    `properties` are named as in `GateResult.properties`.
    """
    annotated = False
    for name, verdict in properties.items():
        metric = name.removeprefix("harness.").removesuffix(".verdict")
        if name.endswith(".verdict") and verdict in _LEVELS:
            difference, interval = (properties[f"harness.{metric}.{key}"] for key in ("difference", "interval"))
            yield _annotation(
                _LEVELS[verdict], file, line, f"{metric} {verdict}", f"{difference}, 95 % interval {interval}"
            )
            annotated = True
    if not annotated and properties.get("harness.outcome", "pass") != "pass":
        yield _annotation("error", file, line, properties["harness.outcome"], properties["harness.why"])


def _annotation(level: str, file: str, line: int, title: str, message: str) -> str:
    return f"::{level} file={_escape(file, ':,')},line={line},title={_escape(title, ':,')}::{_escape(message)}"


def _escape(text: str, signs: str = "") -> str:
    return "".join(f"%{ord(sign):02X}" if sign in f"%\r\n{signs}" else sign for sign in text)
