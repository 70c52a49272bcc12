"""What tests share: a box, and a room in it."""

import numpy as np
import pytest

import radiosity

#: A unit cube seen from inside, by quadrilaterals: floor, ceiling and walls.
CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
    dtype=float,
)
SIDES = np.array(
    [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
)


@pytest.fixture
def room() -> radiosity.Scene:
    """A unit cube whose ceiling shines."""
    exitance = np.array([0.0, 10.0, 0.0, 0.0, 0.0, 0.0])
    return radiosity.Scene(CUBE, SIDES, reflectance=0.5, exitance=exitance, groups=list("abcdef"))
