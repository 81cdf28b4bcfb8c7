# One tap after another, until one is good
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Presses, pulls back, asks for the contact, and repeats what could not be measured."""
import logging
import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

from .analyser import Analyser
from .library import Answer, Context, Move, Tap, TapError
from .load_cell_probe import LoadCellProbe, check_printer

# Reasons that lie in what was pressed on (docs/howto/tap.md), which a scrub may mend.
SCRUB_REASONS = frozenset([
    'adhesion', 'baseline_force_inconsistent', 'fouled_nozzle', 'loose_sheet',
    'low_compression_force', 'low_decompression_force', 'low_tap_quality', 'mid_air_impulse',
    'slow_collision', 'still_in_contact'])

LONGEST_PULLBACK_S = 10.  # Klipper remembers moves for 30 s
APPROACH_S = 3.  # looked at before the pull-back: the rest at full press (0.45 s) and the descent
MOST_USUAL_SPEED = .5  # mm/s: faster, little of a press is left after the acceleration
AFTER_PULLBACK_S = .05  # of free force: more than a converter is late
SAME_PLACE_MM = 1e-6
CONSOLE_S = 5.  # after the start, until Moonraker listens to the console: 1 to 3 s
BESIDE_MM = .1  # what samples dated too late move a contact by, and more


def check_duration(distance: float, speed: float, error: Any) -> None:
    """Raises the error for a pull-back that takes too long, or whose numbers are none."""
    if not distance <= LONGEST_PULLBACK_S * speed:
        raise error("trammel_tap: a pull-back of %.3f mm at %.3f mm/s takes longer than %.0f s"
                    % (distance, speed, LONGEST_PULLBACK_S))


class Settings(NamedTuple):
    """The options of [trammel_tap], but for the library."""
    pullback_distance: float
    pullback_speed: Optional[float]  # None: 1 um per sample, MOST_USUAL_SPEED at most
    retries: int
    latency: float  # NaN: from each tap's approach
    latency_uncertainty: Optional[float]  # None: within half a sample to either side
    scrub: Any  # template; None without one

    @classmethod
    def read(cls, config: Any) -> 'Settings':
        scrub = None
        if config.get('scrub_gcode', '').strip():
            gcode_macro = config.get_printer().load_object(config, 'gcode_macro')
            scrub = gcode_macro.load_template(config, 'scrub_gcode')
        latency = config.getfloat('latency', None, minval=-.2, maxval=.2)
        uncertainty = config.getfloat('latency_uncertainty', None, minval=0., maxval=.2)
        if latency is None and uncertainty is not None:
            raise config.error("trammel_tap: option 'latency_uncertainty' needs 'latency'")
        distance = config.getfloat('pullback_distance', .2, minval=.05, maxval=1.)
        speed = config.getfloat('pullback_speed', None, minval=.02, maxval=2.)
        check_duration(distance, MOST_USUAL_SPEED if speed is None else speed, config.error)
        return cls(distance, speed, config.getint('retries', 3, minval=0, maxval=10),
                   math.nan if latency is None else latency, uncertainty, scrub)

    def of_command(self, gcmd: Any, sample_rate: float) -> 'Settings':
        """Returns these with a command's parameters, complete and in range."""
        usual = min(MOST_USUAL_SPEED, max(.02, .001 * sample_rate))
        latency_uncertainty = self.latency_uncertainty
        if latency_uncertainty is None:
            # All of the sample alike: of that the deviation is a sample over the root of 12.
            latency_uncertainty = (0. if math.isnan(self.latency)
                                   else 1. / (math.sqrt(12.) * sample_rate))
        chosen = self._replace(
            pullback_distance=gcmd.get_float('PULLBACK_DISTANCE', self.pullback_distance,
                                             minval=.05, maxval=1.),
            pullback_speed=gcmd.get_float('PULLBACK_SPEED', self.pullback_speed or usual,
                                          minval=.02, maxval=2.),
            retries=gcmd.get_int('TAP_RETRIES', self.retries, minval=0, maxval=10),
            latency_uncertainty=latency_uncertainty)
        check_duration(chosen.pullback_distance, chosen.pullback_speed, gcmd.error)
        return chosen


class Tapping:
    """The printer object trammel_tap."""

    def __init__(self, printer: Any, settings: Settings, probe: Optional[LoadCellProbe],
                 library: Any, trouble: str = '') -> None:
        """@param probe  None where there is trouble: probing is Klipper's own."""
        self.printer = printer
        self._settings = settings
        self._trouble = trouble
        self._answer = None  # type: Optional[Answer]
        self._counts = {'taps': 0, 'refused': 0, 'scrubs': 0}
        printer.register_event_handler('klippy:ready', self._handle_ready)
        if probe is None:
            return
        self._probe = probe
        self._analyser = Analyser(printer.get_reactor(), library)
        probe.replace_tap(self.run_tap)

    def _handle_ready(self) -> None:
        if self._trouble:
            self._warn(CONSOLE_S)
            return
        try:
            check_printer(self.printer)
        except TapError as e:
            self._give_up(str(e), CONSOLE_S)
            return
        if self._probe.has_own_fit:
            # Whoever installed the extra wants its contact; nobody is to wonder whose height it is.
            self._say_in_console(
                "// trammel_tap: this Klipper fits the contact of a probe by itself. [trammel_tap] "
                "takes the place of that fit: heights are trammel's, with an interval, and a bad "
                "tap is repeated. Without that section they are Klipper's", CONSOLE_S)

    def _warn(self, delay: float) -> None:
        text = ("trammel_tap: %s. Probing is Klipper's own: its heights differ from trammel's, so "
                "calibrate z_offset anew before you print with them" % (self._trouble,))
        self.printer.lookup_object('configfile').runtime_warning(text)
        self._say_in_console('!! ' + text, delay)

    def _say_in_console(self, text: str, delay: float) -> None:
        """Says it after a while: Moonraker begins to listen only after Klipper is ready."""
        reactor = self.printer.get_reactor()

        def say(eventtime: float) -> None:
            self.printer.lookup_object('gcode').respond_raw(text)

        reactor.register_callback(say, reactor.monotonic() + delay)

    def _give_up(self, trouble: str, delay: float = 0.) -> None:
        """Leaves probing to Klipper until the next start, and says so once."""
        self._trouble = trouble
        self._probe.give_back()
        self._warn(delay)

    def get_status(self, eventtime: float) -> Dict[str, Any]:
        """Returns numbers, text, lists and None only, which JSON can hold."""
        a = self._answer
        lo, hi = (a.interval if a is not None and a.interval is not None else (None, None))
        return dict(
            self._counts, active=not self._trouble, trouble=self._trouble,
            last_verdict=a.verdict if a else '', last_reason=a.reason if a else '',
            last_z=a.z if a else None, last_uncertainty=a.uncertainty if a else None,
            last_interval_lo=lo, last_interval_hi=hi, last_quality=a.quality if a else None,
            last_noise=a.noise if a else None, last_notices=list(a.notices) if a else [],
            last_cpu_time=a.cpu_time if a else None)

    def run_tap(self, gcmd: Any) -> Tuple[Sequence[float], bool]:
        """Returns the place of the contact, as Klipper's tap does that of the trigger.

        Whatever goes wrong comes out as an error of the command, with the nozzle lifted.
        """
        homing = gcmd.get_command() == 'G28'
        if self.printer.get_start_args().get('debugoutput') is not None:
            return self._probe.klippers_tap(gcmd)
        # At its first touch G28 has made up a height from which no move up is in range.
        if homing and gcmd.get('HOME_ATTEMPT_NUM', '') == '1':
            return self._touch(gcmd)
        # The command in which it began to hang has failed: no heights of two kinds are mixed.
        if self._analyser.hangs():
            self._give_up("the library hangs: the analysis of a tap has not ended. Restart "
                          "Klipper's service to try it again")
            return self._probe.klippers_tap(gcmd)
        settings = self._settings.of_command(gcmd, self._probe.sample_rate())
        start_z = self._position()[2]
        try:
            return self._tap_until_good(gcmd, settings, start_z, homing)
        except self.printer.command_error:
            self._lift_after_error(gcmd, start_z)
            raise
        except Exception as e:  # anything else would shut the printer down
            if not isinstance(e, TapError):
                logging.exception("trammel_tap")
            self._lift_after_error(gcmd, start_z)
            raise self.printer.command_error("trammel_tap: %s" % (str(e) or repr(e),))

    def _touch(self, gcmd: Any) -> Tuple[Sequence[float], bool]:
        """Takes the place of the trigger and leaves the nozzle there."""
        if not self._probe.lifts:
            return self._probe.klippers_tap(gcmd)
        place, collector = self._probe.press(gcmd)  # Klipper's own tap would lift: out of range
        _, errors = collector.collect_until(
            self.printer.lookup_object('toolhead').get_last_move_time())
        if errors:
            raise self.printer.command_error(
                "trammel_tap: the load cell's sensor reported %d errors and %d overflows" % errors)
        return place, True

    def _tap_until_good(self, gcmd: Any, settings: Settings, start_z: float,
                        homing: bool) -> Tuple[Sequence[float], bool]:
        left = settings.retries
        while True:
            place, halt_z, answer = self._tap(gcmd, settings)
            if answer.z is not None:
                if not homing:  # z is about to change
                    gcmd.respond_info("trammel_tap: %s" % (answer.in_words(),))
                self._rise_further(gcmd, halt_z)
                return [place[0], place[1], answer.z] + list(place[3:]), True
            if left == 0:
                raise TapError("no contact height after %d taps. The last: %s"
                               % (settings.retries + 1, answer.in_words()))
            gcmd.respond_info("trammel_tap: tapping again. %s" % (answer.in_words(),))
            self._lift(gcmd, start_z)
            # While G28 is at work, the nozzle's place is not yet what it seems.
            if settings.scrub is not None and answer.reason in SCRUB_REASONS and not homing:
                self._scrub(settings.scrub)
            left -= 1

    def _tap(self, gcmd: Any, settings: Settings) -> Tuple[Sequence[float], float, Answer]:
        """Presses, pulls back and measures, once. Returns the trigger's place, z where the nozzle
        halted, and the answer."""
        place, collector = self._probe.press(gcmd)
        halt_z = self._position()[2]
        try:
            end = self._pull_back(settings)
        except Exception:
            collector.stop_collecting()
            raise
        samples, errors = collector.collect_until(end + AFTER_PULLBACK_S)
        start = end - settings.pullback_distance / settings.pullback_speed - APPROACH_S
        samples = [s for s in samples if s[0] >= start]
        tap = Tap([s[0] for s in samples], [s[1] for s in samples],
                  self._moves(max(start, samples[0][0]) if samples else start, end))
        if errors:
            answer = Answer('refused', 'sensor_errors',
                            "The load cell's sensor reported %d errors and %d overflows." % errors)
        else:
            answer = self._analyser.analyse(tap, Context(
                settings.latency, settings.latency_uncertainty, self._nozzle_temperature(),
                self._probe.trigger_force(gcmd)))
        # Refuses a contact that the pull-back did not pass.
        if (answer.z is not None
                and not -BESIDE_MM <= answer.z - halt_z <= settings.pullback_distance + BESIDE_MM):
            raise TapError("the library's answer makes no sense: z=%.3f, pulled back from z=%.3f"
                           % (answer.z, halt_z))
        self._answer = answer
        self._counts['taps'] += 1
        self._counts['refused'] += answer.z is None
        self._probe.tell(tap, place, answer)
        return place, halt_z, answer

    def _rise_further(self, gcmd: Any, halt_z: float) -> None:
        """Rises by the rest of the lift that this Klipper's own tap has, and its callers have not.
        """
        params = self._probe.params(gcmd)
        z = halt_z + self._probe.lift_of_tap(gcmd)
        if z > self._position()[2]:
            self.printer.lookup_object('toolhead').manual_move([None, None, z],
                                                               params['lift_speed'])

    def _pull_back(self, settings: Settings) -> float:
        """Raises the nozzle from where it halted; returns the time at which that ends."""
        toolhead = self.printer.lookup_object('toolhead')
        halt_z = self._position()[2]
        toolhead.manual_move([None, None, halt_z + settings.pullback_distance],
                             settings.pullback_speed)
        return toolhead.get_last_move_time()

    def _moves(self, start: float, end: float) -> List[Move]:
        queue = self.printer.lookup_object('motion_report').dtrapqs['toolhead']
        moves, memory = queue.extract_trapq(start, end)  # the memory holds the moves
        return [Move(m.print_time, m.move_t, m.start_v, m.accel, m.start_z, m.z_r) for m in moves]

    def _nozzle_temperature(self) -> float:
        """Returns NaN for a printer without a heater at its nozzle, or without a reading of it."""
        heater = getattr(self.printer.lookup_object('toolhead').get_extruder(), 'heater', None)
        if heater is None:
            return math.nan
        return heater.get_temp(self.printer.get_reactor().monotonic())[0] or math.nan

    def _scrub(self, scrub: Any) -> None:
        self._counts['scrubs'] += 1
        before = self._position()
        scrub.run_gcode_from_command()
        if any(abs(a - b) > SAME_PLACE_MM for a, b in zip(before[:3], self._position()[:3])):
            raise TapError("scrub_gcode must end where it began: use SAVE_GCODE_STATE and "
                           "RESTORE_GCODE_STATE MOVE=1")

    def _position(self) -> Sequence[float]:
        return self.printer.lookup_object('toolhead').get_position()

    def _lift(self, gcmd: Any, start_z: float) -> None:
        """Lifts to where the tap began, and by sample_retract_dist at least."""
        params = self._probe.params(gcmd)
        z = max(start_z, self._position()[2] + self._probe.retract(gcmd))
        self.printer.lookup_object('toolhead').manual_move([None, None, z], params['lift_speed'])

    def _lift_after_error(self, gcmd: Any, start_z: float) -> None:
        if self.printer.is_shutdown():
            return
        try:
            self._lift(gcmd, start_z)
        except Exception:  # the error that led here is what the user has to read
            logging.exception("trammel_tap: lift after an error")
