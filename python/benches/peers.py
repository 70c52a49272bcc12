"""View factors beside pyviewfactor and raystrack, in one run: error and seconds.

    pip install pyviewfactor raystrack trimesh pyvista
    python peers.py

Scenes: two squares (the example of raystrack's README), the inside of a sphere, and a room with a
box in it. The truth is the closed form (J. R. Howell, catalogue of configuration factors, C-11), the
share of the area, and cubature to 1e-8, of the room to 1e-6. Programs that compile do so on the first
scene, which runs twice.
"""

import time

import numpy as np
import pyviewfactor
import pyvista
import raystrack
import trimesh

import radiosity


def squares():
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    vertices = np.vstack([corners, corners + [0, 0, 1]])
    return vertices, np.vstack([faces, faces[:, ::-1] + 4]), [0, 0, 1, 1]


def sphere(subdivisions):
    mesh = trimesh.creation.icosphere(subdivisions)
    mesh.invert()
    return mesh.vertices, mesh.faces, np.arange(len(mesh.faces))


def room():
    walls = trimesh.creation.box(extents=[2, 1, 1])
    walls.invert()
    inner = trimesh.creation.box(extents=[0.5, 0.4, 0.3])
    inner.apply_translation([0.2, 0.1, -0.1])
    whole = trimesh.util.concatenate([walls, inner])
    vertices, faces = trimesh.remesh.subdivide_to_size(whole.vertices, whole.faces, max_edge=1.0)
    return vertices, faces, np.arange(len(faces))


def by_radiosity(error):
    def run(vertices, faces, groups):
        return radiosity.view_factors(vertices, faces, error, groups=groups).toarray()

    return run


def by_pyviewfactor(vertices, faces, groups):
    mesh = pyvista.make_tri_mesh(np.asarray(vertices), np.asarray(faces))
    matrix = np.asarray(pyviewfactor.compute_viewfactor_matrix(mesh))
    # Its rows receive in some versions: the flux that leaves a row is at most its own.
    areas = np.linalg.norm(np.cross(*np.swapaxes(vertices[faces[:, 1:]] - vertices[faces[:, :1]], 0, 1)), axis=1) / 2
    if abs((areas[:, None] * matrix) - (areas[:, None] * matrix).T).max() > abs(
        (areas[None, :] * matrix) - (areas[None, :] * matrix).T
    ).max():
        matrix = matrix.T
    return grouped(matrix, areas, groups)


def grouped(matrix, areas, groups):
    groups = np.asarray(groups)
    one = np.eye(groups.max() + 1)[groups]
    flux = one.T @ (areas[:, None] * matrix) @ one
    return flux / (one.T @ areas)[:, None]


def by_raystrack(rays):
    def run(vertices, faces, groups):
        groups = np.asarray(groups)
        meshes = {
            f"s{g}": raystrack.Mesh(
                np.asarray(vertices, np.float32), np.asarray(faces[groups == g], np.int32)
            )
            for g in range(groups.max() + 1)
        }
        scene = raystrack.Scene.from_meshes(meshes)
        options = raystrack.SolveOptions(
            sampling=raystrack.Sampling(density=16, rays_per_cell=128, seed=11),
            accuracy=raystrack.Accuracy(max_replicates=50, min_replicates=5, tolerance=1e-5),
            batch_size=65536,
        )
        matrix = np.zeros((len(meshes),) * 2)
        with raystrack.Solver(scene, device="cpu", bvh="builtin") as solver:
            result = solver.solve(
                raystrack.Query.matrix(), options, raystrack.Budget(rays=rays * len(meshes))
            )
            for i, sender in enumerate(meshes):
                for j, receiver in enumerate(meshes):
                    channel = raystrack.Channel("surface", receiver, "front")
                    matrix[i, j] = result.value(sender, channel)
        return matrix

    return run


def measured(run, scene):
    start = time.perf_counter()
    matrix = run(*scene)
    return matrix, time.perf_counter() - start


def main():
    programs = [
        ("radiosity 1e-3", by_radiosity(1e-3)),
        ("radiosity 1e-5", by_radiosity(1e-5)),
        ("pyviewfactor", by_pyviewfactor),
        ("raystrack 2^16 rays a row", by_raystrack(1 << 16)),
        ("raystrack 2^20 rays a row", by_raystrack(1 << 20)),
    ]
    scenes = [
        ("two squares, to compile", squares(), 1e-8),
        ("two squares", squares(), 1e-8),
        ("sphere, 320 triangles", sphere(2), 1e-8),
        ("sphere, 1280 triangles", sphere(3), 1e-8),
        ("room with a box", room(), 1e-6),
    ]
    for name, scene, exact in scenes:
        vertices, faces, groups = scene
        truth = radiosity.view_factors(vertices, faces, exact, groups=groups, method="exact")
        truth = truth.toarray()
        if name.startswith("two squares"):
            # C-11 with X = Y = 2, F = 0.415253.
            assert abs(truth[0, 1] - 0.4152530) < 1e-6, truth[0, 1]
        print(f"{name}: {len(truth)} rows, {len(faces)} triangles")
        for program, run in programs:
            if "2^20" in program and len(truth) > 20:
                continue
            try:
                matrix, seconds = measured(run, scene)
            except Exception as error:  # what another program cannot do is part of the table
                print(f"  {program:26} {type(error).__name__}: {str(error)[:80]}")
                continue
            off = matrix - truth
            rms, most = np.sqrt((off**2).mean()), abs(off).max()
            print(f"  {program:26} {seconds:9.3f} s   off by {rms:.1e} (root mean square), "
                  f"{most:.1e} at most; rows {abs(matrix.sum(1) - truth.sum(1)).max():.1e}",
                  flush=True)


if __name__ == "__main__":
    main()
