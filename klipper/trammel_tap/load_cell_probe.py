# What a tap needs of Klipper's [load_cell_probe]
#
# Copyright (C) 2026  The trammel authors
#
# This file may be distributed under the terms of the GNU GPLv3 license.
"""Names the private parts of Klipper's load_cell_probe in one place."""
from typing import Any, Dict, List, Sequence, Tuple

from .library import Answer, Tap, TapError


class LoadCellProbe:
    """The parts of Klipper's [load_cell_probe] that a tap is made of; their names are its own."""

    NAMES = ('_tapping_move.run_tap', '_tapping_move._load_cell_probing_move.probing_move',
             '_tapping_move._config_helper.get_trigger_force_grams', '_tapping_move._clients.send',
             '_tapping_move._clients.client_cbs', '_load_cell.clients.client_cbs',
             '_load_cell.sensor.get_samples_per_second', 'get_probe_params')

    def __init__(self, probe: Any) -> None:
        """Raises TapError where this Klipper's load_cell_probe is made otherwise."""
        for name in self.NAMES:
            part = probe
            for step in name.split('.'):
                part = getattr(part, step, None)
            if part is None:
                raise TapError("made for Klipper since 2026-05; this load_cell_probe has no %s"
                               % name)
        self._probe = probe
        self._tapping = probe._tapping_move
        self._run_tap = self._tapping.run_tap

    def replace_tap(self, run_tap: Any) -> None:
        """Makes run_tap(gcmd) -> (position, valid) the tap of every probe of this printer."""
        self._tapping.run_tap = run_tap

    def klippers_tap(self, gcmd: Any) -> Any:
        """Runs the tap that was replaced."""
        return self._run_tap(gcmd)

    def params(self, gcmd: Any) -> Dict[str, Any]:
        return self._probe.get_probe_params(gcmd)

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
