"""Holds the commands in the documents to the program's own help.

    tools/check_docs.py ROOT TRAMMEL

Each `trammel …` in README.md, docs/ and klipper/, in a block or between backticks, must name a
command that there is, and options that this command has.
"""
import pathlib
import re
import shlex
import subprocess
import sys

STARTS = re.compile(r"^(?:\$ )?(?:sudo )?trammel +(.*)$")
QUOTED = re.compile(r"`trammel +([^`]+)`")
ENDS = {"|", "||", "&&", "&", ";", ">", ">>", "2>", "<", "#"}


def commands(text):
    """Yields (line number, words after `trammel`)."""
    fenced = False
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        fenced ^= line.startswith("```")
        block = line if fenced else line[4:] if line.startswith("    ") else ""
        start = STARTS.match(block.strip())
        found = [start.group(1)] if start else QUOTED.findall(line)
        for command in found:
            command = re.split(r"\s{3,}", command)[0]  # an explanation beside it
            try:
                words = shlex.split(command.rstrip("\\"))
            except ValueError:
                continue
            ends = [i for i, word in enumerate(words) if word in ENDS]
            yield number, words[: ends[0]] if ends else words


class Helps:
    """The program's help, by command, asked once each."""

    def __init__(self, trammel):
        self.trammel, self.texts = trammel, {}

    def text(self, path):
        if path not in self.texts:
            told = subprocess.run([self.trammel, *path, "--help"], capture_output=True, text=True)
            self.texts[path] = told.stdout if told.returncode == 0 else ""
        return self.texts[path]

    def subcommands(self, path):
        _, _, rest = self.text(path).partition("Subcommands:")
        return set(re.findall(r"^  ([a-z][a-z0-9-]*) ", rest, re.M))

    def options(self, path):
        return set(re.findall(r"(?<![\w-])--?[a-z][a-z0-9-]*", self.text(path)))


def faults(helps, words):
    path = ()
    for word in words:
        if word not in helps.subcommands(path):
            break
        path += (word,)
    rest = words[len(path) :]
    if helps.subcommands(path) and rest and re.fullmatch(r"[a-z][a-z-]*", rest[0]):
        yield f"there is no command 'trammel {' '.join([*path, rest[0]])}'"
        return
    known = helps.options(path) | {"--help", "-h"} | helps.options(())
    for word in rest:
        option = re.fullmatch(r"(--[a-z][a-z0-9-]*)(=.*)?", word)
        if option and option.group(1) not in known:
            yield f"'trammel {' '.join(path)}' has no option {option.group(1)}"


def main(root, trammel):
    helps, wrong, seen = Helps(trammel), 0, 0
    root = pathlib.Path(root)
    for document in [root / "README.md", *sorted((root / "docs").glob("*.md")),
                     *sorted((root / "klipper").glob("*.md"))]:
        for line, words in commands(document.read_text()):
            seen += 1
            for fault in faults(helps, words):
                print(f"{document.relative_to(root)}:{line}: {fault}")
                wrong += 1
    print(f"{seen} commands in the documents, {wrong} that the program does not know")
    return 1 if wrong or not seen else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
