"""The motion of a scenario: its test clips, and the clips that methods may learn from."""

import fnmatch
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Self

from harness.core.ranges import Name, Range, check_fields
from harness.errors import BadInput


@dataclass(frozen=True)
class ScenarioMotion:
    """The test clips of a scenario, and the clips that methods may learn from.

    Clip lists take patterns: "13_*" stands for every clip that matches (see `match_clips`).
    """

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"protocol": "split"}

    source: Literal["builtin", "cmu"]
    """`builtin` is the motion generator; `cmu` is the library that --mocap or HARNESS_MOCAP names."""
    test: tuple[Name, ...]
    """Test clips by name; "13_17@0.20-0.40" is that part of the take (for split `block`)."""
    behaviours: tuple[Name, ...]
    """Behaviour of the test clips: one word for all of them, or one word for each."""
    examples: tuple[Name, ...] = ()
    """Clips that methods may learn from, except those that the split forbids for a test clip."""
    withheld: tuple[Name, ...] = ()
    """Clips and parts of clips that are no examples under any split, with 1 s around them: for example the test clips
    of the tables, while constants are chosen on other clips."""
    thin_to: Annotated[int, Range(0, 100_000_000)] = 0
    """Number of frames that all examples together keep, evenly spaced, for a sparse database (Kim et al. 2012); 0 keeps
    all."""
    example_share: Annotated[float, Range(1e-06, 1.0)] = 1.0
    """Share of the frames of all examples that is kept, in pieces of 0.5 s drawn by the scenario's seed; smaller
    shares are subsets of larger ones (see `harness.experiment.example_subset`)."""
    database: Literal["all", "behaviour"] = "all"
    """Learn from all examples, or only from those of the test clip's behaviour (Liu et al. 2011)."""
    split: Literal["block", "sequence", "subject"] = "sequence"
    """Frames that are no examples: those of the test block, of the test take, or of the test subject."""
    body: Literal["own", "standard", "common"] = "own"
    """Body of the test: `own` has the performer's proportions, the others are the mean skeleton. On `standard` the
    bones point as the performer's do; on `common` the recorded angles are kept and the root's path is scaled by the
    legs."""
    longest_s: Annotated[float, Range(0.0, 1e5)] = 0.0
    """Length of each test clip that is used, from its start [s]; 0 is all of it."""
    rate_hz: Annotated[float, Range(0.0, 1e4)] = 0.0
    """Frame rate of files that record none and that no index lists [Hz]; 0 refuses such files."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def tested(self) -> list[tuple[str, str]]:
        """Each test clip with its behaviour."""
        repeated = self.behaviours * (len(self.test) if len(self.behaviours) == 1 else 1)
        return list(zip(self.test, repeated, strict=True))

    @property
    def has_patterns(self) -> bool:
        """Whether a clip list has a pattern."""
        return any(map(_is_pattern, (*self.test, *self.examples, *self.withheld)))

    @property
    def behaviours_fit(self) -> bool:
        """Whether there is one behaviour, or one for each test clip; True while patterns hide how many there are."""
        return any(map(_is_pattern, self.test)) or len(self.behaviours) in (1, len(self.test))

    def match_clips(self, names: Collection[str]) -> Self:
        """The motion with every pattern in its clip lists replaced by the clips of these `names` that match it.

        The clips are sorted by name. "13_*@0.20-0.40" is that part of each. A clip that the list also names itself is
        not repeated. BadInput for a pattern that matches nothing.
        """
        test, examples, withheld = (
            _match_list(key, getattr(self, key), names) for key in ("test", "examples", "withheld")
        )
        return replace(self, test=test, examples=examples, withheld=withheld)


def _is_pattern(text: str) -> bool:
    return any(sign in text.partition("@")[0] for sign in "*?[")


def _match_list(key: str, texts: Sequence[str], names: Collection[str]) -> tuple[str, ...]:
    """The entries of one clip list with its patterns expanded."""
    entries: list[str] = []
    for text in texts:
        if not _is_pattern(text):
            entries.append(text)
            continue
        pattern, at, part = text.partition("@")
        matches = sorted(
            name for name in names if any(fnmatch.fnmatchcase(one, pattern) for one in {name, name.rpartition("/")[2]})
        )
        if not matches:
            raise BadInput(f"motion.{key}: no clip matches {text!r}.", "`harness mocap list` names those of a library.")
        entries += [f"{name}{at}{part}" for name in matches if f"{name}{at}{part}" not in (*texts, *entries)]
    return tuple(entries)
