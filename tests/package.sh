#!/usr/bin/env bash
# Installs the package DEB in a Debian 13 that DEBIAN13, a script, sets up afresh, and renders with it:
#   tests/package.sh DEBIAN13 DEB
set -euo pipefail
debian13=$1 deb=$2
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
# A system of its own: no build of the project has left anything there.
export DEBIAN13=${TWEENRAY_PACKAGE_ROOT:-${XDG_CACHE_HOME:-$HOME/.cache}/debian13-package}
mkdir -p "$(dirname -- "$DEBIAN13")"
"$debian13" --new --bare true
install -d "$DEBIAN13/deb"
cp -- "$deb" "$DEBIAN13/deb/"
# shellcheck disable=SC2016  # for the shell there
"$debian13" --bare '
set -eu
apt-get update -qq >/dev/null
apt-get install -y -qq --no-install-recommends /deb/*.deb >/dev/null
cd /tmp
tweenray --version
! ldd /usr/bin/tweenray | grep "not found"
tweenray render /project/scenes/cornell/scene.toml -o one.png --frames 1 --size 64x64 --spp 1 --overwrite
[ "$(head -c 4 one.png | tail -c 3)" = PNG ]
if ldd /usr/bin/tweenray | grep -q libmpi; then
  export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
  mpirun --oversubscribe -n 2 tweenray render /project/scenes/cornell/scene.toml -o two.png --frames 1 --size 64x64 --spp 1 --overwrite
  cmp one.png two.png
fi
test -s /usr/share/man/man1/tweenray-render.1.gz
test -s /usr/share/bash-completion/completions/tweenray
bash -n /usr/share/bash-completion/completions/tweenray
apt-get remove -y -qq tweenray >/dev/null
test ! -e /usr/bin/tweenray
'
echo "package: installed in a fresh Debian 13, renders, alone and in two processes, and is removed"
