#!/usr/bin/env python3
"""Checks that what a thread throws cannot end the process: its work runs through NoteBug (CONVENTIONS.md, Errors), or
catches all by itself."""
import pathlib
import re
import sys


def span_at(text, opening):
    """The text from the bracket at `opening` to the one that closes it."""
    closing = {"(": ")", "{": "}"}[text[opening]]
    depth = 0
    for end in range(opening, len(text)):
        depth += {text[opening]: 1, closing: -1}.get(text[end], 0)
        if depth == 0:
            return text[opening : end + 1]
    return text[opening:]


def threads_of(text, declared):
    """Yields the offset of each opening bracket behind which a thread's work stands. `declared`: the text with its
    header's, where members are."""
    made = r"std::j?thread(?:\s+\w+)?\s*(?=[({])"
    for match in re.finditer(made, text):
        yield match.end()
    for name in re.findall(r"std::j?thread\s+(\w+);", declared):
        # A member in a constructor's list: what is given to it is a lambda.
        for match in re.finditer(rf"[:,]\s*{name}(?=[({{]\[)", text):
            yield match.end()
    for name in re.findall(r"std::vector<std::j?thread>\s+(\w+);", declared):
        for match in re.finditer(rf"\b{name}\.emplace_back(?=\()", text):
            yield match.end()


def bodies_of(text, name):
    """The bodies of all functions and named lambdas of that name."""
    for match in re.finditer(rf"\b{name}\([^;{{}}]*\)[^;(){{}}]*(?={{)|\b{name} = \[[^{{}};]*(?={{)", text):
        yield span_at(text, match.end())


def catches(text, work):
    """Whether the work, or a function of the same file that it names, lets nothing through."""
    named = set(re.findall(r"\b([A-Za-z_]\w*)\b", work))
    reached = [work] + [body for name in named for body in bodies_of(text, name)]
    return any("NoteBug(" in body or "catch (...)" in body for body in reached)


def violations(root):
    """Yields one line of text for each thread whose work may throw."""
    for path in sorted((root / "src").rglob("*.cc")):
        if path.name.endswith(("_test.cc", "test_client.cc", "test_parsers.cc", "_test_support.cc")):
            continue
        text = path.read_text()
        header = path.with_suffix(".h")
        declared = text + (header.read_text() if header.exists() else "")
        for opening in threads_of(text, declared):
            if not catches(text, span_at(text, opening)):
                line = text.count("\n", 0, opening) + 1
                yield f"{path}:{line}: what this thread throws ends the process: run its work through NoteBug"


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    found = list(violations(root))
    for line in found:
        print(line)
    print(f"{len(found)} thread(s) that can end the process")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
