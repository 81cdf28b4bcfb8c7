"""The private names that the extra uses, looked for in the sources of Klippers that are at hand.

TRAMMEL_KLIPPER has their folders, those that hold `klippy`, between colons; without it this is
skipped.
"""
import ast
import functools
import os
import sys
import unittest

from trammel_tap import kalico
from trammel_tap import load_cell_probe as pinned

FOLDERS = [f for f in os.environ.get('TRAMMEL_KLIPPER', '').split(':') if f]
SKIPPED = 77


class Source:
    """The classes of a Klipper's extras: their methods with their arguments, and attributes."""

    def __init__(self, folder):
        self.extras = os.path.join(folder, 'klippy', 'extras')
        self.is_kalico = os.path.isdir(os.path.join(self.extras, 'load_cell'))

    @functools.lru_cache(maxsize=None)
    def classes(self, module):
        with open(os.path.join(self.extras, module + '.py')) as file:
            tree = ast.parse(file.read())
        return {node.name: node for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}

    def has(self, module, name, attribute, arguments):
        """Whether a class, with those that it is derived from in its module, has this."""
        classes = self.classes(module)
        if name not in classes:
            return False
        for node in ast.walk(classes[name]):
            if isinstance(node, ast.FunctionDef) and node.name == attribute:
                most = len(node.args.args) - 1
                least = most - len(node.args.defaults)
                return arguments is None or least <= arguments <= most
            # A method may be taken over by an assignment: self.f = other.f.
            if (isinstance(node, ast.Attribute) and node.attr == attribute
                    and isinstance(node.ctx, ast.Store)):
                return True
        return any(isinstance(base, ast.Name) and self.has(module, base.id, attribute, arguments)
                   for base in classes[name].bases)


class KlipperSourcesTest(unittest.TestCase):
    def each(self, is_kalico):
        for folder in FOLDERS:
            source = Source(folder)
            if source.is_kalico == is_kalico:
                with self.subTest(folder=folder):
                    yield folder, source

    def look_for(self, source, names):
        for name, arguments, module, of in names:
            self.assertTrue(source.has(module, of, name.split('.')[-1], arguments),
                            "%s of %s.%s moved" % (name, module, of))

    def test_every_name_is_where_it_was(self):
        for folder, source in self.each(is_kalico=False):
            self.look_for(source, pinned.PROBE_NAMES + pinned.COLLECTOR_NAMES + pinned.TRAPQ_NAMES)
            for _, names in pinned.PRINTER_NAMES:
                self.look_for(source, names)

    def test_the_ways_to_them_are_where_they_were(self):
        ways = (('_tapping_move', 'load_cell_probe', 'LoadCellPrinterProbe'),
                ('_load_cell', 'load_cell_probe', 'LoadCellPrinterProbe'),
                ('_load_cell_probing_move', 'load_cell_probe', 'TappingMove'),
                ('_config_helper', 'load_cell_probe', 'TappingMove'),
                ('_clients', 'load_cell_probe', 'TappingMove'),
                ('clients', 'load_cell', 'LoadCell'), ('sensor', 'load_cell', 'LoadCell'))
        for folder, source in self.each(is_kalico=False):
            for name, module, of in ways:
                self.assertTrue(source.has(module, of, name, None), name)

    def test_a_klipper_whose_callers_do_not_lift_is_known_by_its_own_fit(self):
        for folder, source in self.each(is_kalico=False):
            own = [source.has(module, of, name.split('.')[-1], None)
                   for name, module, of in pinned.OWN_FIT_NAMES]
            with open(os.path.join(source.extras, 'load_cell_probe.py')) as file:
                lifts = pinned.LIFT_PARAMS[0] in file.read()
            self.assertEqual(any(own), lifts)
            print("%s: %s" % (folder, "fits the contact by itself" if lifts else "trigger alone"))

    def test_every_name_of_kalicos_is_where_it_was(self):
        for folder, source in self.each(is_kalico=True):
            self.look_for(source, kalico.NAMES)
            print("%s: Kalico" % (folder,))


if __name__ == '__main__':
    if not FOLDERS:
        print("skipped: TRAMMEL_KLIPPER names no folder of Klipper's sources", file=sys.stderr)
        sys.exit(SKIPPED)
    unittest.main()
