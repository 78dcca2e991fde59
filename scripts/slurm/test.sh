#!/usr/bin/env bash
# `heliodon bake --on slurm` on a real Slurm (loopback.sh): the same bundle as one machine's, a node killed in the middle, Ctrl-C, and how
# much faster two nodes of one processor each are than one. As root, on Debian 12: apt-get install slurm-wlm munge
#
#   scripts/slurm/test.sh HELIODON [FOLDER]     HELIODON is the program; the folder (default: a new one) keeps what was made
#
# TRIANGLES and SAMPLES make the site larger than the test needs, SHARDS divides it otherwise.
set -euo pipefail

[ $# -ge 1 ] || { sed -n '2,7s/^# \{0,1\}//p' "$0" >&2; exit 2; }
heliodon=$(realpath "$1")
work=${2:-$(mktemp -d)}
mkdir -p "$work"
work=$(cd "$work" && pwd)
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
triangles=${TRIANGLES:-60000} samples=${SAMPLES:-256} shards=${SHARDS:-4}
site=$work/site
export SLURM_CONF="$work/slurm/slurm.conf"

say() { printf '%s  %s\n' "$(date +%T)" "$*"; }
fail() { say "FAILED: $*"; exit 1; }
loopback() { "$here/loopback.sh" "$1" "$work/slurm" ${2+"$2"}; }
on_slurm() { "$heliodon" bake "$site" -o "$1" --on slurm --no-cache --slurm-option=--no-requeue "${@:2}"; }
nothing_queued() { [ -z "$(squeue -h)" ]; }
same() { diff -r "$work/whole" "$1" && say "$1 is the same as one machine's, byte for byte"; }

# Runs "$@" until it succeeds, at most for so many seconds.
within() {
    local seconds=$1 begun=$SECONDS
    shift
    until "$@" >/dev/null 2>&1; do
        [ $((SECONDS - begun)) -lt "$seconds" ] || return 1
        sleep 0.2
    done
}

# Seconds since a date of `date +%s.%N`.
since() { echo "$(date +%s.%N) $1" | awk '{ printf "%.1f", $1 - $2 }'; }

retried() { ! tr -d ' \n' <"$work/killed.json" | grep -q '"again":\[\]' || grep -q 'requeue JobId' "$work/slurm/slurmctld.log"; }
runs_on() { [ -n "$(squeue -h -r -w "$1" -t running -o %A)" ]; }
# Whether more than so many blocks of the gather are done.
gathered() { [ "$(find "$work/.heliodon" -name 'gather-*' ! -name '*.new' 2>/dev/null | wc -l)" -gt "$1" ]; }

loopback stop 2>/dev/null || true
rm -rf "$work/slurm"
loopback start
trap 'loopback stop' EXIT

rm -rf "$site" "$work/whole" "$work/killed" "$work/cancelled" "$work/one" "$work/two" "$work/.heliodon"
"$heliodon" new "$site" --template temple --triangles "$triangles"
sed -i "s/^.*samples = .*/samples = $samples/" "$site/site.toml"
grep -n "^samples" "$site/site.toml"

say "one machine, one processor"
begun=$(date +%s.%N)
"$heliodon" bake "$site" -o "$work/whole" --threads 1 --no-cache --quiet
say "one machine, one processor: $(since "$begun") s"

say "two nodes, $shards shards, one node killed in the middle"
on_slurm "$work/killed" --shards "$shards" --json >"$work/killed.json" 2> >(tee "$work/killed.log" >&2) &
launcher=$!
within 300 gathered 2 || fail "no block was gathered"
within 60 runs_on node1 || fail "nothing runs on node1"
squeue -r
loopback kill-node node1
wait "$launcher" || fail "the bake did not survive the loss of a node"
# by us or, where it was quicker, by Slurm itself
retried || fail "nothing was submitted or queued again"
tr -d ' \n' <"$work/killed.json" | grep -o '"jobs":.*"seconds":[0-9]*'
grep -E 'requeue|not responding|_start_job|Allocate|_job_complete: .*(done|WEX)' "$work/slurm/slurmctld.log" | cut -c 12-
nothing_queued || fail "jobs are left"
same "$work/killed"
loopback start-node node1

say "Ctrl-C"
# not by the function: the signal is for the program, not for a shell around it
"$heliodon" bake "$site" -o "$work/cancelled" --no-cache --on slurm --shards "$shards" >/dev/null 2>"$work/cancelled.log" &
launcher=$!
within 300 runs_on node1 || fail "nothing runs on node1"
sleep 5
squeue -r
kill -INT "$launcher"
wait "$launcher" && fail "an interrupted bake must say so"
tail -n 1 "$work/cancelled.log"
nothing_queued || fail "jobs are left after Ctrl-C"
say "and on from there"
on_slurm "$work/cancelled" --shards "$shards" --quiet
same "$work/cancelled"

# one worker does both halves, two do one each
timed() {
    local begun
    begun=$(date +%s.%N)
    on_slurm "$work/$1" --shards "$2" --quiet "${@:3}" >&2
    since "$begun"
}
say "one worker against two"
one=$(timed one 1 --slurm-option=--nodelist=node1)
two=$(timed two 2)
same "$work/one"
same "$work/two"
say "one worker $one s, two $two s: $(echo "$one $two" | awk '{ printf "%.2f", $1 / $2 }') times as fast"
