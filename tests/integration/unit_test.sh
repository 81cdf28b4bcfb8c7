#!/usr/bin/env bash
# unit_test.sh UNIT: how far the service's unit opens the computer, and that systemd understands each of its lines.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
unit=$folder/trammel@daemon.service
sed "s#/usr/bin/trammel#/bin/true#" "$1" > "$unit"

# In tenths: systemd calls below 2 OK and above 9 UNSAFE; this unit without its sandbox has 9.2.
systemd-analyze security --offline=true --no-pager --threshold=20 "$unit" > "$folder/exposure" || {
  grep -E '✗|→' "$folder/exposure"
  exit 1
}
tail -n 1 "$folder/exposure"
said=$(systemd-analyze verify "$unit" 2>&1) || true
[[ -z $said ]] || { echo "$said"; exit 1; }
# The thread that fetches frames is to raise itself (base/thread_priority.h), whatever else the unit forbids.
grep -qx 'LimitRTPRIO=1' "$unit"
if grep -E '^(RestrictRealtime=(yes|true|1)|SystemCallFilter=~.*@resources)' "$unit"; then exit 1; fi
# A folder that is not there yet must not keep the service from the command that makes it.
if grep '^ReadWritePaths=' "$unit" | cut -d= -f2 | tr ' ' '\n' | grep -v '^-'; then exit 1; fi
