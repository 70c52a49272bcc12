"""Daylight on the desks of a room, for a date and a place, in false colours.

    python daylight.py [PICTURE.png]

A room of 6 m by 4 m with a window to the south, in Berlin, at noon of 21 March under a clear sky.
"""

import sys
from datetime import datetime, timedelta, timezone

import matplotlib

if len(sys.argv) > 1:
    matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np

import radiosity

# Walls from inside; the south wall, y = 0, has a window between two corners.
x, y, z = 6.0, 4.0, 2.8
(left, right), (sill, head) = (1.0, 5.0), (0.9, 2.4)
quads = [
    ("floor", [[0, 0, 0], [x, 0, 0], [x, y, 0], [0, y, 0]], 0.3),
    ("ceiling", [[0, 0, z], [0, y, z], [x, y, z], [x, 0, z]], 0.8),
    ("north", [[0, y, 0], [x, y, 0], [x, y, z], [0, y, z]], 0.6),
    ("west", [[0, 0, 0], [0, y, 0], [0, y, z], [0, 0, z]], 0.6),
    ("east", [[x, 0, 0], [x, 0, z], [x, y, z], [x, y, 0]], 0.6),
    ("south", [[0, 0, 0], [0, 0, z], [left, 0, z], [left, 0, 0]], 0.6),
    ("south", [[right, 0, 0], [right, 0, z], [x, 0, z], [x, 0, 0]], 0.6),
    ("south", [[left, 0, 0], [left, 0, sill], [right, 0, sill], [right, 0, 0]], 0.6),
    ("south", [[left, 0, head], [left, 0, z], [right, 0, z], [right, 0, head]], 0.6),
    ("ground", [[-40, -60, -0.5], [46, -60, -0.5], [46, -0.1, -0.5], [-40, -0.1, -0.5]], 0.2),
]
noon = datetime(2026, 3, 21, 12, tzinfo=timezone(timedelta(hours=1)))
sun = radiosity.sun_direction(noon, latitude=52.52, longitude=13.40)
# Measured on a clear day, W/m²; with a dew point the light is in lumens.
sky = radiosity.Sky.perez(700.0, 90.0, sun, dew_point=4.0, day=noon.timetuple().tm_yday)
room = radiosity.Scene(
    np.vstack([corners for _, corners, _ in quads]),
    np.arange(4 * len(quads)).reshape(-1, 4),
    reflectance=np.array([reflectance for *_, reflectance in quads]),
    groups=[name for name, *_ in quads],
    sky=sky,
    up=[0, 0, 1],
)
light = radiosity.bake(room, error=0.1)
grid = radiosity.grid(light, 0.05, group="floor", height=0.8, spacing=0.4)[0]
print(f"{np.nanmean(grid.illuminance):.0f} lx in the mean, uniformity {grid.uniformity:.2f}")

points, lux = grid.points.reshape(-1, 3), grid.illuminance.ravel()
plt.figure(figsize=(7, 4.5))
levels = np.geomspace(np.nanmin(lux), np.nanmax(lux), 25)
plt.tricontourf(points[:, 0], points[:, 1], lux, levels=levels, norm="log", cmap="inferno")
plt.colorbar(label="lx", ticks=levels[::4], format="%.0f")
plt.gca().set(aspect="equal", xlabel="m, window below", ylabel="m")
plt.title("Illuminance 0.8 m above the floor")
plt.savefig(sys.argv[1], dpi=120) if len(sys.argv) > 1 else plt.show()
