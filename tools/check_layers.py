#!/usr/bin/env python3
"""Checks that every #include goes along an allowed edge between rooms (ARCHITECTURE.md)."""
import pathlib
import re
import sys

# Kernels and common rooms: what each may include besides itself.
COMMON = {
    "base": set(),
    "geometry": {"base"},
    "signal": {"base", "geometry"},
    "vision": {"base", "geometry"},
    "gcode": {"base", "geometry"},
    "image": {"base"},
    "files": {"base"},
    "settings": {"base", "gcode"},
    "measurement": {"base", "files"},
    "document": {"base", "image", "settings"},
    "machine": {"base", "files", "geometry", "image"},
    "session": {"base", "files", "machine", "settings"},
    "service": {"base", "document", "files", "machine", "measurement", "session", "settings"},
    "panel": {"base", "document", "files", "gcode", "machine", "measurement", "service"},
    "sim": {"base", "files", "geometry", "image"},
}
PURE = {"base", "geometry", "signal", "vision", "gcode", "settings"}
# Each instrument's pure rooms: what each may include of its siblings.
INSTRUMENTS = {
    "pressure_advance": {
        "profile": set(),
        "pattern": {"profile"},
        "recording": {"profile"},
        "timing": {"recording"},
        "laser": {"profile", "recording", "timing"},
        "photo": {"profile"},
        "response": {"profile"},
        "setup": {"pattern"},
        "flow": set(),
    },
    "tap": {
        "samples": set(),
        "two_line": {"samples"},
        "judge": {"samples", "two_line"},
        "contact": {"samples"},
        "analyse": {"samples", "two_line", "judge", "contact"},
        "ensemble": {"samples"},
    },
    "tool_offset": {
        "sheet": set(),
        "original": {"sheet"},
        "reading": {"sheet"},
        "offset": {"sheet", "reading"},
    },
    "part_alignment": {
        "network": set(),
        "camera": {"network"},
        "targets": {"camera"},
        "pose": {"camera", "network", "targets"},
        "views": {"camera", "pose"},
        "board": {"camera", "network", "targets", "pose", "views"},
        "budget": {"camera", "pose"},
        "correction": {"camera", "pose"},
        "mesh": set(),
        "part_fit": {"mesh"},
        "survey": {"camera", "network", "targets", "pose", "part_fit"},
    },
}
# The rooms in which an instrument meets the world: what each may include of the common rooms, and of
# its own instrument's rooms besides the pure ones.
ASPECTS = {
    "files": (PURE | {"files", "measurement"}, set()),
    "report": (PURE | {"document", "image"}, set()),
    "procedure": (PURE | {"files", "machine", "session"}, {"files"}),
    "commands": (
        PURE | {"app", "document", "files", "image", "machine", "measurement", "service", "session"},
        {"files", "report", "procedure"},
    ),
}
# Common rooms with rooms of their own: what each may include of its siblings.
INNER = {
    "machine": {
        "net": set(),
        "module": set(),
        "camera": {"net", "module"},
        "video": {"net", "module", "camera"},
        "page": {"net", "module"},
        "cad": {"net", "module"},
        "scanner": {"net", "module", "page"},
        "moonraker/link": {"net"},
        "moonraker": {"net", "moonraker/link"},
        "moonraker/client": {"net", "moonraker/link", "moonraker"},
        "moonraker/taps": {"net", "moonraker/link", "moonraker", "moonraker/client"},
        "linuxcnc": {"net"},
    },
    "sim": {
        "gcode": set(),
        "print": {"gcode"},
        "laser": {"print"},
        "cell": {"print"},
        "sheet": {"gcode", "print"},
        "scanner": {"print", "sheet"},
        "phone": {"camera", "sheet", "scanner"},
        "spindle": {"print", "camera"},
        "casting": set(),
        "survey": set(),
        "klipper": {"gcode", "print", "cell"},
        "camera": {"print", "laser", "klipper"},
        "photo": {"print", "camera"},
        "slicer_patterns": {"print", "photo"},
        "moonraker": {"camera", "klipper"},
    },
}
# app: what all commands share; trammel.toml is put together from the tables of the instruments, and
# main is a table.
APP_SHARED = {
    "base", "document", "files", "machine", "measurement", "panel", "service", "session", "settings",
}
APP_CONFIG = {"base", "files", "settings", "pressure_advance/pattern", "tool_offset/sheet"}
# trammel-sim's commands stand on what all commands share, and print codes of the real book.
SIM_COMMANDS = {"app", "base", "files", "image", "sim", "part_alignment/targets"}
MAIN = {f"{name}/commands" for name in INSTRUMENTS}
# What tests/support may include: its worlds share no code with sim, nor with what they judge.
SUPPORT_ALLOWED = {"base", "geometry", "support"}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)


def room_of(path):
    """The room of a path below src/: tap/contact, base, app/config; app/main.cc is a room by itself."""
    if path.as_posix() == "app/main.cc":
        return "main"
    return path.parent.as_posix()


def known(room):
    """Whether the tables have such a room."""
    head, _, inner = room.partition("/")
    if room in {"main", "app", "app/config", "sim/commands"}:
        return True
    if head in INSTRUMENTS:
        return inner in INSTRUMENTS[head] or inner in ASPECTS
    if head in INNER:
        return inner in INNER[head]
    return head in COMMON and not inner


def covers(allowed, room):
    """Whether a set of rooms, or of heads of rooms, has the room."""
    return room in allowed or room.partition("/")[0] in allowed


def allowed_in_app(room, other):
    """Whether a room of app may include another room."""
    if other in {"app", "app/config"}:
        return room != "app/config" or other == room
    if room == "main":
        return other in MAIN
    if room == "app/config":
        return covers(APP_CONFIG, other)
    return covers(APP_SHARED, other)


def allowed(room, other):
    """Whether one known room may include another."""
    if room == other:
        return True
    if room == "sim/commands":
        return covers(SIM_COMMANDS, other)
    if room == "main" or room.startswith("app"):
        return allowed_in_app(room, other)
    head, _, inner = room.partition("/")
    other_head, _, other_inner = other.partition("/")
    if head in INSTRUMENTS:
        pure = INSTRUMENTS[head]
        if other_head == head:
            siblings = pure[inner] if inner in pure else set(pure) | ASPECTS[inner][1]
            return other_inner in siblings
        common = PURE if inner in pure else ASPECTS[inner][0]
        return other_head in common
    if head in INNER and other_head == head:
        return other_inner in INNER[head][inner]
    return other_head in COMMON[head]


def is_test(path):
    """Whether only test programs are made of the file."""
    return path.name.endswith(("_test.cc", "_test_support.h", "_test_support.cc"))


def violations(root):
    """Yields one line of text for each include that no allowed edge covers."""
    for path in sorted((root / "src").rglob("*")):
        if path.suffix not in {".h", ".cc"}:
            continue
        room = room_of(path.relative_to(root / "src"))
        if not known(room):
            yield f"{path}: room '{room}' has no entry in tools/check_layers.py"
            continue
        for target in INCLUDE.findall(path.read_text()):
            if target.startswith("support/") and is_test(path):
                continue  # tests/support
            if "/" not in target or not (root / "src" / target).is_file():
                yield f'{path}: include "{target}" is not a path below src/'
                continue
            other = room_of(pathlib.PurePosixPath(target))
            if is_test(path):
                if not allowed_in_test(room, other):
                    yield f'{path}: a test of {room} must not include {other} ("{target}")'
            elif not known(other) or not allowed(room, other):
                yield f'{path}: {room} must not include {other} ("{target}")'


def allowed_in_test(room, other):
    """Whether a test may include a room: besides its own room's, the other rooms of its instrument."""
    head = room.partition("/")[0]
    return known(other) and (allowed(room, other) or other.partition("/")[0] == head)


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
