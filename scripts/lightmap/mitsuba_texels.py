"""Compares a light map with Mitsuba 3 (PyPI: mitsuba) at matching bounces.

  cargo run -p heliodon_lightmap --example truth_scene -- cornell|lamps|workshop FOLDER
  python scripts/lightmap/mitsuba_texels.py FOLDER [--texels 4000] [--spp 4096]

Texels are picked evenly from those that are covered and valid. Mitsuba lights a white Lambertian surface at each: rays of a cosine-weighted hemisphere, its path
integrator from there; a sun without a disc, which none of them meets, and a pane, lamps and a sun with a disc, which few do, are added by themselves (by points on them). LLVM is looked for where Debian
has it, unless DRJIT_LIBLLVM_PATH says where it is. Prints JSON: the root mean square
of the difference as a part of the mean, the same of Mitsuba's own noise (half of the difference between two halves of its samples), and their means.
"""
import argparse
import glob
import json
import os
import re

llvm = sorted(glob.glob("/usr/lib/x86_64-linux-gnu/libLLVM-*.so"), key=lambda path: int(re.search(r"LLVM-(\d+)", path).group(1)))
if llvm:
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", llvm[-1])
import numpy as np
import mitsuba as mi

p = argparse.ArgumentParser()
p.add_argument("folder")
p.add_argument("--texels", type=int, default=4000)
p.add_argument("--spp", type=int, default=4096)
p.add_argument("--seed", type=int, default=1)
p.add_argument("--worst", type=int, default=0, help="also tell the texels that differ most")
a = p.parse_args()
mi.set_variant("llvm_ad_rgb")
import drjit as dr


def array(name, kind, width):
    return np.fromfile(os.path.join(a.folder, name), kind).reshape(-1, width)


P, T, A = array("positions.f32", "<f4", 3), array("triangles.u32", "<u4", 3), array("albedo.f32", "<f4", 3)
X, N, L = (array(f"{name}.f32", "<f4", 3) for name in ("texel_positions", "texel_normals", "light"))
ok = np.flatnonzero(array("texel_flags.u8", "u1", 1)[:, 0])
meta = json.load(open(os.path.join(a.folder, "scene.json")))
pick = np.random.default_rng(a.seed).choice(ok, min(a.texels, len(ok)), replace=False)
X, N, L = X[pick], N[pick], L[pick]

# one mesh for each albedo, rounded
scene = {"type": "scene"}
colors, of = np.unique(np.round(A, 4), axis=0, return_inverse=True)
for k, color in enumerate(colors):
    used, index = np.unique(T[of.reshape(-1) == k], return_inverse=True)
    mesh = mi.Mesh(f"m{k}", len(used), len(index) // 3, has_vertex_normals=False)
    params = mi.traverse(mesh)
    params["vertex_positions"] = P[used].ravel()
    params["faces"] = index.astype(np.uint32).ravel()
    params.update()
    mesh.write_ply(os.path.join(a.folder, "part.ply"))
    scene[f"m{k}"] = {"type": "ply", "filename": os.path.join(a.folder, "part.ply"), "face_normals": True,
                      "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": color.tolist()}}}}
    scene[f"m{k}"] = mi.load_dict(scene[f"m{k}"])
if "sky" in meta:
    scene["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": meta["sky"]}}
if "sun" in meta:
    sun = np.array(meta["sun"]["direction"])
    sun /= np.linalg.norm(sun)
    scene["sun"] = {"type": "directional", "direction": (-sun).tolist(), "irradiance": {"type": "rgb", "value": meta["sun"]["irradiance"]}}
if "pane" in meta:
    c, r, u = (np.array(x) for x in meta["pane"]["corners"])
    # Mitsuba's rectangle spans [-1, 1] and shines along its z
    ex, ey, mid = (r - c) / 2, (u - c) / 2, (r + u) / 2
    n = np.cross(ex, ey)
    n /= np.linalg.norm(n)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = ex, ey, n, mid
    if n[1] > 0:
        m[:3, 0], m[:3, 1], m[:3, 2] = ey, ex, -n
    scene["pane"] = {"type": "rectangle", "to_world": mi.ScalarTransform4f(m.tolist()),
                     "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0] * 3}},
                     "emitter": {"type": "area", "radiance": {"type": "rgb", "value": meta["pane"]["radiance"]}}}
FAR = 1e4
for k, lamp in enumerate(meta.get("lamps", [])):
    if "place" in lamp:
        scene[f"lamp{k}"] = {"type": "point", "position": lamp["place"], "intensity": {"type": "rgb", "value": lamp["intensity"]}}
        continue
    # a sun's disc, far away
    towards = np.array(lamp["direction"])
    towards /= np.linalg.norm(towards)
    sine = np.sin(np.radians(lamp["angular_radius_deg"]))
    across = float(np.tan(np.radians(lamp["angular_radius_deg"])) * FAR)
    to_world = mi.ScalarTransform4f().look_at(origin=(FAR * towards).tolist(), target=[0, 0, 0], up=[0, 1, 0]) @ mi.ScalarTransform4f().scale([across] * 3)
    radiance = (np.array(lamp["irradiance"]) / (np.pi * sine**2)).tolist()
    scene[f"lamp{k}"] = {"type": "disk", "to_world": to_world, "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}}}
scene = mi.load_dict(scene)
small = "pane" in meta or "lamps" in meta

# depth 1 sees emitters; those of the first edge are left to direct sampling where they are small
integrator = mi.load_dict({"type": "path", "max_depth": meta["bounces"] + 1, "rr_depth": 1000, "hide_emitters": small})
sampler = mi.load_dict({"type": "independent"})
count = len(pick)


def direct(o, n_, w):
    """One sample of the emitters that are not seen by chance."""
    it = dr.zeros(mi.SurfaceInteraction3f, w)
    it.p, it.n, it.t = o, n_, 0.0
    it.sh_frame = mi.Frame3f(n_)
    ds, weight = scene.sample_emitter_direction(it, sampler.next_2d(), True)
    return weight * dr.maximum(dr.dot(n_, ds.d), 0) * dr.inv_pi


def half(part):
    total = np.zeros((count, 3))
    chunk = max(1, (1 << 21) // count)
    done = 0
    while done < a.spp // 2:
        k = min(chunk, a.spp // 2 - done)
        w = k * count
        sampler.seed((a.seed * 100 + part) * 100003 + done, w)
        idx = dr.arange(mi.UInt32, w) % count
        n_ = dr.gather(mi.Normal3f, mi.Normal3f(N.T), idx)
        o = dr.gather(mi.Point3f, mi.Point3f(X.T), idx)
        d = mi.Frame3f(n_).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
        if small:
            # what the first ray meets counts only as a surface
            si = scene.ray_intersect(mi.Ray3f(o, d))
            found, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(o, d))
            found = dr.select(si.emitter(scene) != None, 0, found) + direct(o, n_, w)
        else:
            found, _, _ = integrator.sample(scene, sampler, mi.RayDifferential3f(o, d))
        total += np.array(found).reshape(3, k, count).sum(1).T
        done += k
    light = total / done
    if "sun" in meta:
        lit = ~np.array(scene.ray_test(mi.Ray3f(mi.Point3f(X.T), mi.Vector3f(*sun.tolist()))))
        light += (lit * np.maximum(N @ sun, 0) / np.pi)[:, None] * np.array(meta["sun"]["irradiance"])
    return light


one, two = half(0), half(1)
truth = 0.5 * (one + two)
mean = truth.mean()
off = L - truth
rms = lambda x: float(np.sqrt((x ** 2).mean()) / mean)
noise = rms(one - two) / 2
print(json.dumps({"texels": count, "spp": a.spp, "bounces": meta["bounces"], "rmse_of_mean": round(rms(off), 5), "mitsuba_noise_of_mean": round(noise, 5),
                  "rmse_less_noise": round(max(rms(off) ** 2 - noise ** 2, 0) ** 0.5, 5), "mean": [round(float(x), 5) for x in L.mean(0)],
                  "mitsuba_mean": [round(float(x), 5) for x in truth.mean(0)], "largest_of_mean": round(float(np.abs(off).max() / mean), 4)}))
for k in np.argsort(-np.abs(off).max(1))[: a.worst]:
    print(X[k], N[k], L[k], truth[k])
