#!/usr/bin/env python3
"""Checks that text from outside can break nothing on its way out (CONVENTIONS.md, Text)."""
import pathlib
import re
import sys


def call_at(text, opening):
    """The call whose parenthesis opens at `opening`, up to the one that closes it."""
    depth = 0
    for end in range(opening, len(text)):
        depth += {"(": 1, ")": -1}.get(text[end], 0)
        if depth == 0:
            return text[opening : end + 1]
    return text[opening:]


def violations(root):
    """Yields one line of text for each call that a byte can make throw, or that goes past the console."""
    for path in sorted((root / "src").rglob("*.cc")):
        if path.name.endswith(("_test.cc", "test_client.cc", "test_parsers.cc")):
            continue
        text = path.read_text()
        for match in re.finditer(r"(?:\.|->)dump\(", text):
            call = call_at(text, match.end() - 1)
            if "error_handler_t::replace" not in call and "kReplace" not in call:
                line = text.count("\n", 0, match.start()) + 1
                yield f"{path}:{line}: dump throws on bytes that are not UTF-8: give it error_handler_t::replace"
        for match in re.finditer(r"std::(?:cout|cerr|clog)\b", text):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{path}:{line}: {match.group()} goes past app/console.h: use fmt::print"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    found = list(violations(root))
    for line in found:
        print(line)
    print(f"{len(found)} way(s) for text to break something")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
