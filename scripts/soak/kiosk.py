"""An installation for hours: the viewer as a kiosk under a software display, its memory, its days and its frames watched.

  scripts/soak/kiosk.py BUNDLE [--minutes 60] [--heliodon PATH] [--display FILE] [--out DIR] [--nice]

Starts Xvfb and `heliodon view BUNDLE --display FILE` (without one: FlatWorld's two walls in stereo, small windows, a kiosk that begins anew after two minutes), moves a
tracked head by OSC all the time, loses it now and then, floods its port with packets that are none, lets a show-control system set the exposure every minute, and asks for the hour
every half second. Prints one JSON object, and fails on what is at fault: resident memory after five minutes and at the end and its growth, days that passed beside those that should have, slow frames from the
kiosk's log, the time from the tracker to the picture. DIR/memory.csv has resident memory in KiB by seconds. Needs Xvfb (Debian: xvfb) and Python 3 only.
"""
import argparse
import json
import math
import os
import random
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time

DISPLAY = """[display]
name = "soak"
navigation = "window"
[[screen]]
name = "left"
corners = [[-2.263, 0.0, 0.063], [0.0, 0.0, -2.2], [-2.263, 2.4, 0.063]]
stereo = "side-by-side"
output = { window = [0, 0, 640, 240] }
[[screen]]
name = "right"
corners = [[0.0, 0.0, -2.2], [2.263, 0.0, 0.063], [0.0, 2.4, -2.2]]
stereo = "anaglyph"
output = { window = [0, 240, 320, 240] }
[[tracker]]
name = "phone"
protocol = "osc"
listen = "127.0.0.1:5905"
[[tracker.body]]
is = "head"
address = "/head"
[kiosk]
idle_s = 125.0
log = "frames.log"
slow_ms = 1000.0
[control]
listen = "127.0.0.1:5906"
"""
TRACKER, CONTROL = ("127.0.0.1", 5905), ("127.0.0.1", 5906)
DAY_S = 30.0


def padded(text):
    raw = text.encode() + b"\0"
    return raw + b"\0" * (-len(raw) % 4)


def message(address, tags="", *values):
    return padded(address) + padded("," + tags) + b"".join(struct.pack(">" + t, v) for t, v in zip(tags, values))


def state(socket_, patience):
    """The answer to /heliodon/state, as docs/rooms.md lists it; None without one."""
    socket_.settimeout(patience)
    socket_.sendto(message("/heliodon/state"), CONTROL)
    try:
        raw = socket_.recv(2000)
    except (TimeoutError, socket.timeout, ConnectionError):
        return None
    tags_at = raw.index(b",")
    tags = raw[tags_at + 1 : raw.index(b"\0", tags_at)].decode()
    at = tags_at + len(padded("," + tags))
    out = []
    for tag in tags:
        if tag in "TF":
            out.append(tag == "T")
            continue
        code, size = {"d": (">d", 8), "f": (">f", 4), "h": (">q", 8), "i": (">i", 4)}[tag]
        out.append(struct.unpack_from(code, raw, at)[0])
        at += size
    return out


def resident_kib(pid):
    with open(f"/proc/{pid}/status") as status:
        return next((int(line.split()[1]) for line in status if line.startswith("VmRSS:")), None)


def main():
    p = argparse.ArgumentParser()
    p.add_argument("bundle")
    p.add_argument("--minutes", type=float, default=60.0)
    p.add_argument("--heliodon", default="heliodon")
    p.add_argument("--display")
    p.add_argument("--out")
    p.add_argument("--most-growth", type=float, default=1.0, metavar="PERCENT", help="of resident memory, from five minutes on (default 1)")
    p.add_argument("--nice", action="store_true", help="only on processors that nobody else wants")
    a = p.parse_args()
    folder = a.out or tempfile.mkdtemp(prefix="heliodon-soak-")
    os.makedirs(folder, exist_ok=True)
    display = os.path.join(folder, "display.toml")
    if a.display:
        shutil.copy(a.display, display)
    else:
        with open(display, "w") as file:
            file.write(DISPLAY)
    number = next(n for n in range(60, 100) if not os.path.exists(f"/tmp/.X11-unix/X{n}"))
    server = subprocess.Popen(["Xvfb", f":{number}", "-screen", "0", "1280x960x24"], stderr=subprocess.DEVNULL)
    time.sleep(2)
    idle = ["chrt", "-i", "0"] if a.nice else []
    with open(os.path.join(folder, "viewer.log"), "w") as log:
        viewer = subprocess.Popen(
            [*idle, a.heliodon, "view", a.bundle, "--display", display, "--day-seconds", str(DAY_S)],
            env={**os.environ, "DISPLAY": f":{number}"}, stdout=log, stderr=log,
        )
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ask = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begun = time.monotonic()
    rng = random.Random(1)
    memory, pictures, last_told, answers, silent = [], [], None, 0, 0
    days = anew = 0
    last, last_at, since, watched = None, 0.0, None, 0.0
    asked = minute = 0.0
    try:
        while (now := time.monotonic() - begun) < 60 * a.minutes:
            if viewer.poll() is not None:
                break
            # A head that walks about; gone for three seconds in every fifty.
            if now % 50 > 3:
                x, z = 0.6 * math.sin(now * 0.7), 0.3 * math.cos(now * 0.45)
                out.sendto(message("/head", "fffffff", x, 1.65, z, 0.0, 0.0, 0.0, 1.0), TRACKER)
            if rng.random() < 0.02:
                for _ in range(500):
                    out.sendto(rng.randbytes(rng.randrange(1, 400)), TRACKER)
                    out.sendto(rng.randbytes(rng.randrange(1, 400)), CONTROL)
            if now > minute:
                minute += 60
                out.sendto(message("/heliodon/exposure", "f", rng.choice([0.0, 0.5, -0.5])), CONTROL)
            if now > asked:
                asked = now + 0.5
                told = state(ask, 10.0)
                if told is None:
                    silent += 1
                else:
                    answers, last_told = answers + 1, told
                    pictures.append(told[8])
                    clock = told[0]
                    moment = time.monotonic() - begun
                    if last is None:
                        since = moment
                    elif clock < last - 1.0:
                        # The clock went back: a day ended, or everything began anew.
                        days += 1
                    last, last_at = clock, moment
                    watched = moment - since
                kib = resident_kib(viewer.pid)
                if kib is None:
                    # It ended while it was asked.
                    break
                memory.append((time.monotonic() - begun, kib))
            time.sleep(1 / 60)
        ended = viewer.poll()
        out.sendto(message("/heliodon/quit"), CONTROL)
        try:
            quit_code = viewer.wait(60)
        except subprocess.TimeoutExpired:
            quit_code = None
            viewer.kill()
    finally:
        viewer.kill()
        server.terminate()
    with open(os.path.join(folder, "memory.csv"), "w") as file:
        file.writelines(f"{at:.1f},{kib}\n" for at, kib in memory)
    if not memory:
        print(json.dumps({"ended_early": True, "exit": quit_code, "folder": folder}))
        return 1
    settled = [kib for at, kib in memory if 300 <= at < 420] or [kib for _, kib in memory[-20:]]
    final = [kib for at, kib in memory if at > memory[-1][0] - 120]
    middle = lambda values: sorted(values)[len(values) // 2]
    log = os.path.join(folder, "frames.log")
    growth, by_the_clock = 100 * (middle(final) / middle(settled) - 1), watched / DAY_S
    faults = [what for what, is_so in [
        ("it ended early", ended is not None),
        ("it did not end as it was told to", quit_code != 0),
        (f"memory grew by more than {a.most_growth} %", growth > a.most_growth),
        # What begins anew begins a day, too: there are more.
        ("days are missing", days < int(by_the_clock) - 1),
        ("it was silent for one in fifty questions and more", silent > 0.02 * (answers + silent)),
    ] if is_so]
    print(json.dumps({
        "minutes": round((memory[-1][0]) / 60, 2),
        "exit": quit_code,
        "resident_mib_after_5_minutes": round(middle(settled) / 1024, 1),
        "resident_mib_at_end": round(middle(final) / 1024, 1),
        "growth_percent": round(growth, 2),
        "days": days,
        "days_by_the_clock": round(by_the_clock, 2),
        "answers": answers,
        "without_an_answer": silent,
        "orders_refused": last_told[7] if last_told else None,
        "ms_from_tracker_to_picture": round(middle(pictures), 1) if pictures else None,
        "slow_frames": sum(1 for _ in open(log)) if os.path.exists(log) else 0,
        "faults": faults,
        "folder": folder,
    }, indent=1))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
