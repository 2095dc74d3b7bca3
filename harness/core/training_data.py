"""Training data that a method declares: whoever reads a rank must know whether the method may have seen the test clips.

A method declares it by its attribute `training_data`: "examples" if it learns from the examples of a run alone, "none"
if it learns nothing, else the names of outside data, such as "AMASS". A method without the attribute is listed and
ranked with the note "training data unknown". Results of versions that did not store it have no note.
"""

from harness.errors import BadInput

EXAMPLES, NONE, UNKNOWN = "examples", "none", "unknown"


def declared_training_data(method: object) -> str:
    """What a method declares; `UNKNOWN` without a declaration. BadInput for another declaration than a text."""
    text = getattr(method, "training_data", UNKNOWN)
    if not isinstance(text, str) or not text.strip():
        raise BadInput(f"training_data is {text!r}.", f"It must be a text such as {EXAMPLES!r}, {NONE!r} or 'AMASS'.")
    return text.strip()


def training_note(declared: str | None) -> str:
    """The note beside a method's name and rank: "" where it learns from the examples at most, or nothing was stored."""
    if declared in (None, EXAMPLES, NONE):
        return ""
    return "training data unknown" if declared == UNKNOWN else f"trained on {declared}"
