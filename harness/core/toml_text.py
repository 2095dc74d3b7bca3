"""Text of TOML files. Floats keep every digit."""

import re
from collections.abc import Mapping
from typing import Any

import tomli_w

_ARRAY = re.compile(r"\[\n +([^\[\]]*),\n *\]")
"""An array without arrays in it, as tomli-w writes it: one line for each value. Strings have no line breaks."""


def format_toml(content: Mapping[str, Any]) -> str:
    """The text of tables, with arrays on one line; TypeError for values that TOML does not have."""
    return _ARRAY.sub(lambda found: "[" + re.sub(r",\n +", ", ", found[1]) + "]", tomli_w.dumps(content))
