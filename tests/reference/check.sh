#!/bin/sh
# Regenerates every reference file and compares it with the committed one; exit 1 on a difference. Takes about a minute.
# usage: tests/reference/check.sh [--help]
set -u
case "${1:-}" in
--help) sed -n '2,3p' "$0" | sed 's/^# //'; exit 0 ;;
"") ;;
*) echo "check.sh: unknown argument '$1' (see --help)" >&2; exit 2 ;;
esac
cd "$(dirname "$0")" || exit 2
failed=0
for generator in geometry_arcs geometry_s1002_uic60 flange_s1002_uic60 hertz_kalker wheelset_run two_axle_modes track_path; do
    "${PYTHON:-/usr/bin/python3}" "$generator.py" --check || failed=1
done
exit $failed
