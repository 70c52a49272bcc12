"""Scenes: triangles with reflectances and light."""

from __future__ import annotations

import os
from typing import Any, Dict, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _check
from ._radiosity import Scene as _Scene
from .sky import Sky

__all__ = ["Luminaire", "Scene"]


class Luminaire(NamedTuple):
    """A lamp with a measured distribution of light."""

    #: File of IESNA LM-63 (.ies) or EULUMDAT (.ldt).
    file: Union[str, os.PathLike]
    #: Where it is, unit of the scene.
    position: ArrayLike
    #: Direction of its axis: down by default, where +z is up.
    aim: ArrayLike = (0.0, 0.0, -1.0)
    #: Factor of its intensities.
    scale: float = 1.0


class Scene:
    """Triangles with reflectances and light. A scene does not change.

    Parameters
    ----------
    vertices : array_like, (n, 3)
        Positions, in any unit of length, of any numeric type and layout.
    faces : array_like, (m, 3) or (m, 4)
        Indices of the corners, counter-clockwise from the front. Quadrilaterals
        are convex, and cut in two.
    reflectance : float or array_like, (3,), (m,) or (m, 3)
        Diffuse reflectance per channel, in [0, 1): of all faces, or of each.
    exitance : float or array_like, (3,), (m,) or (m, 3)
        Light that faces emit, W/m²: π times their radiance.
    transmittance : float or array_like, (3,), (m,) or (m, 3)
        Diffuse transmittance; with the reflectance below 1.
    groups : sequence, (m,), optional
        A name or a number for each face: faces of one are judged together, and
        are a row of view factors. By default all faces are one group.
    both_sides : bool, optional
        Whether faces reflect on both sides. By default, where light reaches
        both.
    sky : Sky, optional
        The light from outside; none by default.
    luminaires : sequence of Luminaire
        Lamps with measured distributions.
    metres : float
        Metres in the scene's unit, for luminaires.
    up : array_like, (3,), optional
        The upward axis; by default estimated from the scene.

    Attributes
    ----------
    vertices : numpy.ndarray, (n, 3)
    faces : numpy.ndarray, (k, 3)
        Triangles that have area.
    face_groups : numpy.ndarray, (k,)
        Index of each in `groups`.
    groups, materials : list of str
    warnings : list of str
        What was odd about a file, and how it was repaired.
    bounds : numpy.ndarray, (2, 3)
    up : numpy.ndarray, (3,)
    """

    _native: _Scene

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        reflectance: ArrayLike = 0.5,
        exitance: ArrayLike = 0.0,
        transmittance: ArrayLike = 0.0,
        groups: Optional[Sequence] = None,
        both_sides: Optional[bool] = None,
        sky: Optional[Sky] = None,
        luminaires: Sequence[Luminaire] = (),
        metres: float = 1.0,
        up: Optional[ArrayLike] = None,
    ) -> None:
        positions = _check.vectors("vertices", vertices)
        corners = _check.faces(faces, len(positions))
        names, numbers = _groups(groups, len(corners))
        count = len(corners)
        properties = [
            _check.colours("reflectance", reflectance, count, below=1.0),
            _check.colours("exitance", exitance, count),
            _check.colours("transmittance", transmittance, count, below=1.0),
        ]
        both = properties[0] + properties[2]
        if (both >= 1.0).any():
            row, column = np.argwhere(both >= 1.0)[0]
            found = f"{both[row, column]:g} with the reflectance"
            raise _check.wrong(f"transmittance of face {row}", found, "give less: below 1 together")
        materials, of_faces = _materials(properties)
        if corners.shape[1] == 4:
            corners, source = _triangles(positions, corners)
            numbers, of_faces = numbers[source], of_faces[source]
        native = _Scene.from_arrays(
            positions,
            np.ascontiguousarray(corners),
            numbers,
            of_faces,
            names,
            [f"material {k + 1}" for k in range(len(materials))],
            materials,
            None if both_sides is None else bool(both_sides),
            None if up is None else _check.direction("up", up),
        )
        self._native = _with(native, sky, luminaires, metres)

    @classmethod
    def _of(cls, native: _Scene) -> Scene:
        scene = object.__new__(cls)
        scene._native = native
        return scene

    @classmethod
    def load(
        cls,
        file: Union[str, os.PathLike, bytes],
        *,
        name: str = "scene.glb",
        files: Mapping[str, bytes] = {},
        emit: Mapping[str, ArrayLike] = {},
        transmit: Mapping[str, ArrayLike] = {},
        facets: bool = False,
        strict: bool = False,
        texture_coordinates: bool = False,
        ignore_glass: bool = False,
        sky: Optional[Sky] = None,
        luminaires: Sequence[Luminaire] = (),
        metres: float = 1.0,
    ) -> Scene:
        """A scene of a file: glTF (.glb, .gltf), OBJ with MTL, or STL.

        Parameters
        ----------
        file : path or bytes
            The file, or its content.
        name : str
            Name of the content; its ending can say the format.
        files : dict of str to bytes
            Files that the content names: libraries, textures, buffers.
        emit : dict of str to float or array_like, (3,)
            Radiance of materials by name, W/(m² sr).
        transmit : dict of str to float or array_like, (3,)
            Diffuse transmittance of materials by name.
        facets : bool
            Makes each face a group.
        strict : bool
            Refuses what would be repaired otherwise.
        texture_coordinates : bool
            Keeps those of the file for `light_map`, also without textures.
        ignore_glass : bool
            Makes glass and mirrors surfaces as all others.
        sky, luminaires, metres
            As those of `Scene`. Without a sky, a scene without light has a
            uniform one of radiance 1.

        Raises
        ------
        OSError
            If the file cannot be read.
        ValueError
            If it is malformed, with the place.
        """
        content = None
        if isinstance(file, (bytes, bytearray, memoryview)):
            content = (bytes(file), [(str(n), bytes(b)) for n, b in files.items()])
            path = name
        elif isinstance(file, (str, os.PathLike)):
            path = os.fspath(file)
        else:
            raise _check.wrong("file", f"a {type(file).__name__}", "give a path, or bytes")
        emitted = [(k, _check.colour(f"emit[{k!r}]", v)) for k, v in dict(emit).items()]
        passed = [(k, _check.colour(f"transmit[{k!r}]", v)) for k, v in dict(transmit).items()]
        native = _Scene.load(
            path,
            content,
            emitted,
            passed,
            bool(facets),
            bool(strict),
            bool(texture_coordinates),
            bool(ignore_glass),
            sky is not None or len(luminaires) > 0,
        )
        if luminaires and sky is None:
            sky = Sky.uniform(0.0)
        return cls._of(_with(native, sky, luminaires, metres))

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
    def groups(self) -> list[str]:
        return self._native.groups

    @property
    def materials(self) -> list[str]:
        return self._native.materials

    @property
    def warnings(self) -> list[str]:
        return self._native.warnings

    @property
    def bounds(self) -> np.ndarray:
        return np.array(self._native.bounds)

    @property
    def up(self) -> np.ndarray:
        return np.array(self._native.up)

    def __repr__(self) -> str:
        native = self._native
        return f"<radiosity.Scene: {len(native.faces)} triangles in {len(native.groups)} groups>"


def as_scene(scene: Any, **settings: Any) -> Scene:
    """`scene`, or what it can be made of: a path, or an object of trimesh or pyvista."""
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, (str, os.PathLike)):
        return Scene.load(scene)
    arrays = mesh_arrays(scene)
    if arrays is None:
        remedy = "give a Scene, a path, or a mesh of trimesh or pyvista"
        raise _check.wrong("scene", f"a {type(scene).__name__}", remedy)
    vertices, faces, groups = arrays
    return Scene(vertices, faces, groups=groups, **settings)


def mesh_arrays(mesh: Any, by_cell: bool = False):
    """Vertices, triangles and groups of a mesh of trimesh or pyvista; none of what is neither.

    With `by_cell` groups are the cells of pyvista.
    """
    if hasattr(mesh, "geometry") and hasattr(mesh, "graph"):
        mesh = mesh.to_mesh() if hasattr(mesh, "to_mesh") else mesh.dump(concatenate=True)
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces") and not hasattr(mesh, "n_cells"):
        return np.asarray(mesh.vertices), np.asarray(mesh.faces), None
    if hasattr(mesh, "n_cells") and hasattr(mesh, "points"):
        if not hasattr(mesh, "is_all_triangles"):
            mesh = mesh.extract_surface()
        surface = mesh.copy(deep=False)
        surface.clear_data()
        surface.cell_data["cell"] = np.arange(surface.n_cells)
        triangles = surface.triangulate()
        faces = triangles.faces.reshape(-1, 4)[:, 1:]
        groups = np.asarray(triangles.cell_data["cell"]) if by_cell else None
        return np.asarray(triangles.points), faces, groups
    return None


def _with(native: _Scene, sky: Optional[Sky], luminaires: Sequence[Luminaire], metres: float):
    if luminaires:
        unit = _check.number("metres", metres, above=0.0)
        all_lamps = []
        for k, lamp in enumerate(luminaires):
            lamp = Luminaire(*lamp) if not isinstance(lamp, Luminaire) else lamp
            place = f"luminaires[{k}]"
            position = _check.vector(f"{place}.position", lamp.position)
            aim = _check.direction(f"{place}.aim", lamp.aim)
            scale = _check.number(f"{place}.scale", lamp.scale, least=0.0)
            all_lamps.append((os.fspath(lamp.file), position, aim, scale))
        native = native.with_luminaires(all_lamps, unit)
    if sky is None:
        return native
    if not isinstance(sky, Sky):
        raise _check.wrong("sky", f"a {type(sky).__name__}", "give a Sky, such as Sky.uniform(1)")
    return native.with_sky(sky._native)


def _groups(groups: Optional[Sequence], count: int):
    """Names of groups, and the index of that of each face."""
    if groups is None:
        return ["mesh"], np.zeros(count, np.uint32)
    if isinstance(groups, str):
        raise _check.wrong("groups", repr(groups), "give a name or a number for each face")
    given = list(np.asarray(groups).tolist() if not isinstance(groups, list) else groups)
    if len(given) != count:
        raise _check.wrong("groups", f"{len(given)} of them", f"give one for each of {count} faces")
    names: Dict[str, int] = {}
    numbers = np.empty(count, np.uint32)
    for k, group in enumerate(given):
        if not isinstance(group, (str, int)) or isinstance(group, bool):
            found = f"a {type(group).__name__}"
            raise _check.wrong(f"groups[{k}]", found, "give names or whole numbers")
        numbers[k] = names.setdefault(str(group), len(names))
    return list(names), numbers


def _materials(properties):
    """Different rows of reflectance, exitance and transmittance, and the index of that of each
    face."""
    if all(p.strides[0] == 0 for p in properties):
        return np.concatenate([p[:1] for p in properties], axis=1), np.zeros(
            len(properties[0]), np.uint32
        )
    rows = np.concatenate(properties, axis=1)
    materials, of_faces = np.unique(rows, axis=0, return_inverse=True)
    return materials, of_faces.reshape(-1).astype(np.uint32)


def _triangles(positions: np.ndarray, quads: np.ndarray):
    """Triangles of quadrilaterals, cut along the shorter diagonal that lies inside, and the face of
    each."""
    p = positions[quads]
    halves = np.array([[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]])

    def is_inside(cut: np.ndarray) -> np.ndarray:
        a, b = (np.cross(p[:, k] - p[:, i], p[:, j] - p[:, i]) for i, k, j in cut)
        return np.einsum("ij,ij->i", a, b) >= 0.0

    lengths = [np.linalg.norm(p[:, i] - p[:, i + 2], axis=1) for i in (0, 1)]
    first, second = (is_inside(cut) for cut in halves)
    by_first = first & ((lengths[0] <= lengths[1]) | ~second)
    cut = halves[np.where(by_first, 0, 1)]
    triangles = np.take_along_axis(quads, cut.reshape(len(quads), 6), axis=1).reshape(-1, 3)
    return triangles, np.repeat(np.arange(len(quads)), 2)
