"""Light maps: light at the texels of a texture."""

from __future__ import annotations

import os
from typing import Any, Optional, Tuple, Union

import numpy as np

from . import _check, _radiosity
from ._work import Callback, callback, thread_count
from .light import Bake, bake
from .scene import Scene, as_scene

__all__ = ["LightMap", "light_map"]


class LightMap:
    """Irradiance of all surfaces in one texture: what `light_map` returns.

    Attributes
    ----------
    irradiance : numpy.ndarray, (rows, columns, 3)
        W/m² per channel, linear: times a reflectance, it is the reflected
        radiosity.
    gathered : numpy.ndarray, (rows, columns) of bool
        Whether a texel gathered; others are empty, or filled from neighbours.
    standard_error : numpy.ndarray, (rows, columns)
        W/m², a length over the channels.
    coordinates : numpy.ndarray, (m, 3, 2)
        Place of each corner of ``scene.faces`` in the map, in [0, 1]; v is 0 in
        the first row, as in glTF.
    scene : Scene
        The scene with a triangle for each side that reflects.
    error_between_texels : (float, float) or None
        Share of the light that is lost between texels, and its standard error.
    error_of_light : float
        Error of the light at texels, as a share.
    light : Bake
        What the texels gathered from.
    """

    light: Bake
    _native: _radiosity.LightMap

    def __init__(self) -> None:
        raise _check.wrong("LightMap()", "nothing to show", "call radiosity.light_map(scene)")

    @classmethod
    def _of(cls, native: _radiosity.LightMap, light: Bake) -> LightMap:
        made = object.__new__(cls)
        made._native, made.light = native, light
        return made

    @property
    def irradiance(self) -> np.ndarray:
        return self._native.irradiance

    @property
    def gathered(self) -> np.ndarray:
        return self._native.gathered

    @property
    def standard_error(self) -> np.ndarray:
        return self._native.standard_error

    @property
    def coordinates(self) -> np.ndarray:
        return self._native.coordinates

    @property
    def scene(self) -> Scene:
        return Scene._of(self._native.scene)

    @property
    def error_between_texels(self) -> Optional[Tuple[float, float]]:
        return self._native.error_between_texels

    @property
    def error_of_light(self) -> float:
        return self._native.error_of_light

    def save(
        self,
        path: Union[str, os.PathLike],
        *,
        source: Optional[Union[str, os.PathLike]] = None,
        binding: str = "extras",
        map_file: Optional[str] = None,
    ) -> None:
        """Writes a file in the format of its ending.

        Parameters
        ----------
        path : path
            ``.exr`` (irradiance, 32-bit floats), ``.ktx2`` (with a common
            exponent), ``.png`` (RGBM) or ``.glb`` (the scene with the map).
        source : path, optional
            With ``.glb`` or ``.gltf``: the glTF file of the scene, which is
            written again with coordinates in the map.
        binding : str
            How that names the map: ``"extras"`` of primitives, ``"emissive"``
            or ``"occlusion"`` textures of materials.
        map_file : str, optional
            Name of the map's file, for extras.
        """
        _check.choice("binding", binding, ("extras", "emissive", "occlusion"))
        source = None if source is None else os.fspath(source)
        self._native.save(os.fspath(path), source, binding, map_file)


def light_map(
    scene: Any,
    error: float = 0.05,
    *,
    size: Optional[int] = None,
    texel: Optional[float] = None,
    coordinates: str = "auto",
    padding: int = 3,
    device: str = "auto",
    threads: Optional[int] = None,
    progress: Optional[Callback] = None,
) -> LightMap:
    """Bakes the irradiance of a scene's surfaces in a texture.

    Parameters
    ----------
    scene : Scene, path, or mesh of trimesh or pyvista
        Load one with ``texture_coordinates=True`` to use those of its file.
    error : float
        Error of the bake, and of light at texels, as a share.
    size : int, optional
        Texels along a side; by default the smallest of 64, 128, … in which all
        surfaces have room.
    texel : float, optional
        Edge of a texel on the surfaces, unit of the scene, in place of `size`.
    coordinates : str
        ``"file"``: those of the file; ``"new"``: charts of smooth surfaces; or
        ``"auto"``: the first where they can be used.
    padding : int
        Texels around charts that are filled from them, 3 or more.
    device, threads, progress
        As those of `bake`.
    """
    error = _check.share("error", error)
    _check.choice("coordinates", coordinates, ("auto", "file", "new"))
    if size is not None and texel is not None:
        raise _check.wrong("size and texel", "both", "give one of them")
    border = int(_check.number("padding", padding, least=3, most=2048))
    native = as_scene(scene)._native
    edge = None if texel is None else _check.number("texel", texel, above=0.0)
    pixels = None if size is None else int(_check.number("size", size, least=1, most=8192))
    atlas = _radiosity.atlas(native, pixels, edge, coordinates, border)
    light = bake(
        Scene._of(atlas.scene), error, device=device, threads=threads, progress=progress
    )
    if light.report["stopped"]:
        raise KeyboardInterrupt
    made = _radiosity.light_map(
        atlas, light._native, error, thread_count(threads), callback(progress)
    )
    return LightMap._of(made, light)
