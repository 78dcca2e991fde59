"""The paper's Figure 9 anew: one object as wireframe, in local light, in the light of its visible directions, and path traced.

  python figure_nine.py HELIODON MESH PROBE -o figure-nine.jpg [--vertices 134000] [--level 4] [--turn DEG] [--bearing DEG] [--spp 2048]

M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004, Figure 9.

HELIODON is the program; MESH is thinned to `--vertices` (quadric edge collapse, MeshLab), its colours are left out: all is of one albedo,
as in the paper. PROBE is a latitude-longitude HDR image. What is not said is as in docs/images/figure-nine.jpg. The panels share camera,
exposure and tone curve; the first three are drawn from 4 x 4 first hits a pixel:

  wireframe    edges that nothing hides, by their distance on the screen; a loupe shows some of them larger
  local light  ambient + diffuse n.l from one direction, no shadows, as OpenGL's fixed function lit; direction and colours are those (of 600
               directions, least squares over the vertices in sight) that come nearest to the next panel
  visibility   `heliodon visibility --level L --env PROBE` at the vertices, interpolated linearly
  path traced  Mitsuba, the probe as it is (not blurred), interpolated normals, light from the probe only (`max_depth` 2), which is what the
               method computes too; what bounces of light between surfaces add is told as a number (`--bounces`)

Times are of the processor, all its cores together: of ours the whole program, reading and writing included, the median of `--runs`; of
Mitsuba rendering alone, in as many parts in turn with ours, after a small picture that compiles its kernels. Prints a JSON object: differences
over pixels that the object covers wholly, the relative one |a - b| / max(b, 5 % of the mean) before the tone curve (mean of the channels),
FLIP of what is shown. The reference's own noise is in both; it is told too, and how near fewer paths come to the reference in what time.
Needs the DejaVu fonts (Debian: fonts-dejavu-core).
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from PIL import Image, ImageDraw, ImageFont

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("mesh", type=pathlib.Path)
parser.add_argument("probe", type=pathlib.Path)
parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
parser.add_argument("--vertices", type=int, default=134_000, help="the mesh is thinned to about so many; 0 leaves it")
parser.add_argument("--level", type=int, default=4)
parser.add_argument("--turn", type=float, default=-8.0, help="the bearing, degrees clockwise from north (-Z), of the probe's middle")
parser.add_argument("--bearing", type=float, default=262.0, help="where the camera stands, degrees clockwise from north; 180 is +Z")
parser.add_argument("--elevation", type=float, default=3.0, help="degrees that the camera stands above what it looks at")
parser.add_argument("--frame", default="-0.05,1.02", help="the part of the object's height that a panel shows, from 0 (foot) to 1 (top)")
parser.add_argument("--loupe", default="0.49,0.128,0.017", help="what the loupe shows: its middle in widths and heights of a panel, its radius in heights")
parser.add_argument("--loupe-at", default="0.19,0.1,0.08", help="where the loupe lies, wholly within the panel; the same")
parser.add_argument("--size", default="450x1000", help="of a panel, pixels")
parser.add_argument("--spp", type=int, default=2048)
parser.add_argument("--bounces", type=int, default=4, help="light on its way from the probe to the eye meets so many surfaces, for the number")
parser.add_argument("--albedo", type=float, default=0.6)
parser.add_argument("--runs", type=int, default=4)
parser.add_argument("--variant", default="llvm_ad_rgb")
parser.add_argument("--dump", type=pathlib.Path, help="folder for the panels one by one, as PNG")
args = parser.parse_args()

import mitsuba as mi  # noqa: E402  (after the arguments, so that --help needs no Mitsuba)
import trimesh  # noqa: E402

mi.set_variant(args.variant)
import flip_evaluator  # noqa: E402

WIDTH, HEIGHT = map(int, args.size.split("x"))
GRID = 4
FIELD_OF_VIEW_DEG = 18.0
CAPTION = 124
BACKGROUND = np.array([0.022, 0.024, 0.028])
LINE = np.array([0.95, 0.87, 0.72])
INK, QUIET = (236, 232, 224), (168, 166, 162)
kept = tempfile.TemporaryDirectory()
folder = pathlib.Path(kept.name)


# ---------------------------------------------------------------- what is lit, and by what

def thinned_mesh():
    mesh = trimesh.load(args.mesh, force="mesh", process=False)
    positions, triangles = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces)
    positions, index = np.unique(positions, axis=0, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    triangles = triangles[(triangles != np.roll(triangles, 1, 1)).all(1)]
    if args.vertices and len(positions) > args.vertices:
        import pymeshlab

        meshes = pymeshlab.MeshSet()
        meshes.add_mesh(pymeshlab.Mesh(positions, triangles))
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * args.vertices, preservenormal=True)
        positions, triangles = meshes.current_mesh().vertex_matrix(), meshes.current_mesh().face_matrix()
    return positions.astype(np.float32), triangles.astype(np.uint32)


def smooth_normals(positions, triangles):
    corners = positions[triangles].astype(np.float64)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros((len(positions), 3))
    for corner in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(triangles[:, corner], flat[:, axis], len(positions))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # where folded triangles cancel one another, one of them says it
    none = length[:, 0] < 1e-12 * length.mean()
    for corner in range(3):
        normals[triangles[none[triangles[:, corner]], corner]] = flat[none[triangles[:, corner]]]
    return (normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)).astype(np.float32)


def read_probe():
    """The probe without what is no light, as a file that both programs read."""
    image = np.array(mi.Bitmap(str(args.probe)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))
    image = np.where(np.isfinite(image), np.maximum(image, 0), 0)
    path = folder / "probe.exr"
    mi.Bitmap(image).write(str(path))
    return path


positions, triangles = thinned_mesh()
normals = smooth_normals(positions, triangles)
mesh_path = folder / "mesh.ply"
shape = mi.Mesh("object", len(positions), len(triangles), has_vertex_normals=True)
parameters = mi.traverse(shape)
parameters["vertex_positions"], parameters["vertex_normals"], parameters["faces"] = positions.ravel(), normals.ravel(), triangles.ravel()
parameters.update()
shape.write_ply(str(mesh_path))
probe_path = read_probe()

scene = mi.load_dict({
    "type": "scene",
    "object": {"type": "ply", "filename": str(mesh_path), "bsdf": {"type": "twosided", "bsdf": {
        "type": "diffuse", "reflectance": {"type": "rgb", "value": [args.albedo] * 3}}}},
    # Mitsuba looks along +Z in the middle column; ours looks north, -Z
    "sky": {"type": "envmap", "filename": str(probe_path), "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], 180 - args.turn)},
})


# ---------------------------------------------------------------- the camera and what it sees

low, high = positions.min(0).astype(np.float64), positions.max(0).astype(np.float64)
foot, top = (low[1] + float(t) * (high[1] - low[1]) for t in args.frame.split(","))
bearing, elevation = np.radians(args.bearing), np.radians(args.elevation)
behind = np.array([np.sin(bearing) * np.cos(elevation), np.sin(elevation), -np.cos(bearing) * np.cos(elevation)])
target = np.array([(low[0] + high[0]) / 2, (foot + top) / 2, (low[2] + high[2]) / 2])
distance = (top - foot) / 2 / np.tan(np.radians(FIELD_OF_VIEW_DEG) / 2)
eye = target + behind * distance


def camera(crop=(0.0, 0.0, 1.0, 1.0), size=(WIDTH, HEIGHT)):
    """A part of the panel, as large as `size`: x, y, width, height in panels."""
    x, y, w, h = crop
    full = (round(size[0] / w), round(size[1] / h))
    return mi.load_dict({
        "type": "perspective", "fov": FIELD_OF_VIEW_DEG, "fov_axis": "y", "near_clip": distance * 0.01, "far_clip": distance * 10,
        "to_world": mi.ScalarTransform4f().look_at(eye.tolist(), target.tolist(), [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": full[0], "height": full[1], "rfilter": {"type": "box"}, "pixel_format": "rgb",
                 "crop_offset_x": round(x * full[0]), "crop_offset_y": round(y * full[1]), "crop_width": size[0], "crop_height": size[1]},
        "sampler": {"type": "independent"}})


def first_hits(sensor, size):
    """By sample: triangle (-1 where none), barycentric coordinates (n, 3), and the sample's place on the screen in pixels (n, 2)."""
    y, x = np.divmod(np.arange(size[0] * size[1] * GRID * GRID), size[0] * GRID)
    place = np.stack([(x + 0.5) / GRID, (y + 0.5) / GRID], 1)
    at = mi.Point2f((place / size).T.astype(np.float32))
    ray, _ = sensor.sample_ray(0.0, 0.5, at, mi.Point2f(0.5), True)
    hit = scene.ray_intersect_preliminary(ray, True)
    valid = np.array(hit.is_valid())
    second, third = np.array(hit.prim_uv)
    triangle = np.where(valid, np.array(hit.prim_index).astype(np.int64), -1)
    return triangle, np.stack([1 - second - third, second, third], 1), place


def project(sensor, size, points):
    """Points of the scene in pixels of what the sensor sees."""
    world_from_camera = np.array(sensor.world_transform().matrix).reshape(4, 4)
    p = (points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    film = np.array(sensor.film().size())
    offset = np.array(sensor.film().crop_offset())
    scale = film[1] / 2 / np.tan(np.radians(FIELD_OF_VIEW_DEG) / 2)
    # Mitsuba's camera has +X to the left
    return np.stack([film[0] / 2 - p[:, 0] / p[:, 2] * scale, film[1] / 2 - p[:, 1] / p[:, 2] * scale], 1) - offset


def pixels(samples, size):
    return samples.reshape(size[1], GRID, size[0], GRID, -1).mean((1, 3))


def interpolated(values, triangle, weights):
    hit = triangle >= 0
    out = np.zeros((len(triangle), values.shape[1]))
    out[hit] = (values[triangles[triangle[hit]]] * weights[hit][:, :, None]).sum(1)
    return out


def wireframe(sensor, size, width_px, stone):
    """Edges that nothing hides, darker where the surface turns away, on dark stone. Encoded."""
    triangle, weights, place = first_hits(sensor, size)
    hit = triangle >= 0
    on_screen = project(sensor, size, positions.astype(np.float64))
    corner, p = on_screen[triangles[triangle[hit]]], place[hit]
    nearest = np.full(len(p), np.inf)
    for i in range(3):
        a, b = corner[:, i], corner[:, (i + 1) % 3]
        along = b - a
        t = np.clip(((p - a) * along).sum(1) / np.maximum((along**2).sum(1), 1e-12), 0, 1)
        nearest = np.minimum(nearest, np.linalg.norm(p - a - along * t[:, None], axis=1))
    line = np.clip((width_px / 2 - nearest) * GRID + 0.5, 0, 1)[:, None]
    facing = np.abs(interpolated(normals.astype(np.float64), triangle, weights)[hit] @ behind)[:, None]
    colours = np.tile(BACKGROUND, (len(triangle), 1))
    colours[hit] = (stone * (1 - line) + LINE * line) * (0.06 + 0.94 * facing**2)
    return encode(pixels(colours, size))


def encode(linear):
    """sRGB."""
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def tone(linear, exposure):
    """Nearly straight in the shadows, a shoulder above: extended Reinhard on the largest channel, white at 2.5, hue kept."""
    shown = linear * exposure
    peak = np.maximum(shown.max(-1, keepdims=True), 1e-9)
    return shown * ((1 + peak / 2.5**2) / (1 + peak))


# ---------------------------------------------------------------- the panels

def visibility():
    """Light, irradiance / pi, at the vertices, and what the program reports."""
    run = subprocess.run([args.heliodon, "visibility", str(mesh_path), "--level", str(args.level), "--backend", "cpu", "--env", str(probe_path),
                          f"--turn={args.turn}", "-o", str(folder / "light.npy"), "-q", "--json"], check=True, stdout=subprocess.PIPE, text=True)
    return np.load(folder / "light.npy").astype(np.float64), json.loads(run.stdout)


def timed(function, *arguments):
    """What it answers, and its seconds: of the clock, and of the processor, programs that it runs included."""
    clock, before = time.time(), os.times()
    answer = function(*arguments)
    return answer, np.array([time.time() - clock, sum(os.times()[:4]) - sum(before[:4])])


def local_light(light, normals):
    """The direction and the colours, ambient and directional, of light without shadows that comes nearest to `light`."""
    step = np.arange(600) + 0.5
    y, turn = 1 - 2 * step / 600, step * np.pi * (3 - np.sqrt(5))
    directions = np.stack([np.sqrt(1 - y**2) * np.cos(turn), y, np.sqrt(1 - y**2) * np.sin(turn)], 1)
    some = np.random.default_rng(1).choice(len(normals), min(4000, len(normals)), replace=False)
    normals, light = normals[some], light[some]

    def fit(direction):
        terms = np.stack([np.ones(len(normals)), np.maximum(normals @ direction, 0)], 1)
        solution, *_ = np.linalg.lstsq(terms, light, rcond=None)
        return (((terms @ solution - light) ** 2).sum() if (solution >= 0).all() else np.inf), solution

    best = min(directions, key=lambda direction: fit(direction)[0])
    return best, fit(best)[1]


def path_traced(spp, depth, seed, at_once=64):
    """The panel, without its background."""
    sensor, size = camera(), (WIDTH, HEIGHT)
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 1000, "hide_emitters": True})
    total, done = 0.0, 0
    while done < spp:
        more = min(at_once, spp - done)
        image = mi.render(scene, sensor=sensor, integrator=integrator, spp=more, seed=seed * 100_003 + done)
        total = total + np.array(image, np.float64)[:, :, :3] * more
        done += more
    assert total.shape[:2] == size[::-1]
    return total / done


def relative(a, b, where):
    a, b = a.mean(-1)[where], b.mean(-1)[where]
    return float((np.abs(a - b) / np.maximum(b, 0.05 * b.mean())).mean())


path_traced(1, 2, 99)  # compiles
parts, ours, theirs = [], [], []
for run in range(args.runs):
    (light, report), seconds = timed(visibility)
    ours.append(seconds)
    part, seconds = timed(path_traced, args.spp // args.runs, 2, run)
    parts.append(part)
    theirs.append(seconds)
    print("run", run, "ours", ours[-1], "path traced", theirs[-1], file=sys.stderr, flush=True)
ours, theirs = np.median(ours, 0), np.sum(theirs, 0)
traced = np.mean(parts, 0)
paths = args.spp // args.runs * args.runs

sensor, size = camera(), (WIDTH, HEIGHT)
triangle, weights, _ = first_hits(sensor, size)
coverage = pixels((triangle >= 0).astype(float)[:, None], size)
whole = coverage[:, :, 0] > 0.999
lit = pixels(interpolated(light * args.albedo, triangle, weights), size)
seen = np.unique(triangles[triangle[triangle >= 0]])
towards, lights = local_light(light[seen], normals[seen].astype(np.float64))
smooth = interpolated(normals.astype(np.float64), triangle, weights)
smooth /= np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-9)
local = np.stack([np.ones(len(smooth)), np.maximum(smooth @ towards, 0)], 1) @ lights * args.albedo
local = pixels(np.where((triangle >= 0)[:, None], local, 0), size)
exposure = 1.3 / np.percentile(traced[whole].max(-1), 99)


def shown(linear):
    """On the background, encoded; `linear` is weighed by coverage."""
    inside = linear / np.maximum(coverage, 1e-6)
    return encode(tone(inside, exposure) * coverage + BACKGROUND * (1 - coverage))


def loupe(panel):
    cx, cy, radius = (float(v) for v in args.loupe.split(","))
    lx, ly, at_radius = (float(v) for v in args.loupe_at.split(","))
    side = round(2 * at_radius * HEIGHT)
    aspect = HEIGHT / WIDTH
    close = camera((cx - radius * aspect, cy - radius, 2 * radius * aspect, 2 * radius), (side, side))
    image = wireframe(close, (side, side), 0.9, 2 * BACKGROUND)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    ring = encode(np.array([0.80, 0.72, 0.58]))

    def outside(x0, y0, r):
        return np.hypot(x - x0 * WIDTH, y - y0 * HEIGHT)[..., None] - r * HEIGHT

    def ringed(panel, d, width):
        edge = np.clip(width / 2 + 0.5 - np.abs(d), 0, 1)
        return panel * (1 - edge) + ring * edge

    panel = ringed(panel, outside(cx, cy, radius), 1.6)
    d = outside(lx, ly, at_radius)
    left, upper = round(lx * WIDTH) - side // 2, round(ly * HEIGHT) - side // 2
    larger = np.zeros_like(panel)
    larger[upper:upper + side, left:left + side] = image
    inside = np.clip(0.5 - d, 0, 1)
    return ringed(panel * (1 - inside) + larger * inside, d, 2.2)


panels = [loupe(wireframe(sensor, size, 0.28, BACKGROUND)), shown(local), shown(lit), shown(traced)]


def flip(a, b):
    error, _, _ = flip_evaluator.evaluate(b.astype(np.float32), a.astype(np.float32), "LDR", applyMagma=False)
    return round(float(np.asarray(error).squeeze()[whole].mean()), 4)


def percent(share):
    return round(100 * float(share), 2)


def seconds_pair(pair):
    return {"clock": round(float(pair[0]), 2), "processor": round(float(pair[1]), 2)}


half = len(parts) // 2
result = {
    "mesh": args.mesh.name, "probe": args.probe.name, "vertices": len(positions), "triangles": len(triangles),
    "directions": report["directions"], "panel": args.size, "paths_a_pixel": paths,
    "seconds": {"visibility": seconds_pair(ours), "path_traced": seconds_pair(theirs)},
    "visibility": {"relative_percent": percent(relative(lit, traced, whole)), "flip": flip(panels[2], panels[3]),
                   "bias_percent": percent(lit[whole].mean() / traced[whole].mean() - 1)},
    "local_light": {"relative_percent": percent(relative(local, traced, whole)), "flip": flip(panels[1], panels[3])},
}
if half:
    # a half differs from the whole by as much as the whole errs: errors of both halves, with half the weight each
    one, other = np.mean(parts[:half], 0), np.mean(parts[half:2 * half], 0)
    result["noise_percent"] = percent(relative(one, (one + other) / 2, whole))
if args.bounces > 1:
    more = path_traced(max(paths // 8, 1), args.bounces + 1, 100)
    result["bounces"] = {"bounces": args.bounces, "albedo": args.albedo, "add_percent": percent(more[whole].mean() / traced[whole].mean() - 1)}

# as near to the reference as ours: how many paths, how long
total, done, spent = 0.0, 0, np.zeros(2)
result["fewer_paths"] = []
while done < paths // 2:
    more = max(done, 1)
    image, seconds = timed(path_traced, more, 2, 1000 + done)
    total, done, spent = total + image * more, done + more, spent + seconds
    result["fewer_paths"].append({"paths": done, "relative_percent": percent(relative(total / done, traced, whole)),
                                  "flip": flip(shown(total / done), panels[3]), "seconds": seconds_pair(spent)})


# ---------------------------------------------------------------- the picture

def font(size, bold=False):
    return ImageFont.truetype("DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf", size)


def seconds_text(seconds):
    return f"{seconds:.1f} s" if seconds < 100 else f"{seconds:.0f} s"


captions = [
    ("Wireframe", f"{len(positions):,} vertices,", f"{len(triangles):,} triangles"),
    ("Local light", "ambient and n·l,", "no shadows"),
    (f"Heliodon, k = {report['directions']}", "the light of all vertices, any view:", f"{seconds_text(ours[1])} of processor time"),
    ("Path traced (Mitsuba)", f"direct light, {paths:,} paths, one view:", f"{seconds_text(theirs[1])} of processor time"),
]
strip = np.concatenate(panels, 1)
sheet = np.concatenate([strip, np.broadcast_to(encode(BACKGROUND), (CAPTION, strip.shape[1], 3))])
sheet = Image.fromarray(np.round(sheet * 255).astype(np.uint8))
draw = ImageDraw.Draw(sheet)
for i, (title, *rest) in enumerate(captions):
    x = (i + 0.5) * WIDTH
    draw.text((x, HEIGHT + 24), title, INK, font(27, True), anchor="mm")
    for j, line in enumerate(rest):
        draw.text((x, HEIGHT + 60 + 32 * j), line, QUIET, font(23), anchor="mm")
sheet.save(args.output, quality=90, subsampling=0, optimize=True)
if args.dump:
    args.dump.mkdir(parents=True, exist_ok=True)
    for name, panel in zip(("wireframe", "local", "visibility", "traced"), panels):
        Image.fromarray(np.round(panel * 255).astype(np.uint8)).save(args.dump / f"{name}.png")
print(json.dumps(result, indent=1))
