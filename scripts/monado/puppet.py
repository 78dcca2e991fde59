#!/usr/bin/env python3
"""Moves head and hands of Monado's remote driver (P_OVERRIDE_ACTIVE_CONFIG=remote) as a script says.

usage: puppet.py [--port 4242] [--wait SECONDS] SCRIPT     (- for standard input)

A line of the script: the second, what, and how; lines are taken in the order of their seconds, and what they set holds until another sets it.

  0.0 head X Y Z [YAW [PITCH [ROLL]]]             metres in the play space; degrees, to the left, up, and counter-clockwise
  0.0 left|right hand X Y Z [YAW [PITCH [ROLL]]]  where an Index controller grips and points
  1.0 left|right stick X Y                 right and forward, -1 to 1
  2.0 left|right press|release trigger|a|b|stick|system
  9.0 end

The driver listens on TCP port 4242 of all addresses while Monado runs so: for trials on machines of your own. The packets are those of Monado 25.0 (header mndrmt3):
a header, the head's views and pose, two controllers.
"""

import argparse
import math
import socket
import struct
import sys
import time

HEADER = b"mndrmt3\0"
POSE = "7f"
VIEW = "4f" + POSE + "I"
HEAD = VIEW * 2 + POSE + "?3x"
# pose, velocities, curl of five fingers, trigger, squeeze and its force, stick, trackpad's force, trackpad; two states and eleven buttons
HAND = POSE + "6f" + "5f" + "3f2f1f2f" + "13?3x"
PACKET = struct.Struct("<8s" + HEAD + HAND * 2)
BUTTONS = {"system": 2, "a": 4, "b": 6, "trigger": 8, "stick": 10}
RATE_HZ = 60


def pose(x, y, z, yaw_deg=0.0, pitch_deg=0.0, roll_deg=0.0):
    """Orientation (x, y, z, w) and position, as Monado writes them: yaw about the vertical, then pitch, then roll about what points back."""
    halves = [math.radians(degrees) / 2 for degrees in (yaw_deg, pitch_deg, roll_deg)]
    (sy, sp, sr), (cy, cp, cr) = map(math.sin, halves), map(math.cos, halves)
    i, j, k, w = cy * sp, sy * cp, -sy * sp, cy * cp
    return [i * cr + j * sr, j * cr - i * sr, k * cr + w * sr, w * cr - k * sr, x, y, z]


class Hand:
    def __init__(self, x):
        self.pose = pose(x, 1.2, -0.4)
        self.stick = [0.0, 0.0]
        self.flags = [False] * 13
        # hands are seen by their controllers
        self.flags[1] = True

    def fields(self):
        trigger = 1.0 if self.flags[BUTTONS["trigger"]] else 0.0
        return self.pose + [0.0] * 6 + [0.0] * 5 + [trigger, 0.0, 0.0] + self.stick + [0.0, 0.0, 0.0] + self.flags


class Puppet:
    def __init__(self, views):
        self.views = views
        self.head = pose(0.0, 1.65, 0.0)
        self.hands = {"left": Hand(-0.2), "right": Hand(0.2)}

    def packet(self):
        return PACKET.pack(HEADER, *self.views, *self.head, False, *self.hands["left"].fields(), *self.hands["right"].fields())

    def take(self, words):
        """A line without its second; false at the end."""
        what, rest = words[0], words[1:]
        if what == "end":
            return False
        if what == "head":
            self.head = pose(*map(float, rest))
            return True
        hand, (does, *how) = self.hands[what], rest
        if does == "hand":
            hand.pose = pose(*map(float, how))
        elif does == "stick":
            hand.stick = [float(how[0]), float(how[1])]
        elif does in ("press", "release"):
            hand.flags[BUTTONS[how[0]]] = does == "press"
        else:
            raise ValueError(f"{does}: hand, stick, press or release")
        return True


def read_script(lines):
    script = []
    for number, line in enumerate(lines, 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            script.append((float(words[0]), words[1:]))
            Puppet([0.0] * 22 + [0] * 2).take(words[1:])
        except (ValueError, KeyError, IndexError, TypeError) as why:
            sys.exit(f"puppet: line {number}: {line.strip()}: {why}")
    return sorted(script, key=lambda entry: entry[0])


def connect(port, wait_s):
    until = time.monotonic() + wait_s
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=5)
        except OSError as why:
            if time.monotonic() > until:
                sys.exit(f"puppet: Monado's remote driver does not listen on port {port}: {why}")
            time.sleep(0.2)


def receive(connection):
    """The state that the driver tells to whoever connects."""
    got = b""
    while len(got) < PACKET.size:
        more = connection.recv(PACKET.size - len(got))
        if not more:
            sys.exit("puppet: Monado closed the connection: somebody else moves its head")
        got += more
    # Monado 25.0 leaves its own header empty.
    if got[:8] not in (HEADER, bytes(8)):
        sys.exit(f"puppet: packets of another version of Monado: {got[:8]!r} and not {HEADER!r}")
    return PACKET.unpack(got)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("script")
    arguments.add_argument("--port", type=int, default=4242)
    arguments.add_argument("--wait", type=float, default=30.0, metavar="SECONDS")
    given = arguments.parse_args()
    script = read_script(sys.stdin if given.script == "-" else open(given.script, encoding="utf-8"))
    connection = connect(given.port, given.wait)
    views = receive(connection)[1:25]
    puppet, begun = Puppet(list(views)), time.monotonic()
    while True:
        while script and time.monotonic() - begun >= script[0][0]:
            if not puppet.take(script.pop(0)[1]):
                return
        if not script:
            return
        try:
            connection.sendall(puppet.packet())
        except OSError:
            # Monado has ended
            return
        time.sleep(1 / RATE_HZ)


if __name__ == "__main__":
    main()
