#!/usr/bin/env python3
"""Prepares, bakes and draws real scans as they come, each alone on a plain ground, and tells what came of it.

    scripts/scans.py HELIODON DATA [--only WORD]... [--modelled WORD]... [--work DIR] [--probe HDR] [--unscaled] [--renderer HELIODON]

HELIODON is the program, DATA a folder in which all meshes are tried (ply, obj, glb, gltf, stl). For each, a site is made: the file as it is, a
ground under it, a room beside it from which all of it is seen, [prepare] with its defaults, and a model sky, or the probe that is named. The site is prepared, baked and
drawn at two hours; then the same without [prepare], for the difference of the pictures. Objects that are smaller than half a metre or
larger than 200 m are scaled by a power of ten, for hardly a file tells its unit, unless --unscaled wants them as they are. What has --modelled's words in its path (always: architecture) is given the role of filling in place of scan. --renderer names another build of the program
that has the viewer, where HELIODON has none.

Prints a table; reports, coloured meshes and pictures are left in --work (default: scans, in the present folder). The exit code is 1 where
a mesh that could be read did not get through.
"""

import argparse
import json
import math
import os
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

ENDINGS = {".ply", ".obj", ".glb", ".gltf", ".stl"}
HOURS = ["09:00", "15:30"]
# Sides of the ground in quadrilaterals: without [prepare] it has only these for its light.
GROUND_PARTS = 96
# Pixels count as different beyond this many of 255 in any channel: what a neighbouring vertex of light makes, everybody passes over.
DIFFERENT = 24
SIZE = (1024, 768)

SITE = """[site]
name = "{name}"
latitude_deg = 37.97
longitude_deg = 23.73
utc_offset = "+02:00"
[[part]]
file = "{file}"
name = "scan"
role = "{role}"
scale = {scale}
up = "{up}"
[[part]]
file = "ground.obj"
name = "ground"
role = "ground"
albedo = [0.35, 0.33, 0.3]
[sky]
{sky}
[bake]
sun_steps = 40
samples = 64
bounces = 2
[[room]]
name = "beside it"
min = {low}
max = {high}
looks_at = {look}
"""


class Failed(Exception):
    """A command that ended with an error."""


class Done:
    """What a command said and took."""

    def __init__(self, arguments):
        begun = time.monotonic()
        with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as told:
            child = subprocess.Popen([str(a) for a in arguments], stdout=said, stderr=told)
            _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            said.seek(0)
            told.seek(0)
            self.out, self.err = said.read().decode(), told.read().decode()
        self.wall_s = time.monotonic() - begun
        self.cpu_s = usage.ru_utime + usage.ru_stime
        self.peak_mb = usage.ru_maxrss / 1024
        if child.returncode != 0:
            raise Failed(self.err.strip().splitlines()[-1] if self.err.strip() else f"exit code {child.returncode}")


def meshes(data, words):
    """All meshes of the folder, or those whose path has one of the words in it."""
    found = sorted(p for p in data.rglob("*") if p.suffix.lower() in ENDINGS)
    return [p for p in found if not words or any(word in str(p) for word in words)]


def write_ground(path, low, high, y):
    """A level ground from `low` to `high`."""
    n = GROUND_PARTS
    at = lambda i, axis: low[axis] + (high[axis] - low[axis]) * i / n
    lines = [f"v {at(i, 0):.6g} {y:.6g} {at(j, 1):.6g}" for j in range(n + 1) for i in range(n + 1)]
    corner = lambda i, j: j * (n + 1) + i + 1
    lines += [f"f {corner(i, j)} {corner(i, j + 1)} {corner(i + 1, j + 1)} {corner(i + 1, j)}" for j in range(n) for i in range(n)]
    path.write_text("\n".join(lines) + "\n")


def is_z_up(path, size):
    """Whether a file's up is +Z: survey and drafting programs write OBJ so; a statue stands on its end, so a flat model tells it by its flatness."""
    return path.suffix.lower() == ".obj" and size[2] < 0.5 * min(size[0], size[1])


def make_site(folder, mesh, told, arguments):
    """Writes the site, its [prepare] left out; returns the text."""
    low, high = told["min"], told["max"]
    z_up = is_z_up(mesh, [b - a for a, b in zip(low, high)])
    if z_up:
        low, high = [low[0], low[2], -high[1]], [high[0], high[2], -low[1]]
    largest = max(b - a for a, b in zip(low, high))
    scale = 1.0
    if not arguments.unscaled and not 0.5 <= largest <= 200.0:
        scale = 10.0 ** math.floor(math.log10(5.0 / largest))
    low, high = [scale * x for x in low], [scale * x for x in high]
    size = [b - a for a, b in zip(low, high)]
    unit = max(size)
    middle = [0.5 * (a + b) for a, b in zip(low, high)]
    # people's eyes, but before what is smaller than people its own middle
    eye = [low[1] + min(0.45 * unit, 1.3), low[1] + min(0.6 * unit, 1.9)]
    near = high[2] + 0.9 * max(size[0], size[1])
    room = ([middle[0] - 0.3 * unit, eye[0], near], [middle[0] + 0.3 * unit, eye[1], near + 0.4 * unit])
    write_ground(folder / "ground.obj", (low[0] - 1.5 * unit, low[2] - 1.5 * unit), (high[0] + 1.5 * unit, room[1][2] + unit), low[1])
    sky = 'model = "atmosphere"\ndate = "2006-04-21"'
    if arguments.probe:
        sky = f'probes = "{os.path.relpath(arguments.probe.resolve(), folder)}"\nmapping = "lat-long"\ntimes = ["12:00"]'
    point = lambda p: "[" + ", ".join(f"{x:.6g}" for x in p) + "]"
    role = "filling" if any(word in str(mesh) for word in arguments.modelled) else "scan"
    return SITE.format(
        name=mesh.stem, role=role, file=os.path.relpath(mesh, folder), scale=f"{scale:g}", up="z" if z_up else "y", sky=sky,
        low=point(room[0]), high=point(room[1]), look=point(middle),
    )


def read_png(path):
    """Width, height, channels and rows of an 8-bit PNG that is not interlaced."""
    data = path.read_bytes()
    place, packed = 8, b""
    while place < len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        body = data[place + 8 : place + 8 + length]
        if kind == b"IHDR":
            width, height, _, colour = struct.unpack(">IIBB", body[:10])
        elif kind == b"IDAT":
            packed += body
        place += length + 12
    channels = {0: 1, 2: 3, 6: 4}[colour]
    raw, stride = zlib.decompress(packed), width * channels
    rows, before = [], bytes(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)])
        for i in range(stride if kind else 0):
            left, up = (row[i - channels] if i >= channels else 0), before[i]
            corner = before[i - channels] if i >= channels else 0
            if kind == 1:
                guess = left
            elif kind == 2:
                guess = up
            elif kind == 3:
                guess = (left + up) // 2
            else:
                a, b, c = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
                guess = left if a <= b and a <= c else up if b <= c else corner
            row[i] = (row[i] + guess) & 255
        rows.append(bytes(row))
        before = rows[-1]
    return width, height, channels, rows


def write_png(path, width, height, rows):
    """Rows of RGB."""
    chunk = lambda kind, body: struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    packed = zlib.compress(b"".join(b"\0" + row for row in rows))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND", b""))


def difference(one, other, into):
    """The mean difference in 1/255 and the part of pixels that differ visibly; writes a picture of it, four times as bright."""
    (width, height, channels, a), (*_, other_channels, b) = read_png(one), read_png(other)
    total, different, rows = 0, 0, []
    for of_a, of_b in zip(a, b):
        row = bytearray()
        for x in range(width):
            i, j = x * channels, x * other_channels
            off = [abs(of_a[i + c] - of_b[j + c]) for c in range(3)]
            total += sum(off)
            different += max(off) > DIFFERENT
            row += bytes(min(255, 4 * d) for d in off)
        rows.append(bytes(row))
    write_png(into, width, height, rows)
    return total / (3 * width * height), different / (width * height)


def found(report):
    """What cleaning found: the lines of the report that tell of the scan's faults, without their places."""
    lines = report.splitlines()
    end = next(i for i, line in enumerate(lines) if line.startswith("part ground"))
    words = [line.strip() for line in lines[1:end] if line.startswith("    ") and "solids united at" not in line and "more such groups" not in line]
    return "; ".join(word.split(", first at")[0] for word in words)


def attempt(mesh, told, folder, arguments):
    """All of one mesh; returns its row of the table."""
    folder.mkdir(parents=True, exist_ok=True)
    heliodon, renderer = arguments.heliodon, arguments.renderer or arguments.heliodon
    row = {"mesh": mesh.stem, "inspected": told}
    plain, prepared = folder / "plain", folder / "prepared"
    for site, more in ((plain, ""), (prepared, "[prepare]\n")):
        site.mkdir(exist_ok=True)
        text = make_site(site, mesh, told, arguments)
        (site / "site.toml").write_text(text + more)
    done = Done([heliodon, "prepare", prepared, "-o", folder / "found", "--json"])
    report = json.loads(done.out)
    row["prepare"] = {"wall_s": done.wall_s, "cpu_s": done.cpu_s, "peak_mb": done.peak_mb, "said": done.err}
    row["report"] = report
    row["found"] = found((folder / "found" / "report.txt").read_text())
    row["bake"] = {}
    for site in (prepared, plain):
        done = Done([heliodon, "bake", site, "-o", site / "bundle", "-q"])
        row["bake"][site.name] = {"wall_s": done.wall_s, "cpu_s": done.cpu_s, "peak_mb": done.peak_mb, "said": done.err}
    row["off"] = {}
    for hour in HOURS[: 1 if arguments.probe else 2]:
        pictures = [folder / f"{site.name}-{hour.replace(':', '')}.png" for site in (prepared, plain)]
        for site, picture in zip((prepared, plain), pictures):
            Done([renderer, "render", site / "bundle", "--time", hour, "--size", "x".join(map(str, SIZE)), "-o", picture, "-q"])
        row["off"][hour] = difference(*pictures, folder / f"difference-{hour.replace(':', '')}.png")
    (folder / "row.json").write_text(json.dumps(row, indent=1))
    return row


COLUMNS = "mesh | read | limit px | drawn | ground | hidden | off px (95 %) | most px | prepare s | bake s | MB | plain bake s | picture off | found"


def line(row):
    """A row of the table."""
    scan, ground = row["report"]["parts"][:2]
    off = (scan.get("error") or {}).get("from_original", {})
    pictures = ", ".join(f"{100 * part:.2f} %" for _, part in row["off"].values())
    bakes = row["bake"]
    peak = max(row["prepare"]["peak_mb"], bakes["prepared"]["peak_mb"])
    cells = [
        row["mesh"], scan["triangles_read"], f"{scan['error_px']:.1f}, {scan['edge_px']:.1f}", scan["triangles_drawn"], ground["triangles_drawn"], scan["triangles_hidden"],
        f"{off.get('p95_px', 0):.2f}", f"{off.get('max_px', 0):.2f}", f"{row['prepare']['wall_s']:.1f}",
        f"{bakes['prepared']['wall_s']:.1f}", f"{peak:.0f}", f"{bakes['plain']['wall_s']:.1f}", pictures, row["found"],
    ]
    return " | ".join(str(cell) for cell in cells)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("heliodon", type=Path)
    parser.add_argument("data", type=Path)
    parser.add_argument("--only", action="append", default=[])
    parser.add_argument("--modelled", action="append", default=["architecture"])
    parser.add_argument("--work", type=Path, default=Path("scans"))
    parser.add_argument("--probe", type=Path)
    parser.add_argument("--unscaled", action="store_true")
    parser.add_argument("--renderer", type=Path)
    arguments = parser.parse_args()
    failures = 0
    print(COLUMNS, flush=True)
    for mesh in meshes(arguments.data.resolve(), arguments.only):
        name = "-".join(mesh.relative_to(arguments.data.resolve()).parts)
        try:
            told = json.loads(Done([arguments.heliodon, "inspect", mesh, "--json", "-q"]).out)
        except Failed as refused:
            print(f"{mesh.stem} | refused: {refused}", flush=True)
            continue
        try:
            print(line(attempt(mesh, told, arguments.work.resolve() / name, arguments)), flush=True)
        except Failed as failed:
            failures += 1
            print(f"{mesh.stem} | failed: {failed}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
