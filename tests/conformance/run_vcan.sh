#!/bin/sh
# Runs the conformance suite on a real vcan0: on this machine if its kernel has CAN and a vcan0 that is up,
# else under Debian's own kernel in a QEMU guest (tools/vm/vcan_vm.py; fetches that kernel once, about 70 MB).
# usage: tests/conformance/run_vcan.sh [--help] [--native | --guest] CONFORMANCE_PROGRAM
# As root it makes the vcan0 that it needs and takes it away again. Exit status: 0 passed, 1 failed, 2 usage,
# 125 no guest to be had.
set -eu
here=$(cd "$(dirname "$0")/../.." && pwd)
usage() { sed -n '2,7p' "$0" | sed 's/^# //'; }

where=auto
case "${1:-}" in
--help) usage; exit 0 ;;
--native) where=native; shift ;;
--guest) where=guest; shift ;;
esac
[ $# -eq 1 ] || { usage >&2; exit 2; }
program=$1

# The suite takes the interface down and changes its queue: it needs root and an interface of its own.
made=""
native_works() {
    [ "$(id -u)" -eq 0 ] || return 1
    if ip link show vcan0 >/dev/null 2>&1; then return 0; fi
    ip link add dev vcan0 type vcan 2>/dev/null || return 1
    made=yes
    ip link set vcan0 mtu 72 && ip link set vcan0 up
}
if [ "$where" = auto ]; then
    if native_works; then where=native; else where=guest; fi
elif [ "$where" = native ]; then
    native_works || { echo "run_vcan.sh: no vcan0 here (needs root and a kernel with vcan)" >&2; exit 1; }
fi

status=0
case $where in
native) "$program" socketcan:vcan0 socketcan-fd:vcan0 || status=$? ;;
guest)
    echo "run_vcan.sh: no vcan on this machine; running in a QEMU guest"
    "$here/tools/vm/vcan_vm.py" --timeout 240 -- "$program" socketcan:vcan0 socketcan-fd:vcan0 || status=$?
    ;;
esac
[ -z "$made" ] || ip link del vcan0
exit $status
