"""Edits of files: planned in memory, checked, then made together or not at all.

A plan reads each file once and changes what it read; nothing on the disk changes before commit(). Each edit has a record from
which a later run undoes it in its own plan; undoing an edit that was never made changes nothing.
"""
import contextlib
import errno
import hashlib
import json
import os
import pathlib
import stat

from . import InstallError

MOST_BYTES = 16 << 20  # of a file that is edited


def sha256(data):
    return hashlib.sha256(data).hexdigest()


def part_of(path):
    """The file through which `path` is replaced."""
    return path.with_name(f".{path.name}.trammel-part")


def read_regular(path, follow=False):
    """@returns bytes and os.stat_result of an ordinary file; None, None where nothing has the name.

    Follows no link unless asked to, and waits for no pipe. Raises InstallError where the name is something else.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW))
    except FileNotFoundError:
        if os.path.islink(path):
            raise InstallError(f"{path} is a link to {os.readlink(path)}, which is not there: mend or remove it") from None
        return None, None
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise InstallError(f"{path} is a link, and only ordinary files are written: put the file in its place") from None
        raise InstallError(f"{path}: {error.strerror}") from error
    with open(descriptor, "rb") as file:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise InstallError(f"{path} is no ordinary file: move it away")
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise InstallError(f"{path} is larger than {MOST_BYTES >> 20} MiB, which no such file is")
    return data, found


def target_of(path):
    """The file that `path` leads to, which is edited in its own place. Raises InstallError where the link is another's."""
    if path.is_symlink() and path.lstat().st_uid not in (0, os.geteuid()):
        raise InstallError(f"{path} is a link that belongs to another user: put the file in its place")
    try:
        return path.resolve(strict=True)
    except (OSError, RuntimeError) as error:
        raise InstallError(f"{path} leads nowhere ({error}): mend or remove the link") from error


def write_whole(path, data, mode, group=None):
    """Replaces or creates `path` through a new file beside it: no reader sees half of one, no planted link is followed."""
    part = part_of(path)
    part.unlink(missing_ok=True)
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
    try:
        with open(descriptor, "wb") as file:
            file.write(data)
            if group is not None:
                with contextlib.suppress(PermissionError):
                    os.fchown(descriptor, -1, group)
            os.fchmod(descriptor, mode)
            file.flush()
            os.fsync(descriptor)
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


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


def is_odd(path):
    """Whether the name is a link's, a folder's or a pipe's."""
    return os.path.lexists(path) and not stat.S_ISREG(os.lstat(path).st_mode)


class File:
    """What a file held when it was read, and what it is to hold; None: nothing has its name."""

    def __init__(self, path, of_root):
        self.path = path
        self.of_root = of_root  # written by sudo, and not by commit()
        self.before, found = read_regular(path)
        self.now = self.before
        self.mode = stat.S_IMODE(found.st_mode) if found else 0o644
        self.group = found.st_gid if found else None

    @property
    def changes(self):
        return self.now != self.before

    def bring(self, old, new):
        if read_regular(self.path)[0] != old:
            raise InstallError(f"{self.path} was changed meanwhile; run install.sh again")
        if new is None:
            self.path.unlink()
        else:
            write_whole(self.path, new, self.mode, self.group)

    def put_back(self):
        if read_regular(self.path)[0] != self.before:
            self.bring(self.now, self.before)


class Plan:
    """What files are to hold, by their paths; and folders that are made, or removed where they are empty."""

    def __init__(self):
        self.files = {}
        self.made = []
        self.emptied = []

    def file(self, path, of_root=False):
        path = pathlib.Path(path)
        if path not in self.files:
            self.files[path] = File(path, of_root)
        return self.files[path]

    def has(self, path, of_root=False):
        """Whether anything has the name, a link that leads nowhere among it."""
        return is_odd(path) or self.file(path, of_root).now is not None

    def add_folder(self, path):
        self.made.append(path)
        return {"kind": "folder", "path": str(path)}

    def add_file(self, path, data, mode=0o644):
        """A new file; undone unless somebody changed it since."""
        file = self.file(path)
        file.now = data
        if file.before is None:
            file.mode = mode
        return {"kind": "file", "path": str(path), "sha256": sha256(data)}

    def add_block(self, path, block, mark):
        """Appends lines to a text file, after a line end where its last line has none.

        @param mark  what of the block remains where somebody changed it
        """
        file = self.file(path)
        glued = file.now != b"" and not file.now.endswith(b"\n")
        text = "\n" * glued + block
        file.now += text.encode()
        return {"kind": "block", "path": str(path), "text": text, "glued": glued, "mark": mark}

    def add_entry(self, path, entry):
        """Appends an object to a JSON array whose form is kept; None where the file holds no array in UTF-8."""
        file = self.file(path)
        entries = parsed_array(file.now)
        if entries is None:
            return None
        text = ",\n  " * bool(entries) + json.dumps(entry)
        # Before the array's end and the white space before it.
        head = file.now[: file.now.rindex(b"]")].rstrip()
        file.now = head + text.encode() + file.now[len(head) :]
        return {"kind": "entry", "path": str(path), "text": text, "entry": entry}

    def undo(self, record):
        """Undoes one edit. @returns whether it was there as it was made."""
        if record["kind"] == "folder":
            self.emptied.append(pathlib.Path(record["path"]))
            return True
        if is_odd(record["path"]):
            return False
        file = self.file(record["path"], of_root=record["kind"] == "unit")
        if file.now is None:
            return True
        if record["kind"] in ("file", "unit"):
            if sha256(file.now) != record["sha256"]:
                return False
            file.now = None
            return True
        rest = without_block(file.now, record) if record["kind"] == "block" else without_entry(file.now, record)
        if rest is None:
            return False
        file.now = rest
        return True

    def left_behind(self, record):
        """A remark where an edit that could not be undone shows still, else None."""
        path = record["path"]
        if record["kind"] == "file":
            return f"{path} was changed since and is left"
        if record["kind"] == "unit":
            return f"{path} was changed since and is left: sudo systemctl disable --now {pathlib.Path(path).stem}"
        mark = record["mark"] if record["kind"] == "block" else '"trammel"'
        shows = is_odd(path) or mark.encode() in self.file(path).now
        return f"{path} was changed since: take trammel out of it by hand" if shows else None

    def check(self):
        """Raises InstallError where anything that changes is not the user's to write."""
        for file in self.files.values():
            if file.changes and not file.of_root:
                refuse_unwritable(file.path)
        for folder in self.made:
            refuse_unwritable(folder)

    def commit(self, step):
        """Makes all edits. @param step  takes what makes one, and what takes it back"""
        for folder in self.made:
            if not folder.exists():
                step(lambda folder=folder: os.makedirs(folder), lambda folder=folder: remove_empty(folder))
        for file in self.files.values():
            if file.changes and not file.of_root:
                step(lambda file=file: file.bring(file.before, file.now), file.put_back)
        for folder in self.emptied:
            if folder not in self.made and folder.is_dir() and not folder.is_symlink():
                step(lambda folder=folder: remove_empty(folder), lambda folder=folder: os.makedirs(folder, exist_ok=True))


def remove_empty(folder):
    if folder.is_dir() and not any(folder.iterdir()):
        os.rmdir(folder)


def parsed_array(data):
    try:
        parsed = json.loads(data.decode("utf-8-sig"))
    except (ValueError, RecursionError):
        return None
    return parsed if isinstance(parsed, list) else None


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
    return json.dumps(entries, indent=2).encode() + b"\n"
