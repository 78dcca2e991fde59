"""The temple by day with everything switched on: what each feature takes of a frame.

  python temple.py HELIODON [--triangles 120000] [--seconds 4] [--runs 3] [--size 1024x768] [--keep DIR]

HELIODON is the program. A temple is made and lit, with a crowd of impostors and one skinned figure, a film beside them, dust, smoke, fire and water, lamps, sounds, an echo, a thing to
take and a story that runs; then a visit of some seconds is played and filmed with all of it, and with all but one feature in turn. Prints a JSON object: for each feature the mean frame with
everything less that without it (what it takes of the picture too, on software Vulkan on the same cores), and what its systems take of the processor as `play --json` tells.
Between one and the other lie the drawing and, in `with everything`, the film's encoder.
"""

import argparse
import contextlib
import json
import pathlib
import re
import statistics
import struct
import subprocess
import sys
import tempfile

sys.path.append(str(pathlib.Path(__file__).parent.parent / "films"))
from pattern import make_pair

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("--triangles", default="120000")
parser.add_argument("--seconds", type=float, default=4.0, help="of each visit")
parser.add_argument("--runs", type=int, default=3)
parser.add_argument("--size", default="1024x768")
parser.add_argument("--keep", type=pathlib.Path, help="leave site, bundle and films there; a site that is there is played again")
args = parser.parse_args()

STORY = """
state.seconds = 0;
when_enter("porch", || { hint("welcome", 20); task("look"); guide("to-the-porch"); });
when_look("stele", 0, || highlight("stele", true));
every(0.2, || { state.seconds += 0.2; });
"""
TEXTS = """
languages = ["en"]
[texts.welcome]
en = "The procession passes between the columns"
[texts.look]
en = "Go up the steps"
"""
FRONT = (-50.0, -6.0)  # x, z before the west porch
TABLES = """
[[actor]]
name = "crowd"
file = "walker.impostor.ktx2"
count = 60
spread_m = 3.0
path = [[-41.0, 0.0, -18.0], [-39.0, 0.0, 10.0]]
walk = "back-and-forth"
walk_speed = 1.25
ground = "follow"

[[actor]]
name = "walker"
file = "walker.glb"
animation = "walk"
path = [[-45.0, 0.0, -1.0], [-44.0, 0.0, -12.0]]
walk = "back-and-forth"
walk_speed = 1.25
ground = "follow"

[[actor]]
name = "stele"
file = "stele.obj"
place = [-46.0, {stele}, -9.0]
ground = "ignore"
thing = {{ carried = true }}

[[film]]
name = "guide"
file = "guide.mp4"
mask = "guide-mask.mp4"
place = [-45.5, {ground}, -7.0]
height_m = 1.8

[[particles]]
name = "dust"
kind = "dust"
place = [-40.0, 2.5, -6.0]
extent = [6.0, 2.5, 6.0]
density = 0.4

[[particles]]
name = "fire"
kind = "fire"
place = [-44.0, {altar}, -3.5]
extent = [0.2, 0.05, 0.2]

[[particles]]
name = "smoke"
kind = "smoke"
place = [-44.0, {above}, -3.5]
extent = [0.15, 0.05, 0.15]
density = 0.5

[[particles]]
name = "spring"
kind = "water"
place = [-45.0, {altar}, -9.5]
extent = [0.2, 0.05, 0.2]

[[light]]
name = "torch"
place = [-44.0, {torch}, -3.5]
intensity = [9.0, 5.0, 1.9]
reach_m = 9.0

[[sound]]
name = "fire"
kind = "fire"
place = [-44.0, {altar}, -3.5]
repeat = true
plays = true

[[sound]]
name = "crowd"
kind = "crowd"
place = [-40.0, 1.6, -2.0]
repeat = true
plays = true

[[sound]]
name = "wind"
kind = "wind"
repeat = true
plays = true

[[echo]]
name = "porch"
min = [-36.0, 0.0, -14.0]
max = [-20.0, 14.0, 10.0]

[[region]]
name = "porch"
min = [-60.0, -2.0, -30.0]
max = [-20.0, 20.0, 30.0]

[[path]]
name = "to-the-porch"
points = [[-48.5, {ground}, -6.0], [-42.0, {ground}, -6.0]]

[story]
scripts = ["story.rhai"]
texts = "texts.toml"
remembers = false
"""
# the feature, as the manifest names what it is of, and what is left of that without it
FEATURES = {
    "crowd": ("actors", lambda actor: not actor["file"].endswith(".impostor.ktx2")),
    "skinned figure": ("actors", lambda actor: not actor["file"].endswith(".glb")),
    "thing": ("actors", lambda actor: "thing" not in actor or actor["thing"] is None),
    "film": ("living.film", None),
    "air": ("living.particles", None),
    "lamp": ("lamps", None),
    "sounds": ("living.sound", None),
    "story": ("living.story", None),
}


def heliodon(*command):
    subprocess.run([args.heliodon, "--quiet", *map(str, command)], check=True, stdout=subprocess.DEVNULL)


def box(path, width, height):
    """A slab that stands on the ground."""
    corners = [(x, y, z) for y in (0.0, height) for x in (-width, width) for z in (-width / 3, width / 3)]
    faces = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 3, 7, 5), (2, 6, 8, 4), (1, 5, 6, 2), (3, 4, 8, 7)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + ["f " + " ".join(map(str, face)) for face in faces]
    path.write_text("\n".join(lines) + "\n")


def make(site):
    heliodon("new", site, "--template", "temple", "--triangles", args.triangles)
    figures = site.parent / "figures"
    heliodon("figures", figures)
    (site / "walker.glb").write_bytes((figures / "walker.glb").read_bytes())
    # captured for the distance at which most of them are seen
    heliodon("impostor", figures / "walker.glb", "--clip", "walk", "--distance", "8", "-o", site / "walker.impostor.ktx2")
    box(site / "stele.obj", 0.2, 0.5)
    make_pair(site / "guide.mp4", site / "guide-mask.mp4", "640x1280", 30, 8)
    (site / "story.rhai").write_text(STORY)
    (site / "texts.toml").write_text(TEXTS)
    x, z = FRONT
    ground = ground_at(site / "ground.ply", x, z)
    eye = ground + 1.7
    heights = {"ground": ground, "stele": ground, "altar": ground + 0.8, "above": ground + 1.5, "torch": ground + 1.3}
    described = site / "site.toml"
    # the visit begins in the first room's middle
    room = f"[[room]]\nname = \"before the porch\"\nmin = [{x - 1}, {eye - 0.4}, {z - 1}]\nmax = [{x + 1}, {eye + 0.4}, {z + 1}]\nlooks_at = [-30.0, 4.0, -5.0]\n"
    text = described.read_text().replace("[bake]\n", '[bake]\nfirst = "10:00"\nlast = "10:40"\nsun_steps = 8\n')
    text = re.sub(r"\[\[room\]\]\n.*?\n\n", lambda _: room + "\n", text, count=1, flags=re.DOTALL)
    described.write_text(text + TABLES.format(**heights))


def ground_at(path, x, z):
    """The height of the ground's vertex that is nearest."""
    raw = path.read_bytes()
    end = raw.index(b"end_header\n") + len(b"end_header\n")
    header = raw[:end].decode()
    count = int(re.search(r"element vertex (\d+)", header)[1])
    properties = re.findall(r"property (\w+) (\w+)", header[header.index("element vertex") : header.index("element face")])
    codes = {"float": "f", "uchar": "B", "double": "d"}
    vertex = struct.Struct("<" + "".join(codes[kind] for kind, _ in properties))
    axes = [[name for _, name in properties].index(axis) for axis in "xyz"]
    places = ([values[axis] for axis in axes] for values in vertex.iter_unpack(raw[end : end + count * vertex.size]))
    return min(places, key=lambda place: (place[0] - x) ** 2 + (place[2] - z) ** 2)[1]


def without(bundle, feature):
    """A second manifest in the bundle's place, less the feature; back to what it was afterwards."""
    key, stays = FEATURES[feature]
    manifest = json.loads((bundle / "manifest.json").read_text())
    *above, last = key.split(".")
    table = manifest
    for name in above:
        table = table[name]
    if stays is None:
        table.pop(last)
    else:
        table[last] = [entry for entry in table[last] if stays(entry)]
    return json.dumps(manifest)


@contextlib.contextmanager
def manifest_of(bundle, text):
    path = bundle / "manifest.json"
    whole = path.read_text()
    path.write_text(text or whole)
    try:
        yield
    finally:
        path.write_text(whole)


def play(bundle, folder, name):
    script = folder / "stand.play"
    script.write_text(f"wait {args.seconds}\n")
    made = folder / f"{name.replace(' ', '-')}.mp4"
    command = [args.heliodon, "--quiet", "--json", "play", bundle, "--inputs", script, "-o", made, "--size", args.size, "--fps", "15"]
    return json.loads(subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True).stdout)


def measure(folder):
    site, bundle = folder / "site", folder / "site" / "bundle"
    if not site.exists():
        make(site)
    heliodon("bake", site, "-o", bundle)
    told = []
    for _ in range(args.runs):
        found = {}
        for feature in [None, *FEATURES]:
            with manifest_of(bundle, feature and without(bundle, feature)):
                found[feature or "everything"] = play(bundle, folder, feature or "everything")
        told.append(found)
    frame = lambda run, name: run[name]["frames"]["mean_ms"]
    median = lambda pick: round(statistics.median(map(pick, told)), 2)
    systems = [feature["name"] for feature in told[0]["everything"]["features"]]
    of = lambda run, name: next(feature["mean_ms"] for feature in run["everything"]["features"] if feature["name"] == name)
    return {
        "everything_ms": median(lambda run: frame(run, "everything")),
        "saved_without_ms": {name: median(lambda run: frame(run, "everything") - frame(run, name)) for name in FEATURES},
        "systems_ms": {name: median(lambda run: of(run, name)) for name in systems},
    }


if args.keep:
    args.keep.mkdir(exist_ok=True)
    print(json.dumps(measure(args.keep.resolve()), indent=2))
else:
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(pathlib.Path(folder)), indent=2))
