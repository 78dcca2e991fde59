#!/usr/bin/env python3
"""Makes the streams of this folder anew: needs `draco_encoder` of Draco 1.5 (Debian's package draco).

    src/draco/make.py FOLDER

The surface, its texture coordinates and colours are those of mod.rs, which tests compare with what is decoded.
"""

import math
import subprocess
import sys
from pathlib import Path


def height(x, y):
    return 0.1 * math.sin(3 * x) * math.cos(2 * y)


def normal(x, y):
    return -0.3 * math.cos(3 * x) * math.cos(2 * y), 0.2 * math.sin(3 * x) * math.sin(2 * y), 1.0


def grid(n):
    return [(i / n, j / n) for j in range(n + 1) for i in range(n + 1)]


def triangles(n):
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            right = i >= n // 2
            yield (a, a + 1, a + n + 1), right
            yield (a + 1, a + n + 2, a + n + 1), right


def obj(n):
    """With a texture that is cut in the middle: the right half lies one tile further."""
    rows = [f"v {x} {y} {height(x, y)}" for x, y in grid(n)]
    rows += [f"vt {x + tile} {y}" for tile in (0, 1) for x, y in grid(n)]
    rows += ["vn {} {} {}".format(*normal(x, y)) for x, y in grid(n)]
    second = (n + 1) ** 2
    rows += ["f " + " ".join(f"{v + 1}/{v + 1 + second * right}/{v + 1}" for v in corners) for corners, right in triangles(n)]
    return "\n".join(rows) + "\n"


def ply(n):
    properties = [f"property float {axis}" for axis in "xyz"] + [f"property uchar {c}" for c in ("red", "green", "blue", "alpha")]
    header = ["ply", "format ascii 1.0", f"element vertex {(n + 1) ** 2}", *properties, f"element face {2 * n * n}"]
    rows = [f"{x} {y} {height(x, y)} {round(255 * x)} {round(255 * y)} 51 255" for x, y in grid(n)]
    rows += ["3 {} {} {}".format(*corners) for corners, _ in triangles(n)]
    return "\n".join([*header, "property list uchar int vertex_indices", "end_header", *rows]) + "\n"


def main():
    folder = Path(sys.argv[1])
    for name, text, options in [
        ("seams.obj", obj(8), "-cl 7 -qp 14 -qt 12 -qn 10"),
        # only meshes of a thousand triangles or more are coded by valences
        ("valence.obj", obj(24), "-cl 10 -qp 12 -qt 11 -qn 8"),
        ("colors.ply", ply(8), "-cl 0 -qp 14"),
    ]:
        path = folder / name
        path.write_text(text)
        subprocess.run(["draco_encoder", "-i", path, "-o", path.with_suffix(".drc"), *options.split()], check=True)
        path.unlink()


if __name__ == "__main__":
    main()
