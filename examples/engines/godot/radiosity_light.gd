@tool
# Import script of Godot 4 for scenes lit by `radiosity bake SCENE.glb`: in the import dock of
# SCENE.baked.glb, choose this file as "Import Script" and reimport.
#
# The file's COLOR_0 is what a white surface reflects, through the tone curve of the program's
# pictures. Materials are shown as base colour times that, and those that emit by what they emit,
# without lamps. For the renderers Forward+ and Mobile: Compatibility takes linear colours of
# vertices for sRGB ones, and is too dark.
extends EditorScenePostImport


func _post_import(scene: Node) -> Object:
	_light(scene)
	return scene


func _light(node: Node) -> void:
	if node is Light3D:
		node.visible = false
	if node is MeshInstance3D and node.mesh:
		for surface in node.mesh.get_surface_count():
			var format: int = node.mesh.surface_get_format(surface)
			var material: Material = node.get_active_material(surface)
			var has_light: bool = format & Mesh.ARRAY_FORMAT_COLOR and material is BaseMaterial3D
			# What is unshaded emits nothing.
			if has_light and not material.emission_enabled:
				var lit: BaseMaterial3D = material.duplicate()
				lit.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
				lit.vertex_color_use_as_albedo = true
				# COLOR_0 is linear.
				lit.vertex_color_is_srgb = false
				node.set_surface_override_material(surface, lit)
	for child in node.get_children():
		_light(child)
