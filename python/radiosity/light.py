"""Light at vertices, and what is measured in it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _check, _radiosity
from ._work import Callback, callback, thread_count
from .scene import Scene, as_scene

__all__ = ["Bake", "Grid", "Probes", "Verification", "bake", "grid", "probes", "verify"]

#: Weights of linear red, green and blue in luminance (ITU-R BT.709).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


class Bake:
    """Light at vertices: what `bake` returns. Arrays are read-only.

    Attributes
    ----------
    vertices : numpy.ndarray, (n, 3)
        Positions, unit of the scene.
    faces : numpy.ndarray, (m, 3)
        Triangles, counter-clockwise from the front.
    face_groups : numpy.ndarray, (m,)
        Index of each in ``scene.groups``.
    normals : numpy.ndarray, (n, 3)
    radiosity : numpy.ndarray, (n, 3)
        Emitted and reflected light, W/m² per channel; radiance is that over π.
    irradiance : numpy.ndarray, (n, 3)
        Light that arrives, W/m² per channel. 0 in channels in which a surface
        is black.
    error : numpy.ndarray, (n,)
        Standard error of the radiosity, W/m²: a length over the channels.
    report : dict
        ``error`` and its parts, ``error_of_groups``, ``reached``, ``stopped``,
        ``outcome`` in words, ``device``, ``seconds`` and more.
    scene : Scene
        What was baked, each side that reflects a triangle of its own.
    """

    def __init__(self) -> None:
        raise _check.wrong("Bake()", "nothing to bake", "call radiosity.bake(scene, error=0.05)")

    @classmethod
    def _of(cls, native: _radiosity.Bake) -> Bake:
        baked = object.__new__(cls)
        baked._native = native
        baked.report = native.report()
        return baked

    report: Dict[str, Any]
    _native: _radiosity.Bake

    @property
    def vertices(self) -> np.ndarray:
        return self._native.positions

    @property
    def faces(self) -> np.ndarray:
        return self._native.faces

    @property
    def face_groups(self) -> np.ndarray:
        return self._native.face_groups

    @property
    def normals(self) -> np.ndarray:
        return self._native.normals

    @property
    def radiosity(self) -> np.ndarray:
        return self._native.radiosity

    @property
    def irradiance(self) -> np.ndarray:
        return self._native.irradiance

    @property
    def error(self) -> np.ndarray:
        return self._native.error

    @property
    def scene(self) -> Scene:
        return Scene._of(self._native.scene)

    def save(
        self,
        path: Union[str, os.PathLike],
        *,
        source: Optional[Union[str, os.PathLike]] = None,
    ) -> None:
        """Writes a file in the format of its ending.

        Parameters
        ----------
        path : path
            ``.ply`` (light at vertices), ``.glb`` (the same for viewers),
            ``.png`` or ``.exr`` (a picture).
        source : path, optional
            The glTF file that was baked: it is written again, as it is but for
            light at its vertices.
        """
        source = None if source is None else os.fspath(source)
        self._native.save(os.fspath(path), source)

    def picture(
        self,
        size: Tuple[int, int] = (768, 512),
        *,
        eye: Optional[ArrayLike] = None,
        target: Optional[ArrayLike] = None,
        up: Optional[ArrayLike] = None,
        vertical_fov: float = 40.0,
        threads: Optional[int] = None,
    ) -> np.ndarray:
        """A picture in colours of sRGB, (rows, columns, 3) of uint8.

        Parameters
        ----------
        size : (int, int)
            Width and height, pixels.
        eye, target : array_like, (3,), optional
            Where the camera stands and looks to; by default the whole scene.
        up : array_like, (3,), optional
            By default that of the scene.
        vertical_fov : float
            Field of view from below to above, degrees.
        """
        width, height = (int(_check.number("size", side, least=1, most=8192)) for side in size)
        camera = None
        if (eye is None) != (target is None):
            raise _check.wrong("eye and target", "one of them", "give both, or neither")
        if eye is not None and target is not None:
            upwards = self.scene.up if up is None else up
            fov = _check.number("vertical_fov", vertical_fov, above=0.0, below=180.0)
            eye, target = _check.vector("eye", eye), _check.vector("target", target)
            camera = (eye, target, _check.direction("up", upwards), fov)
        image = self._native.picture(camera, [width, height], thread_count(threads))
        return image.colours()

    def __repr__(self) -> str:
        error = 100.0 * self.report["error"]
        return f"<radiosity.Bake: {len(self.vertices)} vertices, error {error:.2f} %>"


def bake(
    scene: Any,
    error: Optional[float] = None,
    *,
    time: Optional[float] = None,
    each_group: bool = False,
    keep_vertices: bool = False,
    device: str = "auto",
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> Bake:
    """Light at the vertices of a scene, refined where it bends.

    Parameters
    ----------
    scene : Scene, path, or mesh of trimesh or pyvista
        Meshes reflect 0.5; give a `Scene` for more.
    error : float, optional
        Root mean square error of the reflected radiosity over the area, as a
        share; 0.05 if neither `error` nor `time` is given.
    time : float, optional
        Seconds after which the bake ends, with what there is.
    each_group : bool
        Whether each group of the scene has the error by itself.
    keep_vertices : bool
        Whether light is gathered at the vertices of the scene alone, in their
        order. The error is that at vertices.
    device : str
        ``"auto"``: graphics hardware where there is any; ``"cpu"``; or a part
        of the name of an adapter.
    threads : int, optional
        Threads on the CPU; by default one a core.
    progress : callable, optional
        Called with a `Progress`; the bake stops if it returns ``False``.

    Returns
    -------
    Bake
        With Ctrl-C what there was then: ``report["stopped"]`` says so.
    """
    light = as_scene(scene)
    if error is None and time is None:
        error = 0.05
    error = None if error is None else _check.share("error", error)
    time = None if time is None else _check.number("time", time, above=0.0)
    if not isinstance(device, str) or not device:
        raise _check.wrong("device", repr(device), "give 'auto', 'cpu' or the name of an adapter")
    native, raised = _radiosity.bake(
        light._native,
        error,
        time,
        bool(each_group),
        bool(keep_vertices),
        device,
        thread_count(threads),
        callback(progress),
    )
    if raised is not None and not isinstance(raised, KeyboardInterrupt):
        raise raised
    return Bake._of(native)


@dataclass(frozen=True)
class Grid:
    """Light at the points of a plane.

    Attributes
    ----------
    name : str
    points : numpy.ndarray, (rows, columns, 3)
        Unit of the scene; NaN where the surface below ends.
    irradiance, standard_error : numpy.ndarray, (rows, columns, 3)
        W/m² per channel; NaN also inside of solids.
    mean_error : numpy.ndarray, (3,)
        Standard error of the mean, W/m² per channel.
    reached : bool
        Whether 95 % of the values have the error that was asked for.
    """

    name: str
    points: np.ndarray
    irradiance: np.ndarray
    standard_error: np.ndarray
    mean_error: np.ndarray
    reached: bool

    @property
    def illuminance(self) -> np.ndarray:
        """Luminance-weighted irradiance, (rows, columns): lux where radiances are in cd/m²."""
        return self.irradiance @ LUMINANCE

    @property
    def uniformity(self) -> float:
        """Minimum over mean of `illuminance` (EN 12464-1)."""
        values = self.illuminance
        mean = float(np.nanmean(values))
        return float(np.nanmin(values)) / mean if mean > 0.0 else 0.0


def grid(
    light: Bake,
    error: float = 0.05,
    *,
    plane: Optional[ArrayLike] = None,
    group: Optional[str] = None,
    height: Optional[float] = None,
    strip: Optional[float] = None,
    spacing: Optional[float] = None,
    metres: float = 1.0,
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> List[Grid]:
    """Irradiance at the points of measuring grids.

    Parameters
    ----------
    light : Bake
        Up to three times less exact than `error`, or 0.3, is good enough.
    error : float
        95 % of the values are off by less, as a share, against the true light.
    plane : array_like, (3, 3), optional
        A corner and two edges: light is measured on the side of their cross
        product.
    group : str, optional
        A flat group of the scene, above which light is measured. Without
        `plane` and `group` it is measured above the floor of each room.
    height : float, optional
        Metres above; by default 0 above a group, 0.8 above floors.
    strip : float, optional
        Metres left out along edges; by default 0.5 along walls, else 0.
    spacing : float, optional
        Largest distance of points, metres; by default that of EN 12464-1.
    metres : float
        Metres in the scene's unit of length.

    Returns
    -------
    list of Grid
    """
    native = _native_of(light)
    floors = plane is None and group is None
    corner_and_edges: Optional[List[List[float]]] = None
    if plane is not None:
        given = _check.vectors("plane", plane)
        if given.shape != (3, 3):
            raise _check.wrong("plane", f"shape {given.shape}", "give a corner and two edges")
        corner_and_edges = given.tolist()
    if group is not None and not isinstance(group, str):
        raise _check.wrong("group", f"a {type(group).__name__}", "give the name of a group")
    above = _check.number("height", (0.8 if floors else 0.0) if height is None else height)
    edge = (0.5 if floors else 0.0) if strip is None else strip
    if spacing is not None:
        spacing = _check.number("spacing", spacing, above=0.0)
    grids = native.grid(
        _check.share("error", error),
        corner_and_edges,
        group,
        above,
        _check.number("strip", edge, least=0.0),
        spacing,
        1.0 / _check.number("metres", metres, above=0.0),
        thread_count(threads),
        callback(progress),
    )
    if not grids:
        found = "none is large enough"
        raise _check.wrong("floors of the scene", found, "give group=, plane= or metres=")
    return [
        Grid(
            name=g.name,
            points=g.points,
            irradiance=g.irradiance,
            standard_error=g.standard_error,
            mean_error=np.array(g.mean_error),
            reached=g.is_reached,
        )
        for g in grids
    ]


@dataclass(frozen=True)
class Probes:
    """Light at points in the air, as spherical harmonics of order 2.

    Attributes
    ----------
    positions : numpy.ndarray, (n, 3)
    counts : tuple of int, optional
        Probes along x, y and z; x runs fastest. ``None`` for given positions.
    harmonics : numpy.ndarray, (n, 9, 3)
        Irradiance over the unit normal n, W/m² per channel: E(n) = Σ_k
        harmonics[k] Y_k(n), with the real harmonics Y_k of R. Ramamoorthi and
        P. Hanrahan 2001 ("An efficient representation for irradiance
        environment maps", equation 3), by l and m from −l to l.
    deviation : numpy.ndarray, (n,)
        Root mean square error over all normals, W/m².
    inside : numpy.ndarray, (n,) of bool
        Whether a probe is inside of something: its light is of no use.
    reached : bool
        Whether 95 % have the error that was asked for.
    """

    positions: np.ndarray
    counts: Optional[Tuple[int, int, int]]
    harmonics: np.ndarray
    deviation: np.ndarray
    inside: np.ndarray
    reached: bool

    def irradiance(self, normal: ArrayLike) -> np.ndarray:
        """Irradiance of a surface with this normal at each probe, W/m², (n, 3)."""
        given = np.array(_check.direction("normal", normal))
        x, y, z = given / np.linalg.norm(given)
        basis = np.array(
            [
                0.28209479177387814,
                0.4886025119029199 * y,
                0.4886025119029199 * z,
                0.4886025119029199 * x,
                1.0925484305920792 * x * y,
                1.0925484305920792 * y * z,
                0.31539156525252005 * (3.0 * z * z - 1.0),
                1.0925484305920792 * x * z,
                0.5462742152960396 * (x * x - y * y),
            ]
        )
        return np.einsum("k,nkc->nc", basis, self.harmonics)


def probes(
    light: Bake,
    error: float = 0.05,
    *,
    positions: Optional[ArrayLike] = None,
    size: Optional[float] = None,
    bounds: Optional[ArrayLike] = None,
    counts: Optional[Tuple[int, int, int]] = None,
    spacing: Optional[float] = None,
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> Probes:
    """Irradiance from all sides at points in the air.

    Parameters
    ----------
    light : Bake
    error : float
        95 % of the probes are off by less, as a share.
    positions : array_like, (n, 3), optional
        Where; by default the middles of the cells of a box.
    size : float, optional
        With positions: the distance to the next, unit of the scene.
    bounds : array_like, (2, 3), optional
        Lowest and highest corner of the box; by default that of the scene.
    counts : (int, int, int), optional
        Cells along x, y and z.
    spacing : float, optional
        Edge of a cell, unit of the scene; by default a tenth of the longest
        side of the box.
    """
    native = _native_of(light)
    number_of: Optional[Tuple[int, int, int]] = None
    if positions is None:
        box = light.scene.bounds if bounds is None else _check.vectors("bounds", bounds)
        if box.shape != (2, 3):
            raise _check.wrong("bounds", f"shape {box.shape}", "give two corners, shape (2, 3)")
        if spacing is None:
            spacing = 0.1 * float((box[1] - box[0]).max())
        spacing = _check.number("spacing", spacing, above=0.0)
        given: Optional[List[int]] = None
        if counts is not None:
            cells = _check.vector("counts", counts)
            if any(n < 1 or n != int(n) for n in cells):
                raise _check.wrong("counts", str(counts), "give three whole numbers above 0")
            given = [int(n) for n in cells]
        points, cells_of, width = _radiosity.probe_positions(box.tolist(), given, spacing)
        number_of = (cells_of[0], cells_of[1], cells_of[2])
    else:
        points = _check.vectors("positions", positions)
        if size is None:
            raise _check.wrong("size", "None", "give the distance of positions to the next")
        width = _check.number("size", size, above=0.0)
    harmonics, deviation, inside, reached = native.probes(
        _check.share("error", error), points, width, thread_count(threads), callback(progress)
    )
    return Probes(points, number_of, harmonics, deviation, inside, reached)


@dataclass(frozen=True)
class Verification:
    """How far off a solution is, by paths that are not used to make it.

    Attributes
    ----------
    error, standard_error : float or None
        Root mean square over the area of relative errors of the reflected
        radiosity, as a share, without the hundredth of the area where they are
        largest and without what is hidden; ``None`` if nothing was measured.
    error_with_tail, error_with_hidden : float or None
        With the one, and with both.
    groups : dict of str to (float, float) or None
        Error and standard error of each.
    points, paths : int
        Points measured at, and paths from each.
    missing : int
        Points that lie on no face of the solution.
    stop : str
        Why it ended: precise, negligible, time, rounds or cancelled.
    """

    error: Optional[float]
    standard_error: Optional[float]
    error_with_tail: Optional[float]
    error_with_hidden: Optional[float]
    hidden_share: float
    groups: Dict[str, Optional[Tuple[float, float]]]
    points: int
    paths: int
    missing: int
    stop: str


def verify(
    scene: Any,
    solution: Union[Bake, Tuple[ArrayLike, ArrayLike, ArrayLike]],
    *,
    precision: float = 0.1,
    time: Optional[float] = 120.0,
    seed: int = 0,
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> Verification:
    """Measures the error of a solution by tracing paths at random points of the scene.

    Parameters
    ----------
    scene : Scene, path, or mesh of trimesh or pyvista
    solution : Bake, or (vertices, faces, radiosity)
        Of any program: radiosity, W/m², is (n, 3) at the vertices.
    precision : float
        Standard error wanted, as a share of the error.
    time : float, optional
        No round begins that would end later, seconds; ``None`` for no limit.
    seed : int
        Another seed gives other points.
    """
    truth = as_scene(scene)
    if isinstance(solution, Bake):
        vertices, corners = solution.vertices, solution.faces
        values = solution.radiosity
    else:
        try:
            positions, faces, radiosity = solution
        except (TypeError, ValueError):
            remedy = "give a Bake, or (vertices, faces, radiosity)"
            raise _check.wrong("solution", f"a {type(solution).__name__}", remedy) from None
        vertices = _check.vectors("vertices", positions)
        corners = _check.faces(faces, len(vertices))
        values = _check.vectors("radiosity", radiosity)
        if len(values) != len(vertices):
            found = f"{len(values)} rows for {len(vertices)} vertices"
            raise _check.wrong("radiosity", found, "give one row for each vertex")
        if corners.shape[1] != 3:
            raise _check.wrong("faces", f"shape {corners.shape}", "give triangles, (m, 3)")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**64:
        raise _check.wrong("seed", repr(seed), "give a whole number, at least 0")
    measured = _radiosity.verify_solution(
        truth._native,
        vertices,
        corners,
        values,
        _check.number("precision", precision, above=0.0, most=1.0),
        None if time is None else _check.number("time", time, above=0.0),
        seed,
        thread_count(threads),
        callback(progress),
    )
    return Verification(**measured)


def _native_of(light: Bake) -> _radiosity.Bake:
    if not isinstance(light, Bake):
        remedy = "give what radiosity.bake(scene) returns"
        raise _check.wrong("light", f"a {type(light).__name__}", remedy)
    return light._native
