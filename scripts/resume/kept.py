#!/usr/bin/env python3
"""Tells what a kill of `heliodon bake` loses at bad moments: when nothing has been kept for long.

    scripts/resume/kept.py HELIODON [--triangles N] [--kills 8] [--folder DIR] [--site DIR]

HELIODON is the program. A temple (or the site of --site, which is baked where it lies) is baked, prepared on the way, and the times are noted at which
something new lies in the cache. Then it is baked again from nothing, and killed whenever nothing has been kept for so long as only in the --kills
longest waits of the first run, once in each. What a kill has lost shows at the next step that both runs have kept: how much later it was there, the
killed runs' times included. The bundle has to be the same byte for byte.
"""

import argparse
import os
import re
import shutil
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True
from trial import Run, differences, make_temple, working_folder

# How often the cache is looked at, in seconds.
LOOK = 0.1


# What is kept within steps, which depends on the time.
WITHIN = re.compile(r"(piece|part)-.*(united|simplifying|measured|nearest|tiles)-\d+")
# What is written over each time that it is kept.
OVER = re.compile(r"bounces-.*-\d+")
# What is kept in several files is there with the last of them.
PARTLY = re.compile(r"(piece|part|scene)-.*(?<!index)-\d+")


def is_step(name):
    """Whether a file of the cache keeps what every run keeps."""
    return re.search(r"-\d+$", name) and not PARTLY.fullmatch(name) and not OVER.fullmatch(name)


def told_apart(folder, name):
    """What is kept under a name, told apart from what was there before."""
    try:
        return f"{name}@{os.stat(os.path.join(folder, name)).st_mtime_ns}" if OVER.fullmatch(name) else name
    except FileNotFoundError:
        return name


class Watched(Run):
    """A bake whose cache is watched."""

    def __init__(self, program, site, seen):
        self.cache, self.seen = site / ".heliodon", seen
        # when something was kept, under what name, and where the bake was
        self.kept = []
        super().__init__(program, ["bake", site])

    def now(self):
        return time.monotonic() - self.begun

    def look(self):
        """Notes what is there that was not."""
        for folder, _, names in os.walk(self.cache):
            for name in {told_apart(folder, name) for name in names} - self.seen:
                if is_step(name) or WITHIN.fullmatch(name) or "@" in name:
                    self.seen.add(name)
                    self.kept.append((self.now(), name, self.stage()))

    def to_end(self, patience=float("inf"), from_start=False):
        """Runs until its end, or kills it where nothing has been kept for so long; whether it was killed. The wait of a run that goes on begins with what it keeps first."""
        while self.is_running():
            self.look()
            since = self.kept[-1][0] if self.kept else 0.0
            if (self.kept or from_start) and self.now() - since > patience:
                self.process.kill()
                self.end()
                return True
            time.sleep(LOOK)
        if self.end() != 0:
            sys.exit("bake failed: " + "\n".join(self.lines))
        self.look()
        return False


def waits(run):
    """The times in which nothing was kept, the longest first: seconds, and where the bake was at their ends."""
    times = [(0.0, "", ""), *run.kept, (run.seconds, "", run.stage())]
    return sorted(((b[0] - a[0], f"{b[2]} (until {b[1] or 'the end'})") for a, b in zip(times, times[1:])), reverse=True)


def killed(program, site, first, patience, most):
    """A bake from nothing that is killed at every such wait, up to so often; for each kill, what it lost and where."""
    steps = {name: at for at, name, _ in first.kept if is_step(name)}
    seen, before, lost, told = set(), 0.0, 0.0, 0
    while True:
        run = Watched(program, site, seen)
        was_killed = run.to_end(patience if told < most else float("inf"), from_start=told == 0)
        known = [(at, name) for at, name, _ in run.kept if name in steps]
        if told and known:
            at, name = known[0]
            late = before + at - steps[name]
            print(f"   lost {late - lost:.1f} s (known by {name})", flush=True)
            lost = late
        if not was_killed:
            print(f"{told} kills, {before + run.seconds:.1f} s beside {first.seconds:.1f}", flush=True)
            return
        told += 1
        before += run.seconds
        print(f"killed after {run.seconds:.1f} s, {run.stage()}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("heliodon", type=Path)
    parser.add_argument("--triangles", type=int, default=10_000_000)
    parser.add_argument("--kills", type=int, default=8)
    parser.add_argument("--folder", type=Path, help="where all is made; it must not be there yet")
    parser.add_argument("--site", type=Path, help="one that is there already; its bundle is made anew")
    options = parser.parse_args()
    program = os.path.abspath(options.heliodon)
    with working_folder(options.folder, "kept-", False) as folder:
        site = options.site or folder / "site"
        if not options.site:
            make_temple(program, site, options.triangles)
        clear(site)
        first = Watched(program, site, set())
        first.to_end()
        longest = waits(first)[: options.kills]
        print(f"not killed: {first.seconds:.1f} s, {first.peak_mb} MB; nothing was kept for", flush=True)
        for seconds, where in longest:
            print(f"{seconds:7.1f} s  {where}", flush=True)
        shutil.move(site / "bundle", folder / "reference")
        clear(site)
        killed(program, site, first, 0.9 * longest[-1][0], options.kills)
        differ = differences(site / "bundle", folder / "reference")
        if differ:
            sys.exit("the bundle differs in " + ", ".join(differ))
    print("the bundle was the same, byte for byte")


def clear(site):
    for leftover in ("bundle", ".heliodon"):
        shutil.rmtree(site / leftover, ignore_errors=True)


if __name__ == "__main__":
    main()
