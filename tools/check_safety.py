#!/usr/bin/env python3
"""Checks that docs/reference/safety.md names only tests that are there."""
import pathlib
import re
import sys


def tests_of(root):
    """The names "Suite.Test" of all GoogleTest and unittest tests below src and tests."""
    names = set()
    for folder in ("src", "tests"):
        for path in (root / folder).rglob("*.cc"):
            for suite, name in re.findall(r"\bTEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)", path.read_text()):
                names.add(f"{suite}.{name}")
    for path in (root / "tests").rglob("*_test.py"):
        for suite, body in re.findall(r"^class (\w+)\(unittest\.TestCase\):\n(.*?)(?=^\S|\Z)", path.read_text(), re.M | re.S):
            names.update(f"{suite}.{name}" for name in re.findall(r"^    def (test_\w+)\(", body, re.M))
    return names


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    named = set(re.findall(r"`([A-Z]\w+\.(?:[A-Z]|test_)\w+)`", (root / "docs/reference/safety.md").read_text()))
    missing = sorted(named - tests_of(root))
    for name in missing:
        print(f"docs/reference/safety.md: there is no test {name}")
    print(f"{len(named)} tests named, {len(missing)} missing")
    return 1 if missing or not named else 0


if __name__ == "__main__":
    sys.exit(main())
