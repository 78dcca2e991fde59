"""A crowd of impostors beside the same crowd of skinned models, on one ground, side by side.

  python crowd.py HELIODON [--people 500] [--frames 12] [--runs 3]

HELIODON is the program. Two small sites are made of an open ground on which as many skeletons walk, all in view 8 to 40 m away: captured for 8 m, and skinned. `heliodon bench frame` draws
both off screen at 1024x768, the day at rest, in turn. Prints a JSON object of medians, in milliseconds by the clock and of a processor: `impostors` with shadows of everybody,
`eight_shadows` of the eight nearest, as many as of skinned people, `without_shadows`, `nearest` (one view each, without shadows), `skinned`, of whom the eight nearest cast shadows, and `empty`, the same ground with nobody on it. `frames_cheaper` compares whole
frames of the processor; `people_cheaper` what the people add to the empty one.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("--people", type=int, default=500)
parser.add_argument("--frames", type=int, default=12, help="that count; as many before them do not")
parser.add_argument("--runs", type=int, default=3)
parser.add_argument("--keep", type=pathlib.Path, help="leave the sites there; those that are there are drawn again")
args = parser.parse_args()

SITE = """
[site]
name = "A crowd"
latitude_deg = 37.97
longitude_deg = 23.73
utc_offset = "+03:00"

[[part]]
file = "ground.obj"
role = "ground"

[sky]
model = "atmosphere"
date = "2006-05-20"

[bake]
sun_steps = 16
samples = 16
bounces = 1
grid_m = 2.0

[[room]]
name = "before the crowd"
min = [-1.0, 2.4, 4.0]
max = [1.0, 3.0, 6.0]
looks_at = [0.0, 0.6, -15.0]
"""
# where the crowd is: its middle, and half of its width and depth, metres
NEAR_M, FAR_M, SLOPE = 8.0, 40.0, 0.42


def places():
    """Spread over what the eye sees, by the golden ratio: no two alike, none beyond the picture's edges."""
    for number in range(args.people):
        away = NEAR_M + (FAR_M - NEAR_M) * ((number + 0.5) / args.people) ** 0.6
        side = (number * 0.6180339887 % 1.0) * 2.0 - 1.0
        yield side * SLOPE * away, 5.0 - away, 360.0 * (number * 0.7548776662 % 1.0)


def heliodon(*command):
    return subprocess.run([args.heliodon, *map(str, command)], check=True, stdout=subprocess.PIPE, text=True).stdout


def make(folder):
    figures = folder / "figures"
    heliodon("--quiet", "figures", figures)
    heliodon("--quiet", "impostor", figures / "walker.glb", "--clip", "walk", "--distance", "8", "-o", figures / "walker.impostor.ktx2")
    for name, file in [("impostors", "walker.impostor.ktx2"), ("skinned", "walker.glb"), ("empty", None)]:
        site = folder / name
        site.mkdir()
        if file:
            (site / file).write_bytes((figures / file).read_bytes())
        steps = range(-40, 41, 4)
        vertices = "".join(f"v {x} 0 {z}\n" for z in steps for x in steps)
        count = len(steps)
        quads = ((row * count + column + 1, (row + 1) * count + column + 1) for row in range(count - 1) for column in range(count - 1))
        (site / "ground.obj").write_text(vertices + "".join(f"f {a} {b} {b + 1} {a + 1}\n" for a, b in quads))
        actors = "".join(
            f'\n[[actor]]\nname = "{number}"\nfile = "{file}"\nanimation = "walk"\nplace = [{x:.3f}, 0.0, {z:.3f}]\nturn_deg = {turn:.1f}\n' for number, (x, z, turn) in enumerate(places() if file else [])
        )
        (site / "site.toml").write_text(SITE + actors)
        heliodon("--quiet", "bake", site)


def bench(folder, name, *more):
    told = heliodon("--quiet", "--json", "bench", "frame", folder / name / "bundle", "--paused", "--runs", 1, "--frames", args.frames, *more)
    told = json.loads(told)
    return {"ms": told["median_seconds"] * 1e3, "processor_ms": told["more"]["processor_ms"]}


def measure(folder):
    if not (folder / "empty" / "bundle").exists():
        make(folder)
    kinds = {
        "impostors": ("impostors",),
        "eight_shadows": ("impostors", "--impostor-shadows", 8),
        "without_shadows": ("impostors", "--no-impostor-shadows"),
        "nearest": ("impostors", "--no-impostor-shadows", "--impostors", "nearest"),
        "skinned": ("skinned",),
        "empty": ("empty",),
    }
    runs = [{kind: bench(folder, *command) for kind, command in kinds.items()} for _ in range(args.runs)]
    median = lambda kind, key: round(statistics.median(run[kind][key] for run in runs), 1)
    found = {kind: {key: median(kind, key) for key in ("ms", "processor_ms")} for kind in kinds}
    peopled = [kind for kind in kinds if kind not in ("skinned", "empty")]

    def cheaper(without):
        """How many times dearer skinned people are, of frames less `without` of each run."""
        ratio = lambda run, kind: (run["skinned"]["processor_ms"] - without(run)) / (run[kind]["processor_ms"] - without(run))
        return {kind: round(statistics.median(ratio(run, kind) for run in runs), 1) for kind in peopled}

    ratios = {"frames_cheaper": cheaper(lambda run: 0.0), "people_cheaper": cheaper(lambda run: run["empty"]["processor_ms"])}
    return {"people": args.people, "runs": args.runs, **found, **ratios}


if args.keep:
    args.keep.mkdir(exist_ok=True)
    print(json.dumps(measure(args.keep), indent=2))
else:
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(measure(pathlib.Path(folder)), indent=2))
