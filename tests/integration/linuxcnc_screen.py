"""Stands in for LinuxCNC's screen (AXIS) in tests: LinuxCNC starts it as its DISPLAY.

Takes every message to the operator away, as a screen does. Carries out what it finds in the file "ask" of its folder and
leaves what it saw in "told": one word and its numbers, answered in JSON.
  ready          switches the machine on, homes it, and chooses MANUAL
  take S         S seconds after the machine has begun to move: chooses MANUAL, then watches for a second
  blink S        the same, and chooses MDI again at once: the move is gone, the mode is as it was
  run, manual    chooses the mode
  abort, estop   as Esc does, and the emergency stop
  feed F         sets the feed override
  mdi BLOCK      carries a block out, and leaves MANUAL behind
  look, quit
"""
import json
import os
import sys
import time

import linuxcnc

folder = sys.argv[1]
stat = linuxcnc.stat()
command = linuxcnc.command()
errors = linuxcnc.error_channel()


def do(name, *arguments):
    getattr(command, name)(*arguments)
    command.wait_complete(10)


def look():
    """Returns where the machine is, and steals the messages meanwhile."""
    while errors.poll():
        pass
    stat.poll()
    return list(stat.actual_position)


def wait(condition, limit_s=20):
    end = time.monotonic() + limit_s
    while not condition() and time.monotonic() < end:
        time.sleep(0.002)


def choose_manual():
    do("mode", linuxcnc.MODE_MANUAL)
    do("teleop_enable", 1)  # without which a machine that was moving stays in AUTO


def ready():
    do("state", linuxcnc.STATE_ESTOP_RESET)
    do("state", linuxcnc.STATE_ON)
    choose_manual()
    if not all(stat.homed[:4]):
        do("teleop_enable", 0)
        do("home", -1)
        wait(lambda: look() and all(stat.homed[:4]))
        choose_manual()
    return {"homed": list(stat.homed[:4])}


def interrupt(delay_s, back):
    """Interrupts a move and reports how far the machine went from a tenth of a second after it on."""
    start = look()
    wait(lambda: max(abs(a - b) for a, b in zip(look(), start)) > 1e-6)
    time.sleep(delay_s)
    do("mode", linuxcnc.MODE_MANUAL)
    taken = time.monotonic()
    if back:
        do("mode", linuxcnc.MODE_MDI)
    else:
        choose_manual()
    wait(lambda: time.monotonic() > taken + 0.1)
    stood = look()
    went = 0.0
    while time.monotonic() < taken + 1:
        went = max(went, max(abs(a - b) for a, b in zip(look(), stood)))
        time.sleep(0.001)
    return {"went_mm": went, "manual": stat.task_mode == linuxcnc.MODE_MANUAL}


def carry_out(words):
    if words[0] == "ready":
        return ready()
    if words[0] in ("take", "blink"):
        return interrupt(float(words[1]), words[0] == "blink")
    if words[0] == "run":
        do("mode", linuxcnc.MODE_AUTO)
    if words[0] == "manual":
        choose_manual()
    if words[0] == "abort":
        do("abort")
    if words[0] == "estop":
        do("state", linuxcnc.STATE_ESTOP)
    if words[0] == "feed":
        do("feedrate", float(words[1]))
    if words[0] == "mdi":
        do("mode", linuxcnc.MODE_MDI)
        do("mdi", " ".join(words[1:]))
        choose_manual()
    at = look()[:3]
    return {"at": at, "mode": stat.task_mode, "rotation": stat.rotation_xy, "g5x": list(stat.g5x_offset[:3]),
            "codes": list(stat.gcodes[1:]), "feed": stat.settings[1]}


def main():
    ask = os.path.join(folder, "ask")
    while True:
        look()
        if not os.path.exists(ask):
            time.sleep(0.005)
            continue
        with open(ask) as file:
            words = file.read().split()
        os.remove(ask)
        answer = {} if words[0] == "quit" else carry_out(words)
        with open(os.path.join(folder, "told.new"), "w") as file:
            json.dump(answer, file)
        os.rename(os.path.join(folder, "told.new"), os.path.join(folder, "told"))
        if words[0] == "quit":
            return


main()
