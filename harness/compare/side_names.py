"""Names of results that are shown side by side.

A name is the label that the user gave, or as many of the last parts of a folder as tell it from the other folders.
"""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from harness.errors import BadInput


def name_sides(words: Sequence[str], *, shorten: bool = True) -> list[tuple[str, str]]:
    """The name of each side and its folder or baseline, of words such as "results/a" and "mine=results/b".

    Without `shorten` a side without a label has its folder as name. BadInput for a name that two sides have.
    """
    labelled = [_split_label(word) for word in words]
    folders = [where for _, where in labelled]
    names = _shortest_names(folders) if shorten else folders
    sides = [(label or name, where) for (label, where), name in zip(labelled, names, strict=True)]
    if shorten:
        check_side_names([name for name, _ in sides])
    return sides


def check_side_names(names: Sequence[str]) -> None:
    """BadInput for a name that occurs twice."""
    for name, times in Counter(names).items():
        if times > 1:
            raise BadInput(f"{name} is named {times} times.", "Name each once. NAME=FOLDER gives a folder a name.")


def _split_label(word: str) -> tuple[str, str]:
    label, sign, where = word.partition("=")
    return (label, where) if sign and where and "/" not in label and not Path(word).exists() else ("", word)


def _shortest_names(folders: Sequence[str]) -> list[str]:
    """The last parts of each folder, as few as no other folder ends with."""
    parts = [Path(folder).parts or (folder,) for folder in folders]
    names = []
    for own in parts:
        unique = (n for n in range(1, len(own) + 1) if sum(other[-n:] == own[-n:] for other in parts) == 1)
        names.append(str(Path(*own[-next(unique, len(own)) :])))
    return names
