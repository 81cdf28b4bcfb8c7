"""Joins a running LinuxCNC through its own Python module, for trammel, over standard input and output.

Each line of standard input is a request in JSON, as in {"id": 7, "do": "mdi", "block": "G4 P0"}; each is answered by one
line: an object with the request's id, and with "error" and its "kind" where the request failed. "taken": somebody else commands LinuxCNC since; nothing is
sent any more. No port is opened, and the one queue of messages, the operator's, is left to the screens that show it.

The end of standard input, or of the process that holds it, ends a move that is under way and gives MANUAL mode back,
where both are still ours.
"""
import json
import os
import select
import shutil
import signal
import sys
import tempfile
import time

LOOK_S = 0.005  # at a move that is under way
PARENT_S = 1.0  # at the process that holds standard input, while nothing is under way
LONGEST = 4096  # bytes of a request


class Failed(Exception):
    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


def connect():
    try:
        import linuxcnc
    except ImportError as error:
        raise Failed("machine", f"{sys.executable} has no module linuxcnc ({error}): it comes with LinuxCNC "
                     "(linuxcnc-uspace); run trammel in the environment in which LinuxCNC runs")
    try:
        session = Session(linuxcnc)
        session.stat.poll()
    except linuxcnc.error as error:
        raise Failed("machine", f"no LinuxCNC of this user runs on this computer ({error}): start it, and run trammel "
                     "as the same user")
    return session


class Session:
    """Holds MDI mode from take() until somebody else changes it."""

    def __init__(self, linuxcnc):
        self.cnc = linuxcnc
        self.stat = linuxcnc.stat()
        self.command = linuxcnc.command()
        self.held = False
        self.was_manual = False
        self.moving = False

    def mode(self):
        names = {self.cnc.MODE_MANUAL: "MANUAL", self.cnc.MODE_AUTO: "AUTO", self.cnc.MODE_MDI: "MDI"}
        return names.get(self.stat.task_mode, "?")

    def taken_up(self):
        """Says whether the controller has seen the last command of this process, or a later one."""
        return self.stat.echo_serial_number >= self.command.serial

    def idle(self):
        return (self.taken_up() and self.stat.state != self.cnc.RCS_EXEC and
                self.stat.interp_state == self.cnc.INTERP_IDLE and self.stat.inpos and not self.stat.paused)

    def poll_held(self):
        self.stat.poll()
        if self.held and self.mode() != "MDI":
            raise Failed("taken", f"somebody took LinuxCNC over (it is in {self.mode()} mode)")

    def look(self):
        self.stat.poll()
        at = self.stat.actual_position
        self.moving = self.moving and not self.idle()
        return {"position": [at[0], at[1], at[2], at[5]], "mode": self.mode(), "idle": self.idle(),
                "spindle_stopped": not any(s["enabled"] or s["speed"] for s in self.stat.spindle)}

    def state(self):
        seen = self.look()
        stat = self.stat
        seen.update({"estop": bool(stat.estop), "on": stat.task_state == self.cnc.STATE_ON, "homed": list(stat.homed),
                     "metric": abs(stat.linear_units - 1) < 1e-9, "feed_override": stat.feedrate})
        return seen

    def take(self):
        self.poll_held()
        if self.held:
            return {}
        if self.mode() == "AUTO" or not self.idle():
            raise Failed("safety", "LinuxCNC is not idle, or in AUTO mode: end the program and choose MANUAL or MDI")
        self.was_manual = self.mode() == "MANUAL"
        if self.was_manual:
            self.command.mode(self.cnc.MODE_MDI)
            self.command.wait_complete(5)
        self.stat.poll()
        if self.mode() != "MDI":
            raise Failed("machine", "LinuxCNC does not go into MDI mode; does another panel hold it?")
        self.held = True
        return {}

    def send(self, block):
        # LinuxCNC itself refuses a block in any mode but MDI: who takes over now has nothing to fear.
        self.poll_held()
        if not self.held:
            raise Failed("machine", "MDI mode was not taken")
        if not self.idle():
            raise Failed("safety", "LinuxCNC still executes something; nothing was added to it")
        self.command.mdi(block)

    def mdi(self, block, move):
        self.send(block)
        self.moving = bool(move)
        return {} if move else self.complete(block)

    def complete(self, block):
        ended = self.command.wait_complete(5)
        self.poll_held()
        if ended != self.cnc.RCS_DONE:
            raise Failed("machine", f"LinuxCNC does not carry out \"{block}\"; its own screen says why")
        return {}

    def show(self, text):
        """Has the interpreter write a text with the values of its parameters into a file, which is read."""
        folder = tempfile.mkdtemp(prefix="trammel-")
        try:
            path = os.path.join(folder, "shown")
            for block in (f"(LOGOPEN,{path})", f"(LOG,{text})", "(LOGCLOSE)"):
                self.mdi(block, False)
            with open(path, errors="replace") as shown:
                return {"shown": shown.read(LONGEST).strip()}
        except OSError as error:
            raise Failed("machine", f"LinuxCNC does not show its parameters ({error}): does it run as the same user, "
                         "on this computer?")
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def abort(self):
        self.poll_held()
        if self.held:
            self.command.abort()
            self.command.wait_complete(5)
        self.moving = False
        return {}

    def leave(self):
        """Ends what is under way and gives back the mode, unless somebody else has it by now."""
        if not self.held:
            return
        self.poll_held()
        if not self.idle():
            self.command.abort()
            self.command.wait_complete(5)
        self.poll_held()
        if self.was_manual:
            self.command.mode(self.cnc.MODE_MANUAL)
            self.command.wait_complete(5)

    def answer(self, request):
        do = request.get("do")
        if do in ("look", "state", "take", "abort"):
            return getattr(self, do)()
        if do == "mdi":
            return self.mdi(str(request["block"]), request.get("move", False))
        if do == "show":
            return self.show(str(request["text"]))
        raise Failed("machine", f"nothing is known of \"{do}\"")


def requests(session):
    """Yields each line of standard input until it ends, or its holder does."""
    parent = os.getppid()
    buffered = b""
    while os.getppid() == parent:
        ready, _, _ = select.select([0], [], [], LOOK_S if session.moving else PARENT_S)
        if not ready:
            continue
        read = os.read(0, LONGEST)
        if not read or len(buffered) > LONGEST:
            return
        *lines, buffered = (buffered + read).split(b"\n")
        yield from lines


def tell(answer):
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()


def main():
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that asks is the one that is interrupted
    try:
        session = connect()
    except Failed as failed:
        tell({"id": 0, "error": str(failed), "kind": failed.kind})
        return
    tell({"id": 0})
    try:
        for line in requests(session):
            request = json.loads(line)
            try:
                answer = session.answer(request)
            except Failed as failed:
                answer = {"error": str(failed), "kind": failed.kind}
            except session.cnc.error as error:
                answer = {"error": f"LinuxCNC has ended ({error})", "kind": "machine"}
            tell({"id": request["id"], **answer})
    except BrokenPipeError:
        pass  # nobody listens any more
    finally:
        try:
            session.leave()
        except (Failed, session.cnc.error):
            pass


main()
