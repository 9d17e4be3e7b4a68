#!/usr/bin/env python3
"""Time to equal error of path tracers on the same cores: `lucerna reference`, Mitsuba 3 and Blender's Cycles.

usage: peers.py LUCERNA [--assets DIR] [--folder DIR] [--scenes NAME,…] [--size WxH] [--runs N]

Each scene is exported once by `lucerna export-gltf`, so that all programs have the same triangles, materials, lamps and camera. Each
program renders it several times with different seeds; the variance over the runs gives the error of one sample. Processor time is counted
without start, loading and compiling. The better program has the smaller product of both. All runs are on this machine's processor:
`lucerna` with the CPU driver (VK_DRIVER_FILES names it), Mitsuba with `llvm_ad_rgb`.

Makes virtual environments with Mitsuba and with Blender in FOLDER. DRJIT_LIBLLVM_PATH may name a newer LLVM, for example that of Debian's
package libllvm19.
"""
import argparse
import os
import pathlib
import resource
import subprocess
import sys
import venv

HERE = pathlib.Path(__file__).resolve().parent
ROOM = "position = [-3.0, 3.0, 0.0]\ntarget = [5.0, 2.5, -3.0]\nyfov_degrees = 60.0\n"
SPONZA = "position = [-8.0, 2.0, 0.5]\ntarget = [5.0, 4.0, -0.5]\nyfov_degrees = 60.0\n"
# Name, arguments of the scene, file of the camera, environment, diffuse only, samples of a run of ours and of Mitsuba's.
SCENES = {
    "cornell": (["--builtin", "cornell-area"], None, None, True, 64, 256),
    "sponza": (["scenes/sponza-dabrovic/sponza.obj", "--sun", "60,40,4"], SPONZA, "environments/blender_city.exr", True, 64, 256),
    "room": (["gltf/sampleroom/sampleroom.gltf"], ROOM, "environments/blender_sunset.exr", True, 64, 256),
    "garage": (["--builtin", "garage"], None, None, True, 64, 256),
    "conference": (["--builtin", "conference"], None, None, False, 64, 256),
}
BOUNCES = 8
# Blender as a Python module, and the only Python that it is made for.
BLENDER, BLENDER_PYTHON = "bpy==5.0.1", (3, 11)


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(command, **more):
    begun = processor_seconds()
    done = subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **more)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stderr}")
    return processor_seconds() - begun


def pfm(path, np):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        file.readline()
        return np.frombuffer(file.read(), "<f4").reshape(height, width, 3)[::-1]


def error_of_a_sample(pictures, spp, np):
    """Mean relative variance of the luminance of one sample, as `lucerna reference` counts it."""
    luminance = pictures.astype(np.float64) @ [0.2126, 0.7152, 0.0722]
    return float(np.mean(luminance.var(0, ddof=1) / (luminance.mean(0) ** 2 + 0.01))) * spp


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lucerna", type=pathlib.Path, help="the built program `lucerna` (release)")
    parser.add_argument("--assets", type=pathlib.Path, default=pathlib.Path("../shared/assets"))
    parser.add_argument("--folder", type=pathlib.Path, default=pathlib.Path("out/peers"))
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--runs", type=int, default=8)
    options = parser.parse_args()
    folder = options.folder.resolve()
    python = folder / "mitsuba/bin/python"
    if not python.exists():
        venv.create(folder / "mitsuba", with_pip=True)
        run([python, "-m", "pip", "install", "--quiet", "mitsuba", "numpy", "pillow"])
    blender = folder / "blender/bin/python"
    if sys.version_info[:2] == BLENDER_PYTHON and not blender.exists():
        venv.create(folder / "blender", with_pip=True)
        run([blender, "-m", "pip", "install", "--quiet", BLENDER, "numpy"])
    if not blender.exists():
        print(f"Cycles is left out: {BLENDER} needs Python {BLENDER_PYTHON[0]}.{BLENDER_PYTHON[1]}", file=sys.stderr)
        blender = None
    if "PEERS_INSIDE" not in os.environ:
        # numpy is there.
        os.execve(python, [str(python), __file__, *sys.argv[1:]], dict(os.environ, PEERS_INSIDE="1"))
    import numpy as np

    import gltf

    width, height = map(int, options.size.split("x"))
    print(f"| scene | program | samples per processor second | error of a sample | time to equal error, Mitsuba's = 1 | mean |\n|---|---|---|---|---|---|")
    for name in options.scenes.split(","):
        source, camera, sky, diffuse, ours_spp, their_spp = SCENES[name]
        source = [word if word.startswith("-") or not (options.assets / word).exists() else options.assets / word for word in source]
        if camera:
            (folder / f"{name}.toml").write_text(camera)
            source += ["--camera", folder / f"{name}.toml"]
        if sky:
            source += ["--environment", options.assets / sky]
        exported = folder / f"{name}.glb"
        run([options.lucerna, "export-gltf", *source, "--size", options.size, "-o", exported, "--overwrite", "-q"])
        environment = exported.with_name(f"{name}-environment.exr")
        lit = folder / f"{name}-lit.glb"
        if gltf.without_unlit(exported, lit):
            exported, source = lit, [lit, *(["--environment", environment] if environment.exists() else [])]

        def ours(seed, spp):
            picture = folder / f"{name}.pfm"
            command = [options.lucerna, "reference", *source, "--size", options.size, "--spp", spp, "--bounces", BOUNCES, "--seed", seed]
            command += ["-D", "reference.diffuse_only=true"] if diffuse else []
            seconds = run([*command, "--overwrite", "-q", "-o", picture])
            return pfm(picture, np), seconds

        ours(1000, 1)
        start = min(ours(1000, 1)[1] for _ in range(3))
        rendered = [ours(seed, ours_spp) for seed in range(options.runs)]
        pictures = np.array([picture for picture, _ in rendered])
        seconds = (np.mean([seconds for _, seconds in rendered]) - start) / (ours_spp - 1)

        def theirs(program, python, script, spp, *more):
            result = folder / f"{name}-{script}.npz"
            command = [python, HERE / f"{script}.py", exported, result, "--size", options.size, "--bounces", BOUNCES, "--spp", spp]
            command += ["--runs", options.runs, *more]
            run(command + (["--environment", environment] if environment.exists() else []))
            found = np.load(result)
            return f"{program} {found['version']}", error_of_a_sample(found["pictures"], spp, np), found["seconds"].mean() / spp, found["pictures"].mean()

        more = ["--diffuse"] if diffuse else []
        rows = [
            ("lucerna", error_of_a_sample(pictures, ours_spp, np), seconds, pictures.mean()),
            theirs("Mitsuba", python, "with_mitsuba", their_spp, *more),
        ]
        if blender:
            rows.append(theirs("Cycles", blender, "with_blender", ours_spp, *more))
        for program, error, each, mean in rows:
            ratio = error * each / (rows[1][1] * rows[1][2])
            print(f"| {name} | {program} | {width * height / each:,.0f} | {error:.3g} | {ratio:.2f} | {mean:.4f} |", flush=True)


if __name__ == "__main__":
    main()
