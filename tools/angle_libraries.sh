#!/bin/sh
# Fetches ANGLE and SwiftShader for the context `angle`: tools/angle_libraries.sh FOLDER
#
# The libraries come from an npm package of Chromium 147, because Debian's Chromium 156 has ANGLE only
# inside its executable. The script needs npm and node, and about 150 MB in a temporary folder.
set -eu

PACKAGE=@sparticuz/chromium@147.0.0
DIGEST=18fe5404ce845594cd7d592fc07f37a19514079ba4d9c27192ad8b908743f16b

[ $# = 1 ] || { echo "usage: tools/angle_libraries.sh FOLDER" >&2; exit 2; }
for program in npm node; do
    command -v $program > /dev/null || { echo "$program is missing; install nodejs and npm" >&2; exit 1; }
done
mkdir -p "$1"
folder=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
archive=$(npm pack --silent $PACKAGE)
echo "$DIGEST  $archive" | sha256sum --check --quiet
tar xzf "$archive" package/bin/swiftshader.tar.br
node -e 'const fs = require("fs"); fs.writeFileSync("libraries.tar",
    require("zlib").brotliDecompressSync(fs.readFileSync("package/bin/swiftshader.tar.br")))'
tar xf libraries.tar --no-same-owner -C "$folder"
echo "export GPGPU_RT_ANGLE=$folder"
