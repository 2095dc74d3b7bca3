"""Configurations: the one place that knows their order."""

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, QPOS_OF_DOF, limits_rad, pack, standard_skeleton, unpack


@pytest.mark.parametrize("shape", [(), (7,), (3, 4)])
def test_unpack_undoes_pack(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    parts = tuple(rng.normal(size=(*shape, size)) for size in (3, 4, 48))
    qpos = pack(*parts)
    assert qpos.shape == (*shape, 55)
    for found, given in zip(unpack(qpos), parts, strict=True):
        np.testing.assert_array_equal(found, given)


def test_hinges_of_a_bone_run_outermost_first() -> None:
    names = np.array(standard_skeleton().dof_names)[QPOS_OF_DOF]
    assert names[:4].tolist() == ["lowerback.rz", "lowerback.ry", "lowerback.rx", "upperback.rz"]
    assert names[-4:].tolist() == ["rfemur.rx", "rtibia.rx", "rfoot.rz", "rfoot.rx"]
    np.testing.assert_array_equal(QPOS_OF_DOF[QPOS_OF_DOF], np.arange(48))


def test_the_skeleton_is_that_of_the_paper() -> None:
    skeleton = standard_skeleton()
    assert (len(BONES), len(skeleton.axes)) == (24, 48)
    np.testing.assert_allclose(np.linalg.norm(skeleton.axes, axis=1), 1.0, atol=1e-12)
    low, high = limits_rad().T
    assert np.all(low < 0.0)
    assert np.all(high > 0.0)
    mirrored = skeleton.bone_m[[skeleton.index(n) for n in BONES if n.startswith("l") and "r" + n[1:] in BONES]]
    right = skeleton.bone_m[[skeleton.index(n) for n in BONES if n.startswith("r")]]
    np.testing.assert_allclose(mirrored * [1, -1, 1], right, atol=1e-12)
