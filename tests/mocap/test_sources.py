"""Of whose bones a source of motion knows."""

from pathlib import Path

import numpy as np

from harness.mocap import synthetic
from harness.mocap.sources import POPULATION_SIZE, open_motion_source
from tests.mocap.sample_files import asf_text


def test_a_library_s_people_are_its_skeletons_but_one(tmp_path: Path) -> None:
    for subject, person in zip(("07", "08", "09"), synthetic.sample_skeletons(3, seed=1), strict=True):
        (tmp_path / f"{subject}.asf").write_text(asf_text(person))
    source = open_motion_source("cmu", tmp_path, seed=1, rate_hz=None)
    assert list(source.other_skeletons(without="08")) == ["07", "09"]
    assert list(source.other_skeletons(without="99")) == ["07", "08", "09"]


def test_built_in_people_are_the_same_for_every_seed_and_performer() -> None:
    one, other = (
        open_motion_source("builtin", None, seed=seed, rate_hz=None).other_skeletons(who)
        for seed, who in ((1, "p1"), (2, "p2"))
    )
    assert len(one) == POPULATION_SIZE
    for a, b in zip(one.values(), other.values(), strict=True):
        np.testing.assert_array_equal(a.bone_m, b.bone_m)
