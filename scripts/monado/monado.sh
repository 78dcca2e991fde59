#!/usr/bin/env bash
# An OpenXR runtime without hardware: Monado with its simulated headset and controllers on Mesa's software Vulkan, from the packages of
# Debian 13, in a chroot of its own. It installs nothing outside of its folder. A run has its own mount and process namespaces, so that
# its mounts and processes end with it, even by kill -9, and sees the chroot read-only. As root, on Debian or Ubuntu: apt-get install debootstrap
set -euo pipefail

usage() {
    cat <<'TEXT'
usage: monado.sh COMMAND [DIR] ...

  setup [DIR]                              make the chroot, or bring it up to date (about 750 MB)
  run [DIR] [OPTIONS] -- COMMAND...        start Monado, run COMMAND in the chroot, give back its exit status
      --bind PATH, --bind-rw PATH          show COMMAND this folder or file at the same path, read-only or to write; without what is mounted below it
      --log FILE                           where Monado's messages go (default DIR/service.log)
  test [DIR]                               hello_xr for 15 s: does it make its swapchains and submit frames?
  clean [DIR]                              remove the chroot

DIR: default ${XDG_CACHE_HOME:-~/.cache}/heliodon/monado. All of it needs root.

COMMAND starts in the present folder where that is bound (else in /), with an empty /tmp and HOME, and with RUST_LOG, RUST_BACKTRACE, HELIODON_*
and DISPLAY from outside; others by env: run -- env WGPU_BACKEND=vulkan COMMAND. Monado's own variables (SIMULATED_*, XRT_*, OXR_*, IPC_*, U_PACING_*,
P_OVERRIDE_ACTIVE_CONFIG) go to COMMAND and to the service and win over these defaults:

  SIMULATED_LEFT=wmr SIMULATED_RIGHT=wmr   the controllers: wmr, ml2 or simple; empty for none. Their buttons are never pressed
  P_OVERRIDE_ACTIVE_CONFIG=remote          instead: a head at rest, Index controllers and hands, moved through TCP port 4242 (open to the network)
  OXR_VIEWPORT_SCALE_PERCENTAGE=100        of the 320x240 recommended for an eye; at most 200

  monado.sh setup
  monado.sh run --bind "$PWD" --bind-rw "$PWD/out" -- ./heliodon view site.bundle
TEXT
}

say() { printf 'monado: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }
wrong() { say "$*"; usage >&2; exit 2; }

suite=trixie
packages=(
    monado-service monado-cli libopenxr1-monado libopenxr-loader1 libopenxr-utils openxr-layer-apidump mesa-vulkan-drivers libvulkan1
    # what a Bevy program opens at run time: windows, keyboards, gamepads, sound
    libx11-6 libx11-xcb1 libxcursor1 libxi6 libxrandr2 libxkbcommon0 libxkbcommon-x11-0 libwayland-client0 libudev1 libasound2t64
)
runtime_dir=/run/xdg
socket=$runtime_dir/monado_comp_ipc
self=$(realpath "${BASH_SOURCE[0]}")
PATH="$PATH:/usr/sbin:/sbin"

need_root() { [ "$(id -u)" = 0 ] || fail "run it as root: it mounts and changes the root folder"; }

need() {
    local program
    for program in unshare setpriv setsid flock pgrep "$@"; do
        command -v "$program" >/dev/null || fail "$program is missing: apt-get install debootstrap debian-archive-keyring util-linux procps"
    done
}

# Runs "$@" until it succeeds, at most for so many seconds.
within() {
    local seconds=$1 tries
    shift
    for ((tries = 0; tries < seconds * 10; tries++)); do
        "$@" && return 0
        sleep 0.1
    done
    return 1
}

is_gone() { ! kill -0 "$1" 2>/dev/null; }

# ---- the folder

# Our folder has this file, which is also locked: shared by what runs in it, exclusively by what changes it.
marker() { printf '%s/.heliodon-monado' "$dir"; }
is_ours() { [ -f "$(marker)" ]; }

lock() {
    exec 9>>"$(marker)"
    flock --nonblock "$1" 9 || fail "$dir is in use: let what runs in it end, then do this again"
}

# Mount points at and below a path, the innermost first.
mounts_in() {
    local point
    cut -d ' ' -f 5 /proc/self/mountinfo | tac | while read -r point; do
        # spaces are written \040 there
        point=$(printf '%b' "$point")
        case "$point" in "$1" | "$1"/*) printf '%s\n' "$point" ;; esac
    done
}

# Removes a folder of ours, never what is mounted in it: --one-file-system alone would follow a bind mount of the same disk.
remove() {
    local left
    left=$(mounts_in "$1")
    [ -z "$left" ] || fail "nothing removed, as something is mounted in $1: $left"
    rm -rf --one-file-system -- "$1"
}

# ---- namespaces and signals

# Waits for a child, whatever signals come meanwhile: the trap passes them on, and after one that ends (TERM, HUP) it has so many seconds.
# Leaves the child's exit status in $status.
status=0 signalled=''
attend() {
    local pid=$1 seconds=$2
    while :; do
        signalled=''
        wait "$pid" 2>/dev/null && status=0 || status=$?
        [ -n "$signalled" ] || return 0
        [ "$signalled" = INT ] || within "$seconds" is_gone "$pid" || kill -KILL "$pid" 2>/dev/null || true
    done
}

# on_signals FUNCTION: calls it with the name of each signal that would end this shell.
on_signals() {
    local signal
    # shellcheck disable=SC2064 # the names are meant to be put in now
    for signal in INT TERM HUP; do trap "signalled=$signal; $1 $signal" "$signal"; done
}

# The process of `unshare`, whose only child is the first one in the namespaces; in there, the command's.
space='' child=''
to_space() {
    local first=''
    [ -z "$space" ] || first=$(pgrep -P "$space" || true)
    [ -z "$first" ] || kill -s "$1" "$first" 2>/dev/null || true
}
to_command() {
    if [ -n "$child" ]; then kill -s "$1" -- "-$child" 2>/dev/null || true; else exit 143; fi
}

# contained FUNCTION ARGUMENTS...: runs that function of ours as the first process of new mount and process namespaces. When it ends, or
# this shell does, everything in them is killed, and the mounts are gone with them.
contained() {
    on_signals to_space
    # Its own session, for Ctrl-C must reach COMMAND once, from us; a job in the background would ignore it, but for env.
    setsid env --default-signal=INT,QUIT setpriv --pdeathsig KILL \
        unshare --mount --propagation private --pid --fork --kill-child -- "$self" inside "$@" <&0 &
    space=$!
    attend "$space" 15
    trap - INT TERM HUP
}

# In there, after `on_signals to_command`: runs a program in its own process group and leaves its exit status in $status.
supervised() {
    setsid env --default-signal=INT,QUIT "$@" <&0 9>&- &
    child=$!
    attend "$child" 10
}

# ---- setup

# The mirror that this machine has its own Debian packages from, or Debian's.
mirror() {
    local found
    # shellcheck disable=SC2016 # apt's own variables
    found=$(apt-get indextargets --format '$(ORIGIN) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
        awk '$1 == "Debian" && $2 !~ /security/ && !found { print $2; found = 1 }') || true
    printf '%s' "${found:-http://deb.debian.org/debian/}"
}

inside_bootstrap() {
    on_signals to_command
    supervised debootstrap --variant=minbase --keyring=/usr/share/keyrings/debian-archive-keyring.gpg "$suite" "$1" "$2"
    exit "$status"
}

inside_install() {
    local root=$1
    shift
    on_signals to_command
    mount -t proc proc "$root/proc"
    cp -L /etc/resolv.conf "$root/etc/resolv.conf"
    apt-config dump | { grep -E '^Acquire::https?::Proxy' || true; } >"$root/etc/apt/apt.conf.d/80proxy"
    # shellcheck disable=SC2016 # expanded in there
    supervised chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C sh -euc '
        dpkg --configure -a
        apt-get update -q
        apt-get install -q -y --no-install-recommends "$@"
        apt-get clean
        rm -rf /var/lib/apt/lists/*' sh "$@"
    exit "$status"
}

# Runs "$@" with its output in a log; what went wrong is at its end.
logged() {
    local log=$1
    shift
    contained "$@" >"$log" 2>&1
    [ "$status" = 0 ] || { tail -n 15 "$log" >&2; fail "that failed; the whole log is $log"; }
}

setup() {
    need debootstrap
    [[ $dir != *[[:space:]]* ]] || fail "debootstrap cannot make \"$dir\": name a folder without spaces"
    if ! is_ours; then
        [ -z "$(ls -A "$dir" 2>/dev/null)" ] || fail "$dir is not empty and not of our making: name another folder"
        mkdir -p "$dir"
    fi
    lock --exclusive
    local wanted="$suite ${packages[*]}"
    if [ -d "$dir/root" ] && [ "$(cat "$dir/installed" 2>/dev/null)" = "$wanted" ]; then
        say "$dir is set up already: $(versions)"
        return
    fi
    if [ ! -d "$dir/root" ]; then
        # what an earlier attempt left
        remove "$dir/root.new"
        say "Debian $suite from $(mirror) into $dir/root (some minutes)"
        logged "$dir/setup.log" bootstrap "$dir/root.new" "$(mirror)"
        mv "$dir/root.new" "$dir/root"
    fi
    say "installing in it: ${packages[*]}"
    logged "$dir/install.log" install "$dir/root" "${packages[@]}"
    mkdir -p "$dir/view"
    printf '%s\n' "$wanted" >"$dir/installed"
    say "$dir is set up, $(du -sxh "$dir" | cut -f 1): $(versions)"
}

# shellcheck disable=SC2016 # dpkg's own variables
versions() { chroot "$dir/root" dpkg-query -W -f='${Package} ${Version}, ' monado-service libopenxr-loader1 mesa-vulkan-drivers | sed 's/, $//'; }

# ---- run

# The root folder of a run: an empty one in memory, with the chroot's own folders in it, read-only.
compose() {
    local root=$1 view=$2 entry name
    mount -t tmpfs -o mode=755 heliodon-monado "$view"
    for entry in "$root"/*; do
        name=${entry##*/}
        if [ -L "$entry" ]; then
            cp -P "$entry" "$view/$name"
        else
            mkdir "$view/$name"
            case "$name" in usr | etc | var) mount -o bind,ro "$entry" "$view/$name" ;; esac
        fi
    done
    chmod 1777 "$view/tmp"
    mkdir -m 700 "$view$runtime_dir"
    mount -t proc proc "$view/proc"
    mount -o bind,ro /sys "$view/sys"
    # with what is mounted in it: /dev/shm, /dev/pts
    mount --rbind /dev "$view/dev"
}

# Shows a folder or file of the machine in a run, at the same path: ro:PATH or rw:PATH.
show() {
    local way=${1%%:*} path=${1#*:}
    if [ -d "$path" ]; then
        mkdir -p "$view$path"
    else
        mkdir -p "$view${path%/*}"
        [ -e "$view$path" ] || : >"$view$path"
    fi
    mount -o "bind,$way" "$path" "$view$path"
}

# Variables that are set outside and pass in, of those whose names match.
passed() {
    local name
    for name in $(compgen -e | grep -E "^($1)\$"); do printf '%s=%s\0' "$name" "${!name}"; done
}

answers() { [ -S "$view$socket" ] || is_gone "$1"; }

# inside_serve DIR LOG WAY:PATH... -- COMMAND...
inside_serve() {
    local dir=$1 log=$2 view=$1/view
    shift 2
    on_signals to_command
    compose "$dir/root" "$view"
    while [ "$1" != -- ]; do
        show "$1"
        shift
    done
    shift

    local common=(PATH=/usr/local/bin:/usr/bin:/usr/sbin HOME=/root LANG=C.UTF-8 "XDG_RUNTIME_DIR=$runtime_dir") monado=() theirs=() service
    mapfile -d '' -t monado < <(passed 'SIMULATED_.*|XRT_.*|OXR_.*|IPC_.*|U_PACING_.*|P_OVERRIDE_ACTIVE_CONFIG')
    mapfile -d '' -t theirs < <(passed 'RUST_LOG|RUST_BACKTRACE|HELIODON_.*|TERM|DISPLAY|XAUTHORITY')
    # without XRT_NO_STDIN it refuses a standard input that is no terminal
    chroot "$view" env -i "${common[@]}" XRT_NO_STDIN=1 XRT_COMPOSITOR_NULL=1 SIMULATED_ENABLE=1 SIMULATED_LEFT=wmr SIMULATED_RIGHT=wmr \
        IPC_EXIT_ON_DISCONNECT=0 "${monado[@]}" monado-service >"$log" 2>&1 </dev/null 9>&- &
    service=$!
    within 30 answers "$service" || fail "Monado did not open its socket within 30 s; see $log"
    ! is_gone "$service" || { tail -n 15 "$log" >&2; fail "Monado ended at once; see $log"; }

    local where=/
    [ ! -d "$view$PWD" ] || where=$PWD
    supervised chroot "$view" env -i -C "$where" "${common[@]}" "${monado[@]}" "${theirs[@]}" \
        XR_RUNTIME_JSON=/usr/share/openxr/1/openxr_monado.json "$@"
    if is_gone "$service"; then
        say "Monado ended before the command did; see $log"
    else
        kill "$service" 2>/dev/null || true
        within 5 is_gone "$service" || kill -KILL "$service" 2>/dev/null || true
    fi
    exit "$status"
}

need_setup() {
    if ! is_ours || ! [ -f "$dir/installed" ]; then fail "$dir is not set up: monado.sh setup${given:+ $given}"; fi
}

# What --bind shows must not hide the chroot's own, and needs a place that can be made.
may_bind() {
    case "$1" in
        / | /run | /bin | /sbin | /lib* | /usr | /usr/* | /etc | /etc/* | /var | /var/* | /dev | /dev/* | /proc | /proc/* | /sys | /sys/*)
            wrong "$1 cannot be bound: the chroot has its own there" ;;
        *'
'*) wrong "a path with a line break cannot be bound" ;;
    esac
}

# run WAY:PATH... -- COMMAND..., Monado's messages to $log; leaves the exit status in $status.
run() {
    need
    lock --shared
    local binds=() authority=${XAUTHORITY:-${HOME:-/root}/.Xauthority}
    while [ "$1" != -- ]; do
        binds+=("$1")
        shift
    done
    if [ -d /tmp/.X11-unix ]; then
        binds+=(ro:/tmp/.X11-unix)
        [ ! -f "$authority" ] || { binds+=("ro:$authority"); export XAUTHORITY=$authority; }
    fi
    # outer folders before those in them
    [ ${#binds[@]} = 0 ] || mapfile -t binds < <(printf '%s\n' "${binds[@]}" | sort -u -t : -k 2)
    contained serve "$dir" "$log" "${binds[@]}" "$@"
}

# ---- test

try() {
    local seconds=15 out=$dir/test.log made submitted
    say "hello_xr -G Vulkan2 for $seconds s; its log is $out"
    # hello_xr ends when its standard input does. The layer writes every call of OpenXR down, from which the frames are counted.
    # shellcheck disable=SC2016 # expanded in there
    run -- sh -c '
        export XR_ENABLE_API_LAYERS=XR_APILAYER_LUNARG_api_dump XR_API_DUMP_FILE_NAME=/tmp/calls
        sleep "$1" | timeout -k 5 "$(($1 + 45))" hello_xr -v -G Vulkan2
        code=$?
        echo "submitted $(grep -ao "frameEndInfo->layerCount = 0x[1-9a-f]" /tmp/calls | wc -l)"
        exit $code' sh "$seconds" </dev/null >"$out" 2>&1
    grep -E 'RuntimeName=|View \[|Creating swapchain|action is bound|Name=Monado' "$out" | sed 's/^\[[^]]*\]\[[^]]*\] */  /' | sort -u >&2
    made=$(grep -c 'Creating swapchain for view' "$out" || true)
    submitted=$(sed -n 's/^submitted //p' "$out")
    say "swapchains made: $made; frames submitted in $seconds s: ${submitted:-0}"
    [ "$status" = 0 ] || fail "hello_xr ended with $status; see $out and $log"
    [ "$made" = 2 ] || fail "it must have made a swapchain for each eye; see $out"
    [ "${submitted:-0}" -gt 0 ] || fail "it must have submitted frames; see $out and $log"
    say "works"
}

# ---- clean

clean() {
    if [ ! -e "$dir" ]; then
        say "$dir is not there"
        return
    fi
    is_ours || fail "$dir is not of our making: nothing removed"
    need
    lock --exclusive
    local point
    while read -r point; do
        say "unmounting $point"
        umount -- "$point"
    done < <(mounts_in "$dir" | grep -vxF -e "$dir" || true)
    local name
    for name in root root.new view; do remove "$dir/$name"; done
    rm -f -- "$dir/installed" "$dir/setup.log" "$dir/install.log" "$dir/service.log" "$dir/test.log" "$(marker)"
    if rmdir -- "$dir" 2>/dev/null; then say "$dir is removed"; else say "$dir holds things of others, and stays; ours are removed"; fi
}

# ---- arguments

command=${1:-help}
[ $# -eq 0 ] || shift
case "$command" in
    inside) "inside_$1" "${@:2}"; exit ;;
    setup | run | test | clean) ;;
    help | -h | --help) usage; exit 0 ;;
    *) wrong "there is no command $command" ;;
esac

dir='' log='' binds=()
while [ $# -gt 0 ]; do
    case "$1" in
        --bind | --bind-rw | --log | --) [ "$command" = run ] || wrong "$command takes a folder, no $1" ;;
    esac
    case "$1" in
        --) break ;;
        --bind | --bind-rw)
            [ $# -ge 2 ] || wrong "$1 needs a path"
            path=$(realpath -es -- "$2" 2>/dev/null) || wrong "$2 is not there"
            may_bind "$path"
            case "$1" in --bind) binds+=("ro:$path") ;; *) binds+=("rw:$path") ;; esac
            shift 2
            ;;
        --log)
            [ $# -ge 2 ] || wrong "$1 needs a file"
            log=$(realpath -m -- "$2")
            shift 2
            ;;
        -h | --help) usage; exit 0 ;;
        -*) wrong "there is no option $1" ;;
        *)
            [ -z "$dir" ] || wrong "one folder only, not also $1"
            dir=$1
            shift
            ;;
    esac
done
[ "$command" != run ] || [ $# -ge 2 ] || wrong "run needs -- and a command"
given=$dir
dir=$(realpath -m -- "${dir:-${XDG_CACHE_HOME:-$HOME/.cache}/heliodon/monado}")
log=${log:-$dir/service.log}
need_root
case "$command" in
    setup) setup ;;
    run)
        need_setup
        run "${binds[@]}" "$@"
        exit "$status"
        ;;
    test)
        need_setup
        try
        ;;
    clean) clean ;;
esac
