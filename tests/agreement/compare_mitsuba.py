#!/usr/bin/env python3
"""Renders scenes with `lucerna reference` and with Mitsuba 3's path integrator and prints the ratio of their light.

usage: compare_mitsuba.py LUCERNA [--assets DIR] [--out DIR] [--spp N]

All surfaces are diffuse in both (Mitsuba's twosided Lambert with the scene's base colour or texture; metals black), the
camera, geometry and light are the same. A lamp that glTF has double-sided gets a second half for Mitsuba, whose lamps
shine to one side. Pixels that see a lamp do not count. Needs: pip install mitsuba trimesh numpy pillow.
"""
import argparse
import json
import pathlib
import struct
import subprocess
import tempfile

import mitsuba as mi
import numpy as np
import trimesh

mi.set_variant("scalar_rgb")
TRANSFORM = mi.ScalarTransform4f()

CORNELL = {"position": [-278.0, 273.0, 800.0], "target": [-278.0, 273.0, -279.0], "yfov_degrees": 30.0}
ROOM = {"position": [-3.0, 3.0, 0.0], "target": [5.0, 2.5, -3.0], "yfov_degrees": 60.0}
# Name, file, camera, environment, bounces.
SCENES = [
    ("cornell, direct light", "gltf/CornellBox-Emissive/CornellBox.glb", CORNELL, None, 0),
    ("cornell, 1 bounce", "gltf/CornellBox-Emissive/CornellBox.glb", CORNELL, None, 1),
    ("cornell, 3 bounces", "gltf/CornellBox-Emissive/CornellBox.glb", CORNELL, None, 3),
    ("sampleroom, 3 bounces", "gltf/sampleroom/sampleroom.gltf", ROOM, "environments/blender_sunset.exr", 3),
]


def materials(path):
    """The materials of a glTF file by name; trimesh rounds colours to bytes."""
    raw = path.read_bytes()
    text = raw[20 : 20 + struct.unpack("<I", raw[12:16])[0]] if raw[:4] == b"glTF" else raw
    return {m.get("name"): m for m in json.loads(text).get("materials", [])}


def shape(folder, name, mesh, transform):
    """Writes a mesh with its smooth normals as PLY."""
    normals = np.asarray(mesh.vertex_normals) @ np.linalg.inv(transform[:3, :3])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
    mesh = mesh.copy()
    mesh.apply_transform(transform)
    uv = getattr(mesh.visual, "uv", None)
    copy = mi.Mesh(name, len(mesh.vertices), len(mesh.faces), has_vertex_normals=True, has_vertex_texcoords=uv is not None)
    values = mi.traverse(copy)
    values["vertex_positions"] = mesh.vertices.astype(np.float32).ravel()
    values["faces"] = mesh.faces.astype(np.uint32).ravel()
    values["vertex_normals"] = normals.astype(np.float32).ravel()
    if uv is not None:
        values["vertex_texcoords"] = np.asarray(uv, np.float32).ravel()
    values.update()
    copy.write_ply(str(folder / f"{name}.ply"))
    return str(folder / f"{name}.ply"), mesh


def scene(folder, path, camera, environment, bounces, size, spp):
    """Mitsuba's dictionary of the scene."""
    width, height = size
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}, "pixel_format": "rgb"}
    view = TRANSFORM.look_at(origin=camera["position"], target=camera["target"], up=[0, 1, 0])
    description = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": bounces + 2, "rr_depth": 1000},
        "sensor": {
            "type": "perspective",
            "fov": camera["yfov_degrees"],
            "fov_axis": "y",
            "to_world": view,
            "film": film,
            "sampler": {"type": "independent", "sample_count": spp},
        },
    }
    named = materials(path)
    loaded = trimesh.load(str(path), force="scene", process=False)
    for index, node in enumerate(loaded.graph.nodes_geometry):
        transform, geometry = loaded.graph[node]
        mesh = loaded.geometry[geometry]
        file, moved = shape(folder, f"mesh{index}", mesh, transform)
        material = mesh.visual.material
        pbr = named.get(material.name, {}).get("pbrMetallicRoughness", {})
        metallic = pbr.get("metallicFactor", 1.0)
        colour = [c * (1.0 - metallic) for c in pbr.get("baseColorFactor", [1.0, 1.0, 1.0])[:3]]
        reflectance = {"type": "rgb", "value": colour}
        if material.baseColorTexture is not None:
            material.baseColorTexture.convert("RGB").save(folder / f"mesh{index}.png")
            reflectance = {"type": "bitmap", "filename": str(folder / f"mesh{index}.png")}
        bsdf = {"type": "twosided", "inner": {"type": "diffuse", "reflectance": reflectance}}
        entry = {"type": "ply", "filename": file, "bsdf": bsdf}
        strength = named.get(material.name, {}).get("extensions", {}).get("KHR_materials_emissive_strength", {})
        emitted = [e * strength.get("emissiveStrength", 1.0) for e in named.get(material.name, {}).get("emissiveFactor", [0, 0, 0])]
        if max(emitted) > 0:
            entry["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": emitted}}
            entry["face_normals"] = True
            if named[material.name].get("doubleSided"):
                behind = TRANSFORM.translate([float(x) for x in -0.02 * np.asarray(moved.face_normals[0])])
                description[f"mesh{index}-back"] = dict(entry, flip_normals=True, to_world=behind)
        description[f"mesh{index}"] = entry
    if environment:
        turned = TRANSFORM.rotate([0, 1, 0], 180)
        description["environment"] = {"type": "envmap", "filename": str(environment), "to_world": turned}
    return description


def linear(path):
    """The layers of an EXR file as float32 arrays by name."""
    return {name: np.array(part, np.float32) for name, part in mi.Bitmap(str(path)).split()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lucerna", help="the built program `lucerna`")
    parser.add_argument("--assets", type=pathlib.Path, default=pathlib.Path("../shared/assets"))
    parser.add_argument("--out", type=pathlib.Path, help="keeps the pictures there")
    parser.add_argument("--spp", type=int, default=256)
    options = parser.parse_args()
    size = (160, 120)
    print(f"mitsuba {mi.__version__}, {size[0]}x{size[1]}, {options.spp} samples a pixel: ratio of the means (ours / Mitsuba)")
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.out or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name, file, camera, environment, bounces in SCENES:
            path = options.assets / file
            environment = environment and options.assets / environment
            stem = name.replace(",", "").replace(" ", "-")
            camera_file = folder / f"{stem}.toml"
            camera_file.write_text("".join(f"{key} = {value}\n" for key, value in camera.items()))
            command = [options.lucerna, "reference", str(path), "--camera", str(camera_file), "--size", f"{size[0]}x{size[1]}"]
            command += ["--spp", str(options.spp), "-o", str(folder / f"{stem}.exr"), "--overwrite", "--quiet"]
            command += ["-D", "reference.diffuse_only=true", "--bounces", str(bounces)]
            command += ["--environment", str(environment)] if environment else []
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            theirs = np.array(mi.render(mi.load_dict(scene(folder, path, camera, environment, bounces, size, options.spp))))
            mi.Bitmap(theirs).write(str(folder / f"{stem}-mitsuba.exr"))
            layers = linear(folder / f"{stem}.exr")
            ours = layers["direct"][..., :3] + layers["indirect"][..., :3]
            counted = layers["emission"][..., :3].max(2) == 0
            ratio = ours[counted].mean(0) / theirs[counted].mean(0)
            # Pixels that see a lamp's second half only in Mitsuba are among those that see the lamp here.
            print(f"{name:24} {ratio[0]:.4f} {ratio[1]:.4f} {ratio[2]:.4f}   of {counted.mean():.3f} of the pixels", flush=True)


if __name__ == "__main__":
    main()
