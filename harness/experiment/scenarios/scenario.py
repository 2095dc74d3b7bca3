"""Scenarios: frozen records of what a TOML file says, and what follows from them (`scenario_reader` reads the file)."""

import itertools
import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from harness.body import Mount
from harness.compare.run_summary import ExpectedOrder
from harness.core.fields import replace_fields
from harness.core.ranges import FileName, MethodName, Name, Range, Text, check_fields
from harness.core.split import StatisticalUnit
from harness.errors import BadInput
from harness.experiment.scenarios.scenario_motion import ScenarioMotion
from harness.simulate import Disturbance, Noise, TrackerConfig, noise_preset
from harness.simulate.physics import ConstellationSettings, Physics
from harness.stream.polhemus import Fault

SCHEMA = 1
MOST_VARIANTS = 1_000_000
"""Most combinations of varied values [choice]."""
_NOT_VARIABLE = ("schema", "name", "methods", "inputs", "vary", "expected_order", "left_out", "fault", "fitted", "unit")


@dataclass(frozen=True)
class Station:
    """One station and its nominal mount (see `harness.body.mounts.Mount`)."""

    bone: str
    """Name of the bone that carries the station."""
    along: Annotated[float, Range(0.0, 1.0)] = 0.5
    """Position along the bone, 0 at its joint to 1 at its far end."""
    around_deg: Annotated[float, Range(-360.0, 360.0)] = 0.0
    """Angle around the bone [deg]."""
    stand_off_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    """Distance of the station's origin from the skin [m]."""

    def __post_init__(self) -> None:
        check_fields(self)

    def nominal_mount(self, name: str) -> Mount:
        """The mount of the station of that name."""
        return Mount(name, self.bone, self.along, float(np.deg2rad(self.around_deg)), self.stand_off_m)


@dataclass(frozen=True)
class CalibrationSettings:
    """Errors of a simulated performer who holds calibration poses, and of the true mounts."""

    miss_deg: Annotated[float, Range(0.0, 45.0)] = 2.5
    """Standard deviation of each hinge, and of the body's lean, from each pose [deg]."""
    hold_s: Annotated[float, Range(2.0, 60.0)] = 3.0
    """Time that each pose is held [s]."""
    beside_m: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Standard deviation of the stations' positions from their nominal mounts, along each axis [m]. It is part of the
    simulated world: the calibration `exact` knows it, the others estimate it."""
    turned_deg: Annotated[float, Range(0.0, 360.0)] = 0.0
    """Standard deviation of the stations' orientations about each axis [deg]; 180 is nearly random."""

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Scenario:
    """One experiment: every test clip with every method and every choice of inputs."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"order": "expected_order"}

    name: FileName
    motion: ScenarioMotion
    stations: dict[Name, Station]
    """The stations by name; in a file also the name of a set, such as "liu2011" (see `expand_station_set`)."""
    methods: tuple[MethodName, ...]
    """Methods by name, with options and alternatives in brackets (see `harness.core.options`)."""
    schema: int = SCHEMA
    seed: Annotated[int, Range(0, 2**63 - 1)] = 1
    """Seed of all random draws."""
    inputs: tuple[MethodName, ...] = ("pos+ori",)
    """Which of position and orientation each station delivers; every method runs with each choice."""
    worn: tuple[Name, ...] = ()
    """Names of the stations that are worn; all of them if empty. Vary "worn" to compare sets of stations. The stream
    has no other stations, so that a station that is not worn is not a lost one."""
    calibration: Literal["exact", "tpose", "poses", "liu2011", "kim2012"] = "exact"
    """Source of the mounts, room and body that methods get: `exact` is the truth, `tpose` estimates mounts and room
    from a T-pose (bone lengths are known), `poses` estimates all three from eight poses. `liu2011` and `kim2012` are
    the papers' equations as printed: eight poses, and a T-pose. Vary it to measure the cost of calibration."""
    calibrating: CalibrationSettings = field(default_factory=CalibrationSettings)
    """Errors of the simulated calibration."""
    mount: Text = "tibia"
    """Name of the mounting in tables, such as tibia or foot: the place of the ankle stations."""
    tracker: TrackerConfig = field(default_factory=TrackerConfig)
    """The device and its line."""
    noise: Literal["clean", "noise", "default"] = "default"
    """Noise preset."""
    profile: Text = ""
    """Name of changed noise in tables; without it the preset's name and an asterisk."""
    fitted: Text = ""
    """Unit file of a measured device (`harness characterize`), in the scenario's folder. Its components and tracker
    replace those of the preset `default`; the scenario's own tables take precedence."""
    components: dict[str, Any] = field(default_factory=dict)
    """Changes to the noise preset (see `harness.simulate.noise.Noise`), such as components.echo.share = 0.05."""
    physics: Physics | None = None
    """Errors from their causes instead of the statistical ones (docs/is900.md 16): the table [physics], which may be
    empty. The noise preset then selects the causes."""
    disturbance: Disturbance = field(default_factory=Disturbance)
    """A fault that ends; vary "disturbance.kind" to measure how methods recover (see `harness.compare.run_summary`)."""
    vary: dict[Text, Any] = field(default_factory=dict)
    """Scenario key -> list of values, such as "components.echo.share" = [0.0, 0.05]. Everything runs with each value,
    or with each combination of values when there are several keys."""
    expected_order: tuple[ExpectedOrder, ...] = ()
    """Rankings that papers state (see `harness.compare.run_summary.expected_orders`)."""
    unit: StatisticalUnit = "performer"
    """What statistics of the results count. Clips of one performer are not independent. `clip` is for test clips of too
    few performers: every page then says that its statements hold for these performers only."""
    left_out: dict[Text, Text] = field(default_factory=dict)
    """Clips, behaviours or experiments that a reader might miss -> the reason why they are left out."""
    fault: tuple[Fault, ...] = ()
    """Faults of the line when an emulator plays the scenario (see `stream.is900.emulator`); runs ignore them."""

    def __post_init__(self) -> None:
        check_fields(self)

    @property
    def noise_label(self) -> str:
        """Name of the noise in tables: the profile, or the preset, with an asterisk if components change it."""
        physical = " physics" if self.physics else ""
        return self.profile or self.noise + physical + ("*" if self.components else "")

    def content(self) -> dict[str, Any]:
        """The fields as a dictionary, without a table [physics] that is not there, and without the name of a unit file.

        The values of the unit are in the tables.
        """
        content = {**asdict(self), "tracker": self.tracker.as_dict()}
        del content["fitted"]
        if self.physics is None:
            del content["physics"]  # as before the key existed
        return content

    @property
    def worn_stations(self) -> dict[str, Station]:
        """The stations that are worn, in the order of the table."""
        return {name: self.stations[name] for name in self.stations if not self.worn or name in self.worn}

    @property
    def nominal_mounts(self) -> tuple[Mount, ...]:
        """Nominal mounts of the stations that are worn."""
        return tuple(station.nominal_mount(name) for name, station in self.worn_stations.items())

    @property
    def device(self) -> TrackerConfig:
        """The tracker with the clock that the noise preset gives it.

        Sampling in turn is an error of the clock. With the preset `clean` all stations are therefore sampled at one
        moment, unless the scenario sets `tracker.slot_s` (docs/is900.md 13.5).
        """
        simultaneous = self.noise == "clean" and self.tracker.slot_s is None
        return replace(self.tracker, slot_s=0.0) if simultaneous else self.tracker

    @property
    def noise_model(self) -> Noise:
        """The noise preset with the scenario's changes to single components; UnknownName, BadInput.

        With a table [physics] the preset selects causes of errors, and of the statistical components the clock remains.
        """
        if "physics" in self.components:
            raise BadInput("components.physics is no component.", "Write the table [physics] beside [components].")
        preset = noise_preset(self.noise)
        if self.physics is not None:
            preset = Noise(clock=preset.clock, physics=self.physics.with_preset(self.noise))
        try:
            return replace_fields(preset, self.components, "components")
        except (TypeError, ValueError) as error:
            raise BadInput(f"{error}.", "`harness.simulate.noise` says what each component takes.") from error

    @property
    def disturbed_noise(self) -> Noise:
        """The noise model with the disturbance of the stations that are worn."""
        return self.disturbance.add_to(self.noise_model, tuple(self.worn_stations))

    @property
    def label(self) -> str:
        """Name in a folder of several scenarios; it precedes the names of the scenario's cells."""
        return f"{self.name} seed {self.seed}"

    @property
    def varied_keys(self) -> dict[str, list[Any]]:
        """Dotted key -> the values of `vary`."""
        return dict(dotted_keys(self.vary))

    def count_variants(self) -> int:
        """Number of combinations of varied values, as `variants` lists them; BadInput for more than `MOST_VARIANTS`."""
        count = math.prod(len(values) for values in self.varied_keys.values())
        if count > MOST_VARIANTS:
            raise BadInput(f"vary: {count:,} combinations.", f"At most {MOST_VARIANTS:,}: vary fewer keys at a time.")
        return count

    def variants(self, chosen: Collection[int] = ()) -> list[tuple[dict[str, Any], "Scenario"]]:
        """Every combination of varied values with the scenario that it gives; one empty combination if nothing varies.

        `chosen` selects combinations by index. UnknownName for a key that does not exist, BadInput for a key that
        cannot be varied and for a value that does not fit.
        """
        choices = self.varied_keys
        for key, values in choices.items():
            if key.split(".")[0] in _NOT_VARIABLE or key in ("motion.test", "motion.behaviours"):
                raise BadInput(
                    f"vary: {key} cannot be varied.", "Name several methods, inputs or clips in their own lists."
                )
            if not isinstance(values, list) or not values or any(values.count(value) > 1 for value in values):
                raise BadInput(
                    f"vary: {key} = {values!r} is not a list of different values.", "Write it as [0.0, 0.05]."
                )
        self.count_variants()
        found = []
        for place, combination in enumerate(itertools.product(*choices.values())):
            if chosen and place not in chosen:
                continue
            values_by_key = dict(zip(choices, combination, strict=True))
            variant = replace(self, vary={})
            try:
                for key, value in values_by_key.items():
                    content: Any = value
                    for name in reversed(key.split(".")):
                        content = {name: content}
                    variant = variant.change(content, "scenario")
            except (TypeError, ValueError) as error:
                raise BadInput(
                    f"vary: {error}.", "A value must be one that the scenario's own key may have."
                ) from error
            found.append((values_by_key, variant))
        return found

    def change(self, content: Mapping[str, Any], where: str) -> "Scenario":
        """The scenario with some fields changed, as `core.fields.replace_fields` does it.

        BadInput for a change of `physics.constellation.file`, which is read with the scenario, and for a change of
        `physics.constellation.name` beside a file, which would have no effect.
        """
        changed = replace_fields(self, content, where)
        before, after = (s.physics.constellation if s.physics else ConstellationSettings() for s in (self, changed))
        if after.file != before.file:
            found = f"{where}: a change of physics.constellation.file."
            raise BadInput(found, "Write a scenario for each file; physics.constellation.name can be changed.")
        if after.file and after.name != before.name:
            found = f"{where}: physics.constellation.name = {after.name!r} beside physics.constellation.file."
            raise BadInput(found, "The file replaces the name: start from a scenario without it.")
        return changed


def dotted_keys(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Entries of a table under dotted keys, whether TOML read these as one text or as nested tables."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from dotted_keys(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value
