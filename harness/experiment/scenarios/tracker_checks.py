"""What a scenario says of its trackers, held against the body, the device and the room."""

import numpy as np

from harness.body import locate_mounts
from harness.core.humanoid24 import standard_skeleton
from harness.errors import UnknownName
from harness.experiment.scenarios.scenario import Scenario
from harness.simulate.physics import fit_room, load_constellation
from harness.stream import make_inputs
from harness.stream.polhemus.codec import WireFormat


def check_trackers(scenario: Scenario) -> None:
    """Check that bones, inputs, stations and emitters exist and fit each other; UnknownName, BadInput.

    The scenario is one variant: nothing in it is varied any more.
    """
    worn, device, noise = tuple(scenario.worn_stations), scenario.device, scenario.disturbed_noise
    for name in scenario.inputs:
        make_inputs(name, worn)
    WireFormat(worn, device.rate_hz, device.items)  # refuses a line that cannot be
    locate_mounts(standard_skeleton(), scenario.nominal_mounts)
    for slip in noise.mount_slip:
        if slip.station not in scenario.stations:
            raise UnknownName("station", slip.station, scenario.stations)
    if noise.physics is not None:
        constellation = load_constellation(noise.physics.constellation)
        fit_room(noise.physics.room, constellation, device.origin_m[2], np.zeros((0, 2)))
