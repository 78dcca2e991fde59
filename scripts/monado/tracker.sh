#!/usr/bin/env bash
# A room's head and hands from an OpenXR runtime that shows nothing (protocol = "openxr"), from end to end: Monado's remote driver is moved, and what `heliodon display --listen`
# tells of it is checked. As root, after monado.sh setup. usage: tracker.sh HELIODON [DIR of monado.sh]
set -euo pipefail

[ $# -ge 1 ] || { echo "usage: tracker.sh HELIODON [DIR]" >&2; exit 2; }
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
program=$(realpath -e -- "$1")
shift
work=$(mktemp -d /tmp/heliodon-tracker.XXXXXX)
mover=''
trap '[ -z "$mover" ] || kill "$mover" 2>/dev/null || true; rm -rf -- "$work"' EXIT
cat >"$work/display.toml" <<'TOML'
[display]
name = "a wall"
[[screen]]
name = "wall"
corners = [[-1.0, 0.5, -1.0], [1.0, 0.5, -1.0], [-1.0, 2.0, -1.0]]
output = { window = [0, 0, 320, 240] }
[[tracker]]
name = "monado"
protocol = "openxr"
translate = [0.0, 0.0, 1.0]
[[tracker.body]]
is = "head"
[[tracker.body]]
is = "wand"
TOML
python3 "$here/puppet.py" --wait 60 - >"$work/puppet.log" 2>&1 <<'SCRIPT' &
0.0 head 0.3 1.65 0.2 40 0
0.0 right hand 0.2 1.2 -0.4 0 30
6.0 head -0.5 1.5 0.4 -90 10
600.0 end
SCRIPT
mover=$!
export P_OVERRIDE_ACTIVE_CONFIG=remote
"$here/monado.sh" run "$@" --bind "$program" --bind "$work" --log "$work/monado.log" -- "$program" --json display "$work/display.toml" --listen 14 >"$work/told.json" 2>"$work/errors.log" ||
    { cat "$work/errors.log" "$work/puppet.log" >&2; exit 1; }
python3 - "$work/told.json" <<'CHECK'
import json, sys

text, moments = open(sys.argv[1]).read().strip(), []
while text:
    moment, end = json.JSONDecoder().raw_decode(text)
    moments.append(moment)
    text = text[end:].lstrip()
bodies = [{body["body"]: body for body in moment["bodies"]} for moment in moments]

def near(body, position, heading, pitch):
    if body["state"] != "tracked":
        return False
    off = max(abs(a - b) for a, b in zip(body["position"], position))
    return off < 0.005 and abs(body["heading_deg"] - heading) < 0.5 and abs(body["pitch_deg"] - pitch) < 0.5

faults = []
for what, body, wanted in [
    ("the head before", "head", ([0.3, 1.65, 1.2], -40, 0)),
    ("the head after", "head", ([-0.5, 1.5, 1.4], 90, 10)),
    ("the hand", "wand", ([0.2, 1.2, 0.6], 0, 30)),
]:
    seconds = sum(near(moment[body], *wanted) for moment in bodies)
    print(f"{what}: {seconds} of {len(bodies)} seconds at {wanted}")
    if seconds < 2:
        faults.append(what)
sys.exit(f"tracker: not seen where it was: {', '.join(faults)}" if faults else 0)
CHECK
