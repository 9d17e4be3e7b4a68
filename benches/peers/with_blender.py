"""Renders an exported scene with Blender's Cycles on the CPU. Called by peers.py; see there.

usage: with_blender.py SCENE.glb OUT.npz --size WxH --bounces N --spp N --runs N [--environment FILE] [--diffuse]

Writes the pictures of all runs (different seeds) and the processor time of each, without that of the first sample,
which holds loading and the trees of boxes.
"""
import pathlib
import tempfile
import time

import bpy
import mathutils
import numpy as np

import arguments
from gltf import Scene

# From Y up to Blender's Z up.
TURN = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def add(name, data, world):
    thing = bpy.data.objects.new(name, data)
    thing.matrix_world = mathutils.Matrix([list(row) for row in TURN @ world])
    bpy.context.scene.collection.objects.link(thing)
    return thing


def placed_uvs(scene, material, uvs):
    """Texture coordinates after the texture's transform, counted upwards."""
    use = scene.materials[material]["pbrMetallicRoughness"].get("baseColorTexture")
    if use is None or uvs is None:
        return None
    transform = use.get("extensions", {}).get("KHR_texture_transform", {})
    turn = transform.get("rotation", 0.0)
    c, s = np.cos(turn), np.sin(turn)
    scaled = uvs * transform.get("scale", [1.0, 1.0])
    placed = scaled @ np.array([[c, -s], [s, c]]) + transform.get("offset", [0.0, 0.0])
    return placed * [1.0, -1.0] + [0.0, 1.0]


def pixels_of(scene, use, path, nodes):
    path.write_bytes(scene.picture(use)[0].getvalue())
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(str(path))
    return texture


def shade(scene, index, folder, diffuse, coloured):
    source = scene.materials[index]
    pbr = source["pbrMetallicRoughness"]
    metallic = pbr.get("metallicFactor", 1.0)
    # In the diffuse form metals are black, as `reference.diffuse_only` has them.
    factor = [min(c, 1.0) * (1.0 - metallic if diffuse else 1.0) for c in pbr["baseColorFactor"][:3]]
    material = bpy.data.materials.new(f"material{index}")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    lit = nodes.new("ShaderNodeBsdfDiffuse" if diffuse else "ShaderNodeBsdfPrincipled")
    colour = lit.inputs["Color" if diffuse else "Base Color"]
    colour.default_value = (*factor, 1.0)
    colours = None
    if "baseColorTexture" in pbr:
        colours = pixels_of(scene, pbr["baseColorTexture"], folder / f"texture{index}.png", nodes).outputs["Color"]
    elif coloured:
        attribute = nodes.new("ShaderNodeVertexColor")
        attribute.layer_name = "colors"
        colours = attribute.outputs["Color"]
    if colours:
        tint = nodes.new("ShaderNodeMix")
        tint.data_type, tint.blend_type = "RGBA", "MULTIPLY"
        # The names of the sockets exist once for each type.
        places = {(socket.name, socket.type): socket for socket in [*tint.inputs, *tint.outputs]}
        places["Factor", "VALUE"].default_value = 1.0
        links.new(colours, places["A", "RGBA"])
        places["B", "RGBA"].default_value = (*factor, 1.0)
        links.new(places["Result", "RGBA"], colour)
    if not diffuse:
        lit.inputs["Metallic"].default_value = metallic
        lit.inputs["Roughness"].default_value = pbr.get("roughnessFactor", 1.0)
        lit.inputs["IOR"].default_value = 1.5
        lit.inputs["Transmission Weight"].default_value = float(scene.transmits(index))
        if "normalTexture" in source:
            texture = pixels_of(scene, source["normalTexture"], folder / f"normals{index}.png", nodes)
            texture.image.colorspace_settings.name = "Non-Color"
            bent = nodes.new("ShaderNodeNormalMap")
            links.new(texture.outputs["Color"], bent.inputs["Color"])
            links.new(bent.outputs["Normal"], lit.inputs["Normal"])
    surface = lit.outputs["BSDF"]
    emitted = scene.emission(index)
    if emitted.max() > 0:
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*(emitted / emitted.max()), 1.0)
        emission.inputs["Strength"].default_value = emitted.max()
        material.cycles.emission_sampling = "FRONT_BACK"
        if not source.get("doubleSided"):
            material.cycles.emission_sampling = "FRONT"
            side = nodes.new("ShaderNodeNewGeometry")
            front = nodes.new("ShaderNodeMath")
            front.operation = "MULTIPLY_ADD"
            links.new(side.outputs["Backfacing"], front.inputs[0])
            front.inputs[1].default_value = -emitted.max()
            front.inputs[2].default_value = emitted.max()
            links.new(front.outputs["Value"], emission.inputs["Strength"])
        both = nodes.new("ShaderNodeAddShader")
        links.new(surface, both.inputs[0])
        links.new(emission.outputs["Emission"], both.inputs[1])
        surface = both.outputs["Shader"]
    links.new(surface, out.inputs["Surface"])
    return material


def load(path, options, folder):
    scene = Scene(path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    coloured = {mesh[4] for mesh, colors in zip(scene.meshes, scene.colors) if colors is not None}
    materials = [shade(scene, index, folder, options.diffuse, index in coloured) for index in range(len(scene.materials))]
    for index, ((positions, normals, uvs, triangles, material), colors) in enumerate(zip(scene.meshes, scene.colors)):
        mesh = bpy.data.meshes.new(f"mesh{index}")
        mesh.from_pydata(positions.tolist(), [], triangles.tolist())
        placed = placed_uvs(scene, material, uvs)
        if placed is not None and len(mesh.loops) == triangles.size:
            mesh.uv_layers.new(name="uv").data.foreach_set("uv", placed[triangles.ravel()].astype(np.float32).ravel())
        if material in coloured:
            values = np.ones((len(positions), 4), np.float32)
            values[:, :3] = 1.0 if colors is None else colors
            mesh.color_attributes.new("colors", "FLOAT_COLOR", "POINT").data.foreach_set("color", values.ravel())
        mesh.normals_split_custom_set_from_vertices(normals.tolist())
        mesh.materials.append(materials[material])
        add(f"mesh{index}", mesh, np.eye(4))
    for index, (world, lamp) in enumerate(scene.lamps):
        kind = {"point": "POINT", "spot": "SPOT", "directional": "SUN"}[lamp["type"]]
        light = bpy.data.lights.new(f"lamp{index}", kind)
        light.color = lamp.get("color", [1.0] * 3)
        # Watts of a lamp that shines to all sides; irradiance of a sun.
        light.energy = lamp["intensity"] * (1.0 if kind == "SUN" else 4.0 * np.pi)
        if kind == "SUN":
            light.angle = 0.0
        else:
            light.shadow_soft_size = 0.0
        if kind == "SPOT":
            outer, inner = lamp["spot"]["outerConeAngle"], lamp["spot"]["innerConeAngle"]
            light.spot_size = 2.0 * outer
            light.spot_blend = min(max(1.0 - inner / outer, 0.0), 1.0)
        add(f"lamp{index}", light, world)
    world, view = scene.view
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = view["perspective"]["yfov"]
    camera.clip_start, camera.clip_end = view["perspective"]["znear"], 1e5
    made = bpy.context.scene
    made.camera = add("camera", camera, world)
    made.world = bpy.data.worlds.new("world")
    made.world.use_nodes = True
    nodes, links = made.world.node_tree.nodes, made.world.node_tree.links
    background = next(node for node in nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    if options.environment:
        sky = nodes.new("ShaderNodeTexEnvironment")
        image = bpy.data.images.load(str(options.environment))
        width, height = image.size
        # Its latitude-longitude maps begin at another azimuth than ours.
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        turned = bpy.data.images.new("sky", width, height, alpha=False, float_buffer=True)
        turned.colorspace_settings.name = image.colorspace_settings.name
        turned.pixels.foreach_set(np.roll(pixels.reshape(height, width, 4), -(width // 4), 1).ravel())
        turned.pack()
        sky.image = turned
        links.new(sky.outputs["Color"], background.inputs["Color"])
    return made


def main():
    options = arguments.parsed(__doc__)
    width, height = options.width, options.height
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scene = load(options.scene, options, folder)
        render, cycles = scene.render, scene.cycles
        render.engine = "CYCLES"
        render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        render.use_persistent_data = True
        render.filter_size = 1.0
        cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
        cycles.blur_glossy = 0.0
        cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
        for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
            setattr(cycles, name, options.bounces)
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0

        def picture(seed, spp):
            cycles.seed, cycles.samples = seed, spp
            render.filepath = str(folder / "picture.exr")
            begun = time.process_time()
            bpy.ops.render.render(write_still=True)
            seconds = time.process_time() - begun
            image = bpy.data.images.load(render.filepath)
            pixels = np.empty(width * height * 4, np.float32)
            image.pixels.foreach_get(pixels)
            bpy.data.images.remove(image)
            return pixels.reshape(height, width, 4)[::-1, :, :3], seconds

        picture(1000, 1)
        start = min(picture(1000, 1)[1] for _ in range(3))
        rendered = [picture(seed, options.spp) for seed in range(options.runs)]
    each = [(seconds - start) * options.spp / (options.spp - 1) for _, seconds in rendered]
    np.savez(options.out, pictures=np.array([p for p, _ in rendered]), seconds=np.array(each), version=bpy.app.version_string)


if __name__ == "__main__":
    main()
