#!/usr/bin/env python3
"""xatlas on meshes, for comparison with `cargo run -p heliodon_lightmap --example unwrap_cost`.

    scripts/lightmap/xatlas_peer.py MESH... [--size 2048] [--margin 2] [--runs 1] [--brute] [--extent 100]

Needs xatlas and trimesh (PyPI). Prints a line of JSON for each mesh: charts, seconds for charts and packing together, of several runs the median, and of the processor's, the texture that came of it, and
the part of it that triangles cover, measured from their texture coordinates as ours is: of the texture that was asked for and of the one that came.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import trimesh
import xatlas


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--size", type=int, default=2048)
    parser.add_argument("--margin", type=int, default=2)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--brute", action="store_true")
    parser.add_argument("--extent", type=float, help="scales each mesh to this size first: xatlas leaves out what is small in its units")
    arguments = parser.parse_args()
    for path in arguments.meshes:
        mesh = trimesh.load(path, process=False, force="mesh")
        positions = np.ascontiguousarray(mesh.vertices, dtype=np.float32)
        triangles = np.ascontiguousarray(mesh.faces, dtype=np.uint32)
        if arguments.extent:
            positions *= arguments.extent / float((positions.max(0) - positions.min(0)).max())
        runs = []
        for _ in range(max(1, arguments.runs)):
            begun, processor = time.monotonic(), time.process_time()
            atlas = xatlas.Atlas()
            atlas.add_mesh(positions, triangles)
            options = xatlas.PackOptions()
            options.resolution = arguments.size
            options.padding = arguments.margin
            options.bruteForce = arguments.brute
            atlas.generate(xatlas.ChartOptions(), options, False)
            runs.append((time.monotonic() - begun, time.process_time() - processor))
        seconds, processor_seconds = (sorted(of_runs)[len(runs) // 2] for of_runs in zip(*runs))
        _, corners, uvs = atlas[0]
        places = uvs[corners.astype(np.int64)].astype(np.float64) * [atlas.width, atlas.height]
        (ax, ay), (bx, by) = (places[:, 1] - places[:, 0]).T, (places[:, 2] - places[:, 0]).T
        area = 0.5 * np.abs(ax * by - ay * bx).sum()
        print(json.dumps({
            "mesh": path.stem, "triangles": len(triangles), "charts": atlas.chart_count, "seconds": round(seconds, 3),
            "processor_seconds": round(processor_seconds, 3),
            "texture": [atlas.width, atlas.height], "textures": atlas.atlas_count, "its_utilisation": round(atlas.utilization, 4),
            "utilisation": round(area / (atlas.width * atlas.height * max(1, atlas.atlas_count)), 4),
            "of_asked": round(area / arguments.size**2, 4),
        }), flush=True)


if __name__ == "__main__":
    main()
