#!/usr/bin/env python3
"""Holds operators of `tonemap` beside those of Luminance HDR (pfstmo) on five photographs and prints the table of docs/measurements.md.

    apt-get install luminance-hdr
    pip install numpy tifffile
    cargo build --release -p lucerna-samples --bin tonemap
    python3 benches/peers/with_luminance_hdr.py target/release/tonemap --assets ../shared/assets

Both programs get the same settings, as far as both have them, and the light of the file as it is. Compared is luminance: that of ours from a
.pfm file, of theirs from a TIFF of floats. Operators end with different fits to the display; so the logarithm of their luminance is first
mapped by the line (slope and offset, least squares) that brings it nearest to ours. The correlation does not depend on that. The operator of
Reinhard and Devlin is also compared with its formula.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import tifffile

PHOTOGRAPHS = ["memorial_o876.hdr", "StillLife.exr", "Desk.exr", "Tree.exr", "Bottles_Small.hdr"]
OPERATORS = {
    "reinhard-devlin": (
        ["--intensity", "0", "--chromatic", "0", "--adaptation", "1", "--exposure", "0"],
        ["--tmo", "reinhard05", "--tmoR05Brightness", "0", "--tmoR05Chroma", "0", "--tmoR05Lightness", "1"],
    ),
    "fattal": (
        ["-D", "tonemap.alpha=0.1", "--beta", "0.9", "--saturation", "1"],
        ["--tmo", "fattal", "--tmoFatAlpha", "0.1", "--tmoFatBeta", "0.9", "--tmoFatNoise", "0", "--tmoFatNew", "true"],
    ),
    "mantiuk": (
        ["--contrast-scale", "0.3", "--saturation", "1"],
        ["--tmo", "mantiuk06", "--tmoM06Contrast", "0.3", "--tmoM06Detail", "1", "--tmoM06ContrastEqual", "false"],
    ),
}


def run(command):
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    # Luminance HDR ends with 1 after telling its version.
    if done.returncode and "version" not in done.stdout:
        raise RuntimeError(f"{command} ended with {done.returncode}: {done.stdout[-300:]}{done.stderr[-300:]}")
    return done.stdout + done.stderr


def luminance(pixels):
    return pixels.astype(np.float64) @ np.array([0.2126, 0.7152, 0.0722])


def read_pfm(path):
    """Linear RGB, top row first."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    assert kind == b"PF" and float(scale) < 0, f"{path} is no little-endian colour PFM"
    return np.frombuffer(data, "<f4").reshape(height, width, 3)[::-1]


def codes(light):
    light = np.clip(light, 0, 1)
    return 255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def receptors(light):
    """Reinhard and Devlin by the formula, in 64 bits: f = 0, c = 0, a = 1, m by the key."""
    light = np.maximum(light.astype(np.float64), 0)
    own = luminance(light)
    low, high = np.log(max(own.min(), 1e-6 * own.max())), np.log(own.max())
    key = np.clip((high - np.log(1e-6 + own[own > 0]).mean()) / (high - low), 0, 1)
    with np.errstate(all="ignore"):
        response = np.where(light > 0, light / (light + own[..., None] ** (0.3 + 0.7 * key**1.4)), 0)
    return (response - response.min()) / (response.max() - response.min())


def compared(ours, theirs):
    """Correlation of the logarithms, slope of the line from theirs to ours, mean absolute difference in codes of 8 bits."""
    theirs = np.where(np.isfinite(theirs), theirs, 0)
    lit = (ours > 1e-5) & (theirs > 1e-7 * theirs.max())
    if lit.mean() < 0.5:
        raise ValueError(f"only {lit.mean():.0%} of the pixels have a value in both")
    x, y = np.log(theirs[lit]), np.log(ours[lit])
    slope, offset = np.polyfit(x, y, 1)
    matched = np.exp(slope * x + offset)
    return np.corrcoef(x, y)[0, 1], slope, np.mean(np.abs(codes(matched) - codes(ours[lit])))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tonemap", type=Path)
    parser.add_argument("--assets", type=Path, required=True)
    arguments = parser.parse_args()
    found = re.search(r"[0-9]+(\.[0-9]+)+", run(["luminance-hdr-cli", "--version"]))
    print(f"Luminance HDR {found[0] if found else '?'}; {run([arguments.tonemap, '--version']).strip()}\n")
    names = [Path(name).stem for name in PHOTOGRAPHS]
    print("| operator | value | " + " | ".join(names) + " |\n|---|---|" + "---|" * len(names))
    folder = Path(tempfile.mkdtemp())
    row = []
    for name in PHOTOGRAPHS:
        photograph, ours = arguments.assets / "hdr" / name, folder / "ours.pfm"
        pictures = []
        for options in (["linear", "--exposure", "0"], ["reinhard-devlin", *OPERATORS["reinhard-devlin"][0]]):
            run([arguments.tonemap, photograph, "-o", ours, "--overwrite", "-q", "--operator", *options])
            pictures.append(read_pfm(ours))
        row.append(f"{np.abs(codes(receptors(pictures[0])) - codes(pictures[1])).max():.5f}")
    print("| reinhard-devlin | largest difference from the formula in 64 bits, codes | " + " | ".join(row) + " |")
    for operator, (own, peer) in OPERATORS.items():
        rows = {"correlation of log luminance": [], "slope to ours": [], "mean difference, codes": []}
        for name in PHOTOGRAPHS:
            photograph = arguments.assets / "hdr" / name
            ours, theirs = folder / "ours.pfm", folder / "theirs.tif"
            theirs.unlink(missing_ok=True)
            run([arguments.tonemap, photograph, "-o", ours, "--overwrite", "-q", "--operator", operator, *own])
            try:
                run(["luminance-hdr-cli", "-l", photograph, "--ldrTiff", "32b", "-o", theirs, *peer])
                values = compared(luminance(read_pfm(ours)), luminance(tifffile.imread(theirs)[..., :3]))
            except (RuntimeError, ValueError) as error:
                print(f"{operator}, {name}: {error}", file=sys.stderr)
                values = None
            for row, value, digits in zip(rows.values(), values or [None] * 3, [4, 3, 2]):
                row.append("none of theirs" if value is None else f"{value:.{digits}f}")
        for what, row in rows.items():
            print(f"| {operator} | {what} | " + " | ".join(row) + " |")


if __name__ == "__main__":
    main()
