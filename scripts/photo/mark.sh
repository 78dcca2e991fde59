#!/bin/sh
# Drives the window of `heliodon photo mark` by real mouse and keys on a display of its own, and leaves screenshots to look at.
#
#   scripts/photo/mark.sh [PROJECT] [OUT]     PROJECT is copied, never changed; without one, simulated photographs are made
#
# Needs Xvfb, xdotool and ImageMagick's import (Debian: xvfb xdotool imagemagick), and a Vulkan driver (mesa-vulkan-drivers draws on the processor).
# Checks that a point that was marked by two clicks is in the file once it is saved and not before, and that undoing gives the same bytes back.
set -eu
cd "$(dirname "$0")/../.."
out=${2:-$(mktemp -d)}
mkdir -p "$out"
work=$(mktemp -d)
cargo build -q -p heliodon_mark --examples
examples=${CARGO_TARGET_DIR:-target}/debug/examples
if [ -n "${1:-}" ]; then cp -r "$1/." "$work/"; else "$examples/simulated" "$work" 1600; fi
rm -f "$work/.photos.toml.autosave"
number=90
while [ -e "/tmp/.X11-unix/X$number" ]; do number=$((number + 1)); done
Xvfb ":$number" -screen 0 1600x1000x24 >/dev/null 2>&1 &
display=$!
export DISPLAY=":$number"
unset WAYLAND_DISPLAY
sleep 1
"$examples/mark" "$work" 2>"$out/log.txt" &
window=$!
trap 'kill $window $display 2>/dev/null || true; rm -rf "$work"' EXIT

fail() { echo "mark.sh: $1; see $out" >&2; exit 1; }
shot() { sleep "${2:-1}"; import -window root "$out/$1.png"; }
key() { for each in "$@"; do xdotool key "$each"; sleep 0.3; done; }
click() { xdotool mousemove "$1" "$2"; sleep 0.2; xdotool mousedown 1; sleep 0.2; xdotool mouseup 1; sleep 0.5; }

id=
for _ in $(seq 100); do
    id=$(xdotool search --name ' - Heliodon' 2>/dev/null | head -n 1) || true
    [ -n "$id" ] && break
    kill -0 $window 2>/dev/null || fail "the window did not open"
    sleep 0.2
done
xdotool windowmove "$id" 0 0 windowsize "$id" 1600 1000
sleep 2
xdotool windowfocus "$id"
shot 1-opened 5
key s && shot 2-solved 5
[ -e "$work/photos.toml" ] || key ctrl+s
sleep 1
cp "$work/photos.toml" "$out/before.toml"

# Without snapping, for these places mean nothing in photographs that are not known; over marks that may be there.
key k n
xdotool keydown shift
click 380 480
click 940 480
xdotool keyup shift
shot 3-marked 4
xdotool mousemove 420 380
for _ in 1 2 3 4 5 6 7 8; do xdotool click 4; sleep 0.1; done
shot 4-zoomed 2
cmp -s "$work/photos.toml" "$out/before.toml" || fail "the file was written before it was saved"
key ctrl+s
sleep 1
cp "$work/photos.toml" "$out/after.toml"
added=$(diff "$out/before.toml" "$out/after.toml" | grep -c '^> "' || true)
[ "$added" = 2 ] || fail "of two marks $added are in the file"
diff "$out/before.toml" "$out/after.toml" | grep -q '^<' && fail "other lines were changed"
key 4 && shot 5-four-panes 3
key F1 && shot 6-help && key Escape
key 2
for dialog in shift+b b shift+l p; do
    key "$dialog" && shot "8-dialog-$dialog" 3 && key Escape
done
key ctrl+z ctrl+z ctrl+z ctrl+s
shot 7-undone 2
cmp -s "$work/photos.toml" "$out/before.toml" || fail "undoing left something"
kill -0 $window 2>/dev/null || fail "the window is gone"
echo "marked, saved, undone; screenshots are in $out"
