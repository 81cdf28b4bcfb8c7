#!/bin/sh
# install.sh [--help]: makes the trammel that lies beside this script known to the printers of this computer.
folder=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd -P) || exit 1
python=/usr/bin/python3
[ -x "$python" ] || {
  echo "install.sh: $python is missing; Klipper and Moonraker need it, too: sudo apt install python3" >&2
  exit 1
}
# Isolated (-I): modules come from Python's own folders and from this one, never from the current folder or the environment.
exec "$python" -I -B -c 'import runpy, sys; sys.path.insert(0, sys.argv.pop(1)); runpy.run_module("installer", run_name="__main__")' \
  "$folder/share/trammel" --program "$folder" "$@"
