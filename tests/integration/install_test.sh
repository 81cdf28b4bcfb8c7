#!/usr/bin/env bash
# install_test.sh BUILD SOURCE VERSION: what cmake --install leaves can be used by itself, in whatever folder.
set -euo pipefail
build=$1 source=$2 version=$3
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cmake --install "$build" --prefix "$folder/installed" > "$folder/log"
mv "$folder/installed" "$folder/moved"

said=$("$folder/moved/bin/trammel" --version)
[[ $said == "trammel $version" ]] || { echo "--version says: $said"; exit 1; }
# The modules are found beside the program, and only there.
printf '%%PDF-1.4\n' > "$folder/page.pdf"
"$folder/moved/bin/trammel" align survey "$folder/page.pdf" > "$folder/read" 2>&1 && exit 1
if grep -q 'trammel-pdf' "$folder/read"; then cat "$folder/read"; exit 1; fi
rm -r "$folder/moved/lib/trammel"
"$folder/moved/bin/trammel" align survey "$folder/page.pdf" > "$folder/read" 2>&1 && exit 1
grep -q 'trammel-pdf' "$folder/read" || { cat "$folder/read"; exit 1; }

cmake -S "$source/tests/integration/installed" -B "$folder/consumer" -DCMAKE_PREFIX_PATH="$folder/moved" \
  -DEXAMPLE="$source/examples/tap/tap.c" > "$folder/log"
cmake --build "$folder/consumer" >> "$folder/log" || { cat "$folder/log"; exit 1; }
"$folder/consumer/tap" /nonexistent > "$folder/answer" 2>&1 && exit 1
# So do those that ask pkg-config.
PKG_CONFIG_PATH=$(dirname "$(find "$folder/moved" -name trammel-tap.pc)")
export PKG_CONFIG_PATH
[[ $(pkg-config --modversion trammel-tap) == "$version" ]]
read -ra flags < <(pkg-config --cflags --libs trammel-tap)
cc -o "$folder/by_pkg_config" "$source/examples/tap/tap.c" "${flags[@]}"
LD_LIBRARY_PATH=$(pkg-config --variable=libdir trammel-tap) "$folder/by_pkg_config" /nonexistent > "$folder/answer" 2>&1 && exit 1
# The extra finds the library that was installed with it.
found=$(PYTHONPATH="$folder/moved/share/trammel/klipper" python3 -B -c 'from trammel_tap.library import library_path; print(library_path())')
[[ $found == "$folder/moved/lib/"*libtrammel_tap.so.1 ]] || { echo "library_path() says: $found"; exit 1; }

# A shell completes commands and options by it; man has every command.
grep -q '^\.SS .*trammel pa analyze' "$folder/moved/share/man/man1/trammel.1"
source "$folder/moved/share/bash-completion/completions/trammel"
completed() {
  COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
  _trammel_words
  echo "${COMPREPLY[*]}"
}
[[ $(completed trammel pa ana) == analyze ]]
[[ $(completed trammel --) == *--version* ]]
[[ $(completed trammel pa analyze some/folder --figu) == --figures ]]
[[ -z $(completed trammel pa analyze some/fo) ]]
# -o and --out are one everywhere.
if grep -e "options=.* --out " -e "options=.* -o " "$folder/moved/share/bash-completion/completions/trammel" |
  grep -v -e ' --out -o '; then
  echo "these take only one of -o and --out"
  exit 1
fi

for file in klipper/trammel.cfg klipper/trammel_tap/__init__.py examples/alignment/scene.json; do
  cmp "$source/$file" "$folder/moved/share/trammel/$file"
done
