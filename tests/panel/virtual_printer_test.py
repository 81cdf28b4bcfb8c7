#!/usr/bin/env python3
"""Runs the journeys of journey_test.py against trammel serve and a virtual printer.

    virtual_printer_test.py TRAMMEL TRAMMEL_SIM [--phone-photos] [OPTIONS AND TESTS OF journey_test.py]

--phone-photos makes photos as phones store them, 48 megapixels and HEIC: half a minute, and much more with a sanitizer.
"""
import os
import pathlib
import re
import shlex
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import web_driver

HERE = pathlib.Path(__file__).resolve().parent
# A run lasts long enough to be looked at and stopped: the pattern takes a minute of the printer's time.
HURRY = "2"


def photo(sim, folder, name, size="1500x2000", more=""):
    """A photo of another tool's lines."""
    if not (folder / "lines.gcode").exists():
        subprocess.run([sim, "pattern", "orca-line", "-o", "lines.gcode"], cwd=folder, check=True)
    look = f"--phone --size {size} --scene black-on-gold --seed 33 --exponent 0.8 --pressure-advance 0.035 {more}"
    subprocess.run([sim, "photo", "lines.gcode", *look.split(), "-o", name], cwd=folder, check=True)
    return folder / name


def heic(photo):
    """The same photo as most phones store it; none where Debian's libheif-examples is missing."""
    if not shutil.which("heif-enc"):
        print("SKIPPED: HEIC, as heif-enc is missing; apt install libheif-examples")
        return []
    subprocess.run(["heif-enc", "-p", "preset=ultrafast", photo, "-o", photo.with_suffix(".heic")], check=True)
    return [photo.with_suffix(".heic")]


class Server:
    def __init__(self, trammel, sim, folder):
        words = [sim, *"printer --port 0 --seed 7 --camera-port 0 --camera-frame 640x480 --hurry".split(), HURRY]
        self.printer = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True)
        address = re.search(r"http://(\S+)", self.printer.stdout.readline()).group(1)
        self.port = web_driver.free_port()
        # Commands, as the journeys stop and start it.
        words = [trammel, "serve", "--printer", address, "--material", "pla", "--out", "recordings", "--panel",
                 str(self.port), "--panel-name", "printer.test"]
        self.back = f"cd {shlex.quote(str(folder))} && exec {sys.executable} {shlex.quote(__file__)} --start {shlex.join(words)}"
        self.gone = f"exec {sys.executable} {shlex.quote(__file__)} --stop {shlex.quote(str(folder))}"
        subprocess.run(self.back, shell=True, check=True)
        self.folder = folder

    def close(self):
        subprocess.run(self.gone, shell=True, check=False)
        if self.printer.poll() is not None:
            print(f"the virtual printer ended by itself: {self.printer.returncode}")
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


def main(trammel, sim, *more):
    trammel, sim, options = os.path.abspath(trammel), os.path.abspath(sim), list(more)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        os.environ.update(HOME=name, XDG_STATE_HOME=name, XDG_DATA_HOME=name)
        good, blurred = photo(sim, folder, "good.jpg"), photo(sim, folder, "blurred.jpg", more="--set blur-px=6")
        if "--phone-photos" in options:
            at = options.index("--phone-photos") + 1
            options[at:at] = photo(sim, folder, "48-megapixels.jpg", "6000x8000"), *heic(good)
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
