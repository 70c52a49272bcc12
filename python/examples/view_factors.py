"""View factors of a trimesh, beside pyviewfactor: the error of each and the seconds it takes.

    python view_factors.py [SUBDIVISIONS]

The inside of a sphere of triangles: each sees all others, and nothing stands between.
"""

import sys
import time

import numpy as np
import pyviewfactor
import pyvista
import trimesh

import radiosity

subdivisions = int(sys.argv[1]) if len(sys.argv) > 1 else 2
sphere = trimesh.creation.icosphere(subdivisions)
sphere.invert()
print(f"{len(sphere.faces)} triangles that see one another")

start = time.perf_counter()
factors = radiosity.view_factors(sphere, error=1e-4)
ours = time.perf_counter() - start
rows = np.asarray(factors.sum(axis=1)).ravel()
print(f"radiosity     {ours:8.2f} s for {factors.nnz} factors, rows sum to 1 within "
      f"{abs(rows - 1).max():.1e}")

mesh = pyvista.make_tri_mesh(sphere.vertices, sphere.faces)
areas = sphere.area_faces
pairs = [(0, k) for k in range(1, len(areas), max(1, len(areas) // 60))]
cells = {k: pyviewfactor.fc_unstruc2poly(mesh.extract_cells(k)) for k in {k for p in pairs for k in p}}
pyviewfactor.compute_viewfactor(cells[1], cells[0])  # compiles
start = time.perf_counter()
theirs = [pyviewfactor.compute_viewfactor(cells[j], cells[i]) for i, j in pairs]
each = (time.perf_counter() - start) / len(pairs)
print(f"pyviewfactor  {each * len(areas) ** 2 / 2:8.2f} s for all, by {len(pairs)} pairs of "
      f"{1e3 * each:.2f} ms, without a test of what stands between")

exact = radiosity.view_factors(sphere, error=1e-4, method="exact")
for name, values in [("radiosity", [factors[p] for p in pairs]), ("pyviewfactor", theirs)]:
    off = np.array(values) - [exact[p] for p in pairs]
    print(f"{name:13} off from cubature by {np.sqrt(np.mean(off**2)):.1e} (root mean square)")
