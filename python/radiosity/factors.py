"""View factors, and heat by them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_matrix, issparse

from . import _check, _radiosity
from ._work import Callback, callback, thread_count
from .scene import Scene, mesh_arrays

__all__ = ["HeatBalance", "ViewFactors", "heat", "load_view_factors", "view_factors"]


class ViewFactors(csr_matrix):
    """A sparse matrix of view factors: SciPy's compressed rows, with errors.

    ``F[i, j]`` is the share of the flux leaving surface i (row) that arrives at
    the front of surface j (column), averaged over the area of i. Results of
    arithmetic are without the attributes below.

    Attributes
    ----------
    standard_error : scipy.sparse.csr_matrix
        Standard error of each nonzero, in the same order.
    areas : numpy.ndarray, (n,)
        Unit of length squared.
    open : numpy.ndarray, (n,)
        Share of the flux of each row that leaves the scene.
    back : numpy.ndarray, (n,)
        Share that arrives at the backs of surfaces.
    names : list of str
        Of the rows: fronts of all groups, then backs of two-sided ones.
    back_of : numpy.ndarray, (n,)
        The row of whose front a row is the back; −1 for fronts.
    is_exact : bool
        Whether a pair that is absent is 0. If not, its factor is below the
        error that was asked for, with few exceptions.
    """

    standard_error: csr_matrix
    areas: np.ndarray
    open: np.ndarray
    back: np.ndarray
    names: List[str]
    back_of: np.ndarray
    is_exact: bool
    _native: Any = None

    @classmethod
    def _from_native(cls, native: Any) -> ViewFactors:
        data, error, indices, starts = native.rows()
        if len(data) < 2**31:
            starts = starts.astype(np.int32)
        count = len(starts) - 1
        matrix = cls((data, indices, starts), shape=(count, count), copy=False)
        matrix.standard_error = csr_matrix((error, indices, starts), shape=(count, count))
        matrix.areas, matrix.open, matrix.back = native.areas, native.open, native.back
        matrix.names, matrix.back_of = native.names, native.back_of
        matrix.is_exact, matrix._native = native.is_exact, native
        return matrix

    def _own(self) -> Any:
        if self._native is None:
            found = "a result of arithmetic, without areas and errors"
            raise _check.wrong("matrix", found, "take that of radiosity.view_factors")
        return self._native

    def checks(self) -> Dict[str, Tuple[float, float]]:
        """Deviations from the laws: root mean square, and the largest.

        ``closure``: rows and what is open and back sum to 1; ``reciprocity``:
        A_i F_ij = A_j F_ji, over the smaller area; ``bounds``: each factor is
        in [0, min(1, A_j / A_i)]; ``row_sums``: no row is above 1.
        """
        return self._own().checks()

    def enforced(self) -> ViewFactors:
        """The matrix nearest to this one that has closure and reciprocity."""
        native, _ = self._own().enforced()
        return ViewFactors._from_native(native)

    def save(self, path: Union[str, os.PathLike]) -> None:
        """Writes ``.npz`` (`scipy.sparse.load_npz`, `load_view_factors`), ``.mtx`` or ``.csv``."""
        self._own().save(os.fspath(path))


def load_view_factors(path: Union[str, os.PathLike]) -> ViewFactors:
    """The matrix of an ``.npz`` file of `ViewFactors.save` or of the program."""
    return ViewFactors._from_native(_radiosity.load_factors(os.fspath(path)))


def view_factors(
    vertices: Any,
    faces: Optional[ArrayLike] = None,
    error: float = 1e-3,
    *,
    groups: Optional[Sequence] = None,
    two_sided: Union[bool, Sequence] = (),
    method: str = "auto",
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> ViewFactors:
    """View factors between the faces of a mesh, or between groups of them.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Or a `Scene`, whose groups are the rows; or a mesh of trimesh or
        pyvista, whose faces or cells are.
    faces : array_like, (m, 3) or (m, 4)
        Indices of the corners, counter-clockwise from the front.
    error : float
        Absolute error of every factor: two standard errors.
    groups : sequence, (m,), optional
        A name or a number for each face: those of one are a row. By default
        each face is.
    two_sided : bool or sequence
        Groups, or indices of faces, that emit and receive on both sides, each
        a row after all fronts; ``True`` for all.
    method : str
        ``"exact"``: each pair by adaptive cubature, with an error far below
        that asked for; ``"sparse"``: rays find the pairs that matter; or
        ``"auto"``: the first unless it would take minutes.

    Returns
    -------
    ViewFactors
        A `scipy.sparse.csr_matrix` with standard errors.
    """
    error = _check.share("error", error)
    _check.choice("method", method, ("auto", "exact", "sparse"))
    scene, names = _scene_of(vertices, faces, groups)
    native = _radiosity.view_factors(
        scene._native,
        error,
        _sides(two_sided, names),
        method,
        thread_count(threads),
        callback(progress),
    )
    return ViewFactors._from_native(native)


def _scene_of(vertices: Any, faces: Any, groups: Any) -> Tuple[Scene, Sequence]:
    """The scene whose groups are the rows, and what these are called."""
    if isinstance(vertices, Scene):
        if faces is not None:
            raise _check.wrong("faces", "given with a Scene", "leave them out")
        return vertices, vertices.groups
    if faces is None:
        arrays = mesh_arrays(vertices, by_cell=True)
        if arrays is None:
            remedy = "give vertices and faces, a Scene, or a mesh of trimesh or pyvista"
            raise _check.wrong("vertices", f"a {type(vertices).__name__} without faces", remedy)
        vertices, faces, cells = arrays
        groups = cells if groups is None else groups
        if groups is not None and cells is not None and groups is not cells:
            groups = np.asarray(groups)[cells]
    if groups is None:
        count = len(faces) if hasattr(faces, "__len__") else 0
        groups = np.arange(count)
    scene = Scene(vertices, faces, groups=groups, both_sides=False)
    return scene, scene.groups


def _sides(two_sided: Union[bool, Sequence], names: Sequence[str]) -> List[int]:
    if two_sided is True:
        return list(range(len(names)))
    if two_sided is False:
        return []
    if isinstance(two_sided, (str, int)):
        two_sided = [two_sided]
    index = {name: k for k, name in enumerate(names)}
    sides = []
    for k, name in enumerate(two_sided):
        if str(name) not in index:
            few = ", ".join(names[:8]) + (" and others" if len(names) > 8 else "")
            raise _check.wrong(f"two_sided[{k}]", f"no group {name!r}", f"there are {few}")
        sides.append(index[str(name)])
    return sides


@dataclass(frozen=True)
class HeatBalance:
    """Radiative exchange between surfaces. Powers are in W where lengths are in metres.

    Attributes
    ----------
    temperature : numpy.ndarray, (n,)
        K: given or found; NaN where it has no effect.
    net_flux, standard_error : numpy.ndarray, (n,)
        Net flux out of each surface, W/m², and its standard error by that of
        the view factors.
    radiosity, irradiance : numpy.ndarray, (n,)
        Flux that leaves and arrives, W/m².
    supplied, lost_to_surroundings, lost_to_backs, imbalance : float
        Powers: out of surfaces that give more than they take, out through
        openings, lost at backs, and what is left over by closure and
        reciprocity that are not exact.
    residual : float
        Of the linear system.
    """

    temperature: np.ndarray
    net_flux: np.ndarray
    standard_error: np.ndarray
    radiosity: np.ndarray
    irradiance: np.ndarray
    supplied: float
    lost_to_surroundings: float
    lost_to_backs: float
    imbalance: float
    residual: float


def heat(
    factors: Any,
    *,
    temperature: ArrayLike,
    net_flux: Optional[ArrayLike] = None,
    emissivity: ArrayLike = 1.0,
    surroundings: float = 0.0,
    band_edges: Sequence[float] = (),
    areas: Optional[ArrayLike] = None,
    threads: Optional[int] = None,
) -> HeatBalance:
    """Temperatures and net fluxes of grey, diffuse surfaces that see each other.

    Solves B = ε M(T) + (1 − ε) H with H_i = Σ_j F_ij B_j + open_i M(T_surroundings)
    (M. F. Modest, "Radiative Heat Transfer", 3rd edition 2013, equations 5.28 to 5.31).

    Parameters
    ----------
    factors : ViewFactors, or matrix (n, n)
        A matrix of another program needs `areas`; what its rows lack to 1
        leaves the enclosure.
    temperature : array_like, (n,)
        K; NaN where the net flux is given instead.
    net_flux : array_like, (n,), optional
        Net flux out of the surface, W/m²; 0, as by default, is adiabatic. Used
        where the temperature is NaN.
    emissivity : float or array_like, (n,) or (n, bands)
        In [0, 1].
    surroundings : float
        Temperature of what is seen through openings, K.
    band_edges : sequence of float
        Wavelengths between bands, µm, ascending; none for one band.
    areas : array_like, (n,), optional
        Of a matrix of another program.
    """
    native = _matrix(factors, areas)
    count = len(native.names)
    kelvin = _per_row("temperature", temperature, count, allow_nan=True)
    if (kelvin < 0.0).any():
        row = int(np.argmax(kelvin < 0.0))
        raise _check.wrong(f"temperature[{row}]", f"{kelvin[row]} K", "give at least 0 K")
    flux = np.zeros(count) if net_flux is None else _per_row("net_flux", net_flux, count, True)
    flux = np.where(np.isnan(flux), 0.0, flux)
    edges = [_check.number(f"band_edges[{k}]", e, above=0.0) for k, e in enumerate(band_edges)]
    bands = len(edges) + 1
    given = _check.array("emissivity", emissivity, "give numbers in [0, 1]").astype(np.float64)
    if given.ndim == 1 and len(given) == count:
        given = given[:, np.newaxis]
    try:
        share = np.ascontiguousarray(np.broadcast_to(given, (count, bands)))
    except ValueError:
        remedy = f"give a number, shape ({count},) or ({count}, {bands})"
        raise _check.wrong("emissivity", f"shape {given.shape}", remedy) from None
    bad = ~((share >= 0.0) & (share <= 1.0))
    if bad.any():
        row, band = np.argwhere(bad)[0]
        found = str(share[row, band])
        raise _check.wrong(f"emissivity[{row}, {band}]", found, "give at least 0 and at most 1")
    outside = _check.number("surroundings", surroundings, least=0.0)
    return HeatBalance(
        **_radiosity.heat(native, kelvin, flux, share, outside, edges, thread_count(threads))
    )


def _per_row(name: str, value: ArrayLike, count: int, allow_nan: bool = False) -> np.ndarray:
    remedy = f"give a number, or one for each of {count} rows"
    given = _check.array(name, value, remedy).astype(np.float64)
    if given.shape not in ((), (count,)):
        raise _check.wrong(name, f"shape {given.shape}", remedy)
    _check.finite(name, np.nan_to_num(given, nan=0.0, posinf=np.inf) if allow_nan else given)
    return np.array(np.broadcast_to(given, (count,)))


def _matrix(factors: Any, areas: Optional[ArrayLike]) -> Any:
    if isinstance(factors, ViewFactors) and factors._native is not None:
        return factors._native
    if issparse(factors):
        matrix = csr_matrix(factors, dtype=np.float64)
    else:
        remedy = "give what view_factors returns, or a square matrix"
        matrix = csr_matrix(_check.finite("factors", _check.array("factors", factors, remedy)))
    matrix.sum_duplicates()
    count = matrix.shape[0]
    if matrix.ndim != 2 or matrix.shape != (count, count):
        raise _check.wrong("factors", f"shape {matrix.shape}", "give a square matrix")
    _check.finite("factors", matrix.data)
    if len(matrix.data) and matrix.data.min() < 0.0:
        raise _check.wrong("factors", str(matrix.data.min()), "give factors of at least 0")
    if areas is None:
        raise _check.wrong("areas", "None", "give the areas of the rows, (n,)")
    sizes = _per_row("areas", areas, count)
    if (sizes < 0.0).any():
        raise _check.wrong("areas", str(sizes.min()), "give at least 0")
    return _radiosity.factors_of_rows(
        matrix.data.astype(np.float64),
        np.zeros(len(matrix.data)),
        matrix.indices.astype(np.int64),
        matrix.indptr.astype(np.int64),
        sizes,
        [str(k) for k in range(count)],
    )
