"""A room lit by a lamp below its ceiling, plotted in PyVista.

    python room.py [PICTURE.png]
"""

import sys

import numpy as np
import pyvista

import radiosity


def box(low, high, inwards=False):
    """Corners and quadrilaterals of a box that faces out of itself, or in."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    quads = np.array(
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]]
    )
    return low + corners * np.subtract(high, low), quads[:, ::-1] if inwards else quads


# What there is: corners, reflectance, and exitance in W/m².
parts = [
    ("walls", box([0, 0, 0], [4, 3, 2.5], inwards=True), [0.75, 0.72, 0.65], 0.0),
    ("table", box([1.2, 1.0, 0.7], [2.8, 2.0, 0.75]), [0.45, 0.25, 0.12], 0.0),
    ("cupboard", box([3.2, 0.1, 0.0], [3.9, 1.2, 1.9]), [0.2, 0.35, 0.5], 0.0),
    ("lamp", box([1.8, 1.3, 2.2], [2.2, 1.7, 2.25]), [0.5, 0.5, 0.5], 90.0),
]
vertices, faces, reflectance, exitance, groups = [], [], [], [], []
for name, (corners, quads), colour, light in parts:
    faces.append(quads + sum(map(len, vertices)))
    vertices.append(corners)
    reflectance += [colour] * len(quads)
    exitance += [light] * len(quads)
    groups += [name] * len(quads)

room = radiosity.Scene(
    np.vstack(vertices),
    np.vstack(faces),
    reflectance=reflectance,
    exitance=np.array(exitance),
    groups=groups,
)
light = radiosity.bake(room, error=0.05)
print(f"{light}: {light.report['outcome']} in {light.report['seconds']:.1f} s")

mesh = pyvista.make_tri_mesh(light.vertices, light.faces)
# What a camera would make of it: reflected light up to that of the walls' brightest, in sRGB.
exposure = 1.0 / np.percentile(light.radiosity, 95)
mesh["colour"] = np.clip(light.radiosity * exposure, 0, 1) ** (1 / 2.2)
plotter = pyvista.Plotter(off_screen=len(sys.argv) > 1)
plotter.add_mesh(mesh, scalars="colour", rgb=True, lighting=False)
plotter.camera_position = [(0.3, 2.8, 1.6), (2.6, 1.2, 0.9), (0, 0, 1)]
plotter.camera.view_angle = 70
plotter.show(screenshot=sys.argv[1] if len(sys.argv) > 1 else None)
