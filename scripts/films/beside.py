"""A film beside the monument: how many of its pictures come too late, and what it takes.

  python beside.py HELIODON BUNDLE [--eye=X,Y,Z --look=X,Y,Z] [--size 640x1280] [--rate 30] [--frames 600] [--runs 3] [--msaa 1]

HELIODON is the program, BUNDLE a baked one without films of its own. A film of moving patterns within an oval, 8 s long, is made by ffmpeg as the pair of
image and inverted mask that `heliodon key` makes, and stands 1.8 m high, 3 m before the eye, in a copy of the bundle. `heliodon bench frame` draws it off
screen at 1024x768 while the day passes, with the film and without. Prints a JSON object: the pictures that were shown and missed in the frames that count,
and medians of a frame's time and of the program's processor time (the decoder is another process, and on few cores takes its share of the frame's time).
"""

import argparse
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile

from pattern import make_pair

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("bundle", type=pathlib.Path)
parser.add_argument("--eye", help="default: the first room's middle")
parser.add_argument("--look", help="default: what that room looks at")
parser.add_argument("--size", default="640x1280")
parser.add_argument("--rate", default="30")
parser.add_argument("--frames", type=int, default=600, help="that count; before them 60 do not")
parser.add_argument("--runs", type=int, default=3)
parser.add_argument("--msaa", type=int, default=1)
args = parser.parse_args()

SECONDS = 8
AHEAD_M = 3.0
HEIGHT_M = 1.8


def numbers(text):
    return [float(part) for part in text.split(",")]


def with_film(folder):
    bundle = folder / "bundle"
    shutil.copytree(args.bundle, bundle)
    manifest = json.loads((bundle / "manifest.json").read_text())
    if manifest.get("living", {}).get("film"):
        sys.exit("the bundle has films of its own")
    (bundle / "films").mkdir(exist_ok=True)
    make_pair(bundle / "films" / "image.mp4", bundle / "films" / "mask.mp4", args.size, args.rate, SECONDS)
    for name in ("image.mp4", "mask.mp4"):
        path = f"films/{name}"
        # a copy to be thrown away: nobody compares what it holds
        manifest["files"].append({"path": path, "bytes": (bundle / path).stat().st_size, "blake3": "0" * 64})
    room = manifest["rooms"][0]
    eye = numbers(args.eye) if args.eye else [(low + high) / 2 for low, high in zip(room["min"], room["max"])]
    look = numbers(args.look) if args.look else room["looks_at"]
    across = math.hypot(look[0] - eye[0], look[2] - eye[2]) or 1.0
    x, z = (eye[axis] + AHEAD_M * (look[axis] - eye[axis]) / across for axis in (0, 2))
    film = {"name": "beside", "file": "films/image.mp4", "mask": "films/mask.mp4", "height_m": HEIGHT_M}
    film["place"] = [x, eye[1] - 0.6 * HEIGHT_M, z]
    manifest.setdefault("living", {})["film"] = [film]
    manifest["version"] = max(manifest["version"], 5)
    (bundle / "manifest.json").write_text(json.dumps(manifest))
    return bundle, [f"--eye={','.join(map(str, eye))}", f"--look={','.join(map(str, look))}"]


def bench(bundle, more):
    command = [args.heliodon, "bench", "frame", str(bundle), "--runs", "1", "--json", f"--frames={args.frames}", f"--msaa={args.msaa}", *more]
    told = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    return {"frame_ms": told["median_seconds"] * 1e3, **told["more"]}


with tempfile.TemporaryDirectory() as folder:
    bundle, place = with_film(pathlib.Path(folder))
    runs = [(bench(bundle, place), bench(bundle, [*place, "--no-films"])) for _ in range(args.runs)]

median = lambda which, key: round(statistics.median(run[which][key] for run in runs), 2)
found = {"size": args.size, "rate": args.rate, "frames": args.frames, "runs": args.runs}
found |= {key: median(0, key) for key in ("films_shown", "films_missed", "films_ms", "frame_ms", "processor_ms")}
found |= {f"{key}_without": median(1, key) for key in ("frame_ms", "processor_ms")}
print(json.dumps(found, indent=2))
