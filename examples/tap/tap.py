#!/usr/bin/env python3
"""Reads taps from a dump_taps file, as Klipper and its forks write them, and prints their contact
height: trammel's C interface through ctypes, as Klipper's host would call it.

    tap.py libtrammel_tap.so taps.json
"""
import ctypes as c
import json
import math
import sys


class Move(c.Structure):
    _fields_ = [(name, c.c_double) for name in (
        "start_time_s", "duration_s", "start_velocity_mm_s", "acceleration_mm_s2", "start_z_mm",
        "z_direction")]


class Options(c.Structure):
    _fields_ = [("struct_size", c.c_size_t), ("method", c.c_int32), ("reserved", c.c_int32)] + [
        (name, c.c_double) for name in (
            "latency_s", "latency_uncertainty_s", "nozzle_temperature_c", "trigger_force_g",
            "decompression_angle_rad")]


class Finding(c.Structure):
    _fields_ = [("code", c.c_int32), ("reserved", c.c_int32), ("figure", c.c_double),
                ("limit", c.c_double)]


class Point(c.Structure):
    _fields_ = [("corner", c.c_int32), ("reserved", c.c_int32), ("time_s", c.c_double),
                ("z_mm", c.c_double), ("force_g", c.c_double)]


class Result(c.Structure):
    _fields_ = [("struct_size", c.c_size_t), ("verdict", c.c_int32), ("method", c.c_int32),
                ("reason", Finding)] + [
        (name, c.c_double) for name in (
            "contact_z_mm", "contact_time_s", "standard_uncertainty_mm", "interval95_lo_mm",
            "interval95_hi_mm", "quality", "noise_g")] + [
        ("point_count", c.c_int32), ("notice_count", c.c_int32), ("points", Point * 8),
        ("notices", Finding * 16)]


class TapLibrary:
    """Keeps the workspace, so that only a longer tap than any before allocates."""

    def __init__(self, path):
        self.lib = c.CDLL(path)
        doubles = c.POINTER(c.c_double)
        self.lib.trammel_tap_workspace_bytes.restype = c.c_size_t
        self.lib.trammel_tap_workspace_bytes.argtypes = [c.c_size_t]
        self.lib.trammel_tap_default_options.argtypes = [c.POINTER(Options), c.c_size_t]
        self.lib.trammel_tap_analyse.argtypes = [
            doubles, doubles, c.c_size_t, c.POINTER(Move), c.c_size_t, c.POINTER(Options),
            c.c_void_p, c.c_size_t, c.POINTER(Result)]
        self.lib.trammel_tap_explain.restype = c.c_size_t
        self.lib.trammel_tap_explain.argtypes = [c.POINTER(Finding), c.c_char_p, c.c_size_t]
        for name in ("verdict", "finding", "status"):
            function = getattr(self.lib, f"trammel_tap_{name}_name")
            function.restype = c.c_char_p
            function.argtypes = [c.c_int32]
        self.options = Options()
        self.lib.trammel_tap_default_options(self.options, c.sizeof(Options))
        self.workspace = c.create_string_buffer(0)

    def analyse(self, tap):
        """A tap of dump_taps ("time", "force", "moves") to a Result."""
        samples = len(tap["time"])
        if len(tap["force"]) != samples:
            raise ValueError(f"{samples} times, but {len(tap['force'])} forces")
        array = c.c_double * samples
        moves = (Move * len(tap["moves"]))(*[
            Move(m["print_time"], m["move_t"], m["start_v"], m["accel"], m["start_z"], m["z_r"])
            for m in tap["moves"]])
        needed = self.lib.trammel_tap_workspace_bytes(samples)
        if len(self.workspace) < needed:
            self.workspace = c.create_string_buffer(needed)
        result = Result(struct_size=c.sizeof(Result))
        status = self.lib.trammel_tap_analyse(
            array(*tap["time"]), array(*tap["force"]), samples, moves, len(moves), self.options,
            self.workspace, len(self.workspace), result)
        if status != 0:
            raise RuntimeError(self.lib.trammel_tap_status_name(status).decode())
        return result

    def explain(self, finding):
        text = c.create_string_buffer(400)
        self.lib.trammel_tap_explain(finding, text, len(text))
        return text.value.decode()


def main():
    library = TapLibrary(sys.argv[1])
    with open(sys.argv[2], encoding="utf-8") as file:
        data = json.load(file)
    good = True
    for tap in data if isinstance(data, list) else [data]:
        result = library.analyse(tap)
        verdict = library.lib.trammel_tap_verdict_name(result.verdict).decode()
        good = good and verdict == "good"
        if math.isnan(result.contact_z_mm):
            print(f"{verdict}: {library.explain(result.reason)}")
        else:
            print(f"{verdict}: contact at z = {result.contact_z_mm:.5f} mm, 95 % interval "
                  f"{result.interval95_lo_mm:.5f} to {result.interval95_hi_mm:.5f} mm")
        for notice in result.notices[:result.notice_count]:
            print(f"  {library.lib.trammel_tap_finding_name(notice.code).decode()}: "
                  f"{library.explain(notice)}")
    return 0 if good else 2


if __name__ == "__main__":
    sys.exit(main())
