"""The macros of klipper/trammel.cfg, rendered as Klipper's host renders them."""
import os
import re
import unittest

import jinja2

FILE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '../../klipper/trammel.cfg')


def template_of(macro):
    """The text below a macro's `gcode:`, without comments, as Klipper's parser hands it on."""
    with open(FILE, encoding='utf-8') as file:
        text = re.sub(r'#.*', '', file.read())
    section = text.split('[gcode_macro %s]\n' % macro, 1)[1].split('\n[', 1)[0]
    return section.split('\ngcode:\n', 1)[1]


class Refused(Exception):
    """A macro's action_raise_error."""


def lines_of(macro, printer, **params):
    """The commands that a macro runs on a printer of these objects, and what it says."""
    said = []

    def refuse(message):
        raise Refused(message)

    environment = jinja2.Environment('{%', '%}', '{', '}')
    text = environment.from_string(template_of(macro)).render(
        printer=printer, params=params, action_raise_error=refuse,
        action_respond_info=lambda message: said.append(message) or '')
    return [line.strip() for line in text.splitlines() if line.strip()], said


def printer_with(motors, kept=None):
    """A printer with these motors (section: pressure advance, queue, printer.cfg's own)."""
    settings = {'extruder': {'nozzle_diameter': 0.4}}
    objects = {'toolhead': {'extruder': 'extruder', 'max_accel': 3000.0},
               'save_variables': {'variables': {'trammel_pa': kept or {}}},
               'configfile': {'settings': settings}}
    for section, (advance, queue, own) in motors.items():
        objects[section] = {'pressure_advance': advance, 'motion_queue': queue}
        settings.setdefault(section.lower(), {})['pressure_advance'] = own
    return objects


# The extruder's own motor, one beside it on the same filament, one that pushes nothing, and another
# extruder's.
MOTORS = {'extruder': (0.05, None, 0.02), 'extruder_stepper Belted': (0.05, 'extruder', 0.01),
          'extruder_stepper spare': (0.05, None, 0.03), 'extruder1': (0.05, None, 0.04)}


class FilamentTest(unittest.TestCase):
    def test_a_kept_value_is_set_on_every_motor_of_the_filament(self):
        printer = printer_with(MOTORS, {'generic_pla': {'extruder/0.40': 0.0421}})
        lines, _ = lines_of('TRAMMEL_FILAMENT', printer, FILAMENT='Generic PLA')
        self.assertEqual(lines, ['SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.0421',
                                 'SET_PRESSURE_ADVANCE EXTRUDER=Belted ADVANCE=0.0421'])

    def test_without_a_kept_value_each_gets_that_of_its_own_section(self):
        lines, said = lines_of('TRAMMEL_FILAMENT', printer_with(MOTORS), FILAMENT='Generic PLA')
        self.assertEqual(lines, ['SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.02',
                                 'SET_PRESSURE_ADVANCE EXTRUDER=Belted ADVANCE=0.01'])
        self.assertIn('nothing is kept for generic_pla on extruder/0.40', said[0])

    def test_a_tool_that_is_not_active_is_set_where_it_is_named(self):
        printer = printer_with(MOTORS, {'petg': {'extruder1/0.40': 0.06}})
        printer['configfile']['settings']['extruder1']['nozzle_diameter'] = 0.4
        lines, _ = lines_of('TRAMMEL_FILAMENT', printer, FILAMENT='PETG', TOOL='1')
        self.assertEqual(lines, ['SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0.06'])
        with self.assertRaises(Refused):
            lines_of('TRAMMEL_FILAMENT', printer, FILAMENT='PETG', TOOL='2')


if __name__ == '__main__':
    unittest.main()
