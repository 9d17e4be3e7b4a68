"""Renders an exported scene with Mitsuba's path integrator on the CPU. Called by peers.py; see there.

usage: with_mitsuba.py SCENE.glb OUT.npz --size WxH --bounces N --spp N --runs N [--environment FILE] [--diffuse]

Writes the pictures of all runs (different seeds) and the processor time of each, without loading and compiling.
"""
import time

import mitsuba as mi
import numpy as np
from PIL import Image

import arguments
from gltf import Scene

mi.set_variant("llvm_ad_rgb")
T = mi.ScalarTransform4f
# Mitsuba's principled material adds its glossy light to the whole diffuse light. A white surface of roughness 0.6 then reflects 0.843 where its
# colour is 0.8 and the other programs reflect about 0.8. This factor on the colour makes up for it.
PRINCIPLED = 0.95


def texture(scene, use, factor):
    data, transform = scene.picture(use)
    values = np.array(Image.open(data).convert("RGB"), np.float32) / 255.0
    if factor is not None:
        # Colours, not normals.
        values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4) * np.array(factor, np.float32)
    size = transform.get("scale", [1.0, 1.0])
    # Mitsuba counts v upwards, so its pictures begin with the last row.
    offset = transform.get("offset", [0.0, 0.0])
    to_uv = T().translate([offset[0], offset[1], 0]).rotate([0, 0, 1], -np.degrees(transform.get("rotation", 0.0))).scale([size[0], size[1], 1])
    return {"type": "bitmap", "bitmap": mi.Bitmap(values.astype(np.float32)), "raw": True, "to_uv": to_uv}


def bsdf(scene, index, diffuse, coloured):
    material = scene.materials[index]
    pbr = material["pbrMetallicRoughness"]
    factor, metallic = pbr["baseColorFactor"], pbr.get("metallicFactor", 1.0)
    # In the diffuse form metals are black, as `reference.diffuse_only` has them.
    factor = [min(c, 1.0) * (1.0 - metallic if diffuse else PRINCIPLED if metallic < 0.5 else 1.0) for c in factor[:3]]
    colour = {"type": "rgb", "value": factor}
    if "baseColorTexture" in pbr:
        colour = texture(scene, pbr["baseColorTexture"], factor)
    elif coloured:
        colour = {"type": "mesh_attribute", "name": "vertex_color"}
    roughness = pbr.get("roughnessFactor", 1.0)
    if diffuse:
        inner = {"type": "diffuse", "reflectance": colour}
    elif scene.transmits(index):
        return {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0, "specular_transmittance": colour}
    elif metallic > 0.5 and roughness < 0.05:
        inner = {"type": "conductor", "material": "none", "specular_reflectance": colour}
    else:
        inner = {"type": "principled", "base_color": colour, "metallic": metallic, "roughness": roughness}
    if not diffuse and "normalTexture" in material:
        inner = {"type": "normalmap", "normalmap": texture(scene, material["normalTexture"], None), "bsdf": inner}
    return {"type": "twosided", "inner": inner}


def sides(scene):
    """The meshes. A double-sided lamp becomes two, a little apart, because Mitsuba's area lights shine to one side."""
    gap = 1e-4 * max(np.ptp(positions) for positions, *_ in scene.meshes)
    for (positions, normals, uvs, triangles, material), colors in zip(scene.meshes, scene.colors):
        if scene.emission(material).max() > 0 and scene.materials[material].get("doubleSided"):
            step = (gap * normals).astype(np.float32)
            yield positions + step, normals, uvs, triangles, material, colors
            yield positions - step, -normals, uvs, triangles[:, ::-1], material, colors
        else:
            yield positions, normals, uvs, triangles, material, colors


def load(path, options):
    scene = Scene(path)
    world, camera = scene.view
    # Mitsuba's cameras look along +Z.
    to_world = T(world @ np.diag([-1.0, 1.0, -1.0, 1.0]))
    fov = np.degrees(camera["perspective"]["yfov"])
    film = {"type": "hdrfilm", "width": options.width, "height": options.height, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    out = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": options.bounces + 2, "rr_depth": 3},
        "sensor": {"type": "perspective", "fov": float(fov), "fov_axis": "y", "to_world": to_world, "film": film,
                   "near_clip": camera["perspective"]["znear"], "sampler": {"type": "independent", "sample_count": options.spp}},
    }
    for index, (positions, normals, uvs, triangles, material, colors) in enumerate(sides(scene)):
        emitted = scene.emission(material)
        props = mi.Properties()
        props["bsdf"] = mi.load_dict(bsdf(scene, material, options.diffuse, colors is not None))
        if emitted.max() > 0:
            props["emitter"] = mi.load_dict({"type": "area", "radiance": {"type": "rgb", "value": emitted.tolist()}})
        mesh = mi.Mesh(f"mesh{index}", len(positions), len(triangles), props=props, has_vertex_normals=True, has_vertex_texcoords=uvs is not None)
        if colors is not None:
            factor = scene.materials[material]["pbrMetallicRoughness"]["baseColorFactor"][:3]
            mesh.add_attribute("vertex_color", 3, (colors * factor * (1.0 if options.diffuse else PRINCIPLED)).astype(np.float32).ravel())
        values = mi.traverse(mesh)
        values["vertex_positions"] = positions.ravel()
        values["vertex_normals"] = normals.astype(np.float32).ravel()
        values["faces"] = triangles.astype(np.uint32).ravel()
        if uvs is not None:
            # Its bitmaps begin with the lowest v.
            values["vertex_texcoords"] = (uvs * [1.0, -1.0] + [0.0, 1.0]).astype(np.float32).ravel()
        values.update()
        out[f"mesh{index}"] = mesh
    for index, (world, lamp) in enumerate(scene.lamps):
        value = {"type": "rgb", "value": [c * lamp["intensity"] for c in lamp.get("color", [1.0] * 3)]}
        turned = T(world @ np.diag([-1.0, 1.0, -1.0, 1.0]))
        if lamp["type"] == "point":
            out[f"lamp{index}"] = {"type": "point", "position": world[:3, 3].tolist(), "intensity": value}
        elif lamp["type"] == "spot":
            cone = lamp["spot"]
            out[f"lamp{index}"] = {"type": "spot", "to_world": turned, "intensity": value, "cutoff_angle": float(np.degrees(cone["outerConeAngle"])),
                                   "beam_width": float(np.degrees(cone["innerConeAngle"]))}
        else:
            out[f"lamp{index}"] = {"type": "directional", "to_world": turned, "irradiance": value}
    if options.environment:
        # Its latitude-longitude maps have their centre at another azimuth than ours.
        out["sky"] = {"type": "envmap", "filename": str(options.environment), "to_world": T().rotate([0, 1, 0], 180)}
    return mi.load_dict(out)


def main():
    options = arguments.parsed(__doc__)
    scene = load(options.scene, options)
    np.array(mi.render(scene, seed=1000, spp=options.spp))
    pictures, seconds = [], []
    for run in range(options.runs):
        begun = time.process_time()
        pictures.append(np.array(mi.render(scene, seed=run, spp=options.spp)))
        seconds.append(time.process_time() - begun)
    np.savez_compressed(options.out, pictures=np.array(pictures, np.float32), seconds=seconds, version=mi.__version__)


if __name__ == "__main__":
    main()
