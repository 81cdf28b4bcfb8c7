# trammel's library through cffi
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Calls libtrammel_tap.so, trammel's C interface (include/trammel/tap.h)."""
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from typing import Any, NamedTuple, Optional, Sequence, Tuple

# As in include/trammel/tap.h.
STRUCTS = """
typedef struct trammel_tap_move {
  double start_time_s; double duration_s; double start_velocity_mm_s; double acceleration_mm_s2;
  double start_z_mm; double z_direction;
} trammel_tap_move;
typedef struct trammel_tap_options {
  size_t struct_size; int32_t method; int32_t reserved; double latency_s;
  double latency_uncertainty_s; double nozzle_temperature_c; double trigger_force_g;
  double decompression_angle_rad;
} trammel_tap_options;
typedef struct trammel_tap_finding {
  int32_t code; int32_t reserved; double figure; double limit;
} trammel_tap_finding;
typedef struct trammel_tap_point {
  int32_t corner; int32_t reserved; double time_s; double z_mm; double force_g;
} trammel_tap_point;
typedef struct trammel_tap_result {
  size_t struct_size; int32_t verdict; int32_t method; trammel_tap_finding reason;
  double contact_z_mm; double contact_time_s; double standard_uncertainty_mm;
  double interval95_lo_mm; double interval95_hi_mm; double quality; double noise_g;
  int32_t point_count; int32_t notice_count; trammel_tap_point points[8];
  trammel_tap_finding notices[16];
} trammel_tap_result;
"""
FUNCTIONS = """
int32_t trammel_tap_version(void);
size_t trammel_tap_workspace_bytes(size_t samples);
void trammel_tap_default_options(trammel_tap_options* options, size_t options_size);
int trammel_tap_analyse(const double* time_s, const double* force_g, size_t samples,
  const trammel_tap_move* moves, size_t move_count, const trammel_tap_options* options,
  void* workspace, size_t workspace_bytes, trammel_tap_result* result);
const char* trammel_tap_verdict_name(int32_t verdict);
const char* trammel_tap_finding_name(int32_t code);
const char* trammel_tap_status_name(int status);
size_t trammel_tap_explain(const trammel_tap_finding* finding, char* text, size_t size);
"""
LEAST_VERSION = 2  # negative latencies
SONAME = 'libtrammel_tap.so.1'
VERDICTS = (0, 1, 2)  # of trammel_tap_result: good, cannot_tell, refused
MOST_NOTICES = 16
OPEN_LIMIT_S = 10.  # a hundred times what a slow disk takes


class TapError(Exception):
    """A tap, a library or a machine that cannot be used; says why."""


class Move(NamedTuple):
    """A piece of motion along Z: z(t) = start_z + z_r (start_v dt + accel dt^2 / 2)."""
    print_time: float
    move_t: float
    start_v: float
    accel: float
    start_z: float
    z_r: float


class Tap(NamedTuple):
    """What a tap recorded: times and forces of equal length, on one clock with the moves."""
    times: Sequence[float]
    forces: Sequence[float]
    moves: Sequence[Move]


class Context(NamedTuple):
    """What is known about a tap beside its recording; NaN for what is not."""
    latency: float = math.nan  # by which samples are dated after their force acted; any sign
    latency_uncertainty: float = 0.
    nozzle_temperature: float = math.nan
    trigger_force: float = math.nan


class Answer(NamedTuple):
    """The contact of a tap, or why there is none. Numbers are None unless the verdict is good."""
    verdict: str  # good, cannot_tell, refused
    reason: str
    text: str
    z: Optional[float] = None
    uncertainty: Optional[float] = None  # standard, k = 1
    interval: Optional[Tuple[float, float]] = None  # 95 %
    quality: Optional[float] = None
    noise: Optional[float] = None
    notices: Tuple[str, ...] = ()
    cpu_time: float = 0.

    def in_words(self) -> str:
        """Returns the contact with its interval and notices, or the verdict with its reason."""
        if self.z is None:
            return "%s, %s: %s" % (self.verdict, self.reason, self.text)
        return ("nozzle contact at z=%.6f, 95%% interval %.6f to %.6f%s"
                % ((self.z,) + self.interval + (''.join(', ' + n for n in self.notices),)))


def _finite(value: float) -> Optional[float]:
    return value if math.isfinite(value) else None


def library_path() -> str:
    """Returns the library installed together with this file, else the system's."""
    # PREFIX/share/trammel/klipper/trammel_tap, and PREFIX/lib or PREFIX/lib/ARCHITECTURE. Anywhere
    # else, as in a source tree, PREFIX would be somebody else's folder.
    here = os.path.dirname(os.path.realpath(__file__))
    installed = os.path.join(os.sep, 'share', 'trammel', 'klipper', 'trammel_tap')
    if not here.endswith(installed):
        return SONAME
    prefix = here[:-len(installed)] or os.sep
    lib = os.path.join(prefix, 'lib')
    folders = [lib] + ([os.path.join(lib, f) for f in sorted(os.listdir(lib))]
                       if os.path.isdir(lib) else [])
    for folder in folders:
        path = os.path.join(folder, SONAME)
        if os.path.exists(path):
            return path
    return SONAME


def open_copy(ffi: Any, path: str) -> Any:
    """Loads a copy of a library's file, so that writing over the file later reaches no process.

    Loads the file itself where it is not given by its path, or where a copy finds no room or may
    not be executed. Raises OSError for a file that is no library.
    """
    if os.path.isfile(path):
        try:
            with tempfile.NamedTemporaryFile(prefix='trammel_tap-', suffix='.so') as copy:
                shutil.copyfile(path, copy.name)
                return ffi.dlopen(copy.name)
        except OSError:  # the file's own error names the file
            pass
    return ffi.dlopen(path)


def try_apart(path: str, limit: float) -> None:
    """Loads and tries the library in a process of its own: dlopen keeps all threads of Klipper
    while it hangs, and a library for another processor ends the process that calls it.

    Raises TapError for a library that does either.
    """
    try:
        process = subprocess.Popen(
            [sys.executable, '-I', os.path.realpath(__file__), path], stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, close_fds=True)
    except OSError:  # no memory for it: the library is trusted
        return
    end = time.monotonic() + limit
    while process.poll() is None and time.monotonic() < end:
        time.sleep(.01)
    if process.poll() is None:
        process.kill()  # not waited for: a hung disk holds it
        raise TapError("the library %s did not answer within %.0f s" % (path, limit))
    if process.returncode < 0:
        raise TapError("the library %s ends the process that calls it, by signal %d: install the "
                       "one for this computer" % (path, -process.returncode))


def open_library(path: str, limit: float = OPEN_LIMIT_S) -> 'Library':
    """Loads the library once it has been tried apart. Raises TapError as Library does."""
    try_apart(path, limit)
    return Library(path)


class Library:
    """libtrammel_tap through cffi. One call at a time: they share a workspace."""

    def __init__(self, path: str) -> None:
        """Loads the library and tries it on a drawn tap.

        Raises TapError, with what is wrong, for a library that is missing, of another
        architecture, older than LEAST_VERSION, or that reads memory otherwise than this module.
        """
        try:
            import cffi
            self._ffi = cffi.FFI()  # not Klipper's own, which all of it shares
            self._ffi.cdef(STRUCTS + FUNCTIONS)
            self._lib = open_copy(self._ffi, path)
            version = self._lib.trammel_tap_version()
        except (ImportError, OSError, AttributeError) as e:
            raise TapError("%s (the library must be there, and built for this computer)"
                           % (str(e).split('.  Additionally')[0],))
        if version < LEAST_VERSION:
            raise TapError("the library %s has interface %d, and %d is needed: install it anew"
                           % (path, version, LEAST_VERSION))
        self._workspace = self._ffi.new('char[]', 0)
        tap, contact = drawn_tap()
        try:
            answer = self.analyse(tap, Context(latency=0.))
        except TapError as e:
            raise TapError("the library %s reads a drawn tap wrongly: %s" % (path, e))
        if answer.z is None or abs(answer.z - contact) > .002:
            raise TapError("the library %s reads a drawn tap with contact at z=%.3f as %s (%s)"
                           % (path, contact, answer.z, answer.reason))

    def analyse(self, tap: Tap, context: Context) -> Answer:
        """Analyses one tap; raises TapError where the library does not take it."""
        ffi, lib = self._ffi, self._lib
        started = time.thread_time()
        samples = len(tap.times)
        if len(tap.forces) != samples:
            raise TapError("%d times, but %d forces" % (samples, len(tap.forces)))
        options = ffi.new('trammel_tap_options *')
        lib.trammel_tap_default_options(options, ffi.sizeof('trammel_tap_options'))
        options.latency_s = context.latency
        options.latency_uncertainty_s = context.latency_uncertainty
        options.nozzle_temperature_c = context.nozzle_temperature
        options.trigger_force_g = context.trigger_force
        needed = lib.trammel_tap_workspace_bytes(samples)
        if len(self._workspace) < needed:
            self._workspace = ffi.new('char[]', needed)
        result = ffi.new('trammel_tap_result *')
        result.struct_size = ffi.sizeof('trammel_tap_result')
        status = lib.trammel_tap_analyse(
            ffi.new('double[]', tap.times), ffi.new('double[]', tap.forces), samples,
            ffi.new('trammel_tap_move[]', list(tap.moves)), len(tap.moves), options,
            self._workspace, len(self._workspace), result)
        if status != 0:
            raise TapError("the library answers %s"
                           % self._string(lib.trammel_tap_status_name(status)))
        return self._answer(result, time.thread_time() - started)

    def _answer(self, result: Any, cpu_time: float) -> Answer:
        interval = (result.interval95_lo_mm, result.interval95_hi_mm)
        if result.verdict not in VERDICTS:
            raise TapError("the library's answer makes no sense: verdict %d" % result.verdict)
        if not 0 <= result.notice_count <= MOST_NOTICES:
            raise TapError("the library's answer makes no sense: %d notices" % result.notice_count)
        names = tuple(self._string(self._lib.trammel_tap_finding_name(result.notices[i].code))
                      for i in range(result.notice_count))
        good = result.verdict == VERDICTS[0]
        # A height that is no number, or lies outside of its own interval, is none.
        if good and not -math.inf < interval[0] <= result.contact_z_mm <= interval[1] < math.inf:
            raise TapError("the library's answer makes no sense: %g in an interval of %g to %g"
                           % ((result.contact_z_mm,) + interval))
        return Answer(
            self._string(self._lib.trammel_tap_verdict_name(result.verdict)),
            self._string(self._lib.trammel_tap_finding_name(result.reason.code)),
            self._explain(result), result.contact_z_mm if good else None,
            result.standard_uncertainty_mm if good else None, interval if good else None,
            _finite(result.quality), _finite(result.noise_g), names, cpu_time)

    def _explain(self, result: Any) -> str:
        text = self._ffi.new('char[]', 400)
        self._lib.trammel_tap_explain(self._ffi.addressof(result, 'reason'), text, 400)
        return self._string(text)

    def _string(self, text: Any) -> str:
        return self._ffi.string(text).decode()


def drawn_tap() -> Tuple[Tap, float]:
    """Draws a tap onto a bed of 3500 gf/mm with 1 gf of noise; returns it with its contact's z."""
    contact, halt, start, stiffness, period = .05, .005, .5, 3500., 1. / 320.
    down, up, accel, distance, rest = 2., .3, 100., .2, .3
    halt_time = (start - halt) / down
    rise = halt_time + rest
    ramp, ramp_z = up / accel, .5 * up * up / accel
    cruise = (distance - 2. * ramp_z) / up
    moves = [Move(0., halt_time, down, 0., start, -1.), Move(rise, ramp, 0., accel, halt, 1.),
             Move(rise + ramp, cruise, up, 0., halt + ramp_z, 1.),
             Move(rise + ramp + cruise, ramp, up, -accel, halt + distance - ramp_z, 1.)]
    noise = random.Random(1)
    times = [i * period for i in range(int((rise + 2. * ramp + cruise + .1) / period))]
    return Tap(times, [stiffness * max(0., contact - height(moves, t)) + noise.gauss(0., 1.)
                       for t in times], moves), contact


def height(moves: Sequence[Move], t: float) -> float:
    """Returns z at a time: on the move under way, else at the end of the one before."""
    move = [m for m in moves if m.print_time <= t or m is moves[0]][-1]
    dt = min(max(0., t - move.print_time), move.move_t)
    return move.start_z + move.z_r * (move.start_v + .5 * move.accel * dt) * dt


if __name__ == '__main__':  # of try_apart
    try:
        Library(sys.argv[1])
    except TapError:
        pass  # whoever loads it next is told
