"""Edits of files, each with a record from which it is undone, whatever moment the installer died at.

A record is written to the manifest before its edit is made, and undoing one that was never made changes nothing.
Files are replaced whole, through a file beside them whose name is known: no reader sees half of one.
"""
import hashlib
import json
import os
import pathlib
import stat

from . import InstallError


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def part_of(path):
    """The file through which `path` is replaced."""
    return path.with_name(f".{path.name}.trammel-part")


def write_whole(path, data, mode=0o644):
    """Replaces or creates `path`; a file that is there keeps its mode."""
    part = part_of(path)
    with open(part, "wb") as file:
        file.write(data)
        os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode) if path.exists() else mode)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def refuse_unwritable(path):
    """Raises InstallError where `path`, or the folder in which it is replaced, is not the user's to write.

    Looks at owner and mode rather than asking the system: what its owner made read-only stays so, for root, too.
    """
    if not path.parent.exists():
        return  # the installer's own to make
    for place in [path, path.parent] if path.exists() else [path.parent]:
        found = place.stat()
        if found.st_uid != os.geteuid():
            raise InstallError(f"{place} belongs to another user: run as its owner, or give it to yourself (chown)")
        if not found.st_mode & stat.S_IWUSR:
            raise InstallError(f"{place} is read-only: chmod u+w {place}, or add trammel by hand (klipper/README.md)")


def edit_folder(path):
    return {"kind": "folder", "path": str(path)}, None


def edit_file(path, data, mode=0o644):
    """A new file; undone unless somebody changed it since."""
    return {"kind": "file", "path": str(path), "sha256": sha256(data)}, lambda: write_whole(path, data, mode)


def edit_block(path, block, mark):
    """Appends lines to a text file, after a line end where its last line has none.

    @param mark  what of the block remains where somebody changed it
    """
    before = path.read_bytes()
    glued = before != b"" and not before.endswith(b"\n")
    text = "\n" * glued + block
    record = {"kind": "block", "path": str(path), "text": text, "glued": glued, "mark": mark}
    return record, lambda: write_whole(path, before + text.encode())


def edit_entry(path, entry):
    """Appends an object to a JSON array whose form is kept; None where the file holds no array."""
    before = path.read_bytes()
    entries = parsed_array(before)
    if entries is None:
        return None
    text = ",\n  " * bool(entries) + json.dumps(entry)
    # Before the array's end and the white space before it.
    head = before[: before.rindex(b"]")].rstrip()
    after = head + text.encode() + before[len(head) :]
    return {"kind": "entry", "path": str(path), "text": text, "entry": entry}, lambda: write_whole(path, after)


def parsed_array(data):
    try:
        parsed = json.loads(data)
    except ValueError:
        return None
    return parsed if isinstance(parsed, list) else None


def make(record, change):
    """Makes one edit."""
    if record["kind"] == "folder":
        os.makedirs(record["path"], exist_ok=True)
    else:
        change()


def without_block(data, record):
    """`data` without the lines that an edit appended; None where they are not in it as they were."""
    text = record["text"].encode()
    end = len(data)
    while (at := data.rfind(text, 0, end)) >= 0:
        if at == 0 or record["glued"] or data[at - 1 : at] == b"\n":
            rest = data[at + len(text) :]
            return data[:at] + b"\n" * (record["glued"] and rest != b"") + rest
        end = at + len(text) - 1
    return None


def without_entry(data, record):
    """`data` without the object that an edit appended, in another form where another program rewrote the array."""
    entries = parsed_array(data)
    if entries is None or record["entry"] not in entries:
        return None
    entries.remove(record["entry"])
    text = record["text"].encode()
    if text in data:
        head, tail = data.rsplit(text, 1)
        if parsed_array(head + tail) == entries:
            return head + tail
    return json.dumps(entries, indent=2, ensure_ascii=False).encode() + b"\n"


def undo(record):
    """Undoes one edit. @returns a remark where something is left behind, else None."""
    path = pathlib.Path(record["path"])
    if record["kind"] == "folder":
        if path.is_dir() and not any(path.iterdir()):
            os.rmdir(path)
        return None
    part_of(path).unlink(missing_ok=True)
    if not path.exists():
        return None
    data = path.read_bytes()
    if record["kind"] == "file":
        if sha256(data) != record["sha256"]:
            return f"{path} was changed since and is left"
        path.unlink()
        return None
    rest = without_block(data, record) if record["kind"] == "block" else without_entry(data, record)
    if rest is not None:
        write_whole(path, rest)
        return None
    left = record["mark"].encode() in data if record["kind"] == "block" else b'"trammel"' in data
    return f"{path} was changed since: take trammel out of it by hand" if left else None
