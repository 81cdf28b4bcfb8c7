"""The extra's way to libtrammel_tap, through cffi; exits 77 (skipped) without python3-cffi.

TRAMMEL_TAP_LIBRARY and TRAMMEL_TAP_HEADER name the library and include/trammel/tap.h.
"""
import importlib.util
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

from trammel_tap import library
from trammel_tap.library import Context, Library, TapError, drawn_tap


def structs(text):
    """The structs of a header: {name: [declaration]}, without comments and macros."""
    text = re.sub(r'/\*.*?\*/', '', text, flags=re.S)
    for name, value in re.findall(r'#define (TRAMMEL_TAP_MAX_\w+) (\d+)', text):
        text = text.replace(name, value)
    return {name: [' '.join(field.split()) for field in body.split(';') if field.strip()]
            for body, name in re.findall(r'typedef struct \w+ \{(.*?)\} (\w+);', text, re.S)}


class Spoilt:
    """A library whose answers are changed before they are read."""

    def __init__(self, lib, spoil):
        self._lib, self._spoil = lib, spoil

    def __getattr__(self, name):
        return getattr(self._lib, name)

    def trammel_tap_analyse(self, *arguments):
        status = self._lib.trammel_tap_analyse(*arguments)
        self._spoil(arguments[-1])
        return status


class LibraryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.path = os.environ['TRAMMEL_TAP_LIBRARY']
        cls.library = Library(cls.path)

    def test_structs_are_those_of_the_header(self):
        with open(os.environ['TRAMMEL_TAP_HEADER'], encoding='utf-8') as header:
            self.assertEqual(structs(library.STRUCTS), structs(header.read()))

    def test_the_contact_of_a_drawn_tap_lies_in_its_interval(self):
        tap, contact = drawn_tap()
        answer = self.library.analyse(tap, Context())
        self.assertEqual((answer.verdict, answer.reason), ('good', 'none'))
        self.assertLessEqual(answer.interval[0], contact)
        self.assertGreaterEqual(answer.interval[1], contact)
        self.assertAlmostEqual(answer.noise, 1., delta=.2)
        self.assertGreater(answer.cpu_time, 0.)

    def test_the_latency_reaches_the_library_with_its_sign(self):
        tap, _ = drawn_tap()
        heights = [self.library.analyse(tap, Context(latency=latency)).z
                   for latency in (-.002, 0., .002)]
        for earlier, later in zip(heights, heights[1:]):  # at 0.3 mm/s
            self.assertAlmostEqual(earlier - later, .0006, delta=.0001)

    def test_trigger_force_and_temperature_reach_the_library(self):
        tap, _ = drawn_tap()
        self.assertEqual(self.library.analyse(tap, Context(trigger_force=1000.)).reason,
                         'low_compression_force')
        self.assertIn('hot_nozzle',
                      self.library.analyse(tap, Context(nozzle_temperature=220.)).notices)

    def test_a_tap_without_a_pull_back_is_refused_with_a_sentence_and_no_height(self):
        tap, _ = drawn_tap()
        answer = self.library.analyse(tap._replace(moves=tap.moves[:1]), Context())
        self.assertEqual((answer.verdict, answer.reason), ('refused', 'missing_moves'))
        self.assertIn("pull-back", answer.text)
        self.assertEqual((answer.z, answer.uncertainty, answer.interval), (None, None, None))

    def test_whatever_samples_hold_the_answer_is_an_answer(self):
        tap, _ = drawn_tap()
        for times, forces in (([], []), ([math.nan] * 400, tap.forces[:400]),
                              (tap.times[:3], tap.forces[:3]), (tap.times[::-1], tap.forces)):
            answer = self.library.analyse(tap._replace(times=times, forces=forces), Context())
            self.assertIsNone(answer.z)
            self.assertNotEqual(answer.reason, 'none')

    def test_forces_of_another_number_than_times_are_not_read(self):
        tap, _ = drawn_tap()
        with self.assertRaisesRegex(TapError, "times, but 3 forces"):
            self.library.analyse(tap._replace(forces=tap.forces[:3]), Context())

    def test_an_option_that_the_library_does_not_take_is_an_error(self):
        with self.assertRaisesRegex(TapError, "bad_argument"):
            self.library.analyse(drawn_tap()[0], Context(latency=11.))

    def test_files_that_are_not_the_library_are_named(self):
        for path in ('/nowhere/libtrammel_tap.so', __file__, 'libm.so.6'):
            with self.subTest(path=path), self.assertRaisesRegex(TapError, re.escape(path)):
                Library(path)

    def test_a_file_that_is_written_over_does_not_reach_the_library_in_use(self):
        program = ("import sys\nfrom trammel_tap.library import *\nlib = Library(sys.argv[1])\n"
                   "open(sys.argv[1], 'wb').close()\n"
                   "print(lib.analyse(drawn_tap()[0], Context()).verdict)")
        with tempfile.TemporaryDirectory() as folder:
            path = shutil.copy(self.path, folder)
            done = subprocess.run([sys.executable, '-c', program, path], stdout=subprocess.PIPE,
                                  universal_newlines=True)
        self.assertEqual((done.returncode, done.stdout), (0, 'good\n'))

    def test_without_room_for_a_copy_the_file_itself_is_loaded(self):
        with mock.patch('shutil.copyfile', side_effect=OSError(28, "No space left on device")):
            self.assertEqual(Library(self.path).analyse(drawn_tap()[0], Context()).verdict, 'good')

    def test_an_answer_that_makes_no_sense_is_an_error(self):
        for field, value in (('contact_z_mm', 7.), ('contact_z_mm', math.nan),
                             ('interval95_hi_mm', math.inf), ('interval95_lo_mm', .2),
                             ('verdict', 99), ('notice_count', 17), ('notice_count', -1)):
            lib = Library(self.path)
            lib._lib = Spoilt(lib._lib, lambda result: setattr(result, field, value))
            with self.subTest(field=field, value=value):
                with self.assertRaisesRegex(TapError, "makes no sense"):
                    lib.analyse(drawn_tap()[0], Context())

    def test_an_older_library_is_refused(self):
        with mock.patch.object(library, 'LEAST_VERSION', 1000):
            with self.assertRaisesRegex(TapError, "1000 is needed"):
                Library(self.path)

    def test_a_library_that_reads_memory_otherwise_is_refused(self):
        swapped = library.STRUCTS.replace('double contact_z_mm; double contact_time_s;',
                                          'double contact_time_s; double contact_z_mm;')
        self.assertNotEqual(swapped, library.STRUCTS)
        with mock.patch.object(library, 'STRUCTS', swapped):
            with self.assertRaisesRegex(TapError, "reads a drawn tap"):
                Library(self.path)

    def test_of_a_source_tree_it_looks_into_no_folder_of_anothers(self):
        with tempfile.TemporaryDirectory() as folder:
            folder = os.path.realpath(folder)
            for above, found in (('home/pi/trammel/klipper', False), ('x/share/trammel/klipper', True)):
                extra = os.path.join(folder, above, 'trammel_tap')
                lib = os.path.join(os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(extra)))), 'lib')
                for made in (extra, lib):
                    os.makedirs(made)
                with open(os.path.join(lib, library.SONAME), 'w'):
                    pass
                with mock.patch.object(library, '__file__', os.path.join(extra, 'library.py')):
                    expected = os.path.join(lib, library.SONAME) if found else library.SONAME
                    self.assertEqual(library.library_path(), expected, above)


if __name__ == '__main__':
    if importlib.util.find_spec('cffi') is None:
        print("SKIPPED: python3-cffi is not installed, so the extra's library was not tried")
        sys.exit(77)
    unittest.main()
