"""Joins a running LinuxCNC through its own Python module, for trammel, over standard input and output.

Each line of standard input is a request in JSON, as in {"id": 7, "do": "mdi", "block": "G4 P0"}; each is answered by one
line: an object with the request's id, and with "error" and its "kind" where the request failed. "taken": somebody else
commands LinuxCNC since; nothing is sent any more. No port is opened, and the one queue of messages, the operator's, is left
to the screens that show it.

The end of standard input, or of the process that holds it, ends a move that is under way and gives back the mode and the
modal codes that were in force, where LinuxCNC is still ours.
"""
import fcntl
import json
import os
import pwd
import select
import shutil
import signal
import stat
import sys
import tempfile
import time

# The end of the process that asks is the only one: it is what aborts a move.
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTTOU):
    signal.signal(number, signal.SIG_IGN)
# Python runs isolated (-I). A LinuxCNC that was built in its own folder is found through absolute folders of PYTHONPATH, behind
# Python's own modules.
sys.path += [folder for folder in os.environ.get("PYTHONPATH", "").split(":") if folder.startswith("/")]

LOOK_S = 0.005  # at a move that is under way
PARENT_S = 1.0  # at the process that holds standard input, while nothing is under way
LIMIT_S = 5.0  # for LinuxCNC to take up a command and to end it
OVERRIDES_S = 0.05  # until the status shows an override that was taken up
LONGEST = 4096  # bytes of a request
C_AXIS = 0x20  # of the axis mask


class Failed(Exception):
    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


def state_folder():
    """The folder of the program's own notes (StateFolder), in which no other user can make a file first."""
    state, home = os.environ.get("XDG_STATE_HOME", ""), os.environ.get("HOME", "")
    if not state.startswith("/"):
        state = os.path.join(home if home.startswith("/") else pwd.getpwuid(os.getuid()).pw_dir, ".local/state")
    folder = os.path.join(state, "trammel")
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        found = os.stat(folder)
    except OSError as error:
        raise Failed("machine", f"{folder}: {error}; XDG_STATE_HOME names another place")
    if found.st_uid != os.geteuid() or found.st_mode & stat.S_IWOTH:
        raise Failed("machine", f"{folder} is not this user's alone: chmod go-w it, or name another place by XDG_STATE_HOME")
    return folder


def connect():
    try:
        import linuxcnc
        broken = linuxcnc.error
    except (ImportError, AttributeError) as error:
        raise Failed("machine", f"{sys.executable} has no module linuxcnc ({error}): it comes with LinuxCNC "
                     "(linuxcnc-uspace); run trammel in the environment in which LinuxCNC runs")
    try:
        session = Session(linuxcnc)
        session.stat.poll()
    except (broken, SystemError) as error:
        raise Failed("machine", f"no LinuxCNC of this user runs on this computer ({error}): start it, and run trammel "
                     "as the same user")
    return session


class Session:
    """Holds LinuxCNC in MDI mode from take() until somebody else commands it.

    Commands are numbered by LinuxCNC, whoever sends them: a number that is not ours is somebody else's.
    """

    def __init__(self, linuxcnc):
        self.cnc = linuxcnc
        self.stat = linuxcnc.stat()
        self.command = linuxcnc.command()
        self.held = False
        self.taken = ""  # by somebody else: how that shows
        self.seen = 0  # the last number that is ours, or harmless
        self.moving = False
        self.was_manual = False
        self.modal = []  # codes in force before take()
        self.feed = 0.0
        self.lock = None

    def mode(self):
        names = {self.cnc.MODE_MANUAL: "MANUAL", self.cnc.MODE_AUTO: "AUTO", self.cnc.MODE_MDI: "MDI"}
        return names.get(self.stat.task_mode, "?")

    def idle(self):
        """Says whether the last command was taken up and has ended, and nothing else is under way."""
        stat = self.stat
        return (stat.echo_serial_number >= self.seen and stat.state != self.cnc.RCS_EXEC and
                stat.interp_state == self.cnc.INTERP_IDLE and stat.inpos and not stat.paused)

    def overrides(self):
        stat = self.stat
        return [stat.feedrate, stat.rapidrate, stat.max_velocity] + [s["override"] for s in stat.spindle]

    def lose(self, how):
        self.held = self.moving = False
        self.taken = f"somebody took LinuxCNC over ({how})"
        raise Failed("taken", self.taken)

    def poll(self):
        """Looks, and notices whoever else commands LinuxCNC since take()."""
        before = self.overrides()
        self.stat.poll()
        if not self.held:
            return
        if self.mode() != "MDI":
            self.lose(f"it is in {self.mode()} mode")
        if self.stat.task_state != self.cnc.STATE_ON:
            self.lose("its emergency stop was pressed" if self.stat.estop else "it was switched off")
        if self.stat.echo_serial_number > self.seen:
            time.sleep(OVERRIDES_S)
            self.stat.poll()
            if self.overrides() == before or self.mode() != "MDI":
                self.lose("a command came from elsewhere")
            self.seen = self.stat.echo_serial_number

    def send(self, name, *arguments):
        """Sends a command; aborts it where another one came in between, which may have been an abort."""
        expected = self.seen + 1
        getattr(self.command, name)(*arguments)
        self.seen = self.command.serial
        if self.held and self.seen != expected:
            self.command.abort()
            self.lose("a command came from elsewhere")

    def await_idle(self, what):
        end = time.monotonic() + LIMIT_S
        while True:
            self.poll()
            if self.idle():
                return
            if time.monotonic() > end:
                raise Failed("machine", f"LinuxCNC does not end {what}")
            time.sleep(LOOK_S)

    def look(self):
        self.poll()
        stat = self.stat
        self.moving = self.moving and not self.idle()
        places = [[at[0], at[1], at[2], at[5]] for at in (stat.actual_position, stat.position)]
        return {"position": places[0], "commanded": places[1], "mode": self.mode(), "idle": self.idle(),
                "spindle_stopped": not any(s["enabled"] or s["speed"] for s in stat.spindle)}

    def state(self):
        seen = self.look()
        stat = self.stat
        seen.update({"estop": bool(stat.estop), "on": stat.task_state == self.cnc.STATE_ON, "homed": list(stat.homed),
                     "metric": abs(stat.linear_units - 1) < 1e-9 and abs(stat.angular_units - 1) < 1e-9,
                     "c_axis": bool(stat.axis_mask & C_AXIS), "feed_override": stat.feedrate,
                     "fastest_mm_s": stat.max_velocity})
        return seen

    def facts(self):
        """Says how the machine is built and set up, lengths in its own unit."""
        told = self.state()
        stat = self.stat
        fitted = next((t for t in stat.tool_table if t.id == stat.tool_in_spindle), None) if stat.tool_in_spindle > 0 else None
        limits = [(stat.axis[i]["min_position_limit"], stat.axis[i]["max_position_limit"]) for i in (0, 1, 2, 5)]
        told.update({"axes": "".join(name for i, name in enumerate("XYZABCUVW") if stat.axis_mask & 1 << i),
                     "unit_mm": 1 / stat.linear_units, "joints": stat.joints, "tool": max(0, stat.tool_in_spindle),
                     "tool_length": fitted.zoffset if fitted else 0, "tools": len({t.id for t in stat.tool_table if t.id > 0}),
                     "low": [low for low, _ in limits], "high": [high for _, high in limits]})
        return told

    def take_alone(self):
        path = os.path.join(state_folder(), "linuxcnc.lock")
        try:
            lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o600)
            if os.fstat(lock).st_uid != os.geteuid():
                raise Failed("machine", f"{path} belongs to another user: remove it")
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise Failed("safety", "another trammel drives this LinuxCNC; wait for its end")
        except OSError as error:
            raise Failed("machine", f"{path}: {error}")
        self.lock = lock  # held until this process ends

    def take(self):
        self.poll()
        if self.held:
            return {}
        if self.mode() == "AUTO" or not self.idle() or abs(self.stat.current_vel) > 1e-9:
            raise Failed("safety", "LinuxCNC is not idle, or in AUTO mode: end what moves and choose MANUAL or MDI")
        if self.lock is None:
            self.take_alone()
        self.was_manual = self.mode() == "MANUAL"
        self.modal = list(self.stat.gcodes)
        self.feed = self.stat.settings[1]
        self.seen = self.stat.echo_serial_number
        if self.was_manual:
            self.send("mode", self.cnc.MODE_MDI)
            end = time.monotonic() + LIMIT_S
            while self.mode() != "MDI" or self.stat.echo_serial_number < self.seen:
                if time.monotonic() > end:
                    self.send("mode", self.cnc.MODE_MANUAL)  # it may come late
                    raise Failed("machine", "LinuxCNC does not go into MDI mode; does another panel hold it?")
                time.sleep(LOOK_S)
                self.stat.poll()
        self.held = True
        self.poll()
        return {}

    def mdi(self, block, move):
        # LinuxCNC itself refuses a block in any mode but MDI: who takes over now has nothing to fear.
        self.poll()
        if not self.held:
            raise Failed("machine", "MDI mode was not taken")
        if not self.idle():
            raise Failed("machine", "LinuxCNC still executes something; nothing was added to it")
        self.send("mdi", block)
        self.moving = bool(move)
        if not move:
            self.await_idle(f"\"{block}\"")
            if self.stat.state == self.cnc.RCS_ERROR:
                raise Failed("machine", f"LinuxCNC does not carry out \"{block}\"; its own screen says why")
        return {}

    def show(self, text):
        """Has the interpreter write a text with the values of its parameters into a file, which is read."""
        folder = None
        try:
            folder = tempfile.mkdtemp(prefix="trammel-", dir="/tmp")
            path = os.path.join(folder, "shown")
            for block in (f"(LOGOPEN,{path})", f"(LOG,{text})", "(LOGCLOSE)"):
                self.mdi(block, False)
            with open(path, errors="replace") as shown:
                return {"shown": shown.read(LONGEST).strip()}
        except OSError as error:
            raise Failed("machine", f"LinuxCNC does not show its parameters ({error}): does it run as the same user, "
                         "on this computer?")
        finally:
            if folder:
                shutil.rmtree(folder, ignore_errors=True)

    def abort(self, orphaned=False):
        """Ends what is under way and sees it stand; orphaned: a helper before this one began it, and has died."""
        self.poll()
        if self.held or (orphaned and self.mode() == "MDI"):
            self.send("abort")
            self.await_idle("the abort")
        self.moving = False
        return {}

    def leave(self):
        """Ends what is under way and gives back modal codes and mode, unless somebody else has LinuxCNC by now."""
        if not self.held:
            return
        self.poll()
        if not self.idle():
            self.abort()
        kept = {code for code in (0, 10, 200, 210, 900, 910, 930, 940, 950) if code in self.modal[1:]}
        if kept - set(self.stat.gcodes[1:]):
            self.mdi(" ".join(f"G{code // 10}" for code in sorted(kept, reverse=True)), False)
        if self.feed > 0 and 930 not in self.modal and self.feed != self.stat.settings[1]:
            self.mdi(f"F{self.feed:.6f}", False)
        if self.was_manual:
            self.send("mode", self.cnc.MODE_MANUAL)
            self.held = False
            self.await_idle("the change to MANUAL")

    def answer(self, request):
        do = request["do"]
        if self.taken:
            raise Failed("taken", self.taken)
        if do in ("look", "state", "facts", "take"):
            return getattr(self, do)()
        if do == "abort":
            return self.abort(request.get("orphaned", False))
        if do == "mdi":
            return self.mdi(str(request["block"]), request.get("move", False))
        if do == "show":
            return self.show(str(request["text"]))
        raise Failed("machine", f"nothing is known of \"{do}\"")


def requests(session, parent):
    """Yields each line of standard input until it ends, or its holder does."""
    buffered = b""
    while os.getppid() == parent:
        ready, _, _ = select.select([0], [], [], LOOK_S if session.moving else PARENT_S)
        if not ready:
            continue
        read = os.read(0, LONGEST)
        if not read or len(buffered) > LONGEST:
            return
        *lines, buffered = (buffered + read).split(b"\n")
        for line in lines:
            if os.getppid() != parent:  # what a dead one asked for is not begun
                return
            yield line


def tell(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def main():
    parent = os.getppid()
    try:
        session = connect()
    except Failed as failed:
        tell({"id": 0, "error": str(failed), "kind": failed.kind})
        return
    try:
        tell({"id": 0})
        for line in requests(session, parent):
            request = json.loads(line)
            try:
                answer = session.answer(request)
            except Failed as failed:
                answer = {"error": str(failed), "kind": failed.kind}
            except Exception as error:  # of LinuxCNC's module, as where LinuxCNC has ended
                answer = {"error": f"LinuxCNC's module: {error!r}", "kind": "machine"}
            tell({"id": request["id"], **answer})
    except OSError:
        pass  # nobody listens any more
    finally:
        try:
            session.leave()
        except Exception:  # there is nobody to tell
            pass


main()
