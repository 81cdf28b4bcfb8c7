#!/usr/bin/env python3
"""Runs the journeys of journey_test.py against trammel serve and a virtual printer.

    virtual_printer_test.py TRAMMEL TRAMMEL_SIM [OPTIONS OF journey_test.py]
"""
import os
import pathlib
import re
import shlex
import socket
import subprocess
import sys
import tempfile
import time

import web_driver

HERE = pathlib.Path(__file__).resolve().parent
# A run lasts long enough to be seen and stopped: the pattern takes a minute of the printer's time.
HURRY = "4"


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def photos(sim, folder):
    """A photo of another tool's lines with a good answer, and a blurred one."""
    subprocess.run([sim, "pattern", "orca-line", "-o", "lines.gcode"], cwd=folder, check=True)
    look = "--phone --size 1500x2000 --scene black-on-gold --seed 33 --exponent 0.8 --pressure-advance 0.035"
    for name, more in (("good.jpg", ""), ("blurred.jpg", "--set blur-px=6")):
        subprocess.run([sim, "photo", "lines.gcode", *f"{look} {more} -o {name}".split()], cwd=folder, check=True)
    return folder / "good.jpg", folder / "blurred.jpg"


class Server:
    def __init__(self, trammel, sim, folder):
        self.printer = subprocess.Popen([sim, "printer", "--port", "0", "--seed", "7", "--hurry", HURRY], cwd=folder,
                                        stdout=subprocess.PIPE, text=True)
        address = re.search(r"http://(\S+)", self.printer.stdout.readline()).group(1)
        self.port = free_port()
        # Commands, as the journeys stop and start it.
        words = [trammel, "serve", "--printer", address, "--material", "pla", "--out", "recordings", "--panel",
                 str(self.port), "--panel-name", "printer.test"]
        self.back = f"cd {shlex.quote(str(folder))} && exec {sys.executable} {shlex.quote(__file__)} --start {shlex.join(words)}"
        self.gone = f"exec {sys.executable} {shlex.quote(__file__)} --stop {shlex.quote(str(folder))}"
        subprocess.run(self.back, shell=True, check=True)
        self.folder = folder

    def close(self):
        subprocess.run(self.gone, shell=True, check=False)
        self.printer.terminate()
        self.printer.wait()


def start(words):
    """Starts the server, and returns once it answers."""
    with open("serve.log", "a", encoding="utf-8") as log:
        process = subprocess.Popen(words, stdout=log, stderr=log, start_new_session=True)
    pathlib.Path("serve.pid").write_text(str(process.pid), encoding="utf-8")
    port = int(words[words.index("--panel") + 1])
    for _ in range(600):
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
            return
        except OSError:
            time.sleep(0.1)
    sys.exit("trammel serve does not answer: " + pathlib.Path("serve.log").read_text(encoding="utf-8"))


def stop(folder):
    number = int(pathlib.Path(folder, "serve.pid").read_text(encoding="utf-8"))
    os.kill(number, 15)
    for _ in range(600):
        try:
            os.kill(number, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    sys.exit("trammel serve does not end")


def main(trammel, sim, *options):
    trammel, sim = os.path.abspath(trammel), os.path.abspath(sim)
    web_driver.require()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        os.environ.update(HOME=name, XDG_STATE_HOME=name, XDG_DATA_HOME=name)
        good, blurred = photos(sim, folder)
        server = Server(trammel, sim, folder)
        try:
            end = subprocess.run([sys.executable, HERE / "journey_test.py", f"http://printer.test:{server.port}/",
                                  "--photo", good, "--refused-photo", blurred, "--pattern", "orca-line",
                                  "--gone", server.gone, "--back", server.back, *options], check=False).returncode
        finally:
            server.close()
        if end != 0:
            print((folder / "serve.log").read_text(encoding="utf-8")[-4000:])
    sys.exit(end)


if __name__ == "__main__":
    if sys.argv[1] == "--start":
        start(sys.argv[2:])
    elif sys.argv[1] == "--stop":
        stop(sys.argv[2])
    else:
        main(*sys.argv[1:])
