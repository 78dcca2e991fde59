#!/usr/bin/env python3
"""Kills `heliodon prepare` and `heliodon bake` at random moments, goes on, and compares the bundle with that of a bake nobody killed.

    scripts/resume/kills.py HELIODON [--kills 200] [--minutes M] [--seed S] [--folder DIR]

HELIODON is the program. A site is made (a temple of 50,000 triangles, few rays, [prepare]), baked once, and then again and again: each time
from nothing, `prepare` and `bake` or `bake` alone, killed up to ten times each and run to the end. Every second kill comes at a random time
within the run's length, the others right after a random line of progress, so that short stages are met as well. A bundle that differs in one
byte, or a run that fails, ends with exit code 1 and keeps the folder. Time lost is what a chain of killed runs took beyond the one that
nobody killed; on a busy machine it says as much of its neighbours.
"""

import argparse
import collections
import filecmp
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

SETTINGS = """
[prepare]
error_px = 2.0
edge_px = 20.0
[display]
width_px = 512
height_px = 384
"""

# A command is killed so often at most before it is run to its end: each kill costs little where the ones before lost little.
MOST_KILLS = 10


class Run:
    """A run of the program: its lines of progress, and how long it took."""

    def __init__(self, program, arguments):
        self.lines = []
        self.begun = time.monotonic()
        self.process = subprocess.Popen([program, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.reader = threading.Thread(target=self.read)
        self.reader.start()

    def read(self):
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def kill_after(self, seconds=None, lines=None, then=0.0):
        """Kills it after a time, or after some lines and a time; whether it was still running."""
        while self.process.poll() is None:
            if seconds is not None and time.monotonic() - self.begun >= seconds:
                break
            if lines is not None and len(self.lines) >= lines:
                time.sleep(then)
                break
            time.sleep(0.001)
        self.process.kill()
        return self.end() < 0

    def end(self):
        """Waits for its end; the exit code, negative where a signal ended it."""
        code = self.process.wait()
        self.reader.join()
        self.seconds = time.monotonic() - self.begun
        return code

    def stage(self):
        """Where it was, from its last line."""
        lines = [line for line in self.lines if line]
        if not lines:
            return "before the first line"
        begun = re.match(r"(.*) \.\.\.$", lines[-1])
        percent = re.match(r"(.*): \d+ %", lines[-1])
        ended = re.match(r"(.*?)( \([\d,]+\))?: [\d.]+ \w+$", lines[-1])
        if begun or percent:
            return "in " + (begun or percent).group(1)
        return "after " + ended.group(1) if ended else "after: " + lines[-1].split(":")[0]


def differences(a, b):
    """Names of files that one of two folders lacks or that differ."""
    names = [{path.relative_to(folder) for path in folder.rglob("*") if path.is_file()} for folder in (a, b)]
    differ = {name for name in names[0] & names[1] if not filecmp.cmp(a / name, b / name, shallow=False)}
    return sorted(map(str, names[0] ^ names[1] | differ))


class Test:
    def __init__(self, program, folder, seed):
        self.program, self.folder, self.random = program, folder, random.Random(seed)
        self.site = folder / "site"
        self.kills = collections.Counter()
        self.lost = []

    def run(self, command, *more):
        return Run(self.program, [command, str(self.site), *map(str, more)])

    def whole(self, command, *more):
        run = self.run(command, *more)
        if run.end() != 0:
            sys.exit(f"{command} failed: " + "\n".join(run.lines))
        return run

    def make_site(self):
        self.whole("new", "--template", "temple", "--triangles", "50000")
        path = self.site / "site.toml"
        text = path.read_text().replace("samples = 128 ", "samples = 32\nsun_steps = 3\nsky_steps = 3\nbounces = 2 ")
        path.write_text(text.replace('transfer = "rgb"', 'transfer = "mono"').replace("atmosphere", "hosek-wilkie", 1) + SETTINGS)

    def measure(self):
        """Runs everything once, and remembers how long it took."""
        cache = self.folder / "reference-cache"
        alone = self.whole("bake", "-o", self.folder / "reference", "--cache", cache)
        shutil.rmtree(cache)
        prepare = self.whole("prepare", "--cache", cache)
        behind = self.whole("bake", "-o", self.folder / "behind", "--cache", cache)
        shutil.rmtree(self.folder / "behind")
        shutil.rmtree(cache)
        self.usual = {"alone": alone, "prepare": prepare, "behind": behind}
        print(", ".join(f"{name}: {run.seconds:.1f} s" for name, run in self.usual.items()), flush=True)

    def until_done(self, command, usual):
        """A command that is killed a few times and then run to its end; seconds in all, and kills."""
        seconds, kills = 0.0, 0
        for _ in range(self.random.randint(0, MOST_KILLS)):
            run = self.run(command)
            # a run that goes on is shorter than one from nothing: early moments are the more frequent ones
            part = self.random.random() ** 2
            if self.random.random() < 0.5:
                killed = run.kill_after(seconds=part * usual.seconds)
            else:
                lines = round(part * len(usual.lines))
                killed = run.kill_after(lines=lines, then=self.random.choice([0.0, 0.005, 0.05]))
            seconds += run.seconds
            if not killed:
                if run.process.returncode != 0:
                    self.fail(f"{command} failed after a kill: " + "\n".join(run.lines))
                return seconds, kills
            kills += 1
            self.kills[f"{command}: {run.stage()}"] += 1
        run = self.run(command)
        if run.end() != 0:
            self.fail(f"{command} failed after {kills} kills: " + "\n".join(run.lines))
        return seconds + run.seconds, kills

    def chain(self):
        """From nothing to the bundle."""
        for leftover in ("bundle", ".heliodon"):
            shutil.rmtree(self.site / leftover, ignore_errors=True)
        steps = [("bake", "alone")] if self.random.random() < 0.5 else [("prepare", "prepare"), ("bake", "behind")]
        seconds, kills = map(sum, zip(*(self.until_done(command, self.usual[usual]) for command, usual in steps)))
        differ = differences(self.site / "bundle", self.folder / "reference")
        if differ:
            self.fail("the bundle differs in " + ", ".join(differ))
        pieces = [str(path) for path in (self.site / ".heliodon").rglob("piece-*")]
        if pieces:
            self.fail("pieces were left behind: " + ", ".join(pieces))
        if kills:
            self.lost.append((seconds - sum(self.usual[usual].seconds for _, usual in steps)) / kills)

    def fail(self, what):
        self.tell()
        sys.exit(f"FAILED: {what}\nthe folder is kept: {self.folder}")

    def tell(self):
        for stage, count in sorted(self.kills.items()):
            print(f"{count:5}  {stage}")
        lost = sorted(self.lost) or [0.0]
        print(f"{self.kills.total()} kills in {len(self.lost)} chains; lost a kill: {sum(lost) / len(lost):.2f} s in the mean, ", end="")
        print(f"{lost[len(lost) // 2]:.2f} s the median, {lost[-1]:.2f} s at most", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("heliodon", type=Path)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin nothing new after so long")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--folder", type=Path, help="where all is made; it must not be there yet")
    options = parser.parse_args()
    if options.folder:
        options.folder.mkdir(parents=True)
    folder = options.folder or Path(tempfile.mkdtemp(prefix="kills-"))
    print(f"seed {options.seed}, in {folder}", flush=True)
    test = Test(os.path.abspath(options.heliodon), folder, options.seed)
    test.make_site()
    test.measure()
    begun = time.monotonic()
    while test.kills.total() < options.kills and time.monotonic() - begun < 60 * options.minutes:
        test.chain()
        print(f"{test.kills.total()} kills, {time.monotonic() - begun:.0f} s", flush=True)
    test.tell()
    shutil.rmtree(folder)
    print("every bundle was the same, byte for byte")


if __name__ == "__main__":
    main()
