"""Real-time frames against the path tracer's, by FLIP.

  python frames.py HELIODON BUNDLE [--times 07:30,09:30,11:30,13:30,15:30,17:00] [--spp 256] [--size 1024x768] [--out DIR]

HELIODON is the program. For each hour `heliodon render` makes the real-time frame and, with `--reference`, the path traced one at
the same exposure and tone curve, and once the coverage (which pixels show geometry). LDR-FLIP is NVIDIA's flip-evaluator (PyPI), its
mean taken over the pixels that show geometry only. Prints a JSON object; exit status 1 where a mean is above 0.08.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import flip_evaluator
import numpy as np
from PIL import Image

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("heliodon")
parser.add_argument("bundle")
parser.add_argument("--times", default="07:30,09:30,11:30,13:30,15:30,17:00")
parser.add_argument("--spp", type=int, default=256)
parser.add_argument("--size", default="1024x768")
parser.add_argument("--out", type=pathlib.Path)
args = parser.parse_args()
out = args.out or pathlib.Path(tempfile.mkdtemp())
out.mkdir(parents=True, exist_ok=True)


def render(name, *more):
    path = out / name
    start = time.time()
    subprocess.run([args.heliodon, "render", args.bundle, "--size", args.size, "-o", str(path), *more], check=True)
    return path, time.time() - start



rows = []
for hour in args.times.split(","):
    stem = hour.replace(":", "")
    fast, fast_seconds = render(f"{stem}-realtime.png", "--time", hour)
    true, true_seconds = render(f"{stem}-reference.png", "--time", hour, "--reference", str(args.spp), "--coverage", str(out / f"{stem}-coverage.png"))
    error, mean, _ = flip_evaluator.evaluate(str(true), str(fast), "LDR", applyMagma=False)
    covered = np.asarray(Image.open(out / f"{stem}-coverage.png").convert("L")) >= 128
    error = np.asarray(error).squeeze()
    rows.append({"time": hour, "flip_geometry": round(float(error[covered].mean()), 4), "flip_frame": round(float(mean), 4),
                 "covered_percent": round(float(covered.mean()) * 100, 1), "realtime_seconds": round(fast_seconds, 1),
                 "reference_seconds": round(true_seconds, 1)})
good = all(row["flip_geometry"] <= 0.08 for row in rows)
print(json.dumps({"bundle": pathlib.Path(args.bundle).name, "size": args.size, "spp": args.spp, "within_target": good, "frames": rows}, indent=1))
sys.exit(0 if good else 1)
