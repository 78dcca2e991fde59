"""Frames of a prepared site from committed views: how long they take, and how far they are from those of the site as it was scanned.

  python prepared.py HELIODON PREPARED [--original BUNDLE] [--views temple.json] [--peer PROGRAM] [--runs 3] [--times 08:30,10:30,15:00]

HELIODON is the program, PREPARED a bundle, --original the bundle of the same site without [prepare]. For each view `heliodon bench frame` tells a frame's
time at 1024x768 with the eye at rest while the day passes, with an eye that moves in every frame, and in stereo; --peer (a program that prints
"… N ms …") runs in turn with them. With --original the pictures of both bundles are compared by LDR-FLIP (NVIDIA's flip-evaluator, PyPI), the mean of
the frame, at the hours of --times, with 16 samples a pixel as stills have. Prints a JSON object with the medians over the views.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("prepared")
parser.add_argument("--original")
parser.add_argument("--views", type=pathlib.Path, default=pathlib.Path(__file__).with_name("temple.json"))
parser.add_argument("--peer")
parser.add_argument("--runs", type=int, default=3, help="of each measurement, whose median counts; 0 compares pictures only")
parser.add_argument("--times", default="08:30,10:30,15:00")
parser.add_argument("--out", type=pathlib.Path)
args = parser.parse_args()
out = args.out or pathlib.Path(tempfile.mkdtemp())
out.mkdir(parents=True, exist_ok=True)

WAYS = {"at_rest": [], "moving": ["--moving"], "stereo": ["--stereo"]}


def place(view):
    return [f"--{name}=" + ",".join(map(str, view[name])) for name in ("eye", "look")]


def frame_ms(view, way):
    command = [args.heliodon, "bench", "frame", args.prepared, "--runs", "1", "--json", *place(view), *WAYS[way]]
    told = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return told["median_seconds"] * 1e3, told["more"]["processor_ms"]


def peer_ms():
    told = subprocess.run([args.peer], check=True, capture_output=True, text=True)
    return float(re.search(r"([0-9.]+) ms", told.stdout + told.stderr).group(1))


def flip(view, number, hour):
    import flip_evaluator

    pictures = []
    for name, bundle in (("original", args.original), ("prepared", args.prepared)):
        path = out / f"view{number}-{hour.replace(':', '')}-{name}.png"
        command = [args.heliodon, "render", bundle, "--size", "1024x768", "--time", hour, "-o", str(path), *place(view)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        pictures.append(str(path))
    return float(flip_evaluator.evaluate(*pictures, "LDR", applyMagma=False)[1])


views = json.loads(args.views.read_text())
rows, peers = [], []
for number, view in enumerate(views, 1):
    row = {"view": view["name"]}
    times = {way: [] for way in WAYS}
    for _ in range(args.runs):
        if args.peer:
            peers.append(peer_ms())
        for way, found in times.items():
            found.append(frame_ms(view, way))
    for way, found in times.items() if args.runs else ():
        row[way + "_ms"] = round(statistics.median(ms for ms, _ in found), 1)
        row[way + "_processor_ms"] = round(statistics.median(ms for _, ms in found), 1)
    if args.original:
        row["flip"] = {hour: round(flip(view, number, hour), 4) for hour in args.times.split(",")}
    print(json.dumps(row), file=sys.stderr, flush=True)
    rows.append(row)
told = {"views": rows}
for way in WAYS if args.runs else ():
    ms = round(statistics.median(row[way + "_ms"] for row in rows), 1)
    told[way] = {"median_ms": ms, "frames_a_second": round(1e3 / ms, 1)}
if peers:
    told["peer_median_ms"] = round(statistics.median(peers), 1)
    told["times_the_peer"] = round(told["peer_median_ms"] / told["at_rest"]["median_ms"], 2)
if args.original:
    told["flip_median"] = statistics.median(value for row in rows for value in row["flip"].values())
    told["flip_worst"] = max(value for row in rows for value in row["flip"].values())
print(json.dumps(told, indent=1))
