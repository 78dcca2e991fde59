#!/usr/bin/env python3
"""Kills `heliodon prepare` and `heliodon bake` at random moments, goes on, and compares the bundle with that of a bake nobody killed.

    scripts/resume/kills.py HELIODON [--rounds 200] [--minutes M] [--seed S] [--folder DIR] [--triangles N] [--shown] [--keep]

HELIODON is the program. A site is made (a temple of 50,000 triangles or of --triangles, few rays, [prepare]), baked once, and then again and again: each time
from nothing, `prepare` and `bake` or `bake` alone, killed up to ten times each and run to the end. Every second kill comes at a random time
within the run's length, the others right after a random line of progress, so that short stages are met as well. A bundle that differs in one
byte, or a run that fails, ends with exit code 1. With --shown the site has texels, a panorama and the scan itself besides. Nothing stays behind, but with --keep the folder of a failure. Time lost is what a chain of
killed runs took beyond the one that nobody killed; on a busy machine it says as much of its neighbours.
"""

import argparse
import collections
import os
import random
import shutil
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True
from trial import Run, differences, make_temple, working_folder

# A command is killed so often at most before it is run to its end: each kill costs little where the ones before lost little.
MOST_KILLS = 10


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

    def until_done(self, command, usual, most):
        """A command that is killed a few times, `most` at most, and then run to its end; seconds in all, and kills."""
        seconds, kills = 0.0, 0
        for _ in range(min(self.random.randint(0, MOST_KILLS), most)):
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
                if run.code != 0:
                    self.fail(f"{command} failed after a kill: " + "\n".join(run.lines))
                return seconds, kills
            kills += 1
            self.kills[f"{command}: {run.stage()}"] += 1
        run = self.run(command)
        if run.end() != 0:
            self.fail(f"{command} failed after {kills} kills: " + "\n".join(run.lines))
        return seconds + run.seconds, kills

    def chain(self, most):
        """From nothing to the bundle, with `most` kills at most."""
        for leftover in ("bundle", ".heliodon"):
            shutil.rmtree(self.site / leftover, ignore_errors=True)
        steps = [("bake", "alone")] if self.random.random() < 0.5 else [("prepare", "prepare"), ("bake", "behind")]
        seconds, kills = 0.0, 0
        for command, usual in steps:
            more_seconds, more_kills = self.until_done(command, self.usual[usual], most - kills)
            seconds, kills = seconds + more_seconds, kills + more_kills
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
        sys.exit(f"FAILED: {what}")

    def tell(self):
        for stage, count in sorted(self.kills.items()):
            print(f"{count:5}  {stage}")
        lost = sorted(self.lost) or [0.0]
        print(f"{self.kills.total()} kills in {len(self.lost)} chains; lost a kill, each chain by its kills: {sum(lost) / len(lost):.2f} s in the mean, ", end="")
        print(f"{lost[len(lost) // 2]:.2f} s the median, {lost[-1]:.2f} s at most", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("heliodon", type=Path)
    parser.add_argument("--rounds", type=int, default=200, help="kills; the last of them is followed by a whole run")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="begin nothing new after so long")
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--folder", type=Path, help="where all is made; it must not be there yet")
    parser.add_argument("--triangles", type=int, default=50_000, help="of the temple: with millions, what a kill loses of a scan")
    parser.add_argument("--shown", action="store_true", help="with texels, a panorama and the scan itself")
    parser.add_argument("--keep", action="store_true", help="keep the folder where something fails, to look at it")
    options = parser.parse_args()
    with working_folder(options.folder, "kills-", options.keep) as folder:
        print(f"seed {options.seed}, in {folder}", flush=True)
        test = Test(os.path.abspath(options.heliodon), folder, options.seed)
        make_temple(test.program, test.site, options.triangles, shown=options.shown)
        test.measure()
        begun = time.monotonic()
        while test.kills.total() < options.rounds and time.monotonic() - begun < 60 * options.minutes:
            test.chain(options.rounds - test.kills.total())
            print(f"{test.kills.total()} kills, {time.monotonic() - begun:.0f} s", flush=True)
        test.tell()
    print("every bundle was the same, byte for byte")


if __name__ == "__main__":
    main()
