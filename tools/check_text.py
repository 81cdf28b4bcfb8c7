#!/usr/bin/env python3
"""Checks that text from outside can break nothing on its way out (CONVENTIONS.md, Text), that the settings named in
messages exist, and that comments of the product begin with a verb or a noun and name headers that exist."""
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


def settings(root):
    """The keys of trammel.toml by section, from the tables that its reader uses."""
    keys = {}
    shared = (root / "src/tool_offset/sheet/sheet_settings.h").read_text()
    for path in sorted((root / "src").rglob("*.cc")):
        text = path.read_text()
        sections = dict(re.findall(r"constexpr std::string_view (k\w+) = (\w+|\"\w+\");", shared + text))
        for section, key in re.findall(r'\{(k\w+),\s*"(\w+)",\s*&\w+::\w+', text):
            name = sections.get(sections[section], sections[section])
            keys.setdefault(name.strip('"'), set()).add(key)
    return keys


def unknown_settings(text, keys):
    """Yields place and name of each `[section] a_key`, and of each `set [section] key`, that trammel.toml has not."""
    for match in re.finditer(r"(set )?\[(\w+)\] (\w+)", text):
        told, section, key = match.groups()
        if section in keys and key not in keys[section] and (told or "_" in key):
            yield match.start(), f"[{section}] {key}"


OPENINGS = "What|Whether|Where|How|Why|Which|Who|Of"  # of a clause that has no verb or noun of its own


def comment_faults(root):
    """Yields one line of text for each comment that begins with a question word or with "Of", or names a header that
    is not there."""
    headers = {path.name for top in ("src", "include") for path in (root / top).rglob("*.h")}
    for path in sorted((root / "src").rglob("*")):
        if path.suffix not in (".h", ".cc") or "_test" in path.name:
            continue
        before = ""
        for number, line in enumerate(path.read_text().splitlines(), 1):
            for header in re.findall(r"\((?:\w+/)*(\w+\.h)\)", line.partition("//")[2]):
                if header not in headers:
                    yield f"{path}:{number}: there is no {header}"
            if not re.match(r"\s*//", before) and (match := re.match(rf"\s*//+ ({OPENINGS})\b", line)):
                yield f"{path}:{number}: begins with {match.group(1)}: begin with a verb or the field's noun"
            before = line


def violations(root):
    """Yields one line of text for each call that a byte can make throw, that goes past the console, or that names a
    setting which is none."""
    keys = settings(root)
    if not keys:
        yield "src: no table of settings found"
    for path in sorted((root / "src").rglob("*.cc")):
        if path.name.endswith(("_test.cc", "test_client.cc", "test_parsers.cc")):
            continue
        text = path.read_text()
        for match in re.finditer(r"(?:\.|->)dump\(", text):
            call = call_at(text, match.end() - 1)
            if "error_handler_t::replace" not in call and "kReplace" not in call:
                line = text.count("\n", 0, match.start()) + 1
                yield f"{path}:{line}: dump throws on bytes that are not UTF-8: give it error_handler_t::replace"
        for start, name in unknown_settings(text, keys):
            line = text.count("\n", 0, start) + 1
            yield f"{path}:{line}: there is no setting {name}: trammel config keys lists what there is"
        for match in re.finditer(r"std::(?:cout|cerr|clog)\b", text):
            line = text.count("\n", 0, match.start()) + 1
            yield f"{path}:{line}: {match.group()} goes past app/console.h: use fmt::print"
    yield from comment_faults(root)


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
    found = list(violations(root))
    for line in found:
        print(line)
    print(f"{len(found)} way(s) for text to break something or to mislead, or comment(s) to reword")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
