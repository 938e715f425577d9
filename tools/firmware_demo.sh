#!/bin/sh
# The demonstration of the firmware: the two-axle wagon as a bare-metal program for a Cortex-M7 (Arm MPS2 board, AN500)
# in QEMU, stepped by its timer interrupt; its UART, a pty here, speaks slcan; stock python-can starts it, gives it a
# speed, reads its states and draws them. QEMU without acceleration keeps no real time on a busy machine: look at
# counters and values, not at timing; late frames and overruns are let pass.
# usage: tools/firmware_demo.sh [--help] [--seconds N] [--speed V] [--out DIR]
set -eu
seconds=20
speed=27
out=build/firmware-demo
klingel=${KLINGEL:-build/klingel}
firmware=${FIRMWARE:-build/firmware/wagon.elf}
divider=20
while [ $# -gt 0 ]; do
    case "$1" in
    --help) sed -n "2,6p" "$0" | sed 's/^# //'; exit 0 ;;
    --seconds) seconds=${2:?--seconds needs a number}; shift 2 ;;
    --speed) speed=${2:?--speed needs a number}; shift 2 ;;
    --out) out=${2:?--out needs a folder}; shift 2 ;;
    *) echo "firmware_demo.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
    esac
done
mkdir -p "$out"
rm -f "$out/states.png" "$out/bus.log" "$out/qemu.txt"
"$klingel" dbc models/two_axle_wagon.yaml --state-divider $divider -o "$out/wagon.dbc"

echo "Starting the firmware: $firmware in qemu-system-arm -machine mps2-an500."
qemu-system-arm -machine mps2-an500 -kernel "$firmware" -display none -monitor none -serial pty >"$out/qemu.txt" 2>&1 &
qemu=$!
trap 'kill $qemu 2>/dev/null || true' EXIT INT TERM
pty=""
for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
    pty=$(sed -n 's/.*redirected to \(\/dev\/[^ ]*\).*/\1/p' "$out/qemu.txt")
    [ -n "$pty" ] && break
    sleep 0.25
done
[ -n "$pty" ] || { echo "firmware_demo.sh: QEMU gave no pty:" >&2; cat "$out/qemu.txt" >&2; exit 1; }
echo "Its UART is $pty; python-can: interface='slcan', channel='$pty', sleep_after_open=0"

status=0
/usr/bin/python3 tools/bench.py --bus "slcan:$pty" --dbc "$out/wagon.dbc" --start --speed "$speed" --tolerate late \
    --time "$seconds" --log "$out/bus.log" --plot "$out/states.png" || status=$?

kill $qemu 2>/dev/null || true
wait $qemu 2>/dev/null || true
trap - EXIT INT TERM
echo
echo "Picture: $out/states.png"
echo "Bus log: $out/bus.log (candump format)"
exit $status
