"""Cycles' light-map bake of a model that `heliodon lightmap` has unwrapped, beside light maps of ours.

  heliodon lightmap SITE --sky even --kind exr --bounces 4 -o TRUTH ...      (of many samples: what both are compared with)
  blender -b --python scripts/lightmap/cycles_bake.py -- TRUTH [--samples 16 64 256] [--bounces 4] [--of FOLDER...] [--save DIR] [--own FILE]

Blender (3.4 or later) imports TRUTH/model.glb, joins it to one mesh and bakes the light on its second UV set as `DIFFUSE` without colour, under an even world of radiance 1, on
as many threads as there are cores, without denoising. A FOLDER is another light map of the same site and size. Prints a line of JSON for each: seconds of the bake by the
clock and of the processor (Blender's own preparation of the scene included, for it is part of every bake), and the root mean square of the difference to TRUTH/light.exr as a part of its mean, over
texels whose eight neighbours are covered as well. Cycles takes a texel's light over the whole of it and with its own offsets, ours at its middle: with `--own`, a map that an earlier run of many samples has
saved, Cycles is compared with itself, and only its noise counts.
"""
import argparse
import json
import os
import resource
import sys
import time

import bpy
import numpy as np

# Blender 3.4's importer asks for names that NumPy has dropped
np.bool = bool

p = argparse.ArgumentParser()
p.add_argument("truth")
p.add_argument("--samples", type=int, nargs="*", default=[16, 64, 256])
p.add_argument("--bounces", type=int, default=4)
p.add_argument("--of", nargs="*", default=[])
p.add_argument("--seed", type=int, default=0)
p.add_argument("--save", help="a folder for what Cycles baked")
p.add_argument("--own", help="what Cycles baked with many samples")
a = p.parse_args(sys.argv[sys.argv.index("--") + 1:])


def pixels(image):
    flat = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)[..., :3].astype(np.float64)


def light(folder):
    image = bpy.data.images.load(os.path.join(os.path.abspath(folder), "light.exr"))
    image.colorspace_settings.name = "Non-Color"
    return pixels(image)


truth = light(a.truth)
side = truth.shape[0]

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=os.path.join(os.path.abspath(a.truth), "model.glb"))
parts = [o for o in bpy.context.scene.objects if o.type == "MESH"]
bpy.ops.object.select_all(action="DESELECT")
for o in parts:
    o.select_set(True)
bpy.context.view_layer.objects.active = parts[0]
if len(parts) > 1:
    bpy.ops.object.join()
mesh = bpy.context.view_layer.objects.active
uvs = mesh.data.uv_layers
uvs.active_index = len(uvs) - 1
uvs[-1].active_render = True

scene = bpy.context.scene
world = bpy.data.worlds.new("even")
scene.world = world
world.use_nodes = True
world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
world.node_tree.nodes["Background"].inputs["Strength"].default_value = 1
scene.render.engine = "CYCLES"
cycles = scene.cycles
cycles.device = "CPU"
cycles.use_denoising = False
cycles.use_adaptive_sampling = False
cycles.max_bounces = cycles.diffuse_bounces = a.bounces
cycles.glossy_bounces = cycles.transmission_bounces = 0
cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
cycles.seed = a.seed
bake = scene.render.bake
bake.margin = 0
bake.use_pass_direct = bake.use_pass_indirect = True
bake.use_pass_color = False


def make_lambertian(tree):
    """The base colour on a surface that throws light evenly, as ours: Principled's diffuse lobe does not."""
    shader = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if shader is None:
        return
    diffuse, color = tree.nodes.new("ShaderNodeBsdfDiffuse"), shader.inputs["Base Color"]
    diffuse.inputs["Color"].default_value = color.default_value
    for link in list(color.links):
        tree.links.new(link.from_socket, diffuse.inputs["Color"])
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    tree.links.new(diffuse.outputs["BSDF"], output.inputs["Surface"])
    tree.nodes.remove(shader)


def target():
    image = bpy.data.images.new("light", side, side, float_buffer=True, alpha=True, is_data=True)
    image.generated_color = (0, 0, 0, 0)
    for slot in mesh.material_slots:
        slot.material.use_nodes = True
        nodes = slot.material.node_tree.nodes
        node = nodes.get("baked") or nodes.new("ShaderNodeTexImage")
        node.name = "baked"
        node.image = image
        nodes.active = node
        make_lambertian(slot.material.node_tree)
    return image


def inner(covered):
    """Texels whose eight neighbours are covered as well."""
    all_of = covered.copy()
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            all_of &= np.roll(covered, (dy, dx), (0, 1))
    return all_of


def told(name, found, truth, **more):
    where = covered & np.isfinite(truth).all(2)
    off = (found - truth)[where]
    mean = truth[where].mean()
    print(json.dumps({"what": name, **more, "texels": int(where.sum()), "mean": round(float(found[where].mean()), 5), "truth": round(float(mean), 5),
                      "rmse_of_mean": round(float(np.sqrt((off**2).mean()) / mean), 5), "bias_of_mean": round(float(off.mean() / mean), 5),
                      "median_of_mean": round(float(np.median(np.abs(off)) / mean), 5)}), flush=True)


covered = None
for samples in a.samples:
    image = target()
    cycles.samples = samples
    before, clock = resource.getrusage(resource.RUSAGE_SELF), time.monotonic()
    bpy.ops.object.bake(type="DIFFUSE")
    clock, after = time.monotonic() - clock, resource.getrusage(resource.RUSAGE_SELF)
    found = np.empty(side * side * 4, np.float32)
    image.pixels.foreach_get(found)
    found = found.reshape(side, side, 4)
    covered = inner(found[..., 3] > 0) if covered is None else covered
    if a.save:
        np.save(os.path.join(a.save, f"cycles_{samples}_{a.seed}.npy"), found)
    cost = {"seconds": round(clock, 2), "processor_s": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 2)}
    told(f"cycles {samples}", found[..., :3].astype(np.float64), truth, **cost)
    if a.own:
        told(f"cycles {samples} beside its own", found[..., :3].astype(np.float64), np.load(a.own)[..., :3].astype(np.float64), **cost)
for folder in a.of:
    report = json.load(open(os.path.join(folder, "lightmap.json")))
    told(folder, light(folder), truth, seconds=round(report["seconds"], 2), rays=report["notes"]["rays"])
