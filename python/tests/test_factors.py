"""View factors and heat against closed forms."""

import numpy as np
import pytest
from conftest import CUBE, SIDES
from scipy import sparse

import radiosity

#: Opposite faces of a cube (M. F. Modest 2013, "Radiative Heat Transfer", configuration 38).
OPPOSITE = 0.19982489569838747
SIGMA = 5.670374419e-8


def test_a_cube_has_its_factors():
    factors = radiosity.view_factors(CUBE, SIDES)
    assert sparse.issparse(factors) and factors.shape == (6, 6)
    assert factors[0, 1] == pytest.approx(OPPOSITE, abs=1e-12)
    assert factors[0, 2] == pytest.approx((1 - OPPOSITE) / 4, abs=1e-12)
    assert factors.toarray().sum(axis=1) == pytest.approx(np.ones(6), abs=1e-12)
    assert factors.is_exact and factors.areas == pytest.approx(np.ones(6))
    assert factors.standard_error.shape == (6, 6)
    assert factors.checks()["closure"][1] < 1e-12
    assert factors @ np.ones(6) == pytest.approx(np.ones(6), abs=1e-12)


def test_triangles_are_rows_of_their_own():
    triangles = np.array([[a, b, c] for a, b, c, d in SIDES] + [[a, c, d] for a, b, c, d in SIDES])
    factors = radiosity.view_factors(CUBE, triangles)
    grouped = radiosity.view_factors(CUBE, triangles, groups=[*range(6), *range(6)])
    assert factors.shape == (12, 12) and grouped.shape == (6, 6)
    of_cube = factors.toarray().reshape(2, 6, 2, 6).sum(axis=2).mean(axis=0)
    assert of_cube == pytest.approx(grouped.toarray(), abs=1e-9)


def test_sparse_factors_are_within_their_errors():
    exact = radiosity.view_factors(CUBE, SIDES, method="exact")
    rough = radiosity.view_factors(CUBE, SIDES, 0.01, method="sparse")
    off = np.abs(rough.toarray() - exact.toarray())
    # Two standard errors of at most 0.01: four of these are never left.
    assert off.max() < 0.02 and not rough.is_exact
    enforced = rough.enforced()
    assert enforced.checks()["reciprocity"][1] < 1e-12


def test_two_sides_are_two_rows():
    square = np.array([[0.0, 0, 0.5], [1, 0, 0.5], [1, 1, 0.5], [0, 1, 0.5]])
    vertices, faces = np.vstack([CUBE, square]), np.vstack([SIDES, [[8, 9, 10, 11]]])
    factors = radiosity.view_factors(vertices, faces, two_sided=[6])
    assert factors.shape == (8, 8) and factors.back_of.tolist() == [-1] * 7 + [6]
    assert factors[0, 1] == 0.0
    with pytest.raises(ValueError, match="no group 9"):
        radiosity.view_factors(CUBE, SIDES, two_sided=[9])


def test_files_of_matrices(tmp_path):
    factors = radiosity.view_factors(CUBE, SIDES)
    factors.save(tmp_path / "a.npz")
    again = radiosity.load_view_factors(tmp_path / "a.npz")
    assert np.array_equal(again.toarray(), factors.toarray())
    assert np.array_equal(sparse.load_npz(tmp_path / "a.npz").toarray(), factors.toarray())
    with pytest.raises(ValueError, match="end it in"):
        factors.save(tmp_path / "a.txt")


def test_heat_between_two_plates_of_a_black_box():
    """Floor and ceiling at two temperatures, adiabatic walls that reflect or not: each wall sees
    both alike, so that F between plates becomes (1 + F)/2."""
    factors = radiosity.view_factors(CUBE, SIDES)
    hot, cold = 1000.0, 500.0
    given = [hot, cold] + [np.nan] * 4
    balance = radiosity.heat(factors, temperature=given, emissivity=1.0)
    flux = (1 + OPPOSITE) / 2 * SIGMA * (hot**4 - cold**4)
    assert balance.net_flux[0] == pytest.approx(flux, rel=1e-9)
    assert balance.net_flux[2:] == pytest.approx(np.zeros(4), abs=1e-6)
    walls = ((hot**4 + cold**4) / 2) ** 0.25
    assert balance.temperature[2:] == pytest.approx(walls, rel=1e-9)
    assert balance.imbalance == pytest.approx(0.0, abs=1e-6)
    # Grey: emissivities of 0.5 add a resistance of (1 - e)/e at each plate (Modest, 5.41).
    grey = radiosity.heat(factors, temperature=given, emissivity=[0.5, 0.5, 1, 1, 1, 1])
    resistance = 1.0 + 2 / (1 + OPPOSITE) + 1.0
    assert grey.net_flux[0] == pytest.approx(SIGMA * (hot**4 - cold**4) / resistance, rel=1e-9)


def test_heat_by_a_matrix_of_another_program():
    factors = radiosity.view_factors(CUBE, SIDES)
    given = [1000.0] + [300.0] * 5
    ours = radiosity.heat(factors, temperature=given, emissivity=0.8)
    dense = radiosity.heat(factors.toarray(), temperature=given, emissivity=0.8, areas=np.ones(6))
    assert dense.net_flux == pytest.approx(ours.net_flux, rel=1e-12)
    with pytest.raises(ValueError, match="areas: None"):
        radiosity.heat(factors.toarray(), temperature=given)
