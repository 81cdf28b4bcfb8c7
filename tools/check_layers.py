#!/usr/bin/env python3
"""Checks that every #include goes along an allowed edge between modules (ARCHITECTURE.md)."""
import pathlib
import re
import sys

CALIBRATIONS = {"pressure_advance", "tap", "tool_offset", "part_alignment"}
PURE = {"base", "geometry", "signal", "vision", "gcode", "settings"}
ALLOWED = {
    "base": set(),
    "files": {"base"},
    "geometry": {"base"},
    "image": {"base"},
    "signal": {"base", "geometry"},
    "vision": {"base", "geometry"},
    "gcode": {"base", "geometry"},
    "settings": {"base", "gcode"},
    "pressure_advance": PURE,
    "tap": PURE,
    "tool_offset": PURE,
    "part_alignment": PURE,
    "machine": {"base", "files", "geometry", "image"},
    "store": {"base", "files", "settings"} | CALIBRATIONS,
    "report": {"base", "image", "settings"} | CALIBRATIONS,
    "procedure": PURE | CALIBRATIONS | {"files", "machine", "store"},
    "sim": {"base", "files", "geometry", "image"},
    "app": PURE | CALIBRATIONS | {"files", "machine", "store", "procedure", "report", "sim"},
}
# Rooms that have rooms of their own: what each of those may include of its siblings.
INNER = {
    "part_alignment": {
        "camera": set(),
        "targets": {"camera"},
        "pose": {"camera", "targets"},
        "views": {"camera", "pose"},
        "budget": {"camera", "pose"},
        "correction": {"camera", "pose"},
        "part_fit": set(),
    },
}
# What tests/support may include: its worlds share no code with sim, nor with what they judge.
SUPPORT_ALLOWED = {"base", "geometry", "support"}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def violations(root):
    """Yields one line of text for each include that no allowed edge covers."""
    for path in sorted((root / "src").rglob("*")):
        if path.suffix not in {".h", ".cc"}:
            continue
        module = path.relative_to(root / "src").parts[0]
        if module not in ALLOWED:
            yield f"{path}: module '{module}' has no entry in tools/check_layers.py"
            continue
        for target in INCLUDE.findall(path.read_text()):
            head, slash, _ = target.partition("/")
            if head == "support" and path.name.endswith(("_test.cc", "_test_support.h")):
                continue  # tests/support
            if not slash or not (root / "src" / target).is_file():
                yield f'{path}: include "{target}" is not a path below src/'
            elif head != module and head not in ALLOWED[module]:
                yield f'{path}: {module} must not include {head} ("{target}")'
            elif head == module and module in INNER:
                yield from inner_violations(path, path.relative_to(root / "src").parts, target)


def inner_violations(path, parts, target):
    """The same between the rooms of one module; `parts` and `target` are paths below src/."""
    allowed = INNER[parts[0]]
    room, other = parts[1], target.split("/")[1]
    for name in (room, other):
        if name not in allowed:
            yield f"{path}: {parts[0]} has no room '{name}' in tools/check_layers.py"
            return
    if other != room and other not in allowed[room]:
        yield f'{path}: {parts[0]}/{room} must not include {parts[0]}/{other} ("{target}")'


def support_violations(root):
    """The same for tests/support, whose own headers are included as "support/..."."""
    for path in sorted((root / "tests" / "support").rglob("*")):
        if path.suffix not in {".h", ".cc"}:
            continue
        for target in INCLUDE.findall(path.read_text()):
            head, slash, _ = target.partition("/")
            base = root / "tests" if head == "support" else root / "src"
            if not slash or not (base / target).is_file():
                yield f'{path}: include "{target}" is neither a path below src/ nor support/'
            elif head not in SUPPORT_ALLOWED:
                yield f'{path}: tests/support must not include {head} ("{target}")'


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    found = list(violations(root)) + list(support_violations(root))
    for line in found:
        print(line)
    print(f"{len(found)} layer violation(s)")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
