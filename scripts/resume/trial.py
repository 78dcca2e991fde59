"""What the scripts of this folder share: a small temple to bake, runs of the program, and folders compared."""

import filecmp
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import contextmanager, suppress
from pathlib import Path

SETTINGS = """
[prepare]
error_px = 2.0
edge_px = 20.0
[display]
width_px = 512
height_px = 384
"""
SMALL_SCREEN = SETTINGS.replace("512", "128").replace("384", "96")

# What is to be killed where the script itself ends early.
RUNNING = set()


class Run:
    """A run of the program: its lines of progress, how long it took, and the most memory that it needed."""

    def __init__(self, program, arguments, **options):
        self.lines = []
        self.begun = time.monotonic()
        self.code = None
        command = [str(word) for word in (program, *arguments)]
        self.process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace", **options
        )
        RUNNING.add(self)
        self.reader = threading.Thread(target=self.read)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def is_running(self):
        """Whether it still runs."""
        if self.code is None:
            pid, status, usage = os.wait4(self.process.pid, os.WNOHANG)
            if pid:
                self.ended(status, usage)
        return self.code is None

    def ended(self, status, usage):
        self.code = self.process.returncode = os.waitstatus_to_exitcode(status)
        self.peak_mb = usage.ru_maxrss // 1024
        self.seconds = time.monotonic() - self.begun
        RUNNING.discard(self)

    def kill_after(self, seconds=None, lines=None, then=0.0):
        """Kills it after a time, or after some lines and a time; whether it was still running."""
        while self.is_running():
            if seconds is not None and time.monotonic() - self.begun >= seconds:
                break
            if lines is not None and len(self.lines) >= lines:
                time.sleep(then)
                break
            time.sleep(0.001)
        if self.is_running():
            self.process.kill()
        return self.end() < 0

    def end(self):
        """Waits for its end; the exit code, negative where a signal ended it."""
        if self.code is None:
            _, status, usage = os.wait4(self.process.pid, 0)
            self.ended(status, usage)
        self.reader.join()
        self.process.stderr.close()
        return self.code

    def errors(self):
        """Its messages."""
        return [line for line in self.lines if line.startswith("error:")]

    def stage(self):
        """Where it was, from its last line that is no message."""
        lines = [line for line in self.lines if line and not line.startswith(("error:", "warning:"))]
        if not lines:
            return "before the first line"
        begun = re.match(r"(.*) \.\.\.$", lines[-1])
        percent = re.match(r"(.*): \d+ %", lines[-1])
        ended = re.match(r"(.*?)( \([\d,]+\))?: [\d.]+ \w+$", lines[-1])
        if begun or percent:
            return "in " + (begun or percent).group(1)
        return "after " + ended.group(1) if ended else "after: " + lines[-1].split(":")[0]


def make_temple(program, site, triangles, more=SETTINGS, shown=False):
    """A site whose stages all have something to do, and little of it; with `shown`, also those of texels, of a panorama and of the scan itself."""
    made = Run(program, ["new", site, "--template", "temple", "--triangles", triangles])
    if made.end() != 0:
        raise SystemExit("new failed: " + "\n".join(made.lines))
    path = site / "site.toml"
    text = path.read_text().replace("samples = 128 ", "samples = 32\nsun_steps = 3\nsky_steps = 3\nbounces = 2 ")
    text = text.replace('transfer = "rgb"', 'transfer = "mono"').replace("atmosphere", "hosek-wilkie", 1) + more
    if shown:
        text = text.replace("samples = 32", "samples = 32\ntexels = 128").replace("[prepare]\n", "[prepare]\nscan = true\npanorama = 64\n")
        text = text.replace("[[part]]\n", '[[part]]\nlight = "texel"\n', 1)
    path.write_text(text)


def ply(vertices, faces, data, before=""):
    """A binary PLY whose header says what it likes."""
    places = "property float x\nproperty float y\nproperty float z\n"
    corners = "property list uchar int vertex_indices\n"
    head = f"ply\nformat binary_little_endian 1.0\n{before}element vertex {vertices}\n{places}element face {faces}\n{corners}end_header\n"
    return head.encode() + data


def mesh_ply(places, faces):
    """A PLY of a mesh."""
    data = b"".join(struct.pack("<3f", *place) for place in places)
    return ply(len(places), len(faces), data + b"".join(struct.pack("<B3i", 3, *face) for face in faces))


def sheet(cells, height):
    """A sheet of a metre: places, whose heights `height` tells, and triangles with their fronts up."""
    side = cells + 1
    places = [(x / cells, height(x / cells), -z / cells) for z in range(side) for x in range(side)]
    firsts = [z * side + x for z in range(cells) for x in range(cells)]
    return places, [face for a in firsts for face in ((a, a + 1, a + side + 1), (a, a + side + 1, a + side))]


def probe(width, height, pixel):
    """A Radiance image of `pixel(x, y)`, four bytes each."""
    pixels = b"".join(bytes(pixel(x, y)) for y in range(height) for x in range(width))
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + pixels


def make_yard(site):
    """A small site whose stages all have something to do, from skies of images to an actor, texels, a panorama and the scan itself: baked in a second or two."""
    (site / "sky").mkdir(parents=True)
    (site / "waves.ply").write_bytes(mesh_ply(*sheet(40, lambda x: 0.2 * abs(x * 10 % 1 - 0.5))))
    (site / "floor.ply").write_bytes(mesh_ply(*sheet(4, lambda x: -0.1)))
    for number, hour in enumerate((9, 15)):
        sun = lambda x, y: (200, 200, 200, 140) if x == 32 * number + 16 and y == 8 else (100, 120, 140, 128)
        (site / f"sky/{hour:02}-00.hdr").write_bytes(probe(64, 32, sun))
    (site / "site.toml").write_text("""[site]
name = "yard"
[[part]]
file = "waves.ply"
[[part]]
file = "floor.ply"
light = "texel"
role = "ground"
scale = 4.0
translate = [-1.5, 0.0, 1.5]
[[room]]
name = "above"
min = [0.2, 0.3, -0.8]
max = [0.8, 0.6, -0.2]
[[actor]]
file = "waves.ply"
place = [0.5, 0.4, -0.5]
scale = 0.1
ground = "ignore"
[sky]
probes = "sky/*.hdr"
mapping = "lat-long"
[bake]
sun_steps = 2
sky_steps = 2
bounces = 2
samples = 32
texels = 64
grid_m = 0.2
""" + SMALL_SCREEN.replace("[prepare]\n", "[prepare]\nscan = true\npanorama = 64\n"))


def differences(a, b):
    """Names of files that one of two folders lacks or that differ."""
    names = [{path.relative_to(folder) for path in folder.rglob("*") if path.is_file()} for folder in (a, b)]
    differ = {name for name in names[0] & names[1] if not filecmp.cmp(a / name, b / name, shallow=False)}
    return sorted(map(str, names[0] ^ names[1] | differ))


@contextmanager
def working_folder(wanted, prefix, keep):
    """A folder to work in, `wanted` or a new one; it goes at the end, however that comes, but stays with `keep` where something failed."""
    if wanted:
        wanted.mkdir(parents=True)
    folder = wanted or Path(tempfile.mkdtemp(prefix=prefix))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit("terminated"))
    try:
        yield folder
    except BaseException:
        for run in list(RUNNING):
            # the signal that ends us may have come right after its end was heard of
            with suppress(ChildProcessError):
                run.process.kill()
                run.end()
        if keep:
            print(f"the folder is kept: {folder}", flush=True)
        else:
            shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder)
