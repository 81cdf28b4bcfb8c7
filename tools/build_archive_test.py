#!/usr/bin/env python3
"""What Moonraker's way of unpacking asks of the release archive, and how its libraries are found."""
import importlib.machinery
import importlib.util
import os
import pathlib
import tempfile
import unittest
import unittest.mock
import zipfile

PATH = str(pathlib.Path(__file__).resolve().parent / "build_archive")
SPEC = importlib.util.spec_from_loader("build_archive", importlib.machinery.SourceFileLoader("build_archive", PATH))
build_archive = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(build_archive)
DATE = (2026, 1, 2, 3, 4, 6)


class ArchiveTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.tree = self.folder / "tree"
        (self.tree / "bin").mkdir(parents=True)
        (self.tree / "bin/trammel").write_bytes(b"program")
        (self.tree / "bin/trammel").chmod(0o755)
        (self.tree / "release_info.json").write_bytes(b"{}")

    def test_every_entry_is_a_file_with_mode_bits(self):
        build_archive.write_zip(self.tree, self.folder / "a.zip", DATE)
        with zipfile.ZipFile(self.folder / "a.zip") as archive:
            modes = {entry.filename: oct(entry.external_attr >> 16) for entry in archive.infolist()}
        self.assertEqual(modes, {"bin/trammel": "0o100755", "release_info.json": "0o100644"})

    def test_the_same_tree_gives_the_same_bytes(self):
        for name in ("a.zip", "b.zip"):
            build_archive.write_zip(self.tree, self.folder / name, DATE)
            os.utime(self.tree / "bin/trammel", (1, 1))
        self.assertEqual((self.folder / "a.zip").read_bytes(), (self.folder / "b.zip").read_bytes())

    def test_a_link_is_refused(self):
        (self.tree / "link").symlink_to("bin/trammel")
        with self.assertRaisesRegex(SystemExit, "link is a link"):
            build_archive.write_zip(self.tree, self.folder / "a.zip", DATE)

    def test_an_archive_that_is_there_is_not_overwritten(self):
        (self.folder / "a.zip").write_bytes(b"older")
        with self.assertRaises(FileExistsError):
            build_archive.write_zip(self.tree, self.folder / "a.zip", DATE)

    def test_links_lead_where_they_would_for_a_program_in_that_root(self):
        root = self.folder / "root"
        (root / "usr/lib/lapack").mkdir(parents=True)
        (root / "etc/alternatives").mkdir(parents=True)
        (root / "usr/lib/lapack/liblapack.so.3").write_bytes(b"")
        (root / "usr/lib/liblapack.so.3").symlink_to("/etc/alternatives/liblapack")
        (root / "etc/alternatives/liblapack").symlink_to("../../usr/lib/lapack/liblapack.so.3")
        found = build_archive.inside(root, root / "usr/lib/liblapack.so.3")
        self.assertEqual(found, root / "usr/lib/lapack/liblapack.so.3")
        (root / "round").symlink_to("/round")
        with self.assertRaisesRegex(SystemExit, "without end"):
            build_archive.inside(root, root / "round")

    def test_libraries_of_libraries_come_along_and_the_systems_own_stay_out(self):
        root = self.folder / "root"
        (root / "usr/lib/x").mkdir(parents=True)
        for name in ("liba.so.1", "libb.so.2"):
            (root / "usr/lib/x" / name).write_bytes(b"")
        asks = {"trammel": ["liba.so.1", "libc.so.6", "libstdc++.so.6", "libssl.so.3"], "liba.so.1": ["libb.so.2", "libm.so.6"],
                "libb.so.2": ["liba.so.1", "ld-linux-x86-64.so.2"]}
        with unittest.mock.patch.object(build_archive, "needed", lambda file: asks[file.name]):
            found = build_archive.collect(root, "x", [pathlib.Path("trammel")])
            self.assertEqual(sorted(found), ["liba.so.1", "libb.so.2"])
            asks["libb.so.2"] = ["libcurious.so.1"]  # begins as libc does
            with self.assertRaisesRegex(SystemExit, "libcurious"):
                build_archive.collect(root, "x", [pathlib.Path("trammel")])


if __name__ == "__main__":
    unittest.main()
