"""Docstrings as Markdown: "[s] [choice]" is a unit and a tag, and no link."""

import re
from typing import Any

from griffe import Extension, Object


class TagsAreNoLinks(Extension):
    """Escapes the second of two brackets."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = re.sub(r"\] \[(?=\w+\])", r"] \\[", obj.docstring.value)
