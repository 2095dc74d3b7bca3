"""The table `[physics]` of a scenario."""

from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from harness.errors import BadInput
from harness.simulate.physics.constellation import ConstellationSettings
from harness.simulate.physics.filter_settings import Fusion
from harness.simulate.physics.inertial import Inertial, InertialErrors
from harness.simulate.physics.room import Room
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.physics.sound import Sound, speed_of_sound_m_s

E = TypeVar("E", bound=InertialErrors)


@dataclass(frozen=True)
class Physics:
    """Errors of an IS-900 from their causes: sound, line of sight, inertia and the filter that fuses them.

    docs/is900.md 16 describes the model. The table replaces the statistical errors of the noise presets.
    """

    constellation: ConstellationSettings = field(default_factory=ConstellationSettings)
    room: Room = field(default_factory=Room)
    sound: Sound = field(default_factory=Sound)
    inertial: Inertial = field(default_factory=Inertial)
    fusion: Fusion = field(default_factory=Fusion)

    def __post_init__(self) -> None:
        slot_s = TICKS_PER_SLOT / self.inertial.rate_hz
        reach_m = slot_s * speed_of_sound_m_s(self.sound.temperature_c)
        if self.constellation.range_m > reach_m:
            raise BadInput(
                f"physics.inertial.rate_hz = {self.inertial.rate_hz:g} makes slots of {1e3 * slot_s:.2f} ms, in which "
                f"sound travels {reach_m:.2f} m, less than constellation.range_m = {self.constellation.range_m:g}.",
                "Lower inertial.rate_hz or constellation.range_m.",
            )

    def with_preset(self, noise: str) -> "Physics":
        """The physics under a noise preset.

        `default` has every cause of errors. `noise` has no shadow, echo, burst or wrong cycle. `clean` also has no
        noise of ranges and inertia, no limit of the inertial sensors, no air flow, no survey error, no misplaced
        microphone and no temperature error. Cones and reaches of emitters hold under each, and so does the filter.
        """
        if noise == "default":
            return self
        room = replace(self.room, shadow=False, echoes=False)
        sound = replace(self.sound, bursts_per_min=0.0, wrong_cycle_share=0.0)
        if noise == "noise":
            return replace(self, room=room, sound=sound)
        none: dict[str, Any] = dict.fromkeys(
            ("range_noise_m", "microphone_sd_m", "air_speed_sd_m_s", "temperature_sd_c"), 0.0
        )
        exact = replace(sound, **none, temperature_c=sound.assumed_c)
        return replace(
            self,
            constellation=replace(self.constellation, survey_sd_m=0.0),
            room=room,
            sound=exact,
            inertial=replace(
                self.inertial,
                gyroscope=_without_errors(self.inertial.gyroscope),
                accelerometer=_without_errors(self.inertial.accelerometer),
            ),
        )


def _without_errors(errors: E) -> E:
    names = "white", "bias_instability", "random_walk", "turn_on", "scale", "misalignment_rad"
    return replace(errors, **dict.fromkeys(names, 0.0), limit=1e6)
