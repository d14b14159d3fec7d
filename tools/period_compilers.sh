#!/usr/bin/env bash
# Builds the compilers of the cards of 2002-2006 into a folder: tools/period_compilers.sh FOLDER
#
# Mesa still has the drivers of R300 to R580 and of NV30 to G80, and a shim that starts a driver without its
# card. The source package comes from the Debian mirror of this machine. Needs root, for apt-get, and about
# ten minutes on two cores. Afterwards run tools/static_costs.py --drivers FOLDER.
set -euo pipefail

[ $# = 1 ] || { echo "usage: tools/period_compilers.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
cd "$1"
folder=$PWD
SUITE=trixie     # Mesa 25.0.7

sources=/etc/apt/sources.list.d/period-compilers.sources
if [ ! -e "$sources" ]; then
    mirror=$(apt-get indextargets --format '$(ORIGIN)|$(LABEL)|$(REPO_URI)' 'Created-By: Packages' |
        sed -n 's/^Debian|Debian|//p' | head -1)
    [ -n "$mirror" ] || { echo "apt's configuration names no mirror of Debian" >&2; exit 1; }
    printf '%s\n' "Types: deb-src" "URIs: $mirror" "Suites: $SUITE" "Components: main" \
        "Signed-By: /usr/share/keyrings/debian-archive-keyring.gpg" > "$sources"
    apt-get update -qq
fi
DEBIAN_FRONTEND=noninteractive apt-get install -y -qq gcc g++ ninja-build bison flex pkg-config \
    libdrm-dev libexpat1-dev zlib1g-dev libelf-dev python3-venv > /dev/null
if [ ! -x tools/bin/meson ]; then
    python3 -m venv tools
    tools/bin/pip install -q 'meson>=1.4' mako packaging pyyaml
fi
if [ ! -d source ]; then
    apt-get source --download-only -qq "mesa/$SUITE"
    mkdir source
    tar xf mesa_*.orig.tar.xz -C source --strip-components=1
fi
cd source
PATH=$folder/tools/bin:$PATH
[ -d build ] || meson setup build --buildtype=release -Dgallium-drivers=r300,nouveau,softpipe \
    -Dvulkan-drivers= -Dplatforms= -Degl=enabled -Dgbm=enabled -Dglx=disabled -Dgles1=disabled \
    -Dgles2=enabled -Dllvm=disabled -Dvideo-codecs= -Dtools=drm-shim -Dshader-cache=disabled \
    -Dvalgrind=disabled -Dlibunwind=disabled -Dlmsensors=disabled -Dzstd=disabled -Dglvnd=disabled
ninja -C build
DESTDIR=$folder/installed ninja -C build install > /dev/null
ls "$folder"/installed/usr/local/lib/*/libradeon_noop_drm_shim.so
