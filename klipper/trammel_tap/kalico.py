# Kalico's taps, judged by trammel
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Gives the taps of Kalico, which pulls back and repeats by itself, trammel's contact."""
import os
from typing import Any

from .analyser import Analyser
from .library import Context, Move, Tap, TapError, library_path, open_library

# What is used of Kalico, as in load_cell_probe.py.
NAMES = tuple((name, arguments, 'load_cell/tap_analysis', 'TapAnalysis') for name, arguments in (
    ('get_time', 0), ('get_force', 0), ('get_moves', 0), ('get_trigger_force', 0),
    ('set_is_valid', 1), ('set_validation_error', 1), ('_tap_pos', None)))


class Classifier:
    """What `tap_classifier: trammel` in Kalico's [load_cell_probe] stands for."""

    def __init__(self, config: Any) -> None:
        path = os.path.expanduser(config.get('trammel_library', '') or library_path())
        self._printer = config.get_printer()
        self._given_up = False
        try:
            self._analyser = Analyser(self._printer.get_reactor(), open_library(path))
        except TapError as e:
            raise config.error("tap_classifier: trammel: %s" % (e,))

    def classify(self, tap_analysis: Any, gcmd: Any) -> None:
        """Sets the tap's place and validity; raises Kalico's error where there is no contact."""
        from klippy.extras.load_cell.tap_analysis import TapValidationError
        if self._analyser.hangs():  # the tap keeps Kalico's own judgement
            if not self._given_up:
                self._given_up = True
                self._printer.lookup_object('gcode').respond_raw(
                    "!! tap_classifier: trammel: the library hangs: the analysis of a tap has not "
                    "ended. Taps are judged by Kalico alone until its service is restarted")
            return
        moves = tap_analysis.get_moves()
        tap = Tap(tap_analysis.get_time(), tap_analysis.get_force(), [
            Move(m.print_time, m.move_t, m.start_v, m.accel, m.start_z, m.z_r) for m in moves])
        try:
            answer = self._analyser.analyse(
                tap, Context(trigger_force=tap_analysis.get_trigger_force()))
        except TapError as e:
            raise TapValidationError('TRAMMEL', str(e))
        if gcmd is not None:
            gcmd.respond_info("trammel_tap: %s" % (answer.in_words(),))
        if answer.z is None:
            raise TapValidationError(answer.reason.upper(), answer.text)
        tap_analysis._tap_pos = (moves[-1].start_x, moves[-1].start_y, answer.z)
        tap_analysis.set_is_valid(True)
        tap_analysis.set_validation_error(None)
