#!/usr/bin/env python3
"""Tone maps crops of photographs with independent programs and writes tonemap.tsv, which tests/tonemap_agreement.rs reads.

    pip install numpy scipy tifffile
    apt-get install luminance-hdr pfstools
    LUCERNA_WRITE_CROPS=CROPS cargo test --test tonemap tonemap_agreement
    python3 tests/agreement/regenerate_tonemap.py CROPS

CROPS is a folder; the test writes into it the pixels that it compares, as NAME.pfm. See README.md for versions and findings.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np
import tifffile
from scipy.ndimage import correlate1d

HERE = Path(__file__).parent
STEP = 12
ROWS = []


def read_pfm(path):
    """Linear RGB, top row first."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"PF" and float(scale) < 0, f"{path} is no little-endian colour PFM"
    return np.frombuffer(data, "<f4").reshape(height, width, 3)[::-1].astype(np.float64)


def luminance(pixels):
    return pixels @ np.array([0.2126, 0.7152, 0.0722])


def record(image, what, options, program, values):
    """The values of every STEPth pixel of every STEPth row, from the middle of the first step."""
    grid = values[STEP // 2 :: STEP, STEP // 2 :: STEP].ravel()
    ROWS.append((image, what, options, program, " ".join(f"{v:.7g}" for v in grid)))
    print(image, what, options, program, f"mean {grid.mean():.6g}", sep="\t", flush=True)


def run(command):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(command, shell=isinstance(command, str), capture_output=True, text=True, env=environment)
    # Luminance HDR ends with 1 after telling its version.
    if done.returncode and "version" not in done.stdout:
        sys.exit(f"{command} ended with {done.returncode}: {done.stdout}{done.stderr}")
    return done.stdout + done.stderr


# Luminance HDR

def luminance_hdr(exr, folder, *flags):
    """What it writes as a TIFF of floats: no encoding, no gamma."""
    out = folder / "out.tif"
    out.unlink(missing_ok=True)
    run(["luminance-hdr-cli", "-l", str(exr), "--ldrTiff", "32b", "-o", str(out), *flags])
    return luminance(tifffile.imread(out).astype(np.float64))


# Written for this script from the papers, with scipy.

def gaussian(values, sigma, radius):
    x = np.arange(-radius, radius + 1)
    kernel = np.exp(-(x**2) / (2 * sigma**2)) if sigma > 0 else np.ones(1)
    kernel /= kernel.sum()
    return correlate1d(correlate1d(values, kernel, axis=0, mode="nearest"), kernel, axis=1, mode="nearest")


# Ashikhmin: σ and reach of the Gaussian of radius 1, largest radius, largest contrast.
SIGMA, REACH, LARGEST, CONTRAST = 0.5, 1, 10, 0.5
# Reinhard: key, φ, ε, scales, their ratio, how many σ a Gaussian reaches, δ of the log-average.
KEY, PHI, EPSILON, SCALES, RATIO, SIGMAS, DELTA = 0.18, 8.0, 0.05, 8, 1.6, 3.0, 1e-5


def capacity(l):
    with np.errstate(divide="ignore", invalid="ignore"):
        dim, bright = 2.4483 + np.log(l / 0.0034) / 0.4027, 32.0693 + np.log(l / 7.2444) / 0.0556
        return np.select([l < 0.0034, l < 1, l < 7.2444], [l / 0.0014, dim, 16.5630 + (l - 1) / 0.4027], bright)


def threshold(l):
    return np.select([l < 0.0034, l < 1, l < 7.2444], [0.0014, 0.4027 * l, 0.4027], 0.0556 * l)


def ashikhmin_adaptation(l):
    blurred = {s: gaussian(l, SIGMA * s, REACH * s) for s in range(1, 2 * LARGEST + 1)}
    level, going = blurred[1].copy(), np.ones(l.shape, bool)
    for s in range(1, LARGEST + 1):
        going &= np.abs(blurred[s] - blurred[2 * s]) < CONTRAST * blurred[s]
        level[going] = blurred[s][going]
    return level


def ashikhmin(l, level, display):
    """L_d, with the display's largest luminance as 1."""
    low, high = capacity(l.min()), capacity(l.max())
    mapped = display * (capacity(level) - low) / (high - low)
    return (mapped + threshold(mapped) / threshold(level) * (l - level)) / display


def reinhard_scaled(l):
    return KEY / np.exp(np.mean(np.log(DELTA + l))) * l


def reinhard_local(scaled):
    scale = [RATIO**i for i in range(SCALES + 1)]
    blurred = [gaussian(scaled, s / 4, int(np.ceil(SIGMAS * s / 4))) for s in scale]
    level, going = blurred[0].copy(), np.ones(scaled.shape, bool)
    for i in range(SCALES):
        activity = (blurred[i] - blurred[i + 1]) / (2**PHI * KEY / scale[i] ** 2 + blurred[i])
        going &= np.abs(activity) < EPSILON
        level[going] = blurred[i][going]
    return scaled / (1 + level)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("crops", type=Path)
    arguments = parser.parse_args()
    found = re.search(r"[0-9]+(\.[0-9]+)+", run(["luminance-hdr-cli", "--version"]))
    theirs, scipy = f"Luminance HDR {found[0] if found else '?'}", f"scipy {version('scipy')}"
    folder = Path(tempfile.mkdtemp())
    for path in sorted(arguments.crops.glob("*.pfm")):
        image = path.stem
        l = luminance(read_pfm(path))
        exr = folder / f"{image}.exr"
        run(f"pfsinpfm {path} | pfsoutexr --float32 {exr}")
        record(image, "luminance", "", "numpy", l)
        key = ["--tmo", "reinhard02", "--tmoR02Key", str(KEY), "--tmoR02Phi", str(PHI), "--tmoR02Num", str(SCALES)]
        key += ["--tmoR02Low", "1", "--tmoR02High", "43"]
        scaled = reinhard_scaled(l)
        record(image, "reinhard-local", "", scipy, reinhard_local(scaled))
        if image == "even":
            record(image, "reinhard-local", "", theirs, luminance_hdr(exr, folder, *key, "--tmoR02Scales", "true"))
            continue

        ash = lambda *flags: luminance_hdr(exr, folder, "--tmo", "ashikhmin", "--tmoAshLocal", "0.5", *flags)
        record(image, "ashikhmin-global", "", theirs, ash("--tmoAshSimple", "true"))
        record(image, "ashikhmin-eq2", "", theirs, ash("--tmoAshSimple", "false", "--tmoAshEq2", "true"))
        record(image, "ashikhmin-eq4", "", theirs, ash("--tmoAshSimple", "false", "--tmoAshEq2", "false"))
        record(image, "reinhard-global", "", theirs, luminance_hdr(exr, folder, *key, "--tmoR02Scales", "false"))

        level = ashikhmin_adaptation(l)
        record(image, "ashikhmin-adaptation", "", scipy, level)
        record(image, "ashikhmin-local", "", scipy, ashikhmin(l, level, 100.0))
        record(image, "ashikhmin-global", "", scipy, ashikhmin(l, l, 100.0))
        record(image, "reinhard-global", "", scipy, scaled * (1 + scaled / scaled.max() ** 2) / (1 + scaled))

    lines = ["image\toperator\toptions\tprogram\tvalues"] + ["\t".join(row) for row in ROWS]
    (HERE / "tonemap.tsv").write_text("\n".join(lines) + "\n")


main()
