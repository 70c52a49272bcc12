"""A light map into a glTF file: any viewer shows the light.

    python light_map.py [LIT.glb [ROOM.glb]]

Without a room it is one that is made here, by trimesh.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
import trimesh

import radiosity


def made(path: Path) -> None:
    """Writes a room with a pillar and a lamp."""
    room = trimesh.creation.box(extents=[4, 2.5, 3])
    room.invert()
    pillar = trimesh.creation.box(extents=[0.4, 2.4, 0.4])
    pillar.apply_translation([0.7, -0.05, 0.4])
    lamp = trimesh.creation.box(extents=[0.8, 0.05, 0.8])
    lamp.apply_translation([-0.5, 1.15, 0])
    material = trimesh.visual.material.PBRMaterial
    colours = {"walls": [0.8, 0.78, 0.7, 1], "pillar": [0.5, 0.2, 0.15, 1], "lamp": [1, 1, 1, 1]}
    scene = trimesh.Scene()
    for name, mesh in [("walls", room), ("pillar", pillar), ("lamp", lamp)]:
        emitted = [6.0, 5.5, 4.5] if name == "lamp" else [0.0, 0.0, 0.0]
        of_mesh = material(
            name=name, baseColorFactor=colours[name], emissiveFactor=emitted, metallicFactor=0.0
        )
        mesh.visual = trimesh.visual.TextureVisuals(material=of_mesh)
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    scene.export(path)


with tempfile.TemporaryDirectory() as folder:
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder, "lit.glb")
    source = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(folder, "room.glb")
    if len(sys.argv) <= 2:
        made(source)
    scene = radiosity.Scene.load(source, texture_coordinates=True)
    light = radiosity.light_map(scene, error=0.05, size=256)
    lost, _ = light.error_between_texels
    print(f"{light.irradiance.shape[1]} x {light.irradiance.shape[0]} texels: light at texels is "
          f"{100 * light.error_of_light:.1f} % off, {100 * lost:.1f} % is lost between them")
    # The same file with coordinates in the map; materials show the scene's radiosity.
    light.save(target, source=source, binding="emissive")
    light.save(target.with_suffix(".exr"))
    print(f"{target.name}: {target.stat().st_size} bytes; map from {light.irradiance.min():.2f} to "
          f"{np.max(light.irradiance):.2f} W/m²")
