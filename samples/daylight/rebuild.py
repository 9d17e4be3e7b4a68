#!/usr/bin/env python3
"""The lightmap of any time of the day from what `daylight export` wrote, with numpy alone.

usage: rebuild.py FOLDER HH:MM[:SS] [--date YYYY-MM-DD] [--lamps SHARE,…] [-o FILE.pfm] [--compare FILE.exr]

docs/daylight-export.md describes the files. Lamps burn by the schedule of the export, or as bright as --lamps says for each group. With --compare the
result is held against an EXR file of `daylight export`.
"""
import argparse
import json
import pathlib
import struct
import zlib

import numpy as np

# VkFormat: type and numbers of a texel.
FORMATS = {38: ("<i1", 4), 97: ("<f2", 4), 98: ("<u4", 1), 100: ("<f4", 1)}


def read_ktx2(path):
    """The largest level of a KTX 2.0 file: rows × columns × numbers. Signed bytes become numbers from -1 to 1."""
    raw = path.read_bytes()
    if raw[:12] != b"\xabKTX 20\xbb\r\n\x1a\n":
        raise SystemExit(f"{path}: is no KTX 2.0 file")
    form, _, width, height = struct.unpack_from("<4I", raw, 12)
    offset, length, _ = struct.unpack_from("<3Q", raw, 80)
    kind, numbers = FORMATS[form]
    values = np.frombuffer(raw, kind, length // np.dtype(kind).itemsize, offset).reshape(height, width, numbers)
    return np.maximum(values.astype(np.float32), -127) / 127 if form == 38 else values


def read_exr(path):
    """Red, green and blue of an EXR file with lines of 16-bit floats in ZIP: the form that `daylight export` writes."""
    raw = path.read_bytes()
    at, attributes = 8, {}
    while raw[at]:
        name, kind, rest = raw[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack_from("<i", raw, at)
        attributes[name.decode()] = raw[at + 4 : at + 4 + size]
        at += 4 + size
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels = [part[:1] for part in (attributes["channels"][i : i + 18] for i in range(0, len(attributes["channels"]) - 1, 18))]
    if attributes["compression"] != b"\x03" or sorted(channels) != [b"B", b"G", b"R"]:
        raise SystemExit(f"{path}: is no EXR file of `daylight export`")
    lines, out = 16, np.zeros((height, width, 3), np.float32)
    count = -(-height // lines)
    for place in struct.unpack_from(f"<{count}Q", raw, at + 1):
        first, size = struct.unpack_from("<2i", raw, place)
        rows = min(lines, height - (first - top))
        data = raw[place + 8 : place + 8 + size]
        if size < rows * width * 6:
            # ZIP of OpenEXR: differences of bytes, after the low bytes of all numbers those that are high.
            coded = np.frombuffer(zlib.decompress(data), np.uint8).astype(np.int64)
            coded[1:] -= 128
            bytes_ = (np.cumsum(coded) & 255).astype(np.uint8)
            half = (len(bytes_) + 1) // 2
            data = np.empty_like(bytes_)
            data[0::2], data[1::2] = bytes_[:half], bytes_[half:]
        block = np.frombuffer(bytes(data), "<f2").reshape(rows, len(channels), width)
        for number, channel in enumerate(channels):
            out[first - top : first - top + rows, :, b"RGB".index(channel)] = block[:, number]
    return out


class Export:
    """An exported bake."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.table = json.loads((self.folder / "daylight.json").read_text())
        if self.table["version"] not in (1, 2):
            raise SystemExit(f"{folder}: version {self.table['version']} is not known, only 1 and 2")
        self.sources = self.read(self.table["sources"])[..., 0]
        # The days of the bake; a bake of one day has its members beside the others.
        self.days = self.table.get("days", [self.table])
        self.groups = [group["name"] for group in self.table.get("lamps", [])]
        self.use(self.days[0]["day"]["date"])
        self.layers = []
        for layer in self.table["layers"]:
            coefficients = self.read(layer["table"])[..., 0] if layer["table"] else np.zeros((0, layer["columns"]), np.float32)
            self.layers.append((layer, coefficients, [self.read(page)[..., :3].astype(np.float32) for page in layer["pages"]]))

    def read(self, name):
        return read_ktx2(self.folder / name)

    def use(self, date):
        """Chooses the day of the times that follow."""
        found = [day for day in self.days if day["day"]["date"] == date]
        if not found:
            raise SystemExit(f"{date} is not in the export; it has {', '.join(day['day']['date'] for day in self.days)}")
        self.day = found[0]
        self.moments = self.read(self.day["moments"]["file"]).astype(np.float32)

    def burning(self, seconds):
        """How bright each group of lamps burns by the schedule, 0 to 1."""
        return np.array([np.interp(seconds, *np.transpose(switch)) for switch in self.day.get("switches", [])])

    def moment(self, seconds):
        """The row of the light from outside at a time: radiances of the patches of the sky, irradiance of the sun, its direction."""
        about = self.day["moments"]
        x = (seconds - about["first_seconds"]) / about["step_seconds"]
        if x < 0 or x > about["rows"] - 1:
            return np.zeros_like(self.moments[0])
        row = int(x)
        following = min(row + 1, about["rows"] - 1)
        return (1 - (x - row)) * self.moments[row] + (x - row) * self.moments[following]

    def weights(self, seconds):
        """For each baked time its weight: the line between the two times around the moment, and over a night the nearer one."""
        times, length, first = self.day["times"], self.day["day"]["seconds"], self.day.get("first_column", 0)
        out = np.zeros(sum(len(day["times"]) for day in self.days))
        if times:
            # After the last time comes the first one of the next day.
            following = int(np.searchsorted(times, seconds, side="right"))
            before, after = (following - 1) % len(times), following % len(times)
            begin = times[before] - (length if following == 0 else 0)
            end = times[after] + (length if following == len(times) else 0)
            part = (seconds - begin) / (end - begin)
            if before in self.day["nights"]:
                part = 0 if part < 0.5 else 1
            out[first + before] += 1 - part
            out[first + after] += part
        return out

    def light(self, seconds, lamps=None):
        """Irradiance, rows × columns × 3, W/m². `lamps`: how bright each group burns, or None for the schedule."""
        row, about = self.moment(seconds)[:, :3], self.day["moments"]
        lamps = self.burning(seconds) if lamps is None else np.asarray(lamps)
        # For each dimension of a layer the colour of its light.
        mixtures = {
            "times": self.weights(seconds)[:, None] * row[about["sun_column"]],
            "patches": row[: about["patches"]],
            "lamps": np.repeat(lamps[:, None], 3, axis=1),
        }
        own = np.zeros((self.table["height"], self.table["width"], 3), np.float32)
        for layer, coefficients, pages in self.layers:
            for tile in self.table["tiles"]:
                x, y, width, height = (tile[key] for key in ("x", "y", "width", "height"))
                first = tile[layer["name"]]["row"]
                for image, (page, left, top) in enumerate(tile[layer["name"]]["images"]):
                    values = pages[page][top : top + height, left : left + width]
                    own[y : y + height, x : x + width] += values * (coefficients[first + image] @ mixtures[layer["dimensions"]])
        own = np.maximum(own, 0).reshape(-1, 3)
        out = np.zeros_like(own)
        sources = self.sources.ravel().astype(np.int64)
        there = np.flatnonzero(sources < len(own))
        # Texels in the padding show the nearest texel on a surface.
        out[there] = own[sources[there]]
        if self.table.get("kind") != "cube":
            # Beside the charts of a lightmap the padding continues the light of the last two texels of a row or column.
            width, near = self.table["width"], sources[there]
            by = near - there
            beside = (np.abs(by) == width) | ((np.abs(by) == 1) & (near // width == there // width))
            far = np.clip(near + by, 0, len(own) - 1)
            beside &= (sources[far] == far) & (far == near + by)
            there, near, far = there[beside], own[near[beside]], own[far[beside]]
            out[there] = np.clip(2 * near - far, near / 2, 2 * near)
        return out.reshape(self.table["height"], self.table["width"], 3)


def seconds_of(export, text):
    """Seconds after the begin of the day. Exact on days without a change of the clock; `lightmaps` of the table says them for all days."""
    for lightmap in export.table["lightmaps"]:
        if lightmap["time"].startswith(text) and lightmap.get("date", export.day["day"]["date"]) == export.day["day"]["date"]:
            return lightmap["seconds"]
    return sum(int(part) * unit for part, unit in zip(text.split(":"), (3600, 60, 1)))


def write_pfm(path, picture):
    height, width, _ = picture.shape
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + picture[::-1].astype("<f4").tobytes())


def difference(ours, theirs):
    """Root mean square of the difference relative to the mean, and the largest difference relative to the largest value."""
    apart = ours.astype(np.float64) - theirs
    return np.sqrt(np.mean(apart**2)) / np.mean(theirs), np.abs(apart).max() / theirs.max()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("time")
    parser.add_argument("--date")
    parser.add_argument("--lamps", type=lambda text: [float(share) for share in text.split(",")])
    parser.add_argument("-o", "--output", type=pathlib.Path)
    parser.add_argument("--compare", type=pathlib.Path)
    options = parser.parse_args()
    export = Export(options.folder)
    if options.date:
        export.use(options.date)
    if options.lamps is not None and len(options.lamps) != len(export.groups):
        raise SystemExit(f"--lamps has {len(options.lamps)} numbers, the export has {len(export.groups)} groups of lamps: {', '.join(export.groups)}")
    light = export.light(seconds_of(export, options.time), options.lamps)
    print(f"{options.time}: {light.shape[1]}×{light.shape[0]} texels, mean {light.mean():.4g} W/m², largest {light.max():.4g}")
    if options.output:
        write_pfm(options.output, light)
    if options.compare:
        relative, largest = difference(light, read_exr(options.compare))
        print(f"against {options.compare.name}: {relative:.2e} of the mean (root mean square), largest {largest:.2e}")


if __name__ == "__main__":
    main()
