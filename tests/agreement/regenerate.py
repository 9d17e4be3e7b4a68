#!/usr/bin/env python3
"""Measures the test images with independent programs and writes values.tsv, which tests/measure_agreement.rs reads.

    pip install numpy scipy scikit-image flip-evaluator pillow
    python3 tests/agreement/regenerate.py [--perceptualdiff COMMAND]

See README.md for the versions that the recorded values come from.
"""

import argparse
import importlib.metadata
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import flip_evaluator
import numpy as np
import sewar.full_ref
from PIL import Image
from scipy.ndimage import correlate1d, uniform_filter
from skimage.metrics import normalized_root_mse, peak_signal_noise_ratio, structural_similarity

import images

HERE = Path(__file__).parent
ROWS = []


def version(package):
    return f"{package} {importlib.metadata.version(package)}"


def record(pair, measure, options, program, value):
    ROWS.append((pair, measure, options, program, f"{value:.9g}"))
    print(*ROWS[-1], sep="\t", flush=True)


def ssim(a, b, **more):
    return structural_similarity(
        a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1.0, **more
    )


def ms_ssim(a, b):
    """Wang, Simoncelli and Bovik 2003, written for this script with scipy: valid windows, means of 2×2 between scales."""
    x = np.arange(-5, 6)
    kernel = np.exp(-(x**2) / (2 * 1.5**2))
    kernel /= kernel.sum()
    blur = lambda p: correlate1d(correlate1d(p, kernel, axis=0), kernel, axis=1)[5:-5, 5:-5]
    weights = [0.0448, 0.2856, 0.3001, 0.2363, 0.1333]
    value = 1.0
    for scale, weight in enumerate(weights):
        ma, mb = blur(a), blur(b)
        va, vb, cov = blur(a * a) - ma**2, blur(b * b) - mb**2, blur(a * b) - ma * mb
        part = (2 * cov + 0.0009) / (va + vb + 0.0009)
        if scale == 4:
            part = part * (2 * ma * mb + 0.0001) / (ma**2 + mb**2 + 0.0001)
        value *= max(part.mean(), 0.0) ** weight
        a, b = (p.reshape(p.shape[0] // 2, 2, p.shape[1] // 2, 2).mean((1, 3)) for p in (a, b))
    return value


def sewar_ms_ssim(a, b):
    """sewar's, with the pixels 2i and 2i + 1 averaged between scales as the authors' program does; sewar itself takes 2i - 1 and 2i."""
    sewar.full_ref.uniform_filter = lambda image, size: uniform_filter(image, (size, size, 1), origin=(-1, -1, 0))
    return np.mean([sewar.full_ref.msssim(a[..., c : c + 1], b[..., c : c + 1], MAX=1.0) for c in range(3)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--perceptualdiff", default="perceptualdiff", help="how to start that program")
    parser.add_argument("--keep", type=Path, help="a folder for the images, to look at them")
    arguments = parser.parse_args()
    numpy, skimage, flip = version("numpy"), version("scikit-image"), version("flip-evaluator")
    pdiff = shlex.split(arguments.perceptualdiff)
    text = subprocess.run([*pdiff, "--version"], capture_output=True, text=True)
    pdiff_version = "perceptualdiff " + (re.search(r"[0-9]+(\.[0-9]+)+", text.stdout + text.stderr) or [""])[0]
    folder = arguments.keep or Path(tempfile.mkdtemp())
    folder.mkdir(exist_ok=True)

    for name, reference, test in images.pairs():
        pair = f"ldr-{name}"
        files = []
        for role, codes in [("reference", reference), ("test", test)]:
            record(pair, "checksum", role, "fnv-1a", 0.0)
            ROWS[-1] = (*ROWS[-1][:4], images.checksum(codes.astype(np.uint8).tobytes()))
            files.append(folder / f"{pair}-{role}.png")
            Image.fromarray(codes.astype(np.uint8)).save(files[-1])
        a, b = reference / 255.0, test / 255.0
        record(pair, "ssim", "rgb", skimage, ssim(a, b, channel_axis=-1))
        luma = lambda p: p @ np.array([0.2126, 0.7152, 0.0722])
        record(pair, "ssim", "luma", skimage, ssim(luma(a), luma(b)))
        record(pair, "ms-ssim", "rgb", f"scipy {version('scipy')[6:]}", np.mean([ms_ssim(a[..., c], b[..., c]) for c in range(3)]))
        record(pair, "ms-ssim", "rgb", version("sewar"), sewar_ms_ssim(a, b))
        record(pair, "psnr", "", skimage, peak_signal_noise_ratio(a, b, data_range=1.0))
        record(pair, "mae", "display", numpy, np.abs(a - b).mean())
        record(pair, "rmse", "display", numpy, np.sqrt(((a - b) ** 2).mean()))
        record(pair, "pearson", "display", numpy, np.corrcoef(a.ravel(), b.ravel())[0, 1])
        nrmse = [normalized_root_mse(a[..., c], b[..., c], normalization="min-max") for c in range(3)]
        record(pair, "nrmse", "display", skimage, np.mean(nrmse))
        for ppd in [67.02064327658226, 30.0]:
            got = flip_evaluator.evaluate(a.astype(np.float32), b.astype(np.float32), "LDR", applyMagma=False, parameters={"ppd": ppd})
            record(pair, "flip", f"ppd={ppd:.9g}", flip, got[1])
        for options in ["fov=45 luminance=100", "fov=20 luminance=100", "fov=45 luminance=300", "fov=85 luminance=20"]:
            flags = [f"--{o.split('=')[0]}={o.split('=')[1]}" for o in options.split()]
            flags = sum((f.split("=") for f in flags), [])
            said = subprocess.run([*pdiff, "--verbose", *flags, *map(str, files)], capture_output=True, text=True)
            found = re.search(r"(\d+) pixels are different", said.stdout + said.stderr)
            if not found:
                sys.exit(f"perceptualdiff said: {said.stdout}{said.stderr}")
            record(pair, "pdiff", options, pdiff_version, 100.0 * int(found[1]) / (images.WIDTH * images.HEIGHT))

    for name, a, b in images.hdr_pairs():
        pair = f"hdr-{name}"
        for role, values in [("reference", a), ("test", b)]:
            record(pair, "checksum", role, "fnv-1a", 0.0)
            ROWS[-1] = (*ROWS[-1][:4], images.checksum(values.astype("<f4").tobytes()))
        for curve in ["aces", "reinhard", "hable"]:
            got = flip_evaluator.evaluate(a, b, "HDR", applyMagma=False, parameters={"tonemapper": curve})
            record(pair, "hdr-flip", f"curve={curve}", flip, got[1])
            if curve == "aces":
                record(pair, "hdr-flip", "start_exposure", flip, got[2]["startExposure"])
                record(pair, "hdr-flip", "stop_exposure", flip, got[2]["stopExposure"])
                record(pair, "hdr-flip", "exposures", flip, got[2]["numExposures"])
        fixed = {"startExposure": -3.0, "stopExposure": 4.0, "numExposures": 5}
        got = flip_evaluator.evaluate(a, b, "HDR", applyMagma=False, parameters=fixed)
        record(pair, "hdr-flip", "start=-3 stop=4 n=5", flip, got[1])
        a, b = a.astype(np.float64), b.astype(np.float64)
        record(pair, "mae", "", numpy, np.abs(a - b).mean())
        record(pair, "rmse", "", numpy, np.sqrt(((a - b) ** 2).mean()))
        record(pair, "pearson", "", numpy, np.corrcoef(a.ravel(), b.ravel())[0, 1])
        nrmse = [normalized_root_mse(a[..., c], b[..., c], normalization="min-max") for c in range(3)]
        record(pair, "nrmse", "", skimage, np.mean(nrmse))
        record(pair, "rel-mse", "", numpy, ((a - b) ** 2 / (a**2 + 0.01)).mean())
        ya, yb = (p @ np.array([0.2126, 0.7152, 0.0722]) for p in (a, b))
        relative = np.abs(ya - yb)[ya > 0] / ya[ya > 0]
        record(pair, "mean-percent", "", numpy, 100 * relative.mean())
        record(pair, "rms-percent", "", numpy, 100 * np.sqrt((relative**2).mean()))

    lines = ["pair\tmeasure\toptions\tprogram\tvalue"] + ["\t".join(row) for row in ROWS]
    (HERE / "values.tsv").write_text("\n".join(lines) + "\n")


main()
