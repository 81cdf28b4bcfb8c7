#!/bin/sh
# install.sh [--help]: makes the trammel that lies beside this script known to the printers of this computer.
folder=$(cd "$(dirname "$0")" && pwd -P) || exit 1
command -v python3 > /dev/null || {
  echo "install.sh: python3 is missing; Klipper and Moonraker need it, too: sudo apt install python3" >&2
  exit 1
}
PYTHONPATH=$folder/share/trammel exec python3 -B -m installer --program "$folder" "$@"
