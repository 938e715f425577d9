#!/bin/sh
# The demonstration: a two-axle wagon runs at 1 kHz through a curve with irregularities; its states arrive, decoded,
# from a CAN bus (vcan0 where there is one, else a socketcand server on this machine); at the end a picture and a
# timing report. Late frames are shown but let pass: they are the machine's, and other programs run on it.
# usage: tools/demo.sh [--help] [--seconds N] [--bus auto|socketcand[:PORT]|IFACE] [--out DIR]
set -eu
seconds=30
bus=auto
out=build/demo
klingel=${KLINGEL:-build/klingel}
while [ $# -gt 0 ]; do
    case "$1" in
    --help) sed -n "2,5p" "$0" | sed 's/^# //'; exit 0 ;;
    --seconds) seconds=${2:?--seconds needs a number}; shift 2 ;;
    --bus) bus=${2:?--bus needs a name}; shift 2 ;;
    --out) out=${2:?--out needs a folder}; shift 2 ;;
    *) echo "demo.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
    esac
done
if [ "$bus" = auto ]; then
    if [ -e /sys/class/net/vcan0 ]; then bus=vcan0; else bus=socketcand; fi
fi
mkdir -p "$out"
rm -f "$out/states.png" "$out/timing.json" "$out/bus.log"
"$klingel" dbc models/two_axle_wagon.yaml -o "$out/wagon.dbc"

echo "Starting the plant model: two-axle wagon, 1 kHz, on $bus."
"$klingel" hil models/two_axle_wagon.yaml models/demo_track.yaml --bus "$bus" --speed 27 \
    --time $((seconds + 20)) --report "$out/timing.json" >"$out/hil.txt" 2>&1 &
hil=$!
trap 'kill -INT $hil 2>/dev/null || true' EXIT INT TERM

status=0
/usr/bin/python3 tools/bench.py --bus "$bus" --dbc "$out/wagon.dbc" --wait 20 --start --speed 27 \
    --tolerate late --time "$seconds" --log "$out/bus.log" --plot "$out/states.png" || status=$?

kill -INT $hil 2>/dev/null || true
wait $hil 2>/dev/null || true
trap - EXIT INT TERM
echo
cat "$out/hil.txt"
echo
echo "Picture:       $out/states.png"
echo "Timing report: $out/timing.json"
echo "Bus log:       $out/bus.log (candump format)"
exit $status
