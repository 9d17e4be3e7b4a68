"""Reads what `lucerna export-gltf` writes: triangles in world space, materials, lamps, the view. Not a reader for all of glTF."""
import io
import json
import struct

import numpy as np

TYPES = {5126: np.float32, 5125: np.uint32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Scene:
    def __init__(self, path):
        raw = path.read_bytes()
        length = struct.unpack("<I", raw[12:16])[0]
        self.document = json.loads(raw[20 : 20 + length])
        self.binary = raw[28 + length :]
        self.materials = self.document.get("materials", [])
        self.meshes, self.colors, self.lamps, self.view = [], [], [], None
        lights = self.document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
        for node in self.document["nodes"]:
            world = np.array(node.get("matrix", np.eye(4).T.ravel()), np.float64).reshape(4, 4).T
            if "mesh" in node:
                primitives = self.document["meshes"][node["mesh"]]["primitives"]
                self.meshes += [self.primitive(primitive, world) for primitive in primitives]
                self.colors += [self.colors_of(primitive) for primitive in primitives]
            if "camera" in node and self.view is None:
                self.view = (world, self.document["cameras"][node["camera"]])
            if "extensions" in node:
                self.lamps.append((world, lights[node["extensions"]["KHR_lights_punctual"]["light"]]))

    def accessor(self, index):
        accessor = self.document["accessors"][index]
        view = self.document["bufferViews"][accessor["bufferView"]]
        width = WIDTHS[accessor["type"]]
        values = np.frombuffer(self.binary, TYPES[accessor["componentType"]], accessor["count"] * width, view["byteOffset"])
        return values.reshape(-1, width) if width > 1 else values

    def primitive(self, primitive, world):
        """Positions, normals, texture coordinates or None, triangles, number of the material."""
        attributes = primitive["attributes"]
        positions = self.accessor(attributes["POSITION"]) @ world[:3, :3].T + world[:3, 3]
        normals = self.accessor(attributes["NORMAL"]) @ np.linalg.inv(world[:3, :3])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True) + 1e-30
        triangles = self.accessor(primitive["indices"]).reshape(-1, 3)
        if np.linalg.det(world[:3, :3]) < 0:
            triangles = triangles[:, ::-1]
        uvs = self.accessor(attributes["TEXCOORD_0"]) if "TEXCOORD_0" in attributes else None
        return positions.astype(np.float32), normals.astype(np.float32), uvs, triangles, primitive["material"]

    def colors_of(self, primitive):
        """Linear colours of the vertices that tell something, or None."""
        colors = self.accessor(primitive["attributes"]["COLOR_0"])[:, :3] if "COLOR_0" in primitive["attributes"] else None
        return None if colors is None or np.all(colors == 1.0) else colors

    def transmits(self, material):
        return self.materials[material].get("extensions", {}).get("KHR_materials_transmission", {}).get("transmissionFactor", 0.0) > 0.5

    def picture(self, use):
        """The bytes of a texture's PNG file, and its transform (offset, rotation, scale)."""
        image = self.document["images"][self.document["textures"][use["index"]]["source"]]
        view = self.document["bufferViews"][image["bufferView"]]
        transform = use.get("extensions", {}).get("KHR_texture_transform", {})
        data = io.BytesIO(self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        return data, transform

    def emission(self, material):
        """Emitted radiance of a material by its number."""
        material = self.materials[material]
        strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        return np.array(material.get("emissiveFactor", [0.0] * 3)) * strength


def without_unlit(source, target):
    """Writes an exported scene without its unlit surfaces, which let light through in lucerna and stop it in other programs. False: there are none."""
    raw = source.read_bytes()
    length = struct.unpack("<I", raw[12:16])[0]
    document = json.loads(raw[20 : 20 + length])
    unlit = {i for i, m in enumerate(document["materials"]) if "KHR_materials_unlit" in m.get("extensions", {})}
    if not unlit:
        return False
    kept = {}
    for index, mesh in enumerate(document["meshes"]):
        mesh["primitives"] = [primitive for primitive in mesh["primitives"] if primitive["material"] not in unlit]
        if mesh["primitives"]:
            kept[index] = len(kept)
    document["meshes"] = [mesh for index, mesh in enumerate(document["meshes"]) if index in kept]
    for node in document["nodes"]:
        if "mesh" in node:
            number = kept.get(node.pop("mesh"))
            if number is not None:
                node["mesh"] = number
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = raw[20 + length :]
    target.write_bytes(raw[:8] + struct.pack("<III", 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
    return True
