#!/usr/bin/env bash
# A Slurm cluster of this one machine, to test `heliodon bake --on slurm` with: munged, slurmctld and two nodes of one processor each, all
# on 127.0.0.1, everything they write in one work folder. It installs nothing and touches no Slurm that is there: ports, socket and
# configuration are its own. As root, on Debian 12: apt-get install slurm-wlm munge
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: loopback.sh COMMAND FOLDER [NODE]

  start FOLDER            start the cluster; then: export SLURM_CONF=FOLDER/slurm.conf
  status FOLDER           nodes and jobs
  kill-node FOLDER NODE   kill -9 a node (node1 or node2) with all that runs on it, as a failure of power would
  start-node FOLDER NODE  start it again
  stop FOLDER             stop everything
TEXT
}

say() { printf 'loopback: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

command=${1:-help}
case "$command" in
    start | status | kill-node | start-node | stop) [ $# -ge 2 ] || { usage >&2; exit 2; } ;;
    help | -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
esac
mkdir -p "$2"
folder=$(cd "$2" && pwd)
node=${3:-}
nodes=(node1 node2)
export SLURM_CONF="$folder/slurm.conf"
PATH="$PATH:/usr/sbin:/sbin"

need() {
    [ "$(id -u)" = 0 ] || fail "run it as root: slurmctld starts jobs for others"
    local program
    for program in munged slurmctld slurmd sbatch squeue scancel scontrol; do
        command -v "$program" >/dev/null || fail "$program is missing: apt-get install slurm-wlm munge"
    done
}

# Runs "$@" until it succeeds, at most for so many seconds.
within() {
    local seconds=$1 tries
    shift
    for ((tries = 0; tries < seconds * 5; tries++)); do
        "$@" >/dev/null 2>&1 && return 0
        sleep 0.2
    done
    return 1
}

configure() {
    local host number
    host=$(hostname -s)
    mkdir -p "$folder/state"
    cat >"$SLURM_CONF" <<TEXT
ClusterName=loopback
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool-%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd-%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SlurmdParameters=config_overrides
# a node that does not answer is down after ten seconds, and serves again as soon as it does
SlurmdTimeout=10
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0
PartitionName=main Nodes=ALL Default=YES State=UP MaxTime=60
TEXT
    number=1
    for node in "${nodes[@]}"; do
        echo "NodeName=$node NodeHostname=$host NodeAddr=127.0.0.1 Port=2682$number CPUs=1 State=UNKNOWN" >>"$SLURM_CONF"
        mkdir -p "$folder/spool-$node"
        number=$((number + 1))
    done
}

start_node() {
    slurmd -N "$1" -f "$SLURM_CONF"
    within 30 is_up "$1" || fail "$1 did not come up; see $folder/slurmd-$1.log"
}

is_up() { sinfo -h -n "$1" -o %T | grep -Eq '^(idle|mixed|allocated|completing)$'; }

# Whether the process of a pid file lives.
lives() { [ -s "$1" ] && kill -0 "$(cat "$1")" 2>/dev/null; }

# Ends the process of a pid file.
end() {
    lives "$1" || return 0
    local pid
    pid=$(cat "$1")
    kill "$pid" 2>/dev/null || true
    within 10 is_gone "$pid" || kill -9 "$pid" 2>/dev/null || true
    rm -f "$1"
}

is_gone() { ! kill -0 "$1" 2>/dev/null; }

# The processes of the jobs that run on a node: their shepherds first, which would tell that they ended.
processes_of() {
    local job
    for job in $(squeue -h -r -w "$1" -t running,completing -o %A); do
        pgrep -f "^slurmstepd: \[$job\." || true
        { grep -lzx "SLURM_JOB_ID=$job" /proc/[0-9]*/environ 2>/dev/null || true; } | cut -d/ -f3
    done
}

case "$command" in
    start)
        need
        ! lives "$folder/slurmctld.pid" || fail "it runs already in $folder"
        configure
        [ -s "$folder/munge.key" ] || { (umask 077 && head -c 128 /dev/urandom >"$folder/munge.key"); }
        munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
            --log-file="$folder/munged.log" --seed-file="$folder/munge.seed"
        slurmctld -f "$SLURM_CONF" -c
        within 30 scontrol ping || fail "slurmctld did not come up; see $folder/slurmctld.log"
        for node in "${nodes[@]}"; do start_node "$node"; done
        say "two nodes are up; export SLURM_CONF=$SLURM_CONF"
        ;;
    status)
        sinfo -N -o '%N %T'
        squeue -r
        ;;
    kill-node)
        [ -n "$node" ] || fail "name the node: ${nodes[*]}"
        daemon=$(cat "$folder/slurmd-$node.pid")
        # first what would begin another job meanwhile
        kill -9 "$daemon" 2>/dev/null || true
        rm -f "$folder/slurmd-$node.pid"
        mapfile -t pids < <(processes_of "$node")
        kill -9 ${pids[@]+"${pids[@]}"} 2>/dev/null || true
        say "killed $node: slurmd $daemon and ${#pids[@]} processes of its jobs"
        ;;
    start-node)
        [ -n "$node" ] || fail "name the node: ${nodes[*]}"
        start_node "$node"
        ;;
    stop)
        if lives "$folder/slurmctld.pid"; then
            scancel --user=root --quiet 2>/dev/null || true
            sleep 1
        fi
        for node in "${nodes[@]}"; do end "$folder/slurmd-$node.pid"; done
        end "$folder/slurmctld.pid"
        end "$folder/munged.pid"
        say "stopped"
        ;;
esac
