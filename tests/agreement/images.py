"""Test images by integer arithmetic alone: tests/measure_agreement.rs makes the same ones, bit for bit."""

import numpy as np

WIDTH, HEIGHT = 256, 192


def hashed(x, y, seed):
    """32 bits from a position and a seed."""
    h = (x * 374761393 + y * 668265263 + seed * 2246822519) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
    return h ^ (h >> 16)


def grid():
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.int64)
    return x, y


def smooth(x, y, cell, seed):
    """Value noise, 0 to 255: bilinear between hashed lattice points."""
    cx, cy, fx, fy = x // cell, y // cell, x % cell, y % cell
    at = lambda i, j: hashed(cx + i, cy + j, seed) & 255
    top = at(0, 0) * (cell - fx) + at(1, 0) * fx
    bottom = at(0, 1) * (cell - fx) + at(1, 1) * fx
    return (top * (cell - fy) + bottom * fy) // (cell * cell)


def base(seed):
    """Codes 0 to 255 of a picture with soft shading, a disc, stripes and fine texture."""
    x, y = grid()
    channels = []
    for c in range(3):
        v = (smooth(x, y, 64, seed + c) * 5 + smooth(x, y, 16, seed + 10) * 2 + smooth(x, y, 4, seed + 20)) // 8
        disc = (x - 90) ** 2 + (y - 80) ** 2 < 45**2
        v = np.where(disc, (v + [200, 60, 40][c] * 2) // 3, v)
        stripes = (x > 160) & (y > 110) & ((x // 5) % 2 == 0)
        v = np.where(stripes, v // 2, v)
        v = np.where((y < 24) & (x > 128), 250 - c * 3, v)
        v = np.where((y >= 168) & (x < 64), 6 + c, v)
        channels.append(v)
    return np.clip(np.stack(channels, -1), 0, 255)


def box(image, radius):
    """Mean of (2r+1)² pixels, edges repeated."""
    padded = np.pad(image, ((radius, radius), (radius, radius), (0, 0)), mode="edge")
    n = 2 * radius + 1
    total = sum(padded[j : j + HEIGHT, i : i + WIDTH] for j in range(n) for i in range(n))
    return total // (n * n)


def distort(image, kind, seed):
    x, y = grid()
    if kind == "noise":
        return np.clip(image + np.stack([hashed(x, y, seed + c) % 41 - 20 for c in range(3)], -1), 0, 255)
    if kind == "blur":
        return box(image, 2)
    if kind == "shift":
        return np.concatenate([image[:, :1], image[:, :-1]], axis=1)
    if kind == "contrast":
        return image * 3 // 4 + 32
    if kind == "colour":
        return np.clip(image + np.array([14, 0, -11]), 0, 255)
    if kind == "fireflies":
        return np.where((hashed(x, y, seed) % 150 == 0)[..., None], 255, image)
    if kind == "blocks":
        blocks = image.reshape(HEIGHT // 8, 8, WIDTH // 8, 8, 3).sum((1, 3)) // 64
        return np.repeat(np.repeat(blocks, 8, 0), 8, 1)
    if kind == "faint":
        return np.clip(image + (hashed(x, y, seed) % 3 - 1)[..., None], 0, 255)
    raise ValueError(kind)


KINDS = ["noise", "blur", "shift", "contrast", "colour", "fireflies", "blocks", "faint"]
HDR_KINDS = ["noise", "blur", "colour", "fireflies"]


def hdr(codes):
    """Linear values from codes: squares, with a lamp 64 times as bright and a dark third."""
    x, y = grid()
    values = codes.astype(np.float32) * codes.astype(np.float32) / np.float32(65536)
    scale = np.where((x - 200) ** 2 + (y - 50) ** 2 < 30**2, np.float32(64), np.float32(1))
    scale = np.where(x < 85, np.float32(1 / 16), scale)
    return values * scale[..., None].astype(np.float32)


def pairs():
    """(name, reference codes, test codes)."""
    for i, kind in enumerate(KINDS):
        reference = base(100 * i + 1)
        yield kind, reference, distort(reference, kind, 7 + i)


def hdr_pairs():
    for i, kind in enumerate(HDR_KINDS):
        reference = base(100 * i + 51)
        yield kind, hdr(reference), hdr(distort(reference, kind, 17 + i))


def checksum(data):
    """FNV-1a of the bytes: shows that both languages made the same image."""
    h = 0xCBF29CE484222325
    for byte in data:
        h = ((h ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    return f"{h:016x}"
