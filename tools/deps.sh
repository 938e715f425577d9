#!/bin/sh
# Installs the Debian packages that Klingel's build, tools and tests need. Says what it does before it does it.
# usage: tools/deps.sh [--help] [--list]
set -eu
packages="gcc libc6-dev make pkg-config libcyaml-dev libyaml-dev liblapacke-dev libcmocka-dev clang clang-format valgrind
python3 python3-numpy python3-scipy python3-matplotlib python3-can python3-canmatrix can-utils
qemu-system-x86 qemu-system-arm gcc-arm-none-eabi libnewlib-arm-none-eabi python3-serial qemu-user
gcc-aarch64-linux-gnu libc6-dev-arm64-cross gcc-riscv64-linux-gnu libc6-dev-riscv64-cross busybox-static cpio kmod iproute2 rt-tests"

case "${1:-}" in
--help) sed -n '2,3p' "$0" | sed 's/^# //'; exit 0 ;;
--list) echo $packages; exit 0 ;;
"") ;;
*) echo "deps.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
esac

missing=""
for p in $packages; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$p" 2>/dev/null)" != installed ]; then
        missing="$missing $p"
    fi
done
[ -z "$missing" ] && exit 0

as_root=""
if [ "$(id -u)" -ne 0 ]; then
    as_root="sudo"
    command -v sudo >/dev/null || {
        echo "deps.sh: these Debian packages are missing, and there is no sudo to install them:$missing" >&2
        exit 1
    }
fi
echo "Installing Debian packages${as_root:+ with sudo}:$missing"
$as_root apt-get update -qq
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing >/dev/null
echo "Installed."
