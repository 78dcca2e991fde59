#!/usr/bin/env python3
"""Bad input, full disks, company and damage, seen for real: what `heliodon` makes of them, as a table.

    scripts/resume/hostile.py HELIODON [--only GROUP,...] [--big-mb 2000] [--temple TRIANGLES] [--growth 1.3] [--seed S] [--folder DIR] [--keep]

HELIODON is the program. Groups:

    big       a PLY of gigabytes, cut off at several places: told at once, and in little memory
    counts    headers that promise too much, too little, or no number at all
    shapes    odd geometry and odd rooms, prepared and baked
    limits    files that cannot grow (RLIMIT_FSIZE), from nothing to enough
    full      full disks below the cache, the bundle, both, and the folder of coloured meshes, from nothing to enough
    readonly  folders that can only be read, and disks that vanish while they are written
    flips     a byte flipped in every file of the cache in turn
    company   two runs at once, of every kind that may meet
    edits     site.toml and meshes that are edited between steps and while they run
    names     blanks, Unicode, links and very long names

`full` and `readonly` mount small file systems (tmpfs), for which one has to be root; without that they are left out, and the table says so. A
full disk must give exit code 1, one message that names a path, no bundle and nothing half-written; once there is room the same command must end
with the bundle of a run that nobody disturbed, byte for byte. Exit code 1 where anything in the table is FAULTY. Nothing stays behind, but with
--keep the folder of a failure.
"""

import argparse
import collections
import math
import os
import random
import resource
import shutil
import signal
import struct
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

sys.dont_write_bytecode = True
from trial import SMALL_SCREEN, Run, differences, make_temple, make_yard, mesh_ply, ply, probe, sheet, working_folder

# A refusal of a file of gigabytes takes no longer than this, and no more memory: a thousandth of reading it.
MOST_SECONDS, MOST_MB = 5.0, 200

THREE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
FACE = struct.pack("<B3i", 3, 0, 1, 2)


def big_ply(path, megabytes):
    """A regular PLY of about so many megabytes: one patch many times over."""
    side = 256
    places = b"".join(struct.pack("<3f", i % side * 0.01, 0.0, i // side * 0.01) for i in range(side * side))
    faces = bytearray()
    for row in range(side - 1):
        for first in range(row * side, row * side + side - 1):
            faces += struct.pack("<B3iB3i", 3, first, first + side, first + 1, 3, first + 1, first + side, first + side + 1)
    times = max(1, megabytes * 1000000 // (len(places) + len(faces)))
    with path.open("wb") as file:
        file.write(ply(side * side * times, 2 * (side - 1) ** 2 * times, b""))
        for part in (places, bytes(faces)):
            for _ in range(times):
                file.write(part)


class Hostile:
    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        self.program = os.path.abspath(options.heliodon)
        self.random = random.Random(options.seed)
        self.rows = []
        self.group = ""
        self.site = None
        self.mounted = []

    # -- telling ------------------------------------------------------------------------------------------------

    def row(self, case, what, run=None, fault=None):
        """One line of the table; `fault` says what is wrong."""
        cost = f"{run.seconds:6.2f} s {run.peak_mb:5} MB" if run else ""
        verdict = f"FAULTY: {fault}" if fault else "ok"
        self.rows.append((self.group, verdict))
        print(f"{self.group:9} {case:46} {cost:18} {verdict:4} {what}", flush=True)

    def refused(self, run, words=()):
        """What is wrong with a refusal, if anything."""
        if run.end() != 1:
            return f"exit code {run.code}: " + " / ".join(run.lines[-3:])
        messages = run.errors()
        if len(messages) != 1:
            return f"{len(messages)} messages: " + " / ".join(run.lines[-3:])
        if any("bug in heliodon" in line or "panicked" in line for line in run.lines):
            return "a panic: " + " / ".join(run.lines[-3:])
        missing = [word for word in words if word not in messages[0]]
        return f"{missing} not in: {messages[0]}" if missing else None

    # -- what is needed again and again ---------------------------------------------------------------------------

    def run(self, *arguments, **options):
        return Run(self.program, arguments, **options)

    def ran(self, *arguments, **options):
        run = self.run(*arguments, **options)
        run.end()
        return run

    def done(self, *arguments):
        run = self.ran(*arguments)
        if run.code != 0:
            raise SystemExit(f"{' '.join(map(str, arguments))} failed: " + "\n".join(run.lines))
        return run

    def usual(self):
        """The site that most groups use; its bundle is `whole`."""
        if self.site is None:
            self.site = self.folder / "site"
            if self.options.temple:
                make_temple(self.program, self.site, self.options.temple)
            else:
                make_yard(self.site)
            self.whole = self.folder / "whole"
            self.done("bake", self.site, "-o", self.whole, "--cache", self.folder / "first-cache")
            shutil.rmtree(self.folder / "first-cache")
        return self.site

    def clear(self):
        for leftover in ("bundle", ".heliodon"):
            shutil.rmtree(self.site / leftover, ignore_errors=True)

    def is_whole(self, bundle):
        """What is wrong with a bundle of the usual site, if anything."""
        if not bundle.exists():
            return "there is no bundle"
        differ = differences(bundle, self.whole)
        return f"the bundle differs in {', '.join(differ)}" if differ else None

    def half_written(self, *folders):
        """Names of what was begun and not ended."""
        endings = (".new", ".tmp", ".part", ".spool", ".old")
        paths = [path for folder in folders if folder.exists() for path in folder.rglob("*")]
        return [str(path) for path in paths if path.name.endswith(endings) or path.name.startswith(".heliodon-")]

    def small_site(self, name, content, more="", ending="ply"):
        """A site of one mesh under a grey sky."""
        site = self.folder / name
        site.mkdir(parents=True, exist_ok=True)
        (site / f"mesh.{ending}").write_bytes(content)
        (site / "grey.hdr").write_bytes(probe(32, 16, lambda x, y: (128, 128, 128, 129)))
        (site / "site.toml").write_text(
            '[site]\nname = "a small one"\n'
            f'[[part]]\nfile = "mesh.{ending}"\nrole = "scan"\nalbedo = [0.5, 0.5, 0.5]\n'
            f'[sky]\nprobes = "grey.hdr"\nmapping = "lat-long"\n[bake]\nbounces = 2\nsamples = 16\n{more}'
        )
        return site

    @contextmanager
    def disk(self, name, size):
        """A small disk, with a function that gives it room; it goes at the end."""
        place = self.folder / name
        place.mkdir(exist_ok=True)
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", place], check=True)
        self.mounted.append(place)
        try:
            yield place, lambda how: subprocess.run(["mount", "-o", f"remount,{how}", place], check=True)
        finally:
            self.mounted.remove(place)
            subprocess.run(["umount", "-l", place], check=True)
            place.rmdir()

    def sizes(self, first):
        """Sizes that grow by the factor that is asked for, to a gigabyte."""
        steps = int(math.log((1 << 30) / first, self.options.growth))
        return [int(first * self.options.growth**step) for step in range(steps)]

    def may_mount(self):
        if os.geteuid() == 0:
            return True
        self.row("all of it", "left out: only root may mount file systems")
        return False

    # -- the groups -----------------------------------------------------------------------------------------------

    def big(self):
        whole = self.folder / "big.ply"
        big_ply(whole, self.options.big_mb)
        site = self.small_site("cut", b"", SMALL_SCREEN + '[[room]]\nname = "r"\nmin = [0.5, 0.5, 0.5]\nmax = [1.0, 1.0, 1.0]\n')
        cut = site / "mesh.ply"
        bytes_of_whole = whole.stat().st_size
        cut.unlink()
        whole.rename(cut)
        # each cut is shorter than the one before, so that one file does for all
        for part in (0.999, 0.7, 0.4, 0.1, 0.0):
            os.truncate(cut, max(300, int(bytes_of_whole * part)))
            for command in ("inspect", "check", "prepare", "bake"):
                run = self.ran(command, cut if command == "inspect" else site)
                fault = self.refused(run, ["mesh.ply", "promises"])
                if not fault and run.peak_mb > MOST_MB:
                    fault = f"{run.peak_mb} MB"
                if not fault and command == "inspect" and run.seconds > MOST_SECONDS:
                    fault = f"{run.seconds:.1f} s"
                self.row(f"{part:.1%} of {bytes_of_whole >> 20} MiB, {command}", "".join(run.errors())[-90:], run, fault)
        shutil.rmtree(site)

    def counts(self):
        cases = {
            "more vertices than bytes": (ply(3000000000, 1, THREE + FACE), ["promises"]),
            "2^64 - 1 vertices": (ply(2**64 - 1, 1, THREE + FACE), ["number of elements"]),
            "2^64 vertices": (ply(2**64, 1, THREE + FACE), ["number of elements"]),
            "vertices whose bytes overflow 2^64": (ply(2**62 // 3, 1, THREE + FACE), []),
            "minus three vertices": (ply(-3, 1, THREE + FACE), ["line 3"]),
            "minus one face": (ply(3, -1, THREE + FACE), ["line 7"]),
            "more faces than bytes": (ply(3, 1000, THREE + FACE * 5), ["promises 1000"]),
            "too few vertices": (ply(2, 1, THREE + FACE), ["counts are wrong"]),
            "an index out of range": (ply(3, 1, THREE + struct.pack("<B3i", 3, 0, 1, 3)), ["face 0", "vertex 3"]),
            "an index below zero": (ply(3, 1, THREE + struct.pack("<B3i", 3, 0, 1, -1)), ["face 0"]),
            "endless rows of nothing": (ply(0, 0, b"", "element a 999999999999999999\n"), ["no vertices"]),
            "no vertices": (ply(0, 0, b""), ["no vertices"]),
            "no faces": (ply(3, 0, THREE), ["without faces"]),
            "nothing at all": (b"", ["ply"]),
        }
        for name, (content, words) in cases.items():
            for more in ("", SMALL_SCREEN):
                site = self.small_site("counts", content, more)
                for command in ("check", "prepare", "bake"):
                    run = self.ran(command, site)
                    fault = self.refused(run, ["mesh.ply", *words])
                    if fault or (command, more) == ("bake", SMALL_SCREEN):
                        self.row(f"{name}, {command}", "".join(run.errors())[-90:], run, fault)
                shutil.rmtree(site)
        site = self.small_site("few", ply(3, 1, THREE + FACE * 4))
        run = self.ran("bake", site)
        told = [line for line in run.lines if "not read" in line]
        self.row("too few faces, bake", "".join(told)[-90:], run, None if run.code == 0 and told else "not told")
        shutil.rmtree(site)

    def shapes(self):
        grid, cells = sheet(8, lambda x: 0.0)

        def with_place(value):
            return [value if i == 40 else place for i, place in enumerate(grid)]

        box = [(x, y, z) for z in (0.0, -1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
        sides = [(0, 1, 3, 2), (5, 4, 6, 7), (1, 5, 7, 3), (4, 0, 2, 6), (2, 3, 7, 6), (4, 5, 1, 0)]
        solid = mesh_ply(box, [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])
        plane = mesh_ply(grid, cells)
        room = '[[room]]\nname = "r"\nmin = {}\nmax = {}\n'
        above = room.format("[0.3, 0.5, -0.7]", "[0.7, 0.8, -0.3]")
        nan, inf = float("nan"), float("inf")
        strip = mesh_ply([(float(i), 0.0, 0.0) for i in range(9)], [(i, i + 1, i + 2) for i in range(7)])
        # name, mesh, rooms, words that a warning or the message has; nothing: it is baked without a word
        cases = [
            ("a vertex that is not a number", mesh_ply(with_place((nan, 0, 0)), cells), above, "left out"),
            ("an infinite vertex", mesh_ply(with_place((inf, 0, 0)), cells), above, "left out"),
            ("a vertex at 1e30", mesh_ply(with_place((1e30, 0, 0)), cells), above, "mesh.ply"),
            ("all of it a light year away", mesh_ply([(x + 1e16, y, z) for x, y, z in grid], cells), above, "mesh.ply"),
            ("all not numbers", mesh_ply([(nan, nan, nan)] * 81, cells), above, "mesh.ply"),
            ("one strip without area", strip, above, "without area"),
            ("one triangle", mesh_ply([(0, 0, 0), (0, 0, 1), (1, 0, 0)], [(0, 1, 2)]), above, ""),
            ("one triangle thrice the same vertex", mesh_ply([(0, 0, 0), (0, 0, 1), (1, 0, 0)], [(0, 0, 0)]), above, "three different"),
            ("a room that reaches into a wall", solid, room.format("[0.2, 0.7, -0.8]", "[0.8, 1.5, -0.2]"), "of its box"),
            ("a room wholly inside a solid", solid, room.format("[0.3, 0.3, -0.7]", "[0.7, 0.7, -0.3]"), "in stone"),
            ("a room that sees nothing", plane, room.format("[0.3, 0.5, -0.7]", "[0.7, 0.8, -0.3]")
             + "windows = [[[0.3, 0.9, -0.3], [0.7, 0.9, -0.3], [0.3, 0.9, -0.7]]]\n", "sees nothing"),
            ("a room of no size", plane, room.format("[0.5, 0.5, -0.5]", "[0.5, 0.5, -0.5]"), "site.toml"),
            ("a room turned inside out", plane, room.format("[0.7, 0.8, -0.3]", "[0.3, 0.5, -0.7]"), "site.toml"),
            ("a room that is not a number", plane, room.format("[nan, 0.5, 0.5]", "[1.0, 0.8, 1.0]"), "site.toml"),
            ("a window without area", plane, above + "windows = [[[1, 1, 1], [1, 1, 1], [1, 1, 1]]]\n", "window"),
            ("a window a kilometre away", plane, above + "windows = [[[1000, 1, 1], [1000, 1, 2], [1000, 2, 1]]]\n", "sees nothing"),
        ]
        for name, content, rooms, word in cases:
            for command, more in (("bake", ""), ("prepare", SMALL_SCREEN), ("bake", SMALL_SCREEN)):
                site = self.small_site("shapes", content, more + rooms)
                run = self.ran(command, site)
                fault = self.refused(run, [word]) if run.code == 1 else None
                if run.code not in (0, 1):
                    fault = f"exit code {run.code}: " + " / ".join(run.lines[-3:])
                # what rooms see means nothing to a bake that is not prepared, and nothing is cleaned then
                asked = more or not any(word in name for word in ("sees nothing", "window", "area"))
                if run.code == 0 and word and asked and not any(word in line for line in run.lines):
                    fault = f"not told: {word}"
                if run.code == 1 and not asked:
                    fault = None if len(run.errors()) == 1 and any(file in run.errors()[0] for file in ("mesh.ply", "site.toml")) else "the message names no file"
                warned = [line for line in run.lines if line.startswith(("warning:", "error:"))]
                if command == "bake" or fault:
                    self.row(f"{name}, {command}{' prepared' if more else ''}", "".join(warned[:1])[-90:], run, fault)
                shutil.rmtree(site)

    def until_there_is_room(self, name, sizes, attempt, spoilt, finish):
        """Tries every size in turn, until one is enough; a line for each stage that was hit. `attempt` runs the program; `spoilt` says what is
        wrong after a failure; `finish` makes room, runs it again and says what is wrong then."""
        hit = collections.Counter()
        for size in sizes:
            run = attempt(size)
            if run.end() == 0:
                break
            fault = self.refused(run) or ("no path in it" if "/" not in "".join(run.errors()) else None) or spoilt() or finish()
            hit[run.stage()] += 1
            if fault:
                self.row(f"{name}, {size >> 10} KiB, {run.stage()}", "".join(run.errors())[-110:], run, fault)
        for stage, count in sorted(hit.items()):
            self.row(f"{name}: {stage}", f"{count} times")

    def limits(self):
        site = self.usual()
        sizes = self.sizes(512)

        def limited(size):
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        for command in (["bake"], ["prepare", "-o", self.folder / "found"], ["bake", "--shard", "1/1"]):
            def attempt(size):
                self.clear()
                shutil.rmtree(self.folder / "found", ignore_errors=True)
                return self.ran(command[0], site, *command[1:], preexec_fn=lambda: limited(size))

            def spoilt():
                half = self.half_written(site, self.folder / "found")
                return f"left behind: {half}" if half else ("a bundle" if (site / "bundle").exists() else None)

            def finish():
                run = self.ran("bake", site)
                return self.is_whole(site / "bundle") if run.code == 0 else "not resumed: " + run.lines[-1]

            self.until_there_is_room(" ".join(map(str, command[:2])), sizes, attempt, spoilt, finish)

    def full(self):
        if not self.may_mount():
            return
        site = self.usual()
        sizes = self.sizes(16384)
        for what in ("the cache", "the bundle", "both", "coloured meshes", "a shard's cache", "the merge"):
            for size in sizes:
                with self.disk("disk", size) as (disk, change):
                    self.clear()
                    shutil.rmtree(self.folder / "cache", ignore_errors=True)
                    cache = disk / "cache" if what in ("the cache", "both", "a shard's cache") else self.folder / "cache"
                    bundle = disk / "bundle" if what in ("the bundle", "both", "the merge") else site / "bundle"
                    places = ["-o", bundle, "--cache", cache]
                    found = disk / "found"
                    commands = [["bake", site, *places]]
                    if what == "coloured meshes":
                        commands = [["prepare", site, "-o", found, "--cache", cache], *commands]
                    if what == "a shard's cache":
                        commands = [["bake", site, *places, "--shard", "1/1"], ["merge", site, *places]]
                    if what == "the merge":
                        self.done("bake", site, *places, "--shard", "1/1")
                        commands = [["merge", site, *places]]
                    run = self.ran(*commands[0])
                    failed = run.code != 0
                    fault = None
                    if failed:
                        half = self.half_written(disk, cache, bundle.parent)
                        fault = self.refused(run) or (f"left behind: {half}" if half else None)
                        if not fault and bundle.exists():
                            fault = "there is a bundle"
                        if not fault and str(disk) not in run.errors()[0]:
                            fault = "the message names no place: " + run.errors()[0]
                        change("size=1g")
                        for command in commands:
                            again = self.ran(*command)
                            fault = fault or (None if again.code == 0 else "not resumed: " + again.lines[-1])
                        fault = fault or self.is_whole(bundle)
                        error = run.errors()[0].replace(str(self.folder), "") if run.errors() else ""
                        self.row(f"{what}, {size >> 10} KiB: {run.stage()}", error[:100], run, fault)
                if not failed:
                    break
            shutil.rmtree(self.folder / "cache", ignore_errors=True)

    def readonly(self):
        if not self.may_mount():
            return
        site = self.usual()
        for what in ("the cache", "the bundle", "coloured meshes"):
            self.clear()
            with self.disk("disk", "1g") as (disk, change):
                change("ro")
                cache = disk / "cache" if what == "the cache" else site / ".heliodon/cache"
                command = ["prepare", site, "-o", disk / "found"] if what == "coloured meshes" else ["bake", site]
                bundle = ["-o", disk / "bundle"] if what == "the bundle" else []
                run = self.ran(*command, *bundle, "--cache", cache)
                self.row(f"{what} can only be read", "".join(run.errors())[-90:], run, self.refused(run, [str(disk)]))
        alone = self.done("bake", site, "--cache", self.folder / "other", "-o", self.folder / "again")
        shutil.rmtree(self.folder / "other")
        shutil.rmtree(self.folder / "again")
        for part in [i / 10 for i in range(10)]:
            for how in ("ro", "gone"):
                self.clear()
                with self.disk("disk", "1g") as (disk, change):
                    run = self.run("bake", site, "--cache", disk / "cache")
                    lines = round(part * len(alone.lines))
                    while run.is_running() and len(run.lines) < lines:
                        time.sleep(0.001)
                    if how == "ro":
                        # what is open for writing keeps it writable: tried until it can be taken
                        for _ in range(200):
                            if subprocess.run(["mount", "-o", "remount,ro", disk], capture_output=True).returncode == 0:
                                break
                            time.sleep(0.005)
                    else:
                        subprocess.run(["umount", "-l", disk], check=True)
                        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1g,ro", "tmpfs", disk], check=True)
                    fault = (None if run.end() == 0 else self.refused(run, [str(disk)]))
                    fault = fault or (self.is_whole(site / "bundle") if run.code == 0 else None)
                    if run.code != 0 and (site / "bundle").exists():
                        fault = fault or "there is a bundle"
                    stage = run.stage()
                    again = self.ran("bake", site)
                    fault = fault or (self.is_whole(site / "bundle") if again.code == 0 else "not resumed")
                    self.row(f"the cache {how} {stage}", "".join(run.errors())[-90:], run, fault)

    def flip(self, path):
        content = bytearray(path.read_bytes())
        if content:
            content[self.random.randrange(len(content))] ^= 1 << self.random.randrange(8)
            path.write_bytes(content)
        return bool(content)

    def flips(self):
        site = self.usual()
        kept = self.folder / "kept"
        done = self.folder / "done"
        made = {"bake": [["bake", site]], "merge": [["bake", site, "--shard", "1/2"], ["bake", site, "--shard", "2/2"]]}
        made["pieces"] = None
        for name, commands in made.items():
            self.clear()
            shutil.rmtree(kept, ignore_errors=True)
            if commands:
                for command in commands:
                    self.done(*command)
                shutil.rmtree(site / "bundle", ignore_errors=True)
                shutil.copytree(site / ".heliodon", kept)
            else:
                self.catch_pieces(kept)
            files = sorted(path.relative_to(kept) for path in kept.rglob("*") if path.is_file())
            kinds = collections.Counter()
            worst = None
            for file in files:
                self.clear()
                shutil.copytree(kept, site / ".heliodon")
                if not self.flip(site / ".heliodon" / file):
                    continue
                run = self.ran("merge" if name == "merge" else "bake", site)
                told = any("damaged" in line or "missing" in line for line in run.lines)
                if name == "merge" and run.code == 1 and file.name in ("plan.json", "blocks.json"):
                    # what shards write down, and write anew: the message says to run them again
                    fault = self.refused(run, ["--shard"])
                    for shard in ("1/2", "2/2"):
                        self.done("bake", site, "--shard", shard)
                    run = self.ran("merge", site)
                else:
                    fault = None
                fault = fault or (self.is_whole(site / "bundle") if run.code == 0 else "not redone: " + run.lines[-1])
                kinds[(file.name.rstrip("0123456789").rstrip("-"), told)] += 1
                if fault:
                    self.row(f"{name}: {file.name}", "", run, fault)
                worst = run if worst is None or run.seconds > worst.seconds else worst
            for (kind, told), count in sorted(kinds.items()):
                self.row(f"{name}: {kind}", f"{count} files, {'told' if told else 'without a word'}")
        shutil.rmtree(kept, ignore_errors=True)
        shutil.rmtree(done, ignore_errors=True)

    def catch_pieces(self, kept):
        """A cache as a kill late in preparation leaves it."""
        site = self.usual()
        for _ in range(20):
            self.clear()
            run = self.run("prepare", site)
            while run.is_running() and not list((site / ".heliodon").rglob("piece-purge-index*")):
                time.sleep(0.001)
            run.process.kill()
            if run.end() < 0:
                shutil.copytree(site / ".heliodon", kept)
                return
        raise SystemExit("no kill met preparation in time")

    def company(self):
        site = self.usual()
        found = self.folder / "found"
        prepared = ["prepare", site]
        shards = [["bake", site, "--shard", f"{i}/2"] for i in (1, 2)]
        pairs = {
            "bake, bake": (["bake", site], ["bake", site]),
            "prepare, prepare": (prepared, prepared),
            "prepare, bake": (prepared, ["bake", site]),
            "bake, prepare": (["bake", site], prepared),
            "prepare, prepare -o": (prepared, ["prepare", site, "-o", found]),
            "shard, its like": (shards[0], shards[0]),
            "shard, shard": (shards[0], shards[1]),
            "shard, bake": (shards[0], ["bake", site]),
            "bake, shard": (["bake", site], shards[0]),
            "merge, shard": (["merge", site], shards[0]),
            "shard, merge": (shards[0], ["merge", site]),
            "merge, merge": (["merge", site], ["merge", site]),
            "bake, another's settings": (["bake", site], ["bake", self.folder / "edited", "-o", site / "bundle"]),
        }
        shutil.copytree(site, self.folder / "edited", ignore=shutil.ignore_patterns("bundle", ".heliodon"))
        toml = self.folder / "edited/site.toml"
        toml.write_text(toml.read_text().replace("samples = 32", "samples = 33").replace("edge_px = 20.0", "edge_px = 21.0"))
        for name, commands in pairs.items():
            for wait in (0.0, 0.3, self.random.random() * 3.0):
                self.clear()
                shutil.rmtree(found, ignore_errors=True)
                if "merge" in name:
                    for shard in shards:
                        self.done(*shard)
                    if "merge, merge" not in name:
                        gathers = sorted((site / ".heliodon").rglob("gather-*"))
                        gathers[0].unlink()
                runs = [self.run(*commands[0])]
                time.sleep(wait)
                runs.append(self.run(*commands[1]))
                codes = [run.end() for run in runs]
                fault = None
                for run in runs:
                    if run.code != 0:
                        fault = fault or self.refused(run)
                        text = "".join(run.errors())
                        if not any(word in text for word in ("another bake", "another process", "--shard", "missing")):
                            fault = fault or f"not of the company: {text}"
                if not any(code == 0 for code in codes):
                    fault = fault or "neither came through"
                told = [line for run in runs for line in run.lines if "waiting for" in line or line.startswith("error:")]
                self.ran("bake", site, *(["--again"] if "settings" in name else []))
                fault = fault or self.is_whole(site / "bundle")
                half = self.half_written(site, found)
                fault = fault or (f"left behind: {half}" if half else None)
                self.row(f"{name}, {wait:.1f} s apart: {codes[0]} and {codes[1]}", "".join(told[:1])[:90], runs[1], fault)
        shutil.rmtree(self.folder / "edited")

    def edits(self):
        site = self.usual()
        toml = site / "site.toml"
        text = toml.read_text()
        meshes = sorted(path for path in site.rglob("*.ply") if "bundle" not in path.parts and ".heliodon" not in path.parts)
        mesh = max(meshes, key=lambda path: path.stat().st_size)
        good = mesh.read_bytes()
        bad = bytearray(good)
        at = good.index(b"end_header\n") + len(b"end_header\n")
        bad[at : at + 4] = struct.pack("<f", struct.unpack("<f", good[at : at + 4])[0] + 0.001)

        self.clear()
        self.done("bake", site, "--shard", "1/2")
        toml.write_text(text.replace("samples = 32", "samples = 33"))
        self.done("bake", site, "--shard", "2/2")
        run = self.ran("merge", site)
        fault = self.refused(run, ["bake.samples"])
        toml.write_text(text)
        middle = self.ran("merge", site)
        fault = fault or self.refused(middle, ["2/2"])
        self.done("bake", site, "--shard", "2/2")
        self.done("merge", site)
        self.row("site.toml edited between shards", "".join(run.errors())[-90:], run, fault or self.is_whole(site / "bundle"))

        self.clear()
        self.done("prepare", site)
        mesh.write_bytes(bad)
        other = self.done("bake", site)
        fault = None if self.is_whole(site / "bundle") else "the edit of the mesh has no effect"
        if any("geometry is prepared" in line for line in other.lines):
            fault = fault or "the geometry of another file is taken"
        mesh.write_bytes(good)
        self.done("bake", site)
        self.row("a mesh edited between prepare and bake", "", other, fault or self.is_whole(site / "bundle"))

        alone = self.done("bake", site, "--again")
        for how in ("in place", "by a rename"):
            for part in [i / 12 for i in range(12)]:
                self.clear()
                run = self.run("bake", site)
                while run.is_running() and time.monotonic() - run.begun < part * alone.seconds * 0.6:
                    time.sleep(0.001)
                if how == "in place":
                    mesh.write_bytes(bad)
                else:
                    beside = mesh.with_name("beside.tmp-mesh")
                    beside.write_bytes(bad)
                    beside.rename(mesh)
                fault = self.refused(run, [mesh.name]) if run.end() != 0 else None
                stage = run.stage()
                code = run.code
                # whatever was read: with the old file back, the old bundle must come of it
                mesh.write_bytes(good)
                again = self.ran("bake", site)
                fault = fault or (self.is_whole(site / "bundle") if again.code == 0 else "not resumed: " + again.lines[-1])
                told = "".join(run.errors())[-90:] if code else "baked as it was hashed"
                self.row(f"a mesh edited {how} after {part * alone.seconds * 0.6:.1f} s", told, run, fault)

    def names(self):
        plane = ply(4, 2, struct.pack("<12f", 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0, 1) + struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 2, 1, 3))
        room = SMALL_SCREEN + '[[room]]\nname = "r"\nmin = [0.4, 0.5, 0.4]\nmax = [0.6, 0.7, 0.6]\n'
        for name in ("a b  c", "Ναός του Ηφαίστου", "寺院 🏛", "it's \"quoted\" $HOME `ls` %a", "-o", "n" * 200, "tab\tand\nnewline"):
            site = self.small_site(os.path.join("names", name), plane, room)
            file = f"{name[:200]}.ply"
            (site / "mesh.ply").rename(site / file)
            toml = (site / "site.toml").read_text().split("\n")
            quoted = file.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t").replace("\n", "\\n")
            toml = [f'file = "{quoted}"' if line.startswith("file = ") else line for line in toml]
            (site / "site.toml").write_text("\n".join(toml))
            runs = [self.ran("prepare", "-o", site / "found", "--", site), self.ran("bake", "--shard", "1/1", "--", site)]
            runs += [self.ran("merge", "--", site), self.ran("inspect", "--", site / "bundle")]
            failed = [run for run in runs if run.code != 0]
            self.row(repr(name[:30]), "", runs[1], " / ".join(failed[0].lines[-2:]) if failed else None)
        site = self.small_site("names/linked", plane, room)
        (site / "mesh.ply").rename(site / "real.ply")
        (site / "mesh.ply").symlink_to("real.ply")
        (self.folder / "names/by-link").symlink_to(site)
        runs = [self.ran("bake", site), self.ran("bake", self.folder / "names/by-link")]
        fault = "".join(runs[0].errors() + runs[1].errors()) or None
        up_to_date = any("up to date" in line for line in runs[1].lines)
        self.row("links to the mesh and to the site", "", runs[0], fault or (None if up_to_date else "baked twice"))
        (site / "real.ply").unlink()
        run = self.ran("bake", site)
        self.row("a link to nothing", "".join(run.errors())[-90:], run, self.refused(run, ["mesh.ply"]))
        (site / "mesh.ply").unlink()
        (site / "mesh.ply").symlink_to("mesh.ply")
        run = self.ran("bake", site)
        self.row("a link to itself", "".join(run.errors())[-90:], run, self.refused(run, ["mesh.ply"]))
        shutil.rmtree(self.folder / "names")


GROUPS = ["big", "counts", "shapes", "limits", "full", "readonly", "flips", "company", "edits", "names"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("heliodon", type=Path)
    parser.add_argument("--only", default=",".join(GROUPS), help="groups, with commas between")
    parser.add_argument("--big-mb", type=int, default=2000)
    parser.add_argument("--temple", type=int, metavar="TRIANGLES", help="a temple in place of the small site")
    parser.add_argument("--growth", type=float, default=1.3, help="from one size of a disk to the next")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--folder", type=Path, help="where all is made; it must not be there yet")
    parser.add_argument("--keep", action="store_true", help="keep the folder where something fails, to look at it")
    options = parser.parse_args()
    wanted = options.only.split(",")
    if unknown := set(wanted) - set(GROUPS):
        parser.error(f"no such group: {', '.join(unknown)}; there are {', '.join(GROUPS)}")
    with working_folder(options.folder, "hostile-", options.keep) as folder:
        hostile = Hostile(options, folder)
        print(f"seed {options.seed}, in {folder}", flush=True)
        for name in wanted:
            hostile.group = name
            getattr(hostile, name)()
        faulty = sum(verdict != "ok" for _, verdict in hostile.rows)
        print(f"{len(hostile.rows)} lines, {faulty} of them faulty", flush=True)
        if faulty:
            sys.exit(1)


if __name__ == "__main__":
    main()
