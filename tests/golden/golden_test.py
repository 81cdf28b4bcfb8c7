"""Compares the JSON that commands print with what they printed before.

golden_test.py TRAMMEL TRAMMEL_SIM [--update]

rows.txt has one command a line, NAME ARGUMENTS, run in the order shown in one folder. A line that
begins with "-" only makes what later rows read; with "- sim" it is the simulator's. EXAMPLES/ is
examples/alignment, DATA/ the recordings of TRAMMEL_TEST_DATA; without these their rows are skipped.
answers.json holds for each row its exit code and values. Numbers agree to 1 part in 100,000, or to
1e-9: other processors and compilers add up in another order. Lists of more than eight entries are
compared by their length, mean and last entry.
"""
import json
import math
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
RELATIVE, ABSOLUTE = 1e-5, 1e-9
LONGEST_LIST = 8
MASKS = [(r"\d{4}-\d\d-\d\d([T ]\d\d:?\d\d:?\d\d(\.\d+)?Z?)?", "DATE"), (r"\d{8}T\d{6}Z?", "DATE"),
         (r"\b\d+\.\d+\.\d+(-\d+-g[0-9a-f]+)?\b", "VERSION"), (r"\b[0-9a-f]{40,64}\b", "HASH")]
TIMES = re.compile(r"(elapsed|cpu|duration)_s$")


def masked(text, folders):
    for folder, name in folders.items():
        text = text.replace(folder, name)
    for pattern, name in MASKS:
        text = re.sub(pattern, name, text)
    return text


def flat(value, path, folders, out):
    if TIMES.search(path):
        return
    if isinstance(value, dict):
        for key, inner in value.items():
            flat(inner, f"{path}.{key}" if path else key, folders, out)
    elif isinstance(value, list):
        if len(value) > LONGEST_LIST:
            out[f"{path}.length"] = len(value)
            if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in value):
                out[f"{path}.mean"] = sum(value) / len(value)
            value = value[-1:]
        for i, inner in enumerate(value):
            flat(inner, f"{path}[{i}]", folders, out)
    else:
        out[path] = masked(value, folders) if isinstance(value, str) else value


def same(a, b):
    if isinstance(a, float) or isinstance(b, float):
        numbers = all(isinstance(v, (int, float)) for v in (a, b))
        return numbers and math.isclose(a, b, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    return a == b


def run(command, folder):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600,
                          stdin=subprocess.DEVNULL)


def rows():
    for line in (HERE / "rows.txt").read_text().splitlines():
        if line and not line.startswith("#"):
            yield line.split(" ", 1)


def answers_of(program, simulator, data, folder):
    """Runs all rows; gives {name: values}, and the names that need recordings that are not here."""
    answers, skipped = {}, []
    folders = {str(folder): "FOLDER", str(HERE.parents[1]): "SOURCE"}
    if data:
        folders[data] = "DATA"
    for name, line in rows():
        if "DATA/" in line and not data:
            skipped.append(name)
            continue
        line = line.replace("EXAMPLES/", f"{HERE.parents[1]}/examples/alignment/")
        words = shlex.split(line.replace("DATA/", f"{data}/"))
        if words[0] == "sim":
            command = shlex.split(simulator) + words[1:]
        else:
            command = [program] + words
        done = run(command, folder)
        if name == "-":
            if done.returncode != 0:
                sys.exit(f"{line}: exit {done.returncode}\n{done.stderr}")
            continue
        values = {"exit": done.returncode}
        try:
            flat(json.loads(done.stdout), "", folders, values)
        except ValueError:
            values["text"] = masked(done.stdout, folders)
        answers[name] = values
    return answers, skipped


def differences(before, now):
    for path in list(before) + [p for p in now if p not in before]:
        if path not in now or path not in before or not same(before[path], now[path]):
            yield f"{path}: {before.get(path, 'not there')} before, {now.get(path, 'not there')} now"


def main(program, simulator, *options):
    data = os.environ.get("TRAMMEL_TEST_DATA", "")
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(HOME=folder, XDG_STATE_HOME=f"{folder}/state", TZ="UTC", NO_COLOR="1")
        answers, skipped = answers_of(str(pathlib.Path(program).resolve()), simulator, data, folder)
    stored = HERE / "answers.json"
    before = json.loads(stored.read_text()) if stored.exists() else {}
    if "--update" in options:
        for name, values in answers.items():
            old = before.get(name, {})
            values.update((path, old[path]) for path in values
                          if path in old and same(old[path], values[path]))
        answers.update((name, before[name]) for name in skipped if name in before)
        stored.write_text(json.dumps(answers, indent=0, ensure_ascii=False, sort_keys=True) + "\n")
        return 0
    wrong = 0
    for name, values in answers.items():
        for line in list(differences(before.get(name, {}), values))[:5]:
            wrong += 1
            print(f"{name}: {line}")
    if skipped:
        print(f"skipped for want of TRAMMEL_TEST_DATA: {' '.join(skipped)}")
    print(f"{len(answers)} rows, {wrong} differences")
    return 1 if wrong or not answers else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
