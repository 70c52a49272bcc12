"""Diffuse light, view factors, radiative heat and daylight of triangle meshes.

=================  ===========================================================
`Scene`            triangles with reflectances and light: from arrays, files,
                   trimesh or pyvista
`bake`             light at vertices, to an error or within a time
`light_map`        light at the texels of a texture
`grid`             light at the points of measuring planes
`probes`           light at points in the air, as spherical harmonics
`verify`           how far off a solution is, by tracing paths
`view_factors`     a sparse matrix of view factors, with standard errors
`heat`             temperatures and heat fluxes by view factors
`Sky`              the light from outside; `sun_direction`, where the sun is
=================  ===========================================================

>>> import radiosity
>>> room = radiosity.Scene.load("room.glb")
>>> light = radiosity.bake(room, error=0.05)
>>> light.radiosity.shape, light.error.max()

Units: lengths are in the unit of the vertices; radiosity, irradiance and
exitance in W/m² per channel (linear red, green and blue, or any three bands);
radiance in W/(m² sr); temperatures in K. Errors are shares (0.05 is 5 %)
unless a unit is given. The front of a face is where its corners run
counter-clockwise.

Work runs on all cores, without the interpreter's lock. Functions with
`progress` call it about 20 times a second with a `Progress`; if it returns
``False`` the work stops. Ctrl-C stops it, too: `bake` then returns what there
is, other functions raise ``KeyboardInterrupt``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

from ._radiosity import Stopped
from ._work import Progress
from .light import Bake, Grid, Probes, Verification, bake, grid, probes, verify
from .light_map import LightMap, light_map
from .scene import Luminaire, Scene
from .sky import Sky, sun_direction

if TYPE_CHECKING:
    from .factors import HeatBalance, ViewFactors, heat, load_view_factors, view_factors

#: Names that need SciPy, which takes longer to import than all else.
_OF_FACTORS = ("HeatBalance", "ViewFactors", "heat", "load_view_factors", "view_factors")

__all__ = [
    "Bake",
    "Grid",
    "HeatBalance",
    "LightMap",
    "Luminaire",
    "Probes",
    "Progress",
    "Scene",
    "Sky",
    "Stopped",
    "Verification",
    "ViewFactors",
    "bake",
    "grid",
    "heat",
    "light_map",
    "load_view_factors",
    "probes",
    "sun_direction",
    "verify",
    "view_factors",
]


def __getattr__(name: str):
    if name in _OF_FACTORS:
        return getattr(importlib.import_module(".factors", __name__), name)
    raise AttributeError(f"module 'radiosity' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
