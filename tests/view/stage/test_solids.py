"""Bodies of a scene where it puts them."""

import numpy as np
import pytest

from coneskin.scene.values.scene import BodyScene
from coneskin.view.stage.solids import body_solids


def enclosed(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Volume inside of a closed surface; positive where its faces look out [m3]."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize(
    ("body", "volume", "middle"),
    [
        (BodyScene("hand", (0.1, 0.2, 0.3), radius=0.04), 4.19 * 0.04**3, (0.1, 0.2, 0.3)),
        (BodyScene("wall", (0.5, 0.0, 0.2), (0.0, -2.0, 0.0), radius=0.3), 0.01 * 0.6**2, (0.5, 0.005, 0.2)),
        (BodyScene("post", (0.5, 0.0, 0.2), (0.0, 0.0, 1.0), 0.02, 0.4), 3.14 * 0.02**2 * 0.4, (0.5, 0.0, 0.2)),
    ],
)
def test_a_body_is_closed_and_in_its_place(body: BodyScene, volume: float, middle: tuple[float, ...]) -> None:
    (solid,) = body_solids([body])
    assert enclosed(solid.vertices, solid.faces) == pytest.approx(volume, rel=0.1)
    assert 0.5 * (solid.vertices.min(axis=0) + solid.vertices.max(axis=0)) == pytest.approx(middle, abs=1e-9)
    assert solid.link == 0


def test_a_grip_has_two_hands() -> None:
    first, second = body_solids([BodyScene("grip", (0.1, 0.2, 0.3), (0.0, 0.2, 0.0))])
    assert (second.vertices - first.vertices).mean(axis=0) == pytest.approx((0.0, 0.2, 0.0))
