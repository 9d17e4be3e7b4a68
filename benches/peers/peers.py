#!/usr/bin/env python3
"""Time to equal error of path tracers on the same cores: `lucerna reference` and Mitsuba 3.

usage: peers.py LUCERNA [--assets DIR] [--folder DIR] [--scenes NAME,…] [--size WxH] [--runs N]

Each scene is exported once by `lucerna export-gltf`, so that both programs have the same triangles, materials, lamps and camera. Each
program renders it several times with different seeds; the variance over the runs gives the error of one sample. Processor time is counted
without start, loading and compiling. Of two programs that one is better whose error of one sample times its time of one sample is
smaller. All runs are on this machine's processor: `lucerna` with the CPU driver (VK_DRIVER_FILES names it), Mitsuba with `llvm_ad_rgb`.

Makes a virtual environment with Mitsuba in FOLDER. DRJIT_LIBLLVM_PATH may name a newer LLVM, for example that of Debian's package libllvm19.
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
    "sponza": (["scenes/sponza-dabrovic/sponza.obj", "--sun", "60,40,4"], SPONZA, "environments/blender_city.exr", True, 16, 64),
    "room": (["gltf/sampleroom/sampleroom.gltf"], ROOM, "environments/blender_sunset.exr", True, 16, 64),
    "garage": (["--builtin", "garage"], None, None, True, 16, 64),
}
BOUNCES = 8


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
    if "PEERS_INSIDE" not in os.environ:
        # numpy is there.
        os.execve(python, [str(python), __file__, *sys.argv[1:]], dict(os.environ, PEERS_INSIDE="1"))
    import numpy as np

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
        result = folder / f"{name}.npz"
        command = [python, HERE / "with_mitsuba.py", exported, result, "--size", options.size, "--bounces", BOUNCES, "--spp", their_spp]
        command += ["--runs", options.runs] + (["--diffuse"] if diffuse else [])
        environment = exported.with_name(f"{name}-environment.exr")
        command += ["--environment", environment] if environment.exists() else []
        run(command)
        theirs = np.load(result)
        rows = [
            ("lucerna", error_of_a_sample(pictures, ours_spp, np), seconds, pictures.mean()),
            (f"Mitsuba {theirs['version']}", error_of_a_sample(theirs["pictures"], their_spp, np), theirs["seconds"].mean() / their_spp, theirs["pictures"].mean()),
        ]
        for program, error, each, mean in rows:
            ratio = error * each / (rows[1][1] * rows[1][2])
            print(f"| {name} | {program} | {width * height / each:,.0f} | {error:.3g} | {ratio:.2f} | {mean:.4f} |", flush=True)


if __name__ == "__main__":
    main()
