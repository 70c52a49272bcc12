"""Temperatures in a furnace: a hot floor, a load on it, and walls that lose nothing.

    python furnace.py

The load is a box that takes in 20 kW/m²; its sides and the walls are grey. Prints the temperature
of each part, and where the heat goes.
"""

import numpy as np
import trimesh

import radiosity


def parts():
    """Name, mesh, temperature (K) or NaN, net flux out (W/m²) and emissivity of each."""
    room = trimesh.creation.box(extents=[2.0, 1.0, 1.0])
    room.invert()
    floor = room.face_normals[:, 2] > 0.9
    load = trimesh.creation.box(extents=[0.6, 0.4, 0.3])
    load.apply_translation([0.3, 0.0, -0.2])
    yield "floor", room.submesh([floor], append=True), 1400.0, 0.0, 0.9
    yield "walls", room.submesh([~floor], append=True), np.nan, 0.0, 0.6
    yield "load", load, np.nan, -20e3, 0.8


everything = list(parts())
counts = [len(mesh.faces) for _, mesh, *_ in everything]
whole = trimesh.util.concatenate([mesh for _, mesh, *_ in everything])
part = np.repeat(np.arange(len(everything)), counts)

# Finer faces, each with a temperature of its own.
vertices, faces, index = trimesh.remesh.subdivide_to_size(
    whole.vertices, whole.faces, max_edge=0.25, return_index=True
)
part = part[index]
factors = radiosity.view_factors(vertices, faces, error=1e-3)
print(f"{factors.shape[0]} faces, {factors.nnz} factors; {factors.checks()['closure'][1]:.1e} from "
      "closure")

temperature, flux, emissivity = (
    np.array([of[k] for of in everything])[part] for k in (2, 3, 4)
)
balance = radiosity.heat(
    factors.enforced(), temperature=temperature, net_flux=flux, emissivity=emissivity
)
for k, (name, *_) in enumerate(everything):
    of = part == k
    kelvin, areas = balance.temperature[of], factors.areas[of]
    power = (balance.net_flux[of] * areas).sum() / 1e3
    print(f"{name:6} {kelvin.min():7.1f} to {kelvin.max():7.1f} K, gives {power:8.3f} kW")
print(f"out of balance by {balance.imbalance:.1e} W")
