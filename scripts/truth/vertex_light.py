"""Baked light at vertices against Mitsuba 3, path by path.

  python vertex_light.py ARRAYS_DIR --offset-m 0.002 [--cases uniform,sky,sun] [--env sky.hdr] [--bounces 4] [--spp 16384] [--vertices 2000] [--flat]

ARRAYS_DIR is what `heliodon arrays BUNDLE ARRAYS_DIR --sun-bounce` wrote; the bundle's own albedo is used, vertex by vertex. For a
sample of valid vertices, irradiance / pi is traced with `--spp` cosine-distributed paths a vertex and compared with the baked light,
error = |baked - traced| / max(traced, 5 % of the traced mean) on the luminance-free mean of the channels.

  uniform  a sky of radiance 1
  sky      `--env` (lat-long), rebuilt from the bundle's number of spherical harmonics: what the projection loses is not the bake's
           error. The rebuilt sky may be negative, so a constant is added before tracing and its uniform-sky result is subtracted.
  sun      the suns of a few steps, direct and bounced

On rough scans the reference is not one: where a ray meets a triangle from a side that its interpolated normal turns away from, Mitsuba
reflects into the stone and the path is lost. `--flat` takes the triangles' own normals; compare both to see how far they agree.

Prints a JSON object; exit status 1 where a median is above 2 % or a 95th percentile above 6 %.
"""

import argparse
import json
import pathlib
import sys
import time

import numpy as np

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("arrays", type=pathlib.Path)
parser.add_argument("--offset-m", type=float, required=True, help="the bake's ray start, from the manifest")
parser.add_argument("--cases", default="uniform,sky,sun")
parser.add_argument("--env", help="lat-long HDR image for the case `sky`")
parser.add_argument("--bounces", type=int, default=4)
parser.add_argument("--spp", type=int, default=16384)
parser.add_argument("--vertices", type=int, default=2000)
parser.add_argument("--suns", type=int, default=3, help="how many sun steps to trace")
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--variant", default="llvm_ad_rgb")
parser.add_argument("--flat", action="store_true", help="light bounces by the triangles' own normals, not the interpolated ones")
parser.add_argument("--dump", type=pathlib.Path, help="folder for per-vertex results")
args = parser.parse_args()

import mitsuba as mi  # noqa: E402  (after the arguments, so that --help needs no Mitsuba)

mi.set_variant(args.variant)
import drjit as dr  # noqa: E402

SH_BAND_END = {4: 1, 9: 2}


def load(name):
    return np.load(args.arrays / f"{name}.npy")


positions, normals, albedo, triangles = load("positions"), load("normals"), load("albedo"), load("triangles")
valid, mask, transfer = load("valid").astype(bool), load("sun_mask"), load("sky_transfer")
lapse = json.loads((args.arrays / "lapse.json").read_text())
if transfer.ndim == 2:
    transfer = np.repeat(transfer[:, :, None], 3, axis=2)
coefficients = transfer.shape[1]

rng = np.random.default_rng(args.seed)
used = np.zeros(len(positions), bool)
used[triangles] = True
candidates = np.flatnonzero(valid & used)
sample = np.sort(rng.choice(candidates, min(args.vertices, len(candidates)), replace=False))


def basis9(d):
    x, y, z = d[..., 0], d[..., 1], d[..., 2]
    one = np.ones_like(x)
    return np.stack(
        [0.28209479 * one, 0.48860251 * y, 0.48860251 * z, 0.48860251 * x, 1.0925484 * x * y, 1.0925484 * y * z,
         0.31539157 * (3 * z * z - 1), 1.0925484 * x * z, 0.54627421 * (x * x - y * y)], -1)


def lat_long_directions(width, height):
    """Directions of the pixels of a lat-long image as DESIGN has it: the middle column looks north (-Z), east to its right."""
    azimuth = (np.arange(width) + 0.5) / width * 2 * np.pi - np.pi
    elevation = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    a, e = np.meshgrid(azimuth, elevation)
    return np.stack([np.cos(e) * np.sin(a), np.sin(e), -np.cos(e) * np.cos(a)], -1)


def solid_angles(width, height):
    edges = np.sin(np.pi / 2 - np.arange(height + 1) / height * np.pi)
    return np.repeat(((edges[:-1] - edges[1:]) * 2 * np.pi / width)[:, None], width, axis=1)


def make_mesh():
    mesh = mi.Mesh("site", len(positions), len(triangles), has_vertex_normals=True)
    mesh.add_attribute("vertex_color", 3, albedo.astype(np.float32).ravel())
    params = mi.traverse(mesh)
    params["vertex_positions"] = positions.astype(np.float32).ravel()
    params["vertex_normals"] = normals.astype(np.float32).ravel()
    params["faces"] = triangles.astype(np.uint32).ravel()
    params.update()
    # the material comes with the shape when it is loaded, so the mesh goes through a file
    path = args.arrays / "site-for-mitsuba.ply"
    mesh.write_ply(str(path))
    return {"type": "ply", "filename": str(path), "face_normals": args.flat, "bsdf": {"type": "twosided", "bsdf": {
        "type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}}}


MESH = make_mesh()
INTEGRATOR = None


def trace(emitters, sun=None):
    """Irradiance / pi at the sampled vertices, (n, 3), and its standard error."""
    scene = mi.load_dict({"type": "scene", "mesh": MESH, **emitters})
    integrator = mi.load_dict({"type": "path", "max_depth": args.bounces + 1, "rr_depth": 1000})
    sampler = mi.load_dict({"type": "independent"})
    p, n = positions[sample], normals[sample]
    start = (p + n * args.offset_m).astype(np.float32)
    total, square, done, batch = np.zeros((len(sample), 3)), np.zeros((len(sample), 3)), 0, 0
    per_batch = max(1, (1 << 21) // len(sample))
    while done < args.spp:
        k = min(per_batch, args.spp - done)
        wavefront = k * len(sample)
        sampler.seed(args.seed * 1_000_003 + batch, wavefront)
        index = dr.arange(mi.UInt32, wavefront) % len(sample)
        normal = dr.gather(mi.Normal3f, mi.Normal3f(n.T.astype(np.float32)), index)
        origin = dr.gather(mi.Point3f, mi.Point3f(start.T), index)
        direction = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
        light, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(origin, direction))
        light = np.array(light).reshape(3, k, len(sample)).astype(np.float64)
        total += light.sum(1).T
        square += (light**2).sum(1).T
        done, batch = done + k, batch + 1
    mean = total / done
    error = np.sqrt(np.maximum(square / done - mean**2, 0) / done)
    if sun is not None:
        towards = sun / np.linalg.norm(sun)
        lit = ~np.array(scene.ray_test(mi.Ray3f(mi.Point3f(start.T), mi.Vector3f(*towards.astype(np.float32).tolist()))))
        mean = mean + (lit * np.maximum(n @ towards, 0) / np.pi)[:, None]
    return mean, error


def compare(name, baked, traced, traced_error, seconds):
    a, b = baked.mean(1), traced.mean(1)
    floor = np.maximum(b, 0.05 * b.mean())
    relative = np.abs(a - b) / floor
    if args.dump:
        args.dump.mkdir(parents=True, exist_ok=True)
        np.savez(args.dump / f"{name}.npz", sample=sample, baked=baked, traced=traced, error=relative)
    return {
        "case": name,
        "median_percent": round(float(np.median(relative)) * 100, 3),
        "p95_percent": round(float(np.percentile(relative, 95)) * 100, 3),
        "bias_percent": round(float((a.mean() - b.mean()) / b.mean()) * 100, 3),
        "reference_noise_median_percent": round(float(np.median(traced_error.mean(1) / floor)) * 100, 3),
        "reference_seconds": round(seconds, 1),
    }


def timed(function, *arguments, **keywords):
    start = time.time()
    result = function(*arguments, **keywords)
    return (*result, time.time() - start)


def case_uniform():
    traced, error, seconds = timed(trace, {"sky": {"type": "constant", "radiance": {"type": "rgb", "value": [1.0] * 3}}})
    baked = transfer[sample, 0] * np.sqrt(4 * np.pi)
    return [compare("uniform sky", baked, traced, error, seconds)], traced


def case_sky(uniform):
    image = np.array(mi.Bitmap(args.env).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32), dtype=np.float64)
    height, width = image.shape[:2]
    d, w = lat_long_directions(width, height), solid_angles(width, height)
    # a sun in the image is the sun masks' business: what is brighter than 50 times the mean is cut off here
    level = image.mean(2)
    image *= np.minimum(1.0, 50 * (level * w).sum() / w.sum() / np.maximum(level, 1e-9))[..., None]
    s = np.einsum("hwk,hwc,hw->kc", basis9(d)[..., :coefficients], image, w)
    width, height = 256, 128
    rebuilt = np.einsum("hwk,kc->hwc", basis9(lat_long_directions(width, height))[..., :coefficients], s)
    constant = max(0.0, -rebuilt.min()) + 1e-3
    # Mitsuba looks along +Z in the middle column; ours looks north, -Z
    sky = {"type": "envmap", "bitmap": mi.Bitmap((rebuilt + constant).astype(np.float32)),
           "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 180)}
    traced, error, seconds = timed(trace, {"sky": sky})
    traced = traced - constant * uniform
    baked = np.einsum("nkc,kc->nc", transfer[sample], s)
    return [compare(f"rebuilt sky of {pathlib.Path(args.env).name}, {coefficients} coefficients", baked, traced, error, seconds)]


def case_sun():
    bounce = load("sun_bounce")
    by_bit = {step["mask_bit"]: step for step in lapse["steps"] if step["sun"]}
    bits = sorted(by_bit)
    results = []
    for bit in [bits[round(i)] for i in np.linspace(0, len(bits) - 1, args.suns + 2)[1:-1]]:
        # the mask was baked for the direction of the entry that opens the sun step
        towards = np.array(next(s for s in lapse["steps"] if s["mask_bit"] == bit and s["sun"])["sun"]["direction"])
        emitter = {"type": "directional", "direction": (-towards).tolist(), "irradiance": {"type": "rgb", "value": [1.0] * 3}}
        traced, error, seconds = timed(trace, {"sun": emitter}, sun=towards)
        lit = (mask[sample, bit // 32] >> np.uint32(bit % 32)) & 1
        direct = lit * np.maximum(normals[sample] @ towards, 0) / np.pi
        baked = direct[:, None] + bounce[bit, sample]
        results.append(compare(f"sun of step {bit} ({by_bit[bit]['time']})", baked, traced, error, seconds))
    return results


cases = args.cases.split(",")
results = []
uniform_rows, uniform_light = case_uniform()
if "uniform" in cases:
    results += uniform_rows
if "sky" in cases and args.env:
    results += case_sky(uniform_light)
if "sun" in cases:
    results += case_sun()
good = all(row["median_percent"] <= 2 and row["p95_percent"] <= 6 for row in results)
print(json.dumps({"arrays": args.arrays.name, "vertices": len(sample), "paths_a_vertex": args.spp, "bounces": args.bounces,
                  "within_target": good, "results": results}, indent=1))
sys.exit(0 if good else 1)
