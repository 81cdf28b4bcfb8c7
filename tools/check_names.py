#!/usr/bin/env python3
"""Checks that no source has a constant of its own by the name of a header's in the same namespace.

check_names.py ROOT. Sources are compiled in batches (cmake/Batches.cmake): in one translation unit the sources behind
it would take its value for the header's, without a word from the compiler.
"""
import pathlib
import re
import sys

TOKEN = re.compile(
    r"^(?:namespace ([\w:]+ )?\{|(\})  // namespace|(?:inline |static )?constexpr [^=({;\n]*?\b(k[A-Z]\w*)(?:\[\w*\])?\s*[={])",
    re.M)


def constants(text):
    """Yields namespace and name of each constant at file scope; unnamed namespaces count as the one around them."""
    stack = []
    for match in TOKEN.finditer(text):
        if match.group(3):
            yield "::".join(name for name in stack if name), match.group(3)
        elif match.group(2):
            if stack:
                stack.pop()
        else:
            stack.append((match.group(1) or "").strip())


def main(root):
    root, headers, found = pathlib.Path(root), {}, []
    paths = [p for folder in ("src", "tests") for p in sorted((root / folder).rglob("*"))]
    for path in paths:
        if path.suffix == ".h":
            for where in constants(path.read_text()):
                headers[where] = path
    for path in paths:
        if path.suffix == ".cc":
            for where in constants(path.read_text()):
                if where in headers:
                    found.append(f"{path}: {where[1]} is a constant of {headers[where]}, too: give it another name")
    for line in found:
        print(line)
    print(f"{len(headers)} constants in headers, {len(found)} that a source has again")
    return 1 if found or not headers else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
