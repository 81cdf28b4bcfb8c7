#!/usr/bin/env python3
"""Tests that check_layers.py refuses what it is there to refuse."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).with_name("check_layers.py")
# A tree with one header in each of a few rooms.
HEADERS = ["base/result.h", "files/new_file.h", "machine/net/byte_stream.h", "sim/print/printer.h",
           "tap/contact/contact.h", "tap/files/tap_file.h", "tap/report/tap_text.h",
           "tap/samples/tap.h", "tool_offset/sheet/sheet_plan.h", "app/commands.h"]


class CheckLayers(unittest.TestCase):
    def check(self, path, include):
        """Whether a file of that path may include that header, and what is said."""
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for header in HEADERS:
                (root / "src" / header).parent.mkdir(parents=True, exist_ok=True)
                (root / "src" / header).write_text("#pragma once\n")
            source = root / path
            source.parent.mkdir(parents=True, exist_ok=True)
            source.write_text(f'#include "{include}"\n')
            done = subprocess.run([sys.executable, str(CHECK), folder], capture_output=True, text=True)
            return done.returncode == 0, done.stdout

    def assert_refused(self, path, include, words):
        passed, said = self.check(path, include)
        self.assertFalse(passed)
        self.assertIn(words, said)
        self.assertIn("1 layer violation(s)", said)

    def test_what_lies_within_an_instrument_passes(self):
        for path, include in [("src/tap/contact/fit.cc", "tap/samples/tap.h"),
                              ("src/tap/files/tap_csv.cc", "files/new_file.h"),
                              ("src/tap/commands/tap_run.cc", "tap/report/tap_text.h"),
                              ("src/sim/commands/main.cc", "app/commands.h")]:
            self.assertEqual(self.check(path, include), (True, "0 layer violation(s)\n"))

    def test_no_instrument_includes_another(self):
        for room in ["contact", "files", "report", "procedure", "commands"]:
            self.assert_refused(f"src/tap/{room}/x.cc", "tool_offset/sheet/sheet_plan.h",
                                f"tap/{room} must not include tool_offset/sheet")

    def test_a_pure_room_reads_no_files_and_moves_no_machine(self):
        for include, room in [("files/new_file.h", "files"), ("tap/files/tap_file.h", "tap/files"),
                              ("machine/net/byte_stream.h", "machine/net"),
                              ("app/commands.h", "app")]:
            self.assert_refused("src/tap/contact/x.cc", include,
                                f"tap/contact must not include {room}")

    def test_simulators_and_estimators_never_meet(self):
        self.assert_refused("src/sim/cell/x.cc", "tap/contact/contact.h",
                            "sim/cell must not include tap/contact")
        for room in ["contact", "report", "commands"]:
            self.assert_refused(f"src/tap/{room}/x.cc", "sim/print/printer.h",
                                f"tap/{room} must not include sim/print")
        self.assert_refused("tests/support/world.cc", "sim/print/printer.h",
                            "tests/support must not include sim")

    def test_a_room_depends_on_no_room_above_it(self):
        self.assert_refused("src/tap/samples/x.cc", "tap/contact/contact.h",
                            "tap/samples must not include tap/contact")
        self.assert_refused("src/tap/files/x.cc", "tap/report/tap_text.h",
                            "tap/files must not include tap/report")
        self.assert_refused("src/base/x.cc", "files/new_file.h", "base must not include files")

    def test_a_room_that_nobody_knows_is_named(self):
        self.assert_refused("src/tap/guess/x.cc", "tap/samples/tap.h", "room 'tap/guess'")
        self.assert_refused("src/stray.cc", "base/result.h", "room '.'")

    def test_tests_stay_within_their_instrument(self):
        self.assertTrue(self.check("src/tap/samples/x_test.cc", "tap/contact/contact.h")[0])
        self.assert_refused("src/tap/samples/x_test.cc", "tool_offset/sheet/sheet_plan.h",
                            "a test of tap/samples must not include tool_offset/sheet")


if __name__ == "__main__":
    unittest.main()
