"""Reproduction of Kim, Seol and Lee 2012: every experiment (docs/papers.md B; scenarios/papers/kim2012).

The criteria of the claims were fixed before any run. The paper prints no errors as numbers. Its orders, and the sets
that it calls suitable, are tested by intervals over units.
"""

from functools import partial

from harness.study.papers.five_stations import five_stations
from harness.study.papers.local_models import local_models
from harness.study.papers.paper import Paper
from harness.study.papers.published_speed import KIM2012, compare_speed
from harness.study.papers.sparse_database import extrapolation, sparse
from harness.study.papers.station_choice import one_station, rank_station_sets

PAPER = Paper(
    "kim2012",
    "Kim, Seol, Lee: Realtime performance animation using sparse 3D motion sensors, 2012",
    experiments={
        "sensors": rank_station_sets,
        "sparse": sparse,
        "extrapolation": extrapolation,
        "local_models": local_models,
        "one_tracker": one_station,
        "five_trackers": five_stations,
        "speed": partial(compare_speed, published=KIM2012),
    },
    runs_of={
        "sensors": ("sensors_walking", "sensors_boxing"),
        "sparse": ("sparse_table_tennis", "sparse_walking", "one_sparse_table_tennis", "one_sparse_walking"),
        "extrapolation": ("extrapolation",),
        "local_models": ("global_table_tennis", "global_walking"),
        "one_tracker": ("one_table_tennis", "sensors_boxing", "sensors_walking"),
        "five_trackers": ("five_boxing", "five_table_tennis", "five_walking"),
        "speed": (),
    },
)
