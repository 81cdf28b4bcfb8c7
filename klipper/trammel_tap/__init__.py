# The nozzle's contact height, with an uncertainty, for each probe of a [load_cell_probe]
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""An extra of Klipper's host; docs/howto/tap-klipper.md is its manual.

Klipper presses the nozzle onto the bed until the load cell triggers and takes the height of that
moment. This extra lets it press as before, pulls the nozzle back slowly, and has trammel's library
read from the forces at which height the nozzle let go of the bed. A tap that cannot be measured is
repeated, after a scrub where plastic is to blame, and ends as an error of the command with the
nozzle lifted.

Lengths are in mm, times in s, forces in gf. Runs on Python 3.7 and later.
"""
import os
import sys
from typing import Any

from .kalico import Classifier
from .library import TapError, library_path, open_library
from .load_cell_probe import LoadCellProbe
from .tapping import Settings, Tapping

LEAST_SAMPLE_RATE = 40  # per second


def check_homing(config: Any) -> None:
    """Refuses a G28 that ends with its first contact, from which nothing can be pulled back."""
    for name in ('stepper_z', 'carriage z'):
        if not config.has_section(name):
            continue
        section = config.getsection(name)
        if ('z_virtual_endstop' in section.get('endstop_pin', '', note_valid=False)
                and section.getfloat('homing_retract_dist', 5., note_valid=False) == 0.):
            raise config.error(
                "trammel_tap: option 'homing_retract_dist' in section '%s' must be above 0: G28 "
                "measures the contact of its second touch" % (name,))


def check_sample_rate(config: Any, rate: float) -> None:
    """Refuses a sensor with too few samples, whose times Klipper cannot tell."""
    if rate < LEAST_SAMPLE_RATE:
        raise config.error(
            "trammel_tap: option 'sample_rate' in section 'load_cell_probe' must be at least %d; "
            "it is %d" % (LEAST_SAMPLE_RATE, rate))


def load_config(config: Any) -> Tapping:
    """Makes the printer object trammel_tap.

    Without its library, or in a Klipper that is made otherwise, probing stays Klipper's own.
    """
    if getattr(sys.modules.get('klippy'), 'APP_NAME', '') == 'Kalico':
        raise config.error("trammel_tap: Kalico pulls back by itself: remove [trammel_tap], and "
                           "set tap_classifier: trammel in [load_cell_probe]")
    if not config.has_section('load_cell_probe'):
        raise config.error("trammel_tap: a section [load_cell_probe] is needed")
    printer = config.get_printer()
    settings = Settings.read(config)
    path = os.path.expanduser(config.get('library', '') or library_path())
    try:
        probe = LoadCellProbe(printer.load_object(config, 'load_cell_probe'))
        library = open_library(path)
    except TapError as e:
        return Tapping(printer, settings, None, None, str(e))
    check_homing(config)
    check_sample_rate(config, probe.sample_rate())
    return Tapping(printer, settings, probe, library)


def register_components(subsystem: Any) -> None:
    """Called by Kalico only: offers trammel as a judge of its taps."""
    subsystem.register_component('load_cell_probe_tap_classifiers', 'trammel', Classifier)
