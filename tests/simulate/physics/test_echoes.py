"""Mirror images and reflection points, by a construction of their own."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from harness.core.seeds import generator
from harness.simulate.physics.room import Room
from harness.simulate.physics.sound import mirror_images, reflection_point
from tests.simulate.physics.rooms import placed

planes = placed(Room(size_m=(6.0, 5.0))).planes()


@settings(deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 5))
def test_an_echo_takes_the_shortest_way_over_its_plane(seed: int, which: int) -> None:
    """Fermat: the reflection point minimises the length of the path, which is the distance from the image."""
    rng = generator(seed, "echo")
    emitter_m, at_m = rng.uniform([-2.9, -2.4, 0.0], [2.9, 2.4, 2.4], (2, 3))
    normal, distance_m = planes[which, :3], planes[which, 3]
    across = np.linalg.svd(normal[None])[2][1:]

    def length_m(places: np.ndarray) -> float:
        point_m = distance_m * normal + places @ across
        return float(np.linalg.norm(point_m - emitter_m) + np.linalg.norm(at_m - point_m))

    shortest = minimize(length_m, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-13})
    image_m = mirror_images(planes, emitter_m[None])[0, which]
    bounce_m = np.zeros(3)
    assert reflection_point(planes[which], image_m, at_m, bounce_m)
    np.testing.assert_allclose(np.linalg.norm(image_m - at_m), shortest.fun, atol=1e-9)
    np.testing.assert_allclose(length_m(across @ bounce_m), shortest.fun, atol=1e-9)
    np.testing.assert_allclose(bounce_m @ normal, distance_m, atol=1e-9)
    np.testing.assert_allclose(bounce_m, distance_m * normal + shortest.x @ across, atol=1e-4)


def test_an_image_is_as_far_behind_each_plane_as_its_emitter_is_before_it() -> None:
    emitter_m = np.array([[0.3, -0.2, 0.4], [1.0, 1.0, 1.0]])
    images_m = mirror_images(planes, emitter_m)
    assert images_m.shape == (2, 6, 3)
    before_m = emitter_m @ planes[:, :3].T - planes[:, 3]
    behind_m = np.einsum("jpx,px->jp", images_m, planes[:, :3]) - planes[:, 3]
    assert (before_m < 0.0).all()
    np.testing.assert_allclose(behind_m, -before_m)


def test_a_point_behind_the_plane_has_no_reflection() -> None:
    image_m = mirror_images(planes, np.array([[0.0, 0.0, 0.5]]))[0, 0]
    assert not reflection_point(planes[0], image_m, np.array([0.0, 0.0, 2.6]), np.zeros(3))
