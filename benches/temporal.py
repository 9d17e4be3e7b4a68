#!/usr/bin/env python3
"""Error, ghosts, flicker and cost of anti-aliasing in sequences against the truth, the mean of 64 pictures a frame. Needs numpy.

    benches/temporal.py FOLDER [--size WxH] [--frames N] [--only NAME ...] [--keep]

FOLDER takes the pictures; frames that are there are not rendered again with --keep. The programs `isr` and `lucerna` must be in PATH.
Prints a table for docs/measurements.md.

Measures, over all frames from the ninth on: FLIP and relative mean square error (`lucerna compare -m flip,rel-mse`); the ghost: the
absolute error over the pixels that in the last eight frames showed a surface at least 3 % nearer than now, as a share of their light; the
flicker: the absolute error of the change from frame to frame, as a share of the light.
"""

import argparse
import json
import pathlib
import struct
import subprocess
import sys

import numpy

WAYS = {"none": ["--aa", "1"], "temporal": ["--aa", "temporal"], "mean of 8": ["--aa", "8"]}
SETTLED = 8


def run(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return done.stdout


def pfm(path):
    """A layer, row by row from the top: an array of height x width x channels."""
    head, size, scale, data = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    order = "<f4" if float(scale) < 0 else ">f4"
    return numpy.frombuffer(data, order).reshape(height, width, {b"PF": 3, b"Pf": 1}[head])[::-1].astype(numpy.float64)


def layer(place, frame, name):
    return place / f"{frame:04}-{name}.pfm"


def moving_camera(folder, builtin, yaw, pan):
    """A glTF file of a built-in scene whose first camera turns by `yaw` degrees and moves by `pan` metres to its right in a second."""
    path = folder / f"{builtin}.glb"
    run(["lucerna", "export-gltf", "--builtin", builtin, "-o", path, "--overwrite"])
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    scene = json.loads(data[20 : 20 + length])
    binary = data[28 + length :]
    node = next(i for i, node in enumerate(scene["nodes"]) if "camera" in node)
    camera = scene["nodes"][node]
    if "matrix" in camera:
        m = numpy.array(camera.pop("matrix")).reshape(4, 4)
        x, y, z = m[0, :3], m[1, :3], m[2, :3]
        w = max(0.0, 1 + x[0] + y[1] + z[2]) ** 0.5 / 2
        camera["rotation"] = [(y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w]
        camera["translation"] = list(map(float, m[3, :3]))
    turn = numpy.array(camera.get("rotation", [0, 0, 0, 1]), float)
    place = numpy.array(camera.get("translation", [0, 0, 0]), float)
    half = numpy.radians(yaw) / 2
    x, y, z, w = turn
    right = numpy.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
    s, c = numpy.sin(half), numpy.cos(half)
    # About the world's vertical axis.
    turned = numpy.array([c * x + s * z, c * y + s * w, c * z - s * x, c * w - s * y])
    keys = numpy.array([0, 1], "<f4").tobytes()
    places = numpy.array([place, place + pan * right], "<f4").tobytes()
    turns = numpy.array([turn, turned], "<f4").tobytes()
    views, accessors = scene.setdefault("bufferViews", []), scene.setdefault("accessors", [])
    first = len(accessors)
    binary += bytes(-len(binary) % 4)
    for values, kind, extra in [(keys, "SCALAR", {"min": [0], "max": [1]}), (places, "VEC3", {}), (turns, "VEC4", {})]:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(values)})
        accessors.append({"bufferView": len(views) - 1, "componentType": 5126, "count": 2, "type": kind, **extra})
        binary += values
    scene["buffers"][0]["byteLength"] = len(binary)
    sampler = lambda output: {"input": first, "output": output, "interpolation": "LINEAR"}
    channel = lambda i, path: {"sampler": i, "target": {"node": node, "path": path}}
    scene.setdefault("animations", []).append({
        "samplers": [sampler(first + 1), sampler(first + 2)],
        "channels": [channel(0, "translation"), channel(1, "rotation")],
    })
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    around = folder / f"{builtin}-environment.exr"
    return [path, *(["--environment", around] if around.exists() else [])]


def sequences(folder):
    yield "figure", ["--builtin", "figure"]
    yield "shadows-moving", ["--builtin", "shadows-moving"]
    yield "office", ["--builtin", "office"]
    yield "office-camera", moving_camera(folder, "office", 14, 0.5)


def render(folder, name, scene, way, options, given):
    place = folder / name / way.replace(" ", "-")
    place.mkdir(parents=True, exist_ok=True)
    report = place / "run.json"
    if not (given.keep and report.exists()):
        # With a given exposure all ways have the same one.
        outputs = ["-o", place / "{frame:04}-{layer}.pfm", "-o", place / "{frame:04}.png"]
        command = ["isr", "render", *scene, "--size", given.size, "--frames", f"0..{given.frames}", "--exposure", given.exposure]
        report.write_text(run([*command, *options, *outputs, "--overwrite", "--json", "-q"]))
    return place, json.loads(report.read_text())


def measures(truth, place, near, frames):
    out = {"flip": [], "rel-mse": [], "ghost": [], "flicker": []}
    pictures = [pfm(layer(place, i, "picture")) for i in range(frames)]
    for i in range(SETTLED, frames):
        files = [layer(folder, i, "picture") for folder in (truth["place"], place)]
        report = json.loads(run(["lucerna", "compare", "-q", "--json", "-m", "flip,rel-mse", *files]))
        found = report["tests"][0]["measures"]
        for measure in ("flip", "rel-mse"):
            out[measure].append(found[measure]["value"])
        right, was = truth["pictures"][i], truth["pictures"][i - 1]
        mask = near[i]
        if mask.sum() >= 20:
            out["ghost"].append(numpy.abs(pictures[i] - right)[mask].sum() / right[mask].sum())
        change = (pictures[i] - pictures[i - 1]) - (right - was)
        out["flicker"].append(numpy.abs(change).sum() / right.sum())
    return {key: float(numpy.mean(values)) if values else None for key, values in out.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--frames", type=int, default=16)
    parser.add_argument("--exposure", default="0")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--way", nargs="*", default=[], help="another way: NAME=OPTIONS")
    parser.add_argument("--again", nargs="*", default=[], help="ways that are rendered again")
    parser.add_argument("--keep", action="store_true")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    ways = dict(WAYS)
    ways.update({name: options.split() for name, options in (way.split("=", 1) for way in given.way)})
    number = lambda value, form: "-" if value is None else format(value, form)
    print("| sequence | anti-aliasing | FLIP | relMSE | ghost | flicker | light | ms a frame |\n|---|---|---|---|---|---|---|---|")
    for name, scene in sequences(given.folder):
        if given.only and name not in given.only:
            continue
        place, _ = render(given.folder, name, scene, "truth", ["--aa", "64"], given)
        truth = {"place": place, "pictures": [pfm(layer(place, i, "picture")) for i in range(given.frames)]}
        depth = [pfm(layer(place, i, "depth"))[:, :, 0] for i in range(given.frames)]
        near = [None] * given.frames
        for i in range(SETTLED, given.frames):
            near[i] = numpy.min(depth[i - SETTLED : i], axis=0) < 0.97 * depth[i]
        for way, options in ways.items():
            keep, given.keep = given.keep, given.keep and way not in given.again
            place, report = render(given.folder, name, scene, way, options, given)
            given.keep = keep
            found = measures(truth, place, near, given.frames)
            light = numpy.mean([pfm(layer(place, i, "picture")).sum() / truth["pictures"][i].sum() for i in range(SETTLED, given.frames)])
            times = sorted(sum(run["milliseconds"] for run in frame["runs"]) for frame in report["frames"])
            cells = [number(found[key], ".4f") for key in ("flip", "rel-mse", "ghost", "flicker")]
            print(f"| {name} | {way} | {' | '.join(cells)} | {100 * (light - 1):+.2f} % | {times[len(times) // 2]:.0f} |", flush=True)


main()
