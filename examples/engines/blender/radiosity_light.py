"""Bakes the open Blender scene with `radiosity` and brings the light back.

    blender -b SCENE.blend --python radiosity_light.py -- [OPTIONS OF radiosity bake]
    blender -b SCENE.blend --python radiosity_light.py -- --error 0.02 --save LIT.blend
    blender -b SCENE.blend --python radiosity_light.py -- --light-map [OPTIONS OF radiosity light-map]

Exports the scene as glTF with its lamps and cameras, runs `radiosity bake` on it, and stores the
baked irradiance (W/m2 per channel) on every mesh object as the attribute `radiosity`: colours of
32-bit floats at face corners. Objects that share a mesh get one each, as their light differs. Every
material gets a copy that shows it: base colour times irradiance over pi, and what it emits.

With --light-map the light is in an image, packed into the scene: triangulated copies of the objects
have its coordinates as a UV map, in the collection `radiosity`, and the objects themselves are
hidden. For walls of two triangles that is more light for less mesh.

RADIOSITY names the program [radiosity]. --save writes the scene to a file; without it, and without
-b, the light is in the open scene.
"""
import json
import math
import os
import struct
import subprocess
import sys
import tempfile

import bpy
import numpy as np
from mathutils import Matrix, Vector
from mathutils.kdtree import KDTree

# Blender is z up, glTF y up.
TO_BLENDER = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
ATTRIBUTE = "radiosity"


def export(path):
    """Writes the scene as glTF, with all that light needs."""
    if not hasattr(np, "bool"):
        np.bool = bool  # the exporter of Blender 3.4 names it
    bpy.ops.export_scene.gltf(
        filepath=path, export_format="GLB", export_lights=True, export_cameras=True, export_apply=True,
        export_yup=True, use_visible=True)


def read_glb(path):
    """The document of a GLB file, and its binary part."""
    data = open(path, "rb").read()
    length, = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20:20 + length])
    start = 20 + length
    return document, data[start + 8:] if len(data) > start + 8 else b""


def accessor(document, binary, number):
    """The numbers of an accessor of 32-bit floats, a row an item."""
    of = document["accessors"][number]
    view = document["bufferViews"][of["bufferView"]]
    items = {"VEC2": 2, "VEC3": 3, "VEC4": 4}[of["type"]]
    offset = view.get("byteOffset", 0) + of.get("byteOffset", 0)
    stride = view.get("byteStride", 4 * items)
    rows = np.ndarray((of["count"], items), "<f4", binary, offset, (stride, 4))
    return rows.astype(float)


def world_matrices(document):
    """The world matrix of each node, in Blender's axes."""
    nodes, matrices = document["nodes"], {}

    def place(number, parent):
        node = nodes[number]
        if "matrix" in node:
            local = Matrix(np.array(node["matrix"]).reshape(4, 4).T.tolist())
        else:
            from mathutils import Quaternion
            x, y, z, w = node.get("rotation", (0, 0, 0, 1))
            local = Matrix.LocRotScale(
                Vector(node.get("translation", (0, 0, 0))), Quaternion((w, x, y, z)),
                Vector(node.get("scale", (1, 1, 1))))
        matrices[number] = parent @ local
        for child in node.get("children", ()):
            place(child, matrices[number])

    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        place(root, TO_BLENDER)
    return matrices


def light_of_nodes(path):
    """Of each node with light, by name: positions and normals in the world, and irradiance."""
    document, binary = read_glb(path)
    found = {}
    for number, matrix in world_matrices(document).items():
        node = document["nodes"][number]
        rows = []
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            attributes = primitive["attributes"]
            if "_IRRADIANCE" not in attributes:
                continue
            positions, irradiance = (
                accessor(document, binary, attributes[name]) for name in ("POSITION", "_IRRADIANCE"))
            normals = np.zeros_like(positions)
            if "NORMAL" in attributes:
                normals = accessor(document, binary, attributes["NORMAL"])
            turn = np.linalg.inv(np.array(matrix.to_3x3())).T
            place = np.array(matrix)
            rows.append((positions @ place[:3, :3].T + place[:3, 3], normals @ turn.T, irradiance))
        if rows:
            found[node.get("name", "")] = [np.concatenate(part) for part in zip(*rows)]
    return found


def store(item, light):
    """Stores the light of a node at the face corners of an object."""
    positions, normals, irradiance = light
    tree = KDTree(len(positions))
    for k, position in enumerate(positions):
        tree.insert(position, k)
    tree.balance()
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(lengths, 1e-30)
    if item.modifiers:
        # The light is that of the mesh as it is exported.
        shape = item.evaluated_get(bpy.context.evaluated_depsgraph_get())
        item.data = bpy.data.meshes.new_from_object(shape)
        item.modifiers.clear()
    elif item.data.users > 1:
        item.data = item.data.copy()
    mesh = item.data
    world, turn = item.matrix_world, item.matrix_world.inverted_safe().transposed().to_3x3()
    if hasattr(mesh, "calc_normals_split"):
        mesh.calc_normals_split()
    size = max((world @ Vector(p) - world.translation).length for p in item.bound_box) + 1e-12
    old = mesh.color_attributes.get(ATTRIBUTE)
    if old:
        mesh.color_attributes.remove(old)
    colours = mesh.color_attributes.new(ATTRIBUTE, "FLOAT_COLOR", "CORNER")
    missing = 0
    for k, loop in enumerate(mesh.loops):
        position = world @ mesh.vertices[loop.vertex_index].co
        normal = (turn @ loop.normal).normalized()
        # Corners at one point are told apart by their normals.
        near = tree.find_range(position, 1e-4 * size)
        if not near:
            missing += 1
            continue
        best = max(near, key=lambda hit: normals[hit[1]] @ np.array(normal))
        colours.data[k].color = (*irradiance[best[1]], 1.0)
    return missing


def light_of_vertices(nodes, links):
    """The colour of the light that `store` stored."""
    light = nodes.new("ShaderNodeAttribute")
    light.attribute_name = ATTRIBUTE
    return light.outputs["Color"]


def light_of_map(image, coordinates):
    """What gives the colour of the light in an image, at a UV map."""
    def colour(nodes, links):
        uv, light = nodes.new("ShaderNodeUVMap"), nodes.new("ShaderNodeTexImage")
        uv.uv_map, light.image, light.extension = coordinates, image, "EXTEND"
        links.new(uv.outputs["UV"], light.inputs["Vector"])
        return light.outputs["Color"]
    return colour


def show(material, name, light_colour):
    """A copy of a material that shows the light: base colour times irradiance over pi, and what it
    emits."""
    if name in bpy.data.materials:
        return bpy.data.materials[name]
    lit = material.copy()
    lit.name = name
    lit.use_nodes = True
    nodes, links = lit.node_tree.nodes, lit.node_tree.links
    shader = next((n for n in nodes if n.type == "BSDF_PRINCIPLED"), None)
    output = next((n for n in nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)
    if shader is None or output is None:
        return material
    times = nodes.new("ShaderNodeMixRGB")
    times.blend_type = "MULTIPLY"
    times.inputs["Fac"].default_value = 1.0
    base = shader.inputs["Base Color"]
    times.inputs["Color2"].default_value = base.default_value
    if base.links:
        links.new(base.links[0].from_socket, times.inputs["Color2"])
    links.new(light_colour(nodes, links), times.inputs["Color1"])
    reflected = nodes.new("ShaderNodeEmission")
    reflected.inputs["Strength"].default_value = 1.0 / math.pi
    links.new(times.outputs["Color"], reflected.inputs["Color"])
    emitted = nodes.new("ShaderNodeEmission")
    colour = shader.inputs.get("Emission Color") or shader.inputs["Emission"]
    emitted.inputs["Color"].default_value = colour.default_value
    emitted.inputs["Strength"].default_value = shader.inputs["Emission Strength"].default_value
    if colour.links:
        links.new(colour.links[0].from_socket, emitted.inputs["Color"])
    both = nodes.new("ShaderNodeAddShader")
    links.new(reflected.outputs[0], both.inputs[0])
    links.new(emitted.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])
    return lit


def light_vertices(program, scene, stem, options):
    """Bakes, and brings the light back to the objects."""
    subprocess.run([program, "bake", scene, "--write", "glb", "--out", stem, *options], check=True)
    lights = light_of_nodes(stem + ".glb")
    lit = missing = 0
    for item in bpy.context.scene.objects:
        if item.type == "MESH" and item.name in lights:
            missing += store(item, lights[item.name])
            lit += 1
            for slot in item.material_slots:
                material = slot.material
                if material:
                    slot.link = "OBJECT"
                    slot.material = show(material, f"{material.name} lit", light_of_vertices)
    print(f"radiosity: light on {lit} objects, {missing} corners without")


def unnumbered(name):
    """A name without the number that Blender gives it where it is taken."""
    return name[:-4] if name[-4:-3] == "." else name


def light_by_map(program, scene, stem, options):
    """Bakes a light map, and shows copies of the objects by it."""
    subprocess.run(
        [program, "light-map", scene, "--write", "glb,exr", "--out", stem, *options], check=True)
    document, _ = read_glb(stem + ".glb")
    # By node and material: the file of the map, and the number of its coordinates.
    maps = {}
    for node in document["nodes"]:
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            light = primitive.get("extras", {}).get("radiosity", {})
            material = document["materials"][primitive["material"]]["name"] if "material" in primitive else None
            if "lightMap" in light:
                maps[node.get("name", ""), material] = light["lightMap"], light["texCoord"]
    before, materials = set(bpy.data.objects), set(bpy.data.materials)
    for item in bpy.context.scene.objects:
        item.hide_render = True
        item.hide_set(True)
    bpy.ops.import_scene.gltf(filepath=stem + ".glb")
    imported = [item for item in bpy.data.objects if item not in before]
    original = {m: unnumbered(m.name) for m in bpy.data.materials if m not in materials}
    collection = bpy.data.collections.new("radiosity")
    bpy.context.scene.collection.children.link(collection)
    images, lit = {}, 0
    for item in imported:
        for other in item.users_collection:
            other.objects.unlink(item)
        collection.objects.link(item)
        for slot in item.material_slots if item.type == "MESH" else ():
            found = maps.get((unnumbered(item.name), original.get(slot.material)))
            if found is None:
                continue
            file, number = found
            if file not in images:
                images[file] = bpy.data.images.load(os.path.join(os.path.dirname(stem), file))
                images[file].colorspace_settings.name = "Non-Color"
                images[file].pack()
            coordinates = item.data.uv_layers[number].name
            shown = f"{slot.material.name} lit {file} {coordinates}"
            slot.material = show(slot.material, shown, light_of_map(images[file], coordinates))
            lit += 1
    print(f"radiosity: light on {lit} surfaces of {len(imported)} objects")


def main(options):
    save = None
    if "--save" in options:
        at = options.index("--save")
        save = options[at + 1]
        del options[at:at + 2]
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "scene.glb")
        export(scene)
        program = os.environ.get("RADIOSITY", "radiosity")
        bring_back = light_vertices
        if "--light-map" in options:
            options.remove("--light-map")
            bring_back = light_by_map
        bring_back(program, scene, os.path.join(folder, "lit"), options)
    # Light is exposed by the scene, once.
    bpy.context.scene.view_settings.view_transform = "Standard"
    if save:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(save))


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
