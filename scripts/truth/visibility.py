"""The visibility matrix against Embree, entry by entry, and ambient occlusion against very many rays.

  python visibility.py HELIODON MESH [--level 3] [--backend cpu] [--reference 1000000] [--vertices 200]

Runs `HELIODON visibility MESH --matrix` and asks Embree (PyPI: embreex, trimesh) for each entry with n.l > 0 whether a ray from the same
point, off the surface by the same offset along the same normal, meets anything. Ambient occlusion is compared at a sample of vertices with
`--reference` cosine-distributed rays. Prints a JSON object; exit status 1 where more than 0.1 % of all entries differ.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import trimesh
from embreex import rtcore_scene as rtcs
from embreex.mesh_construction import TriangleMesh

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("mesh")
parser.add_argument("--level", type=int, default=3)
parser.add_argument("--backend", default="cpu")
parser.add_argument("--reference", type=int, default=0, help="rays a vertex for ambient occlusion; 0 leaves it out")
parser.add_argument("--vertices", type=int, default=200, help="vertices at which that is asked")
parser.add_argument("--seed", type=int, default=1)
args = parser.parse_args()


def heliodon(*arguments):
    run = subprocess.run([args.heliodon, "visibility", args.mesh, "--level", str(args.level), "-q", "--json", *arguments],
                         check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(run.stdout)


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    report = heliodon("--backend", args.backend, "--matrix", "-o", str(folder / "m.npy"))
    m, directions, weights = (np.load(folder / name) for name in ("m.npy", "m.directions.npy", "m.weights.npy"))
    exact = heliodon("--backend", "cpu", "-o", str(folder / "mesh.ply"))
    mesh = trimesh.load(folder / "mesh.ply", process=False)
    header = (folder / "mesh.ply").read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2].decode() for line in header[0].splitlines() if line.startswith(b"property float") or line.startswith(b"property uchar")]
    kinds = ["<f4" if line.startswith(b"property float") else "u1" for line in header[0].splitlines() if line.startswith((b"property float", b"property uchar"))]
    rows = np.frombuffer(header[1], np.dtype(list(zip(names, kinds))), count=len(mesh.vertices))

positions = np.stack([rows[axis] for axis in ("x", "y", "z")], 1)[: len(m)]
normals = np.stack([rows[axis] for axis in ("nx", "ny", "nz")], 1)[: len(m)]
used = np.isin(np.arange(len(m)), mesh.faces)
scene = rtcs.EmbreeScene()
TriangleMesh(scene, mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32))
origins = (positions + normals * np.float32(exact["offset_m"])).astype(np.float32)


def reaches(starts, towards):
    return scene.run(np.ascontiguousarray(starts, np.float32), np.ascontiguousarray(towards, np.float32), query="OCCLUDED") < 0


differ = asked = 0
for j, direction in enumerate(directions):
    facing = used & ((normals @ direction) > 0)
    seen = np.zeros(len(m), bool)
    seen[facing] = reaches(origins[facing], np.broadcast_to(direction, (facing.sum(), 3)))
    differ += int((seen != (m[:, j] > 0)).sum())
    asked += int(facing.sum())
result = {
    "mesh": pathlib.Path(args.mesh).name, "backend": args.backend, "directions": len(directions), "entries": m.size, "rays": asked,
    "differing_entries": differ, "differing_percent": round(100 * differ / m.size, 5),
}

if args.reference:
    rng = np.random.default_rng(args.seed)
    sample = rng.choice(np.flatnonzero(used), min(args.vertices, int(used.sum())), replace=False)
    open_sum = np.maximum(normals[sample] @ directions.T, 0) @ weights
    occlusion = (m[sample] @ weights) / np.maximum(open_sum, 1e-9)
    truth = np.zeros(len(sample))
    for i, vertex in enumerate(sample):
        n = normals[vertex]
        t = np.cross(n, [1, 0, 0] if abs(n[0]) < 0.9 else [0, 1, 0])
        t /= np.linalg.norm(t)
        b = np.cross(n, t)
        u = rng.random((args.reference, 2))
        r, phi = np.sqrt(u[:, :1]), 2 * np.pi * u[:, 1:]
        towards = r * np.cos(phi) * t + r * np.sin(phi) * b + np.sqrt(1 - u[:, :1]) * n
        truth[i] = reaches(np.broadcast_to(origins[vertex], towards.shape), towards).mean()
    error = np.abs(occlusion - truth)
    result |= {"reference_rays": args.reference, "vertices": len(sample), "occlusion_error_mean": round(float(error.mean()), 5),
               "occlusion_error_p95": round(float(np.percentile(error, 95)), 5), "occlusion_bias": round(float((occlusion - truth).mean()), 5)}
print(json.dumps(result, indent=1))
sys.exit(result["differing_percent"] > 0.1)
