"""Holds the commands in the documents to the programs' own help.

    tools/check_docs.py ROOT TRAMMEL TRAMMEL_SIM

Each `trammel …` and `trammel-sim …` in README.md, docs/ and klipper/, in a block or between backticks, must name a
command that there is, and options that this command has.
"""
import pathlib
import re
import shlex
import subprocess
import sys

STARTS = re.compile(r"^(?:\$ )?(?:sudo )?(trammel(?:-sim)?) +(.*)$")
QUOTED = re.compile(r"`(trammel(?:-sim)?) +([^`]+)`")
ENDS = {"|", "||", "&&", "&", ";", ">", ">>", "2>", "<", "#"}


def commands(text):
    """Yields (line number, program, words after it)."""
    fenced = False
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        fenced ^= line.startswith("```")
        block = line if fenced else line[4:] if line.startswith("    ") else ""
        start = STARTS.match(block.strip())
        found = [start.groups()] if start else QUOTED.findall(line)
        for program, command in found:
            command = re.split(r"\s{3,}", command)[0]  # an explanation beside it
            try:
                words = shlex.split(command.rstrip("\\"))
            except ValueError:
                continue
            ends = [i for i, word in enumerate(words) if word in ENDS]
            yield number, program, words[: ends[0]] if ends else words


class Helps:
    """A program's help, by command, asked once each."""

    def __init__(self, name, program):
        self.name, self.program, self.texts = name, program, {}

    def text(self, path):
        if path not in self.texts:
            told = subprocess.run([self.program, *path, "--help"], capture_output=True, text=True)
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
        yield f"there is no command '{helps.name} {' '.join([*path, rest[0]])}'"
        return
    known = helps.options(path) | {"--help", "-h"} | helps.options(())
    for word in rest:
        option = re.fullmatch(r"(--[a-z][a-z0-9-]*)(=.*)?", word)
        if option and option.group(1) not in known:
            yield f"'{helps.name} {' '.join(path)}' has no option {option.group(1)}"


def main(root, trammel, trammel_sim):
    helps = {"trammel": Helps("trammel", trammel), "trammel-sim": Helps("trammel-sim", trammel_sim)}
    wrong, seen = 0, 0
    root = pathlib.Path(root)
    for document in [root / "README.md", *sorted((root / "docs").rglob("*.md")),
                     *sorted((root / "klipper").glob("*.md"))]:
        for line, program, words in commands(document.read_text()):
            seen += 1
            for fault in faults(helps[program], words):
                print(f"{document.relative_to(root)}:{line}: {fault}")
                wrong += 1
    print(f"{seen} commands in the documents, {wrong} that the program does not know")
    return 1 if wrong or not seen else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
