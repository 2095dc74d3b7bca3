"""Captures with planted faults, as `harness record sim:` makes them, and what a lab's verbs have to find in each.

Captures for `harness characterize` are takes of the rig at rest. Those for `harness validate` are a minute of boxing.
Their stations are those of the scenario `lab`, and their errors those of the preset `default`, with one fault each.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from harness.body import retarget_to_own_body
from harness.core.arrays import Floats
from harness.core.fields import replace_fields
from harness.core.motion import Clip
from harness.core.package_data import VERSION
from harness.core.seeds import generator
from harness.errors import UnknownName
from harness.experiment.scenarios import Scenario, load_scenario
from harness.mocap import synthetic
from harness.mocap.synthetic import generate_rig, stretch_marks
from harness.simulate import (
    Dropout,
    SessionBias,
    TrackerConfig,
    Trajectory,
    sampling_times_s,
    simulate_readings,
    transmit_readings,
)
from harness.stream.polhemus import Fault, add_byte_faults
from harness.stream.polhemus.codec import ByteCapture, WireFormat
from harness.stream.recording import record_capture

SCENARIO = "lab"
FIVE_MINUTES, TWENTY_MINUTES = "rig_p1_02", "rig_p1_03"
"""Takes of the rig at rest."""
SHORT_S = 120.0
"""Length of the captures at rest of all faults but excursions, of which two minutes have a dozen [s]."""
BOXING, BOXING_S = "boxing", 60.0
"""Behaviour and length [s] of the motion before a reference."""
STATION, OTHER_STATION = "right_hand", "left_hand"
"""Station of the faults of one station, and the one that it is exchanged with."""
NO_FAULT = "none"
NO_FAULTS = (NO_FAULT, "none_validated")
"""Kinds of captures in which nothing may be named."""
EARLIER = "earlier"
"""Kind of the capture of the same session whose validation the scale is compared with."""
LOST_SHARE, REPEATED_SHARE, SCALE, LATENCY_S = 0.05, 0.01, 0.003, 0.02
"""Sizes of faults; the latency [s] is that to the first bit, and the last one comes a record later."""
LEAST_DRAW = 0.05
"""Least size of the draw of a session's scale. With a smaller one no scenario plants the scale, and the next seed of
the session is taken."""
WANTED = 0.95
"""Share of the captures in which a fault has to be named, or nothing where there is none, and an error be small."""
_NEXT_SEED = 1_000_000
_PERFORMER, _SESSION = "p1", "boxing_p1_01"
"""Performer of the boxing, and the take that names the session of all boxing."""


@dataclass(frozen=True)
class PlantedNumber:
    """A number that a verb has to name, and its planted size."""

    key: str
    value: float
    station: str = ""
    is_change: bool = False
    """Whether the size is the difference from what is expected."""


@dataclass(frozen=True)
class PlantedFault:
    """A fault as changes to the scenario `lab`, and the numbers by which it has to be named."""

    title: str
    verb: Literal["characterize", "validate"]
    numbers: tuple[PlantedNumber, ...] = ()
    """Numbers that all have to be named; () where none may be."""
    exchanged: tuple[str, ...] = ()
    """Stations that have to be named as exchanged, each with the body that carries it."""
    take: str = FIVE_MINUTES
    seconds: float = SHORT_S
    """Length of the capture [s]; that of the take if it is shorter."""
    components: Mapping[str, Any] = field(default_factory=dict)
    tracker: Mapping[str, Any] = field(default_factory=dict)
    line: tuple[Fault, ...] = ()


def _component_fault(title: str, component: str, take: str = FIVE_MINUTES, **values: float) -> PlantedFault:
    """Other values of an error component, each of which `characterize` has to name."""
    numbers = tuple(PlantedNumber(f"components.{component}.{key}", value) for key, value in values.items())
    seconds = SHORT_S if take == FIVE_MINUTES else math.inf
    return PlantedFault(title, "characterize", numbers, take=take, seconds=seconds, components={component: values})


PLANTED_FAULTS: Mapping[str, PlantedFault] = {
    "white": _component_fault("white noise x2", "white", position_m=0.0015, orientation_rad=math.radians(0.1)),
    "excursions": _component_fault("excursions x3", "excursion", TWENTY_MINUTES, onsets_per_min=3.0),
    "echoes": _component_fault("echoes x3", "echo", share=0.09),
    "lost": PlantedFault(
        "station lost 5 %", "characterize", (PlantedNumber("components.dropout.share", LOST_SHARE, STATION),)
    ),
    "duplicates": PlantedFault(
        "duplicates 1 %",
        "characterize",
        (PlantedNumber("timing.duplicate_share", REPEATED_SHARE),),
        line=(Fault("repeated", share=REPEATED_SHARE),),
    ),
    "clock": _component_fault("clock 80 ppm", "clock", drift_ppm=80.0),
    "stamps": PlantedFault(
        "stamps after 5 h",
        "characterize",
        (PlantedNumber("timing.clock_age_s", 18_000.0), PlantedNumber("timing.stamp_resolution_s", 0.002)),
        components={"clock": {"offset_s": 18_000.0}},
    ),
    NO_FAULT: PlantedFault("no fault", "characterize", take=TWENTY_MINUTES, seconds=math.inf),
    "turned": PlantedFault(
        "station turned 3 deg",
        "validate",
        (PlantedNumber("mount_turn_rad", math.radians(3.0), STATION),),
        take=BOXING,
        components={"mount_slip": [{"station": STATION, "from_s": -1.0, "around_rad": math.radians(3.0)}]},
    ),
    "heading": PlantedFault(
        "heading 5 deg",
        "validate",
        (PlantedNumber("heading_rad", math.radians(5.0)),),
        take=BOXING,
        components={"orientation_offset": [{"angle_rad": math.radians(5.0)}]},
    ),
    "latency": PlantedFault(
        "latency 20 ms",
        "validate",
        (PlantedNumber("latency_s", LATENCY_S + TrackerConfig().record_s),),
        take=BOXING,
        tracker={"latency_s": LATENCY_S},
    ),
    "scale": PlantedFault("scale 0.3 %", "validate", (PlantedNumber("scale", SCALE, is_change=True),), take=BOXING),
    "exchanged": PlantedFault(
        "two stations exchanged", "validate", exchanged=("left_hand: rhand", "right_hand: lhand"), take=BOXING
    ),
    "none_validated": PlantedFault("no fault, with a reference", "validate", take=BOXING),
    EARLIER: PlantedFault("an earlier capture of the session", "validate", take=BOXING),
}
"""Faults by kind."""


def needed_captures(count: int, share: float = WANTED) -> int:
    """Least number of captures of `count` that is this share of them or more."""
    return math.ceil(share * count - 1e-9)


def planted_capture(kind: str, seed: int, folder: Path, *, seconds: float = math.inf) -> Path:
    """Record the capture of a fault and seed into a folder, in which it must not exist yet.

    `seconds` cuts it shorter [s]. UnknownName for another kind of fault.
    """
    if kind not in PLANTED_FAULTS:
        raise UnknownName("planted fault", kind, PLANTED_FAULTS)
    scenario, clip = planted_scenario(kind, seed), planted_motion(kind, seed)
    wire_format, wire = _simulate_line(scenario, clip)
    wire = add_byte_faults(wire, scenario.fault, scenario.seed)
    path = folder / f"{kind}_{seed}.rec"
    record_capture(
        path,
        wire_format,
        wire,
        simulation_note(scenario, clip.name),
        seconds=min(seconds, PLANTED_FAULTS[kind].seconds),
        marks=stretch_marks(clip.name),
    )
    return path


def simulation_note(scenario: Scenario, clip: str) -> dict[str, Any]:
    """The note that `harness record sim:` writes for a clip of a scenario."""
    return {
        "source": "simulation",
        "scenario": scenario.name,
        "clip": clip,
        "seed": scenario.seed,
        "noise": scenario.noise,
        "stations": list(scenario.stations),
        "rate_hz": scenario.tracker.rate_hz,
        "posing": False,
        "harness": VERSION,
    }


def planted_scenario(kind: str, seed: int) -> Scenario:
    """The scenario with the fault of a capture."""
    fault = PLANTED_FAULTS[kind]
    scenario = replace(load_scenario(SCENARIO), seed=_session_seed(seed) if kind in ("scale", EARLIER) else seed)
    components = dict(fault.components)
    if kind == "lost":
        components["lost"] = _gaps_of_station(seed, generate_rig(fault.take).duration_s)
    if kind == "scale":
        components["session"] = {"scale": SessionBias.scale + SCALE / abs(_scale_draw(scenario.seed))}
    if kind == "exchanged":
        stations = dict(scenario.stations)
        stations[STATION], stations[OTHER_STATION] = stations[OTHER_STATION], stations[STATION]
        scenario = replace(scenario, stations=stations)
    tracker = replace_fields(scenario.tracker, dict(fault.tracker), "tracker")
    return replace(scenario, components=components, tracker=tracker, fault=fault.line)


def planted_motion(kind: str, seed: int) -> Clip:
    """The true motion of a capture: a take of the rig, or boxing that depends on the seed."""
    take = PLANTED_FAULTS[kind].take
    if take != BOXING:
        return generate_rig(take)
    number = 2 if kind == EARLIER else 1
    return synthetic.generate(BOXING, _PERFORMER, number, seed=seed, duration_s=BOXING_S)


def planted_numbers(kind: str, seed: int) -> tuple[PlantedNumber, ...]:
    """The numbers that have to be named in a capture, with the sign of the session's scale."""
    numbers = PLANTED_FAULTS[kind].numbers
    if kind != "scale":
        return numbers
    sign = math.copysign(1.0, _scale_draw(_session_seed(seed)))
    return tuple(replace(number, value=sign * number.value) for number in numbers)


def _simulate_line(scenario: Scenario, clip: Clip) -> tuple[WireFormat, ByteCapture]:
    """What `harness record sim:` records of a scenario and a clip."""
    body, motion = retarget_to_own_body(clip)
    mounts, tracker = scenario.nominal_mounts, scenario.device
    wire_format = WireFormat(tuple(mount.station for mount in mounts), tracker.rate_hz, tracker.items)
    trajectory = Trajectory(body, motion)
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(mounts))
    session = _SESSION if clip.behaviour == BOXING else ""
    readings = simulate_readings(
        trajectory, mounts, tracker, scenario.noise_model, time_s, seed=scenario.seed, take=clip.name, session=session
    )
    return wire_format, transmit_readings(readings, wire_format, tracker)[1]


def _gaps_of_station(seed: int, until_s: float) -> list[dict[str, Any]]:
    """Losses of `STATION`, with the lengths of the preset's, so that it is lost for `LOST_SHARE` of the time."""
    more = Dropout(share=1.0 - (1.0 - LOST_SHARE) / (1.0 - Dropout.share))
    gaps = more.gaps(generator(seed, "planted", "lost"), until_s)
    return [{"station": STATION, "from_s": begin_s, "to_s": end_s, "fade_s": 0.0} for begin_s, end_s, _ in gaps]


def station_offset_m(seed: int, station: str) -> Floats:
    """(3,) offset of a station in its housing in the session of a boxing capture, in the station's axes [m]."""
    draw = generator(seed, "noise", _SESSION, "session", station).normal(size=3)
    out: Floats = SessionBias.station_offset_m * draw
    return out


def _scale_draw(seed: int) -> float:
    """The draw of `SessionBias` that the scale of the session is multiplied with."""
    return float(generator(seed, "noise", _SESSION, "session", "").normal())


def _session_seed(seed: int) -> int:
    while abs(_scale_draw(seed)) < LEAST_DRAW:
        seed += _NEXT_SEED
    return seed
