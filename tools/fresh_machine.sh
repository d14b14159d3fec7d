#!/usr/bin/env bash
# Tests the program on a fresh Debian as a new user would: tools/fresh_machine.sh [--short] SUITE
#
#   SUITE     bookworm, trixie, forky or another suite of the machine's Debian mirror
#   --short   run the set-up, one bench, two figures about graphics cards, and a part of the tests;
#             without --short, run `make figures`, `make test` and the bench
#
# Creates a root file system with debootstrap in a temporary folder, clones the committed state of
# this checkout into it, runs the commands there, and prints versions, results and times. The
# fresh machine uses the Debian mirror, the proxies, the certificates and pip's configuration of
# this machine. Exit status: 0 for success; 1 if a command failed in the fresh machine; 77 with a
# line SKIPPED if no fresh machine can be made. FRESH_MINUTES limits the time (15 with --short,
# else 90). The script copies the new root file system before the first command runs there, keeps
# the copy in ${XDG_CACHE_HOME:-~/.cache}/gpgpu_rt-fresh, and uses it again for a week.
set -euo pipefail

SHORT=
if [ "${1:-}" = --short ]; then SHORT=1; shift; fi
SUITE=${1:-}
HERE=$(cd "$(dirname "$0")/.." && pwd)
PATH=$PATH:/usr/sbin:/sbin

skipped() { echo "SKIPPED: fresh machine with ${SUITE:-no suite}: $*"; exit 77; }

# This part runs inside a separate mount namespace. Its mounts disappear with the namespace. The
# outer script, which removes the root, does not see the mounts, so it cannot remove files below
# them.
if [ "${FRESH_INSIDE:-}" = 1 ]; then
    root=$FRESH_ROOT
    mount -t proc proc "$root/proc"
    mount --bind /dev "$root/dev"
    mount -t tmpfs tmpfs "$root/dev/shm"
    while read -r folder; do
        mkdir -p "$root$folder"
        mount --bind "$folder" "$root$folder"
        mount -o remount,bind,ro "$root$folder"
    done < "$root.folders"
    mapfile -t variables < "$root.environment"
    exec chroot "$root" env -i HOME=/root TERM=dumb LANG=C.UTF-8 SHORT="$SHORT" \
        PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
        "${variables[@]}" bash /root/newcomer
fi

[[ $SUITE =~ ^[a-z]+$ ]] || { echo "usage: tools/fresh_machine.sh [--short] SUITE" >&2; exit 2; }
[ "$(id -u)" = 0 ] || skipped "only root can make a fresh machine"
command -v debootstrap >/dev/null || skipped "debootstrap is not installed (apt-get install debootstrap)"
unshare --mount --pid --fork --propagation private true 2>/dev/null ||
    skipped "this machine allows no mount namespace"
git -C "$HERE" rev-parse --verify -q HEAD >/dev/null || skipped "$HERE is no checkout of git"

# Use the mirror of this machine's own Debian.
mirror=$(apt-get indextargets --format '$(ORIGIN)|$(LABEL)|$(REPO_URI)' 'Created-By: Packages' \
    2>/dev/null | sed -n 's/^Debian|Debian|//p' | head -1)
if [ -z "$mirror" ]; then     # package lists were never fetched: use the first configured source
    mirror=$(sed -n -e 's/^URIs: *\([^ ]*debian\/*\)$/\1/p' \
        -e 's/^deb  *\(\[[^]]*\]  *\)\{0,1\}\([^ ]*debian\/*\) .*/\2/p' \
        /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | head -1 || true)
fi
[ -n "$mirror" ] || skipped "apt's configuration names no mirror of Debian"

work=$(mktemp -d "${TMPDIR:-/tmp}/fresh-$SUITE.XXXXXX")
root=$work/root
clean() {
    if grep -q " $work" /proc/mounts; then
        echo "something is mounted under $work: unmount it and remove it by hand" >&2
    else
        rm -rf --one-file-system "$work"
    fi
}
trap clean EXIT
trap 'exit 130' INT TERM HUP
began=$SECONDS

# Base root -----------------------------------------------------------------------------------

cache=${XDG_CACHE_HOME:-$HOME/.cache}/gpgpu_rt-fresh
base=$cache/$SUITE-$(dpkg --print-architecture).tar
mkdir -p "$cache" "$root"
if [ -n "$(find "$base" -mtime -7 2>/dev/null)" ]; then
    tar -C "$root" -xf "$base"
    echo "fresh machine: Debian $SUITE, as debootstrap made it on $(date -r "$base" +%F)"
else
    script=$SUITE      # use the script of sid for a suite that this debootstrap does not know
    [ -e "/usr/share/debootstrap/scripts/$SUITE" ] || script=sid
    if ! debootstrap --variant=minbase --include=python3,make,git,ca-certificates "$SUITE" \
            "$root" "$mirror" "/usr/share/debootstrap/scripts/$script" > "$work/log" 2>&1; then
        tail -5 "$work/log" >&2
        skipped "debootstrap had no success: no network, or no such suite"
    fi
    rm -rf "$root"/var/cache/apt/archives/*.deb
    tar -C "$root" -cf "$base.$$" . && mv "$base.$$" "$base"
    echo "fresh machine: Debian $SUITE by debootstrap, $((SECONDS - began)) s"
fi

# Network configuration -------------------------------------------------------------------------

mkdir -p "$root/usr/local/share/ca-certificates" "$root/etc/apt/apt.conf.d"
cp /etc/resolv.conf /etc/hosts "$root/etc/"
find /usr/local/share/ca-certificates -name '*.crt' -exec \
    cp {} "$root/usr/local/share/ca-certificates/" \; 2>/dev/null || true
chroot "$root" update-ca-certificates >/dev/null 2>&1
apt-config dump | grep -E '^Acquire::(https?|ftp|Check-)' > "$root/etc/apt/apt.conf.d/00machine" ||
    true
echo "deb $mirror $SUITE main" > "$root/etc/apt/sources.list"

# Copy the environment variables and pip's settings unchanged. Also copy the files, and mount
# (read-only) the folders, that these settings name.
env | grep -iE '^(https?_proxy|no_proxy|all_proxy|PIP_[A-Z_]*|SSL_CERT_(FILE|DIR)|[A-Z]*_CA_BUNDLE)=' \
    > "$root.environment" || true
: > "$root.pip"
pip=$(command -v pip3 || command -v pip || true)
if [ -n "$pip" ]; then
    "$pip" config list 2>/dev/null |
        sed -n "s/^\(global\|install\)\.\([a-z-]*\)='\(.*\)'$/\1 \2 = \3/p" | sort > "$root.pip"
fi
awk '$1 != section { section = $1; print "[" section "]" } { sub(/^[^ ]* /, ""); print }' \
    "$root.pip" > "$root/etc/pip.conf"
: > "$root.folders"
{ sed 's/^[^=]*=//' "$root.environment"; cat "$root.pip"; } | tr ' ' '\n' |
    sed -n 's|^\(file://\)\{0,1\}\(/.*\)$|\1\2|p' | sort -u | while read -r path; do
    real=${path#file://}
    # A package index with a file:// address refers to files beside the index, so mount the
    # index's parent folder.
    if [ "$real" != "$path" ] && [ "$(dirname "$real")" != / ]; then real=$(dirname "$real"); fi
    if [ -f "$real" ] && [ ! -e "$root$real" ]; then
        mkdir -p "$root$(dirname "$real")" && cp "$real" "$root$real"
    elif [ -d "$real" ] && [ ! -d "$root$real" ]; then
        echo "$real" >> "$root.folders"
    fi
done
sort -u -o "$root.folders" "$root.folders"

# Commands of a new user ------------------------------------------------------------------------

git clone -q --no-hardlinks "$HERE" "$root/root/gpgpu_rt"
[ -z "$(git -C "$HERE" status --porcelain)" ] ||
    echo "fresh machine: changes that are not committed are left out"
cat > "$root/root/newcomer" <<'NEWCOMER'
cd /root/gpgpu_rt || exit 1
failed=
try() {
    local began=$SECONDS said=/tmp/said status=0
    "$@" > "$said" 2>&1 || status=$?
    echo "== $* : exit $status, $((SECONDS - began)) s"
    grep -E '(passed|failed).* in [0-9.]+s|cells left out' "$said" || true
    if [ "$status" != 0 ]; then
        failed="$failed; $*"
        grep -E '^(FAILED|ERROR) ' "$said" | head -60 || true
        grep -E '^E  ' "$said" | cut -c1-300 | head -60 || true    # why the tests failed
        tail -n 25 "$said"
    fi
}
ended() { echo "== fresh machine: ${failed:-; all went well}, $SECONDS s" | sed 's/: ; /: /'; }
BENCH=(.venv/bin/gpgpu-rt bench cornell --size 64 -m grid --runs 1)
if [ -n "$SHORT" ]; then
    try make setup
else
    try make figures
fi
. /etc/os-release
echo "$PRETTY_NAME; $(python3 -V); $(dpkg-query -W -f '${Package} ${Version}; ' libgl1-mesa-dri \
    libosmesa6 2>/dev/null)"
.venv/bin/gpgpu-rt info 2>&1 | sed 's/^/    /'
try "${BENCH[@]}"
if [ -n "$SHORT" ]; then
    try .venv/bin/python -m gpgpu_rt.figures --only retention stacks
    try .venv/bin/python tools/run_tests.py -- -q tests/hardware tests/bench tests/repro \
        tests/traversal/test_hits.py tests/traversal/test_packet_tiles.py
else
    try make test
fi
ended
[ -z "$failed" ]
NEWCOMER

minutes=${FRESH_MINUTES:-$([ -n "$SHORT" ] && echo 15 || echo 90)}
status=0
FRESH_INSIDE=1 FRESH_ROOT=$root timeout --kill-after=20 "${minutes}m" \
    unshare --mount --pid --fork --kill-child --propagation private \
    bash "$0" ${SHORT:+--short} "$SUITE" &
# Run in the background and wait, so that a signal ends the inner process at once. Otherwise bash
# would handle the signal only after the inner process has ended.
inside=$!
trap 'kill "$inside" 2>/dev/null; wait "$inside" || true; exit 130' INT TERM HUP
wait "$inside" || status=$?
[ "$status" != 124 ] || echo "fresh machine: stopped after $minutes minutes"
echo "fresh machine: $SUITE, $((SECONDS - began)) s in all, exit $status"
[ "$status" = 0 ] || exit 1
