#!/usr/bin/env python3
"""The light of a file of baked daylight (.day), with Python's standard library alone.

usage: read_day.py FILE.day                       what the file holds
       read_day.py FILE.day sun NUMBER            irradiance of each texel at a lit step, for a white sun of 1 W/m²
       read_day.py FILE.day sky NUMBER            for a radiance of 1 W/(sr m²) of a patch of the sky
       read_day.py FILE.day lamps NUMBER          for a group of lamps

Prints a line for each texel on a surface: its column, its row, and red, green and blue in W/m². docs/daylight-file.md describes the file. Images in
blocks (bake.format other than plain) and probes are not read, and the digest at the end is not checked.
"""
import json
import struct
import sys

KINDS = ["sun", "sky", "lamps"]


class Bytes:
    """Numbers from the front of some bytes, the low byte first."""

    def __init__(self, raw):
        self.raw, self.at = raw, 0

    def take(self, form):
        values = struct.unpack_from("<" + form, self.raw, self.at)
        self.at += struct.calcsize("<" + form)
        return values


class Layer:
    """One kind of light of a tile."""

    def __init__(self, rest):
        self.dimensions, self.wide, self.narrow, self.worst_dimension, self.hidden = rest.take("5I")
        self.worst, self.noise = rest.take("2f")
        (words,) = rest.take("Q")
        images = self.wide + self.narrow
        table = rest.raw[rest.at : rest.at + 3 * images * self.dimensions]
        rest.at += len(table)
        # The low byte of each number is zero and not stored.
        self.table = struct.unpack(f"<{images * self.dimensions}f", b"".join(b"\0" + table[i : i + 3] for i in range(0, len(table), 3)))
        self.images = rest.raw[rest.at : rest.at + 4 * words]
        rest.at += 4 * words
        self.stride = (6 * self.wide + 3 * self.narrow + 3) // 4 * 4

    def light(self, texel, dimension):
        """Red, green and blue of a texel, counted among those on surfaces."""
        wide = struct.unpack_from(f"<{3 * self.wide}e", self.images, texel * self.stride)
        narrow = struct.unpack_from(f"<{3 * self.narrow}b", self.images, texel * self.stride + 6 * self.wide)
        values = wide + narrow
        of_images = [self.table[image * self.dimensions + dimension] for image in range(self.wide + self.narrow)]
        return [sum(values[3 * image + c] * share for image, share in enumerate(of_images)) for c in range(3)]


def read(path):
    """The plan, and for each tile its mask and its three layers."""
    with open(path, "rb") as file:
        raw = file.read()
    if raw[:8] != b"lucday\r\n":
        sys.exit(f"{path}: is not a file of baked daylight")
    version, length = struct.unpack_from("<2I", raw, 8)
    if version != 3:
        sys.exit(f"{path}: has version {version}, and this program reads version 3")
    header = json.loads(raw[16 : 16 + length])
    if header["plan"]["settings"]["format"] != "plain":
        sys.exit(f"{path}: has images in blocks, which this program does not read")
    tiles, at = [], 16 + length
    for size in header["tiles"]:
        rest = Bytes(raw[at : at + size])
        mask = rest.take(f"{rest.take('I')[0]}I")
        # Light and squared error of each step, which `daylight info` prints.
        rest.take(f"{2 * rest.take('I')[0]}d")
        tiles.append((mask, [Layer(rest) for _ in KINDS]))
        at += size
    return header["plan"], tiles


def main():
    if len(sys.argv) not in (2, 4) or len(sys.argv) == 4 and not (sys.argv[2] in KINDS and sys.argv[3].isdecimal()):
        sys.exit(__doc__)
    plan, tiles = read(sys.argv[1])
    width, height = plan["extent"]
    if len(sys.argv) == 2:
        print(f"{plan['receivers']['kind']} of {width}×{height} texels, {len(plan['times'])} lit steps of {plan['steps']}, {len(tiles)} tiles")
        for kind, layers in zip(KINDS, zip(*(layers for _, layers in tiles))):
            print(f"{kind}: {layers[0].dimensions} dimensions, {sum(layer.wide + layer.narrow for layer in layers)} images")
        return
    kind, number = KINDS.index(sys.argv[2]), int(sys.argv[3])
    side = plan["settings"]["tile"] or max(width, height)
    columns = -(-width // side)
    for index, (mask, layers) in enumerate(tiles):
        if number >= layers[kind].dimensions:
            sys.exit(f"{sys.argv[2]} has the numbers 0 to {layers[kind].dimensions - 1}, not {number}")
        x, y = index % columns * side, index // columns * side
        across = min(side, width - x)
        texels = [texel for texel in range(32 * len(mask)) if mask[texel // 32] >> texel % 32 & 1]
        for there, texel in enumerate(texels):
            red, green, blue = layers[kind].light(there, number)
            print(x + texel % across, y + texel // across, f"{red:.6g} {green:.6g} {blue:.6g}")


if __name__ == "__main__":
    main()
