"""The body that an export draws for a cell."""

from collections.abc import Callable

import pytest

from harness.errors import BadInput
from harness.experiment.run_export import body_model
from harness.mocap.write import pose_truth_and_estimate
from harness.results import Cell


def test_a_cell_has_its_surface_and_its_stations(make_cell: Callable[..., Cell]) -> None:
    cell = make_cell(defined_by={"stations": {"head": {"bone": "head", "along": 1.0}}})
    model = body_model(cell, pose_truth_and_estimate(cell)["truth"])
    assert {shape.bone for shape in model.shapes} == {"root", *pose_truth_and_estimate(cell)["truth"].skeleton.names}
    (station,) = model.stations
    assert (station.name, station.bone) == ("head", "head")


@pytest.mark.parametrize("stations", [None, [], {"head": {"bone": 3}}, {"head": {"along": 0.5}}])
def test_a_cell_without_stations_is_refused(make_cell: Callable[..., Cell], stations: object) -> None:
    cell = make_cell(defined_by={} if stations is None else {"stations": stations})
    with pytest.raises(BadInput, match="does not say where its stations sit"):
        body_model(cell, pose_truth_and_estimate(cell)["truth"])
