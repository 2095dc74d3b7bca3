"""The constellation: the fixed emitters of the room."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats, Ints, freeze
from harness.core.package_data import data_folder
from harness.core.ranges import Range, Text, check_fields
from harness.core.seeds import generator
from harness.errors import BadFile, BadInput, UnknownName
from harness.simulate.physics.emitters import MCF_SUFFIX, find_emitter_fault, read_mcf
from harness.simulate.physics.further_bars import further_bars
from harness.stream.polhemus.codec import Emitter

_UNIT_TOLERANCE = 1e-9


@dataclass(frozen=True)
class ConstellationSettings:
    """The emitters of a scenario."""

    name: Text = "cave"
    """A shipped constellation: `cave` for performers on the spot, `hall` for performers who walk, or one of two real
    rooms, `real_cave` and `real_walls` (`models/constellations/README.md`)."""
    file: Text = ""
    """Path of a file of `MCF` lines in the folder of the scenario's, or below it; it replaces `name`."""
    emitters: tuple[Emitter, ...] = ()
    """The emitters themselves; those of `file` once the scenario has been read. They replace `name`."""
    centre_m: Annotated[tuple[float, float] | None, Range(-100.0, 100.0)] = None
    """World x and y of the constellation's origin [m]; by default above the middle of the take's path."""
    cone_deg: Annotated[float, Range(1.0, 90.0)] = 70.0
    """Largest angle between an emitter's normal and its sound [deg] (docs/is900.md 13.1; that the published 70 deg are
    measured from the normal is a choice)."""
    range_m: Annotated[float, Range(0.1, 4.2)] = 4.0
    """Largest distance from emitter to station [m]: 4 m with power boosters, 3 m without (docs/is900.md 13.1)."""
    survey_sd_m: Annotated[float, Range(0.0, 1.0)] = 0.001
    """Standard deviation of the error of an emitter's surveyed position along each axis [m] [choice]."""

    def __post_init__(self) -> None:
        check_fields(self)
        if self.emitters:
            _check_emitters(self.emitters)

    def with_file_read(self, folder: Path) -> "ConstellationSettings":
        """The settings with the emitters of `file`, which is relative to the scenario's folder; BadFile.

        A file outside that folder is refused, also behind a symbolic link.
        """
        if not self.file:
            return self
        path = folder / self.file
        if not path.resolve().is_relative_to(folder.resolve()):
            raise BadFile(path, "a file outside the scenario's folder", "a path inside it", "Copy the file there.")
        return replace(self, emitters=read_mcf(path))


@dataclass(frozen=True, eq=False)
class Constellation:
    """J emitters in the tracker's frame, in the order in which they fire."""

    number: Ints
    """(J,) number of each emitter, unique."""
    position_m: Floats
    """(J, 3) positions [m]."""
    normal: Floats
    """(J, 3) unit vectors along the axes of the emitters."""
    identity: Ints
    """(J,) hardware identities."""
    cone_rad: float
    """Largest angle between an emitter's normal and its sound [rad]."""
    range_m: float
    """Largest distance from emitter to station [m]."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, number=("J",), identity=("J",))
        freeze(self, position_m=(len(self.number), 3), normal=(len(self.number), 3))
        length = np.sqrt(np.sum(self.normal**2, axis=1))
        if not (np.all(np.isfinite(self.position_m)) and np.all(np.abs(length - 1.0) <= _UNIT_TOLERANCE)):
            raise BadInput(
                "A constellation has a position that is not finite, or a normal that is not unit.", "Fix it."
            )
        if not 0.0 < self.cone_rad <= np.pi / 2 or not 0.0 < self.range_m < np.inf:
            found = f"Emitters with a cone of {np.rad2deg(self.cone_rad):g} deg and a range of {self.range_m:g} m."
            raise BadInput(found, "Give up to 90 deg, and a positive range.")

    @classmethod
    def of_emitters(cls, emitters: Sequence[Emitter], cone_rad: float, range_m: float) -> "Constellation":
        """A constellation of emitters whose normals may be rounded to two decimals.

        Raises BadInput for fewer than three emitters, two with one number or at one place, values that are not finite,
        and normals that are not unit.
        """
        _check_emitters(emitters)
        normal = np.array([emitter.normal for emitter in emitters])
        return cls(
            number=np.array([emitter.number for emitter in emitters], dtype=np.int64),
            position_m=np.array([emitter.position_m for emitter in emitters]),
            normal=normal / np.sqrt(np.sum(normal**2, axis=1, keepdims=True)),
            identity=np.array([emitter.identity for emitter in emitters], dtype=np.int64),
            cone_rad=cone_rad,
            range_m=range_m,
        )

    def __len__(self) -> int:
        """Number of emitters, J."""
        return len(self.number)

    @property
    def emitters(self) -> tuple[Emitter, ...]:
        """The emitters as values of the device's replies."""
        columns = (self.number, self.position_m, self.normal, self.identity)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        return tuple(Emitter(number, tuple(at), tuple(normal), identity) for number, at, normal, identity in rows)

    def translate(self, offset_m: Floats) -> "Constellation":
        """The constellation moved by an offset (3,) in the tracker's axes [m]."""
        return replace(self, position_m=self.position_m + offset_m)

    def with_survey_error(self, sd_m: float, seed: int, session: str) -> "Constellation":
        """The constellation at its true positions, which differ from the surveyed ones that the device knows.

        Errors are normal, of `sd_m` along each axis [m], for a whole session. Each emitter has its own generator.
        """
        error = [
            generator(seed, "physics", session, "survey", number).standard_normal(3) for number in self.number.tolist()
        ]
        return replace(self, position_m=self.position_m + sd_m * np.array(error))


def load_constellation(settings: ConstellationSettings, half_path_m: tuple[float, float] = (0.0, 0.0)) -> Constellation:
    """The constellation of a scenario, its origin in the tracker's.

    `hall` has further bars where the performer's root goes farther than usual from the middle of its path, along x and
    y [m]. Raises UnknownName for a name that is not shipped, and BadInput for a file that has not been read.
    """
    if settings.file and not settings.emitters:
        raise BadInput(f"constellation.file = {settings.file!r} has not been read.", "Load the scenario from its file.")
    emitters = settings.emitters or read_mcf(constellation_path(settings.name))
    if settings.name == "hall" and not settings.emitters:
        emitters = (*emitters, *further_bars(half_path_m))
    return Constellation.of_emitters(emitters, float(np.deg2rad(settings.cone_deg)), settings.range_m)


def constellation_path(name: str) -> Path:
    """The file of a shipped constellation; UnknownName."""
    shipped = {path.stem: path for path in sorted((data_folder("models") / "constellations").glob(f"*{MCF_SUFFIX}"))}
    if name not in shipped:
        raise UnknownName("constellation", name, shipped)
    return shipped[name]


def middle_of_path_m(root_m: Floats) -> Floats:
    """(2,) world x and y of the middle of the rectangle that a path (N, 3) of the root covers [m], in whole cm."""
    out: Floats = np.round(0.5 * (np.min(root_m[:, :2], axis=0) + np.max(root_m[:, :2], axis=0)), 2)
    return out


def check_reach(constellation: Constellation, position_m: Floats) -> None:
    """BadInput unless one of the places (N, 3) of stations lies in the cone and range of an emitter; tracker frame."""
    cone_cos = np.cos(constellation.cone_rad)
    nearest_m = np.inf
    for at_m, normal in zip(constellation.position_m, constellation.normal, strict=True):
        ray_m = position_m - at_m
        distance_m = np.sqrt(np.sum(ray_m**2, axis=1))
        if np.any((distance_m <= constellation.range_m) & (np.sum(ray_m * normal, axis=1) >= cone_cos * distance_m)):
            return
        nearest_m = min(nearest_m, float(np.min(distance_m, initial=np.inf)))
    raise BadInput(
        f"No station is within reach of an emitter: the nearest is {nearest_m:.2f} m away, of the {len(constellation)}"
        f" emitters' range of {constellation.range_m:g} m, or outside their cones.",
        "Move constellation.centre_m or tracker.origin_m, or use another constellation.",
    )


def _check_emitters(emitters: Sequence[Emitter]) -> None:
    if fault := find_emitter_fault(emitters):
        raise BadInput(f"The constellation has {fault.found}.", f"Give {fault.expected}.")
