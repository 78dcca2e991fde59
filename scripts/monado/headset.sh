#!/usr/bin/env bash
# The viewer in Monado's simulated headset, from end to end: it is built, visits for a minute, and what it submitted is checked. With --puppet, hands and
# sticks are moved as well, and what they did is checked. As root, after monado.sh setup
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: headset.sh [OPTIONS]

  --seconds N      how long the visit lasts (default 60)
  --bundle PATH    what it shows (default: the example's own court of columns)
  --out DIR        where both eyes' pictures and the logs go (default: a new folder in /tmp, which is named)
  --puppet         Monado's remote driver in place of the simulated one: the left stick moves, the right one turns, the trigger pauses the day.
                   While it runs, TCP port 4242 is open
  --program FILE   this one of `examples/headset`, which is not built
  --passes HOW     auto, one or two: in how many passes both eyes are drawn (default: auto)
  --monado DIR     where monado.sh has set it up

Variables for Monado (U_PACING_*, OXR_*, ...) are handed on; see monado.sh.
TEXT
}

say() { printf 'headset: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
seconds=60 bundle='' out='' passes=auto puppet='' program='' monado=()
while [ $# -gt 0 ]; do
    case "$1" in
        --seconds | --bundle | --passes | --out | --program | --monado) [ $# -ge 2 ] || fail "$1 needs a value" ;;
    esac
    case "$1" in
        --seconds) seconds=$2; shift 2 ;;
        --bundle) bundle=$(realpath -e -- "$2") || fail "$2 is not there"; shift 2 ;;
        --out) out=$2; shift 2 ;;
        --program) program=$(realpath -e -- "$2") || fail "$2 is not there"; shift 2 ;;
        --monado) monado=("$2"); shift 2 ;;
        --passes) passes=$2; shift 2 ;;
        --puppet) puppet=1; shift ;;
        -h | --help) usage; exit 0 ;;
        *) usage >&2; fail "there is no option $1" ;;
    esac
done

for tool in python3 realpath; do command -v "$tool" >/dev/null || fail "$tool is missing"; done
if [ -z "$program" ]; then
    command -v cargo >/dev/null || fail "cargo is missing: name a built one with --program"
    say "building examples/headset"
    # With the whole workspace: a crate alone would have other features of Bevy, and build it anew.
    (cd "$root" && cargo build --quiet --workspace --example headset)
    target=$(cd "$root" && cargo metadata --no-deps --format-version 1 | python3 -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')
    program=$target/debug/examples/headset
fi
if [ -n "$out" ]; then mkdir -p -- "$out"; else out=$(mktemp -d /tmp/heliodon-headset.XXXXXX); fi
out=$(realpath -- "$out")
rm -f -- "$out/left.png" "$out/right.png" "$out/report.json"

arguments=(--no-window --seconds "$seconds" --capture "$out" --passes "$passes")
binds=(--bind "$program" --bind-rw "$out")
[ -z "$bundle" ] || { binds+=(--bind "$bundle"); arguments+=("$bundle"); }
if [ -n "$puppet" ]; then
    [ "${seconds%.*}" -ge 40 ] || fail "--puppet takes 40 seconds at the least"
    export P_OVERRIDE_ACTIVE_CONFIG=remote
    # The program needs some seconds until its first frame; all of this happens in the middle of the visit.
    python3 "$here/puppet.py" --wait 120 - >"$out/puppet.log" 2>&1 <<'SCRIPT' &
0.0 head 0.3 1.65 0.2 40 0
0.0 left hand -0.2 1.2 -0.4
0.0 right hand 0.2 1.2 -0.4 0 30
20.0 left stick 0 1
23.0 left stick 0 0
24.0 right stick 1 0
26.0 right stick 0 0
27.0 right press trigger
29.0 right release trigger
600.0 end
SCRIPT
    mover=$!
    trap 'kill "$mover" 2>/dev/null || true' EXIT
fi
say "$seconds s in Monado; pictures and logs are in $out"
code=0
"$here/monado.sh" run "${monado[@]}" "${binds[@]}" --log "$out/monado.log" -- "$program" "${arguments[@]}" >"$out/report.json" 2>"$out/headset.log" || code=$?
if [ "$code" != 0 ]; then
    tail -n 15 "$out/headset.log" >&2
    [ ! -s "$out/puppet.log" ] || cat "$out/puppet.log" >&2
    fail "that ended with $code; all of what was said is in $out/headset.log and $out/monado.log"
fi

python3 - "$out" "$seconds" "$puppet" "$bundle" "$passes" <<'CHECK'
import json, struct, sys
from pathlib import Path

out, seconds, puppet, bundle, passes = Path(sys.argv[1]), float(sys.argv[2]), *sys.argv[3:]
report = json.loads((out / "report.json").read_text())
print(json.dumps(report))
faults = []

def want(holds, what):
    if not holds:
        faults.append(what)

want(report["frames"] > seconds, f"{report['frames']} frames in {seconds:g} s: less than one a second")
want(report["seconds"] > 0.9 * seconds, f"it lasted {report['seconds']:g} s")
# A processor draws here, for which two are quicker.
wanted_passes = 1 if passes == "one" else 2
want(report["passes"] == wanted_passes, f"both eyes were drawn in {report['passes']} passes, and not in {wanted_passes}")
pictures = [out / name for name in ("left.png", "right.png")]
for picture in pictures:
    if not picture.exists():
        faults.append(f"{picture} is not there")
        continue
    size = list(struct.unpack(">2I", picture.read_bytes()[16:24]))
    want(size == report["resolution"], f"{picture} is of {size} pixels")
if all(picture.exists() for picture in pictures):
    want(pictures[0].read_bytes() != pictures[1].read_bytes(), "both eyes see the same: there is no parallax")
if puppet:
    # One push is one snap; in the court a visitor begins at z = 30 and looks north.
    if not bundle:
        want(abs(report["heading_deg"] - 30) < 1, f"the right stick turned it to {report['heading_deg']} degrees, and not by 30")
        want(report["eye"][2] < 29.9, f"the left stick moved it to {report['eye']}, and not forward")
    want(not report["playing"], "the trigger did not pause the day")
for fault in faults:
    print(f"headset: {fault}", file=sys.stderr)
sys.exit(bool(faults))
CHECK
say "works: $out/left.png and $out/right.png are what the eyes saw last"
