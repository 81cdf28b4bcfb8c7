#!/usr/bin/env bash
# instruments_test.sh SOURCE: each instrument builds without the others and the tests without the studies, and a build says
# what it cannot leave out.
set -euo pipefail
source=$1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
configure() {  # FOLDER OPTIONS...
  cmake -G Ninja -S "$source" -B "$folder/$1" -DTRAMMEL_ARAVIS=OFF "${@:2}" \
    > "$folder/log" 2>&1
}
instruments=(pressure_advance tap tool_offset part_alignment)

for only in "${instruments[@]}"; do
  configure "$only" -DTRAMMEL_TESTS=OFF "-DTRAMMEL_INSTRUMENTS=$only" || { cat "$folder/log"; exit 1; }
  ninja -C "$folder/$only" -t commands trammel > "$folder/commands"
  for other in "${instruments[@]}"; do
    compiled=$(grep -cE -- "-c $source/src/$other/commands/" "$folder/commands" || true)
    if [[ $other == "$only" && $compiled -eq 0 ]] || [[ $other != "$only" && $compiled -ne 0 ]]; then
      echo "TRAMMEL_INSTRUMENTS=$only compiles $compiled of the commands of $other"
      exit 1
    fi
  done
done

refused() {  # WORDS OPTIONS...
  if configure refused "${@:2}"; then echo "${*:2}: not refused"; exit 1; fi
  tr -s ' \n' ' ' < "$folder/log" | grep -qF "$1" || { cat "$folder/log"; exit 1; }
}
refused "there is no taps" -DTRAMMEL_INSTRUMENTS=taps -DTRAMMEL_TESTS=OFF
refused "leaves tool_offset out" "-DTRAMMEL_INSTRUMENTS=pressure_advance;tap;part_alignment" -DTRAMMEL_TESTS=ON

# Tests do not need the studies, which only ./test slow and continuous integration build.
cmake -G Ninja -S "$source" -B "$folder/without_studies" -DTRAMMEL_TESTS=ON -DTRAMMEL_STUDIES=OFF > "$folder/log" 2>&1 ||
  { cat "$folder/log"; exit 1; }
