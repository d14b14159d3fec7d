#!/bin/sh
# Creates the virtual environment $1 with the package in it, and installs OpenGL libraries if they
# are missing.
set -eu
venv=$1
python=${PYTHON:-python3}

PATH=$PATH:/usr/sbin:/sbin     # the folders of ldconfig, which may be missing from the path
has_library() { ldconfig -p 2>/dev/null | grep -q "$1"; }
apt_install() {
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null
    else
        echo "Missing system packages. Run once, then make again:" >&2
        echo "    sudo apt-get update && sudo apt-get install -y $*" >&2
        exit 1
    fi
}

if ! { has_library libEGL.so.1 && has_library libGL.so.1; } && ! has_library libOSMesa.so; then
    apt_install libegl1 libgl1 libgl1-mesa-dri
fi
# Newer Mesa releases have no OSMesa. Without OSMesa, EGL is enough.
if ! has_library libOSMesa.so && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq libosmesa6 >/dev/null 2>&1 ||
        echo "libosmesa6 is not available: only EGL will be used."
fi

if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))'; then
    echo "Python 3.11 or later is needed, $python is $("$python" -V 2>&1); make PYTHON=..." >&2
    exit 1
fi
if [ ! -x "$venv/bin/python" ]; then
    if ! "$python" -m venv "$venv" >/dev/null 2>&1; then   # Debian packages venv separately
        rm -rf "$venv"
        apt_install python3-venv
        "$python" -m venv "$venv"
    fi
fi
echo "Installing the package and its dependencies in $venv; this takes one to three minutes."
# Print errors only (-qq): a warning of setuptools about the folders in package_dir is harmless.
"$venv/bin/python" -m pip install -qq --upgrade pip
"$venv/bin/python" -m pip install -qq --editable '.[test,figures,report,docs,lint]'
# Python searches the current folder before it asks setuptools' finder. If this folder holds the
# checkout as gpgpu_rt, Python would import the checkout itself. The .pth file below prevents this.
pwd > "$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/gpgpu_rt_checkout.pth"
echo "Done. Next: . $venv/bin/activate"
