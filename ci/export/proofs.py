#!/usr/bin/env python3
"""Holds what other programs make of an export against lucerna's own pictures. Called by ci/export-proofs.

usage: proofs.py PROGRAMS NODE_MODULES FOLDER [--keep PICTURES]
"""
import argparse
import base64
import json
import pathlib
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
READERS = HERE.parent.parent / "samples" / "daylight"
sys.path += [str(HERE), str(READERS)]
from browser import Browser, serve  # noqa: E402
import rebuild  # noqa: E402

WIDTH, HEIGHT = 320, 240
# Two steps of the bake and a time between two.
TIMES = ["12:00", "07:40", "19:03"]
# Plain colours: filters of textures differ between programs. The second one has a lamp, which burns at night.
SCENES = {
    "primitives": (["--builtin", "primitives"], TIMES),
    "cornell": (["--builtin", "cornell"], [*TIMES, "23:30"]),
}
# Albedo of a floor alone under an overcast sky: its irradiance has a closed form.
ALBEDO = 0.5


def seconds(text):
    hours, minutes = map(int, text.split(":"))
    return 3600 * hours + 60 * minutes


def read_pfm(path):
    raw = path.read_bytes()
    kind, size, scale, data = raw.split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"PF" and float(scale) < 0, path
    return np.frombuffer(data, "<f4").reshape(height, width, 3)


class Proofs:
    def __init__(self):
        self.failures = []

    def check(self, fine, text):
        print(("ok    " if fine else "FAILS ") + text, flush=True)
        if not fine:
            self.failures.append(text)

    def pictures(self, name, ours, theirs, share=0.97):
        """Means within 1 %, and a share of the pixels within 2 % of their own value or of a tenth of the mean: edges fall between pixels."""
        mean = ours.mean()
        apart = np.abs(ours - theirs).max(axis=2)
        close = apart <= 0.02 * np.maximum(ours.max(axis=2), 0.1 * mean)
        ratio = theirs.mean() / mean
        text = f"{name}: mean {ratio:.4f} of ours, {100 * close.mean():.2f} % of the pixels within 2 %, median difference {np.median(apart) / mean:.1e} of the mean"
        self.check(mean > 0 and abs(ratio - 1) <= 0.01 and close.mean() >= share, text)


def png(path, picture, mean):
    """Writes a picture for people: its mean light becomes a middle grey."""
    import struct
    import zlib

    light = np.clip(0.35 * picture[::-1] / mean, 0, 1)
    codes = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    rows = np.round(255 * codes).astype(np.uint8).reshape(picture.shape[0], -1)
    data = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows))
    chunk = lambda name, body: struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    head = struct.pack(">2I5B", picture.shape[1], picture.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def write_floor(path):
    """A floor of 2×2 m of albedo ALBEDO, and a camera above that sees nothing else."""
    corners = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], "<f4")
    normals = np.array([[0, 1, 0]] * 4, "<f4")
    triangles = np.array([0, 1, 2, 0, 2, 3], "<u4")
    parts = [corners.tobytes(), normals.tobytes(), triangles.tobytes()]
    starts = np.cumsum([0] + [len(part) for part in parts])
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"name": "above", "camera": 0, "translation": [0, 1, 0], "rotation": [-(0.5**0.5), 0, 0, 0.5**0.5]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [ALBEDO] * 3 + [1], "metallicFactor": 0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, -1], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": int(at), "byteLength": len(part)} for at, part in zip(starts, parts)],
        "buffers": [{"byteLength": int(starts[-1]), "uri": "data:application/octet-stream;base64," + base64.b64encode(b"".join(parts)).decode()}],
    }
    path.write_text(json.dumps(document))


def floor(proofs, options, run, daylight):
    """The floor has E = 7π/9 · L of the zenith under the overcast sky of the CIE, and reflects ρ/π · E in all programs."""
    scene, bake, folder = (options.folder / name for name in ("floor.gltf", "floor.day", "floor"))
    write_floor(scene)
    size = f"{WIDTH}x{HEIGHT}"
    run(daylight, "bake", scene, "-q", "-D", "bake.samples=256", "-D", "bake.density=8", "-D", "bake.interval=60", "-o", bake)
    run(daylight, "export", scene, "--size", size, "--bake", bake, "-q", "--overcast", "1", "-o", folder)
    export = rebuild.Export(folder)
    noon = seconds("12:00")
    expected = 7 * np.pi / 9 * export.moment(noon)[144, :3].mean()
    radiance = ALBEDO / np.pi * expected
    light = export.light(noon)[export.sources < export.sources.size].mean()
    proofs.check(abs(light / expected - 1) < 0.03, f"floor, numpy: E = {light:.2f} W/m², in closed form {expected:.2f}")
    address = serve({"/": READERS, "/node_modules/": options.modules, "/export/": folder, "/babylon.html": HERE / "babylon.html"})
    browser = Browser(WIDTH + 500, HEIGHT + 400)
    for name, page, call in [
        ("three.js", "viewer.html", f"indirect({noon})"),
        ("three.js, MOZ_lightmap", "viewer.html", f"indirect({noon}, 'scene')"),
        ("Babylon.js", "babylon.html", "indirect('lightmap-1200.ktx2')"),
    ]:
        browser.open(f"{address}/{page}?export=export&size={size}")
        middle = browser.floats(call).reshape(HEIGHT, WIDTH, 4)[HEIGHT // 4 : -HEIGHT // 4, WIDTH // 4 : -WIDTH // 4, :3].mean()
        text = f"floor, {name}: {middle:.2f} W/(sr m²), in closed form {radiance:.2f}; against E of the file times ρ/π {middle / (light * ALBEDO / np.pi):.4f}"
        proofs.check(abs(middle / (light * ALBEDO / np.pi) - 1) < 0.01 and abs(middle / radiance - 1) < 0.03, text)
    browser.close()


def cube(proofs, options, run, daylight):
    """A camera in the middle of a cube sees in three.js what it sees here, but for the texels along edges, which three.js mixes."""
    scene, size = ["--builtin", "primitives"], ["--size", f"{WIDTH}x{HEIGHT}"]
    bake, folder = options.folder / "cube.day", options.folder / "cube"
    run(daylight, "bake", *scene, "-q", "--kind", "cube", "-D", "bake.samples=32", "-D", "bake.face=256", "-D", "bake.interval=60", "-o", bake)
    run(daylight, "export", *scene, *size, "--bake", bake, "-q", "-o", folder)
    export = rebuild.Export(folder)
    apart, largest = rebuild.difference(export.light(seconds("12:00")), rebuild.read_exr(folder / "lightmap-1200.exr"))
    proofs.check(apart < 1e-3, f"cube, numpy, 12:00: {apart:.1e} of the mean (root mean square), largest {largest:.1e}")
    picture = options.folder / "cube.pfm"
    run(daylight, "render", *scene, *size, "--bake", bake, "--mode", "indirect", "--aa", "1", "-D", "daylight.gloss=false", "--time", "12:00", "-q", "-o", picture)
    address = serve({"/": READERS, "/node_modules/": options.modules, "/export/": folder})
    browser = Browser(WIDTH + 500, HEIGHT + 400)
    browser.open(f"{address}/viewer.html?export=export&size={WIDTH}x{HEIGHT}")
    pixels = browser.floats(f"indirect({seconds('12:00')})").reshape(HEIGHT, WIDTH, 4)[..., :3]
    ours = read_pfm(picture)
    proofs.pictures("cube, three.js, 12:00", ours, pixels, 0.9)
    if options.keep:
        png(options.keep / "cube.png", np.concatenate([ours, pixels], axis=1), ours.mean())
    browser.close()


def days(proofs, options, run, daylight):
    """Both days of a bake, with numpy and in three.js."""
    scene, size = ["--builtin", "primitives"], ["--size", f"{WIDTH}x{HEIGHT}"]
    bake, folder, dates = options.folder / "days.day", options.folder / "days", ["2026-06-21", "2026-12-21"]
    run(daylight, "bake", *scene, "-q", "--dates", ",".join(dates), "-D", "bake.samples=16", "-D", "bake.interval=60", "-o", bake)
    run(daylight, "export", *scene, *size, "--bake", bake, "-q", "-o", folder)
    export = rebuild.Export(folder)
    address = serve({"/": READERS, "/node_modules/": options.modules, "/export/": folder})
    browser = Browser(WIDTH + 500, HEIGHT + 400)
    browser.open(f"{address}/viewer.html?export=export&size={WIDTH}x{HEIGHT}")
    for date in dates:
        export.use(date)
        apart, _ = rebuild.difference(export.light(seconds("12:00")), rebuild.read_exr(folder / f"lightmap-{date}-1200.exr"))
        proofs.check(apart < 1e-3, f"days, numpy, {date} 12:00: {apart:.1e} of the mean (root mean square)")
        picture = options.folder / f"{date}.pfm"
        run(daylight, "render", *scene, *size, "--bake", bake, "--mode", "indirect", "--aa", "1", "-D", "daylight.gloss=false", "--date", date, "--time", "12:00", "-q", "-o", picture)
        pixels = browser.floats(f"(day('{date}'), indirect({seconds('12:00')}))").reshape(HEIGHT, WIDTH, 4)[..., :3]
        proofs.pictures(f"days, three.js, {date} 12:00", read_pfm(picture), pixels)
    browser.close()


def main():
    parser = argparse.ArgumentParser()
    for name in ("programs", "modules", "folder"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("--keep", type=pathlib.Path)
    options = parser.parse_args()
    proofs = Proofs()
    run = lambda *command: subprocess.run([str(part) for part in command], check=True)
    daylight = options.programs / "daylight"
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    floor(proofs, options, run, daylight)
    cube(proofs, options, run, daylight)
    days(proofs, options, run, daylight)
    for name, (scene, times) in SCENES.items():
        folder, bake = options.folder / name, options.folder / f"{name}.day"
        size = ["--size", f"{WIDTH}x{HEIGHT}"]
        run(daylight, "bake", *scene, "-q", "-D", "bake.samples=32", "-D", "bake.density=8", "-D", "bake.interval=20", "-o", bake)
        run(daylight, "export", *scene, *size, "--bake", bake, "-q", "--time", ",".join(times), "-o", folder)

        export = rebuild.Export(folder)
        for time in times:
            light = export.light(seconds(time))
            apart, largest = rebuild.difference(light, rebuild.read_exr(folder / f"lightmap-{time.replace(':', '')}.exr"))
            # Both sides are 16-bit floats, and at times between minutes the sky is interpolated.
            proofs.check(apart < 1e-3, f"{name}, numpy, {time}: {apart:.1e} of the mean (root mean square), largest {largest:.1e}")

        found = subprocess.run(["node", HERE / "validate.cjs", options.modules, folder / "scene.glb"], capture_output=True, text=True)
        proofs.check(found.returncode == 0, f"{name}, gltf-validator: {found.stdout.strip() or found.stderr.strip()}")

        ours = {}
        for time in times:
            picture = options.folder / f"{name}-{time.replace(':', '')}.pfm"
            run(daylight, "render", *scene, *size, "--bake", bake, "--mode", "indirect", "--aa", "1", "-D", "daylight.gloss=false", "--time", time, "-q", "-o", picture)
            ours[time] = read_pfm(picture)
        address = serve({"/": READERS, "/node_modules/": options.modules, "/export/": folder, "/babylon.html": HERE / "babylon.html"})
        browser = Browser(WIDTH + 500, HEIGHT + 400)
        browser.open(f"{address}/viewer.html?export=export&size={WIDTH}x{HEIGHT}")
        shape = lambda pixels: pixels.reshape(HEIGHT, WIDTH, 4)[..., :3]
        for time in times:
            pixels = shape(browser.floats(f"indirect({seconds(time)})"))
            proofs.pictures(f"{name}, three.js, {time} by the slider", ours[time], pixels)
            if options.keep:
                mean = ours[time].mean()
                png(options.keep / f"{name}-{time.replace(':', '')}.png", np.concatenate([ours[time], pixels], axis=1), mean)
        proofs.pictures(f"{name}, three.js, MOZ_lightmap", ours[times[0]], shape(browser.floats(f"indirect({seconds(times[0])}, 'scene')")))
        file = f"lightmap-{times[0].replace(':', '')}.ktx2"
        proofs.pictures(f"{name}, three.js, {file}", ours[times[0]], shape(browser.floats(f"indirect({seconds(times[0])}, '{file}')")))
        if options.keep:
            (options.keep / f"{name}-viewer.png").write_bytes(browser.picture())
        browser.open(f"{address}/babylon.html?export=export&size={WIDTH}x{HEIGHT}")
        pixels = shape(browser.floats(f"indirect('{file}')"))
        proofs.pictures(f"{name}, Babylon.js, {file}", ours[times[0]], pixels)
        if options.keep:
            png(options.keep / f"{name}-babylon.png", np.concatenate([ours[times[0]], pixels], axis=1), ours[times[0]].mean())
        browser.close()
    print(f"{len(proofs.failures)} proofs fail" if proofs.failures else "all proofs hold")
    sys.exit(1 if proofs.failures else 0)


if __name__ == "__main__":
    main()
