"""Joins the pictures of the experiment `daylight-kinds`: daylight_sheet.py LUCERNA FOLDER. Needs no other packages."""

import array
import json
import math
import pathlib
import subprocess
import sys
import tempfile

# Scenes have one of the two lightmaps. The last row is the path tracer.
ROWS = {"": ["day", "cube", "lightmap", "coarse lightmap", "day, truth"], "-probes": ["probes", "probes, truth"]}
# Share of the pixels of the path tracer's picture that are darker than the level that is shown as this grey.
SHARE, GREY = 0.8, 0.5
GAP = 2


def pixels(lucerna, file, layer, work):
    """Width, height and the linear values of a layer, row by row from the top."""
    pfm = work / "layer.pfm"
    command = [lucerna, "tonemap", "--operator", "linear", "--overwrite", "--quiet", "-o", pfm]
    subprocess.run([*command, f"{file}:{layer}" if layer else file], check=True)
    head, size, scale, data = pfm.read_bytes().split(b"\n", 3)
    assert head == b"PF", head
    width, height = map(int, size.split())
    values = array.array("f", data)
    if (float(scale) < 0) != (sys.byteorder == "little"):
        values.byteswap()
    # The first row of a PFM file is the lowest one.
    rows = [values[3 * width * y : 3 * width * (y + 1)] for y in reversed(range(height))]
    return width, height, rows


def exposed(rows, factor):
    """Bright values come near to 1 and do not reach it."""
    return [array.array("f", (1 - math.exp(-factor * max(value, 0)) for value in row)) for row in rows]


def sheet(lucerna, rows, runs, layer, output, work):
    """One column for each time, one row for each method. The exposure is that of the path tracer's picture of all light."""
    times = sorted({time for method, time in runs if method == rows[-1]})
    if not times:
        return
    methods = [row for row in rows if (row, times[0]) in runs]
    columns = []
    for time in times:
        truth = pixels(lucerna, runs[rows[-1], time], "", work)
        greens = sorted(value for row in truth[2] for value in row[1::3])
        factor = -math.log(1 - GREY) / max(greens[int(SHARE * (len(greens) - 1))], 1e-9)
        columns.append([exposed(pixels(lucerna, runs[row, time], layer, work)[2], factor) for row in methods])
    width, height, _ = truth
    gap = array.array("f", [1.0] * (3 * GAP))
    lines = []
    for row in range(len(methods)):
        for y in range(height):
            line = array.array("f")
            for column in columns:
                line += column[row][y] + gap
            lines.append(line[: -len(gap)])
        lines += [array.array("f", [1.0] * len(lines[0]))] * GAP
    del lines[-GAP:]
    if sys.byteorder != "little":
        for line in lines:
            line.byteswap()
    pfm = work / "sheet.pfm"
    pfm.write_bytes(f"PF\n{len(lines[0]) // 3} {len(lines)}\n-1.0\n".encode() + b"".join(line.tobytes() for line in reversed(lines)))
    command = [lucerna, "tonemap", "--operator", "linear", "--overwrite", "--quiet", "--quality", "90", "-o", output, pfm]
    subprocess.run(command, check=True)
    print(f"wrote {output}: columns {', '.join(times)}; rows {', '.join(methods)}")


def main():
    lucerna, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    scenes = {}
    for run in json.loads((folder / "manifest.json").read_text())["runs"]:
        time = next(value for key, value in run["variant"].items() if key.endswith("daylight.time"))
        scenes.setdefault(run["scene"], {})[run["method"], time] = folder / "runs" / f"{run['key']}.exr"
    with tempfile.TemporaryDirectory() as work:
        for scene, runs in scenes.items():
            for kind, rows in ROWS.items():
                for layer, suffix in [("", ""), ("indirect", "-baked")]:
                    sheet(lucerna, rows, runs, layer, folder / f"{scene}{kind}{suffix}.jpg", pathlib.Path(work))


main()
