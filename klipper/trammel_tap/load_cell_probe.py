# What a tap needs of Klipper's [load_cell_probe]
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Names the private parts of Klipper in one place.

Two Klippers are known. Until August 2026 a probe took the height of the trigger and left the nozzle
pressed; its callers lifted it. Since then a probe lifts the nozzle by itself, fits the contact to
the forces of that lift, and tells its callers to lift by 0.
"""
import inspect
from typing import Any, Dict, List, Optional, Sequence, Tuple

from .library import Answer, Tap, TapError

# What is used of printer.load_cell_probe, with the arguments it is called with (None: not called),
# and where it stands in Klipper's source: file, class.
PROBE_NAMES = (
    ('_tapping_move.run_tap', 1, 'load_cell_probe', 'TappingMove'),
    ('_tapping_move._load_cell_probing_move.probing_move', 1, 'load_cell_probe',
     'LoadCellProbingMove'),
    ('_tapping_move._config_helper.get_trigger_force_grams', 1, 'load_cell_probe',
     'LoadCellProbeConfigHelper'),
    ('_tapping_move._clients.send', 1, 'load_cell', 'ApiClientHelper'),
    ('_tapping_move._clients.client_cbs', None, 'load_cell', 'ApiClientHelper'),
    ('_tapping_move._last_result', None, 'load_cell_probe', 'TappingMove'),
    ('_tapping_move._is_last_result_valid', None, 'load_cell_probe', 'TappingMove'),
    ('_load_cell.clients.client_cbs', None, 'load_cell', 'ApiClientHelper'),
    ('_load_cell.sensor.get_samples_per_second', 0, 'hx71x', 'HX71xBase'),
    ('_load_cell.get_collector', 0, 'load_cell', 'LoadCell'),
    ('get_probe_params', 1, 'load_cell_probe', 'LoadCellPrinterProbe'),
)
# Of what _load_cell.get_collector returns.
COLLECTOR_NAMES = (('collect_until', 1, 'load_cell', 'LoadCellSampleCollector'),
                   ('stop_collecting', 0, 'load_cell', 'LoadCellSampleCollector'))
# Of the printer's objects of these names.
PRINTER_NAMES = (('toolhead', (('get_position', 0, '../toolhead', 'ToolHead'),
                               ('manual_move', 2, '../toolhead', 'ToolHead'),
                               ('get_last_move_time', 0, '../toolhead', 'ToolHead'),
                               ('get_extruder', 0, '../toolhead', 'ToolHead'))),
                 ('motion_report', (('dtrapqs', None, 'motion_report', 'PrinterMotionReport'),)))
TRAPQ_NAMES = (('extract_trapq', 2, 'motion_report', 'DumpTrapQ'),)
# By one of these a Klipper is known that fits the contact by itself.
OWN_FIT_NAMES = (('_tapping_move._analyze_ascent', 'load_cell_probe', 'TappingMove'),
                 ('_tapping_move._best_fit', 'load_cell_probe', 'TappingMove'))
# Of get_probe_params, the first that is there and above 0: how far a probe is lifted.
LIFT_PARAMS = ('load_cell_retract_dist', 'sample_retract_dist')
MISSING = object()


def part(of: Any, name: str) -> Any:
    """Returns what a dotted name leads to; MISSING where it leads nowhere."""
    for step in name.split('.'):
        of = getattr(of, step, MISSING)
    return of


def check_names(of: Any, names: Sequence[Sequence[Any]]) -> None:
    """Raises TapError for the first name that is not there, or is called otherwise."""
    for name, arguments in [n[:2] for n in names]:
        found = part(of, name)
        if found is MISSING:
            raise TapError("this Klipper is made otherwise: it has no %s" % (name,))
        if arguments is None:
            continue
        try:
            inspect.signature(found).bind(*[None] * arguments)
        except (TypeError, ValueError):
            raise TapError("this Klipper is made otherwise: it calls %s with other arguments"
                           % (name,))


def check_printer(printer: Any) -> None:
    """Raises TapError where the printer's motion is made otherwise; once all of it is loaded."""
    for name, names in PRINTER_NAMES:
        check_names(printer.lookup_object(name), names)
    check_names(printer.lookup_object('motion_report').dtrapqs.get('toolhead'), TRAPQ_NAMES)


class LoadCellProbe:
    """The parts of Klipper's [load_cell_probe] that a tap is made of; their names are its own."""

    def __init__(self, probe: Any) -> None:
        """Raises TapError where this Klipper's load_cell_probe is made otherwise."""
        check_names(probe, PROBE_NAMES)
        check_names(probe._load_cell.get_collector(), COLLECTOR_NAMES)
        self._probe = probe
        self._tapping = probe._tapping_move
        self._run_tap = self._tapping.run_tap
        self.has_own_fit = any(part(probe, name[0]) is not MISSING for name in OWN_FIT_NAMES)
        # A Klipper whose callers do not lift has a tap that does.
        params = self.params(None)
        self.lifts = not params.get('sample_retract_dist')
        if self.lifts and self._retract(params) is None:
            raise TapError("this Klipper is made otherwise: it does not name how far a probe lifts")

    def replace_tap(self, run_tap: Any) -> None:
        """Makes run_tap(gcmd) -> (position, valid) the tap of every probe of this printer."""
        self._tapping.run_tap = run_tap

    def give_back(self) -> None:
        """Makes Klipper's own tap that of every probe again."""
        self._tapping.run_tap = self._run_tap

    def klippers_tap(self, gcmd: Any) -> Any:
        """Runs the tap that was replaced."""
        return self._run_tap(gcmd)

    def params(self, gcmd: Any) -> Dict[str, Any]:
        return self._probe.get_probe_params(gcmd)

    @staticmethod
    def _retract(params: Dict[str, Any]) -> Optional[float]:
        found = [params[name] for name in LIFT_PARAMS if params.get(name)]
        return float(found[0]) if found else None

    def retract(self, gcmd: Any) -> float:
        """Returns by how much a probe is lifted before the next one."""
        distance = self._retract(self.params(gcmd))
        if distance is None:
            raise TapError("a probe is lifted by 0 mm: sample_retract_dist must be above 0")
        return distance

    def lift_of_tap(self, gcmd: Any) -> float:
        """Returns how far above its halt a tap has to leave the nozzle: 0 where callers lift it."""
        return self.retract(gcmd) if self.lifts else 0.

    def sample_rate(self) -> float:
        return float(self._probe._load_cell.sensor.get_samples_per_second())

    def trigger_force(self, gcmd: Any) -> float:
        return float(self._tapping._config_helper.get_trigger_force_grams(gcmd))

    def press(self, gcmd: Any) -> Tuple[List[float], Any]:
        """Presses the nozzle onto the bed; returns the trigger's place and the running collector.

        Where that fails, ends the collection, which Klipper lets run on.
        """
        collecting = self._probe._load_cell.clients.client_cbs
        before = list(collecting)
        try:
            return self._tapping._load_cell_probing_move.probing_move(gcmd)
        except Exception:
            for callback in [c for c in collecting if c not in before]:
                stop = getattr(getattr(callback, '__self__', None), 'stop_collecting', None)
                if stop is not None:
                    stop()
            raise

    def tell(self, tap: Tap, place: Sequence[float], answer: Answer) -> None:
        """Sets what printer.load_cell_probe says of the last tap, and sends it to dump_taps."""
        self._tapping._is_last_result_valid = answer.z is not None
        self._tapping._last_result = answer.z
        if not self._tapping._clients.client_cbs:
            return
        moves = [dict(m._asdict(), start_x=place[0], start_y=place[1]) for m in tap.moves]
        dump = {'time': tap.times, 'force': tap.forces, 'moves': moves,
                'is_valid': answer.z is not None}
        if answer.z is not None:
            dump['tap_pos'] = [place[0], place[1], answer.z]
        self._tapping._clients.send({'tap': dump})
