#!/usr/bin/env python3
"""The installer, on homes as printers have them: what it installs, and that it takes exactly that back."""
import http.server
import json
import os
import pathlib
import shutil
import stat
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import unittest.mock
import urllib.parse

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from installer import InstallError, edits, install, maintenance, printers, unit  # noqa: E402

SOURCE = pathlib.Path(__file__).resolve().parent.parent
RELEASE = {"project_owner": "maker", "project_name": "trammel", "asset_name": "trammel-amd64.zip", "version": "v1.0.0"}
LINK = "http://printer.local:7130/"
MOONRAKER = b"[server]\nhost: 0.0.0.0\nport: 7126\n\n[update_manager]\nchannel: dev\n"
NAVIGATION = b'[\n  {"title": "KlipperFleet", "href": ":8321", "position": 86}\n]\n'
# What a caller sees of a process that died of itself, without any handler of Python's.
DIED = 9


def snapshot(folder):
    """Every folder, and every file with its mode and bytes."""
    return {str(path.relative_to(folder)): (stat.S_IMODE(path.stat().st_mode), path.read_bytes() if path.is_file() else None)
            for path in sorted(folder.rglob("*"))}


class Home(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        # The test kills processes, not the computer: nothing has to wait for the disk.
        patch = unittest.mock.patch("os.fsync")
        patch.start()
        self.addCleanup(patch.stop)
        self.home = self.root / "home"
        self.units = self.root / "units"
        self.units.mkdir()
        self.program = self.root / "trammel"
        shutil.copytree(SOURCE / "klipper", self.program / "share/trammel/klipper")
        self.commands = []
        self.refused = None  # a command that sudo refuses
        self.printer("printer_data")

    def printer(self, name, moonraker=MOONRAKER, allowed=b"klipper_mcu\nmoonraker\n", navigation=NAVIGATION):
        data = self.home / name
        (data / "config").mkdir(parents=True)
        (data / "config/moonraker.conf").write_bytes(moonraker)
        (data / "moonraker.asvc").write_bytes(allowed)
        if navigation is not None:
            (data / "config/.theme").mkdir()
            (data / "config/.theme/navi.json").write_bytes(navigation)
        return data

    def run_as_root(self, words, text=None):
        """Stands in for sudo: does what touches files, and notes the rest."""
        self.assertEqual(words[0], "sudo")
        if words[1] == self.refused or " ".join(words[1:3]) == self.refused:
            raise InstallError(f"{words[1]} failed")
        if words[1] == "install":
            pathlib.Path(words[5]).write_bytes(text)
        elif words[1] == "rm":
            os.unlink(words[2])
        else:
            self.commands.append(" ".join(words[1:]))

    def install(self, **changed):
        arguments = {"units": self.units, "link": LINK} | changed
        found = printers.find_printers(self.home)
        return install.install(self.home, self.program, found, user="pi", release=RELEASE, run=self.run_as_root, **arguments)

    def uninstall(self):
        return install.uninstall(self.home, self.program, self.run_as_root)

    def check_round_trip(self):
        """Installs, checks that anything was, uninstalls, and compares byte for byte."""
        before = snapshot(self.root)
        self.install()
        installed = snapshot(self.root)
        self.assertNotEqual(before, installed)
        # To run it again is to have run it once.
        self.install()
        self.assertEqual(installed, snapshot(self.root))
        self.assertEqual(self.uninstall(), [])
        self.assertEqual(before, snapshot(self.root))

    def read(self, path):
        return (self.home / "printer_data" / path).read_text()


class InstallTest(Home):
    def test_a_printer_gets_macros_settings_section_permission_link_and_service(self):
        self.assertEqual(self.install(), [])
        for name in ("trammel.cfg", "trammel_laser.cfg"):
            self.assertEqual(self.read(f"config/{name}"), (SOURCE / "klipper" / name).read_text())
        self.assertIn('address = "127.0.0.1:7126"', self.read("config/trammel.toml"))
        self.assertEqual(self.read("config/moonraker.conf"), MOONRAKER.decode() + f"""
[update_manager trammel]
type: zip
channel: stable
repo: maker/trammel
path: {self.program}
managed_services: trammel
""")
        self.assertEqual(self.read("moonraker.asvc"), "klipper_mcu\nmoonraker\ntrammel\n")
        links = json.loads(self.read("config/.theme/navi.json"))
        self.assertEqual([link["title"] for link in links], ["KlipperFleet", "trammel"])
        self.assertEqual(links[1]["href"], LINK)
        service = (self.units / "trammel.service").read_text()
        self.assertIn("User=pi\n", service)
        self.assertIn(f"ExecStart={self.program}/bin/trammel serve --config {self.home}/printer_data/config/trammel.toml"
                      f" --out {self.home}/printer_data/trammel/recordings\n", service)
        self.assertNotIn("%", service)
        self.assertEqual(self.commands, ["systemctl daemon-reload", "systemctl enable --now trammel"])

    def test_uninstalling_leaves_a_home_byte_for_byte_as_it_was(self):
        self.check_round_trip()
        self.assertEqual(self.commands[-2:], ["systemctl disable --now trammel", "systemctl daemon-reload"])

    def test_files_without_a_final_newline_come_back_without_one(self):
        self.printer("printer_2_data", moonraker=b"[server]\nport: 7127", allowed=b"klipper", navigation=b"[]")
        self.printer("printer_3_data", moonraker=b"", allowed=b"", navigation=None)
        self.check_round_trip()
        self.install()
        self.assertEqual((self.home / "printer_2_data/moonraker.asvc").read_bytes(), b"klipper\ntrammel\n")
        self.assertEqual((self.home / "printer_3_data/moonraker.asvc").read_bytes(), b"trammel\n")

    def test_two_printers_have_a_service_each_and_both_restart_with_the_first(self):
        self.printer("printer_1_data", moonraker=b"[server]\nport = 7200\n")
        self.check_round_trip()
        self.install()
        self.assertEqual(sorted(path.name for path in self.units.iterdir()),
                         ["trammel-printer_1_data.service", "trammel.service"])
        second = (self.units / "trammel-printer_1_data.service").read_text()
        self.assertIn("PartOf=trammel.service\n", second)
        self.assertIn("/printer_1_data/config/trammel.toml", second)
        self.assertIn('"127.0.0.1:7200"', (self.home / "printer_1_data/config/trammel.toml").read_text())

    def test_sections_and_files_of_that_name_that_are_there_stay(self):
        config = self.home / "printer_data/config"
        for name in ("trammel.cfg", "trammel_laser.cfg"):
            (config / name).write_text("# mine\n")
        (config / "trammel.toml").write_text("# mine\n")
        (config / "moonraker.conf").write_bytes(MOONRAKER + b"[include up*.conf]\n")
        (config / "update.conf").write_text("[update_manager trammel]\ntype: git_repo\n")
        (self.home / "printer_data/moonraker.asvc").write_text("trammel\nklipper\n")
        (self.units / "trammel.service").write_text("# mine\n")
        before = snapshot(self.root)
        remarks = self.install(link="")
        self.assertEqual(before, snapshot(self.root))
        for word in ("trammel.cfg", "trammel_laser.cfg", "update_manager trammel", "trammel.service"):
            self.assertTrue(any(word in remark for remark in remarks), remarks)

    def test_a_navigation_that_is_no_array_is_left_and_named(self):
        for navigation in (b'{"title": 1}\n', b"[{]", b"\xff\xfe", b""):
            path = self.home / "printer_data/config/.theme/navi.json"
            path.write_bytes(navigation)
            remarks = self.install()
            self.assertEqual(path.read_bytes(), navigation)
            self.assertTrue(any("navi.json is no JSON array" in remark for remark in remarks), remarks)
            self.uninstall()

    def test_a_link_is_taken_out_of_a_navigation_that_others_wrote_anew(self):
        self.install()
        path = self.home / "printer_data/config/.theme/navi.json"
        links = json.loads(path.read_bytes())
        path.write_text(json.dumps(links + [{"title": "later"}]))
        self.assertEqual(self.uninstall(), [])
        self.assertEqual([link["title"] for link in json.loads(path.read_bytes())], ["KlipperFleet", "later"])

    def test_what_others_appended_below_stays(self):
        (self.home / "printer_data/moonraker.asvc").write_bytes(b"klipper")
        self.install()
        with open(self.home / "printer_data/moonraker.asvc", "ab") as allowed:
            allowed.write(b"mytrammel\n")
        with open(self.home / "printer_data/config/moonraker.conf", "ab") as moonraker:
            moonraker.write(b"\n[octoprint_compat]\n")
        self.assertEqual(self.uninstall(), [])
        self.assertEqual(self.read("moonraker.asvc"), "klipper\nmytrammel\n")
        self.assertEqual(self.read("config/moonraker.conf"), MOONRAKER.decode() + "\n[octoprint_compat]\n")

    def test_what_the_owner_changed_is_left_and_named(self):
        self.install()
        settings = self.home / "printer_data/config/trammel.toml"
        settings.write_text('[filament]\nmaterial = "pla"\n')
        moonraker = self.home / "printer_data/config/moonraker.conf"
        moonraker.write_text(moonraker.read_text().replace("channel: stable", "channel: beta"))
        remarks = self.uninstall()
        self.assertEqual(len(remarks), 2)
        self.assertTrue(any("trammel.toml was changed" in remark for remark in remarks), remarks)
        self.assertTrue(any("moonraker.conf was changed" in remark for remark in remarks), remarks)
        self.assertIn("pla", settings.read_text())

    def test_a_read_only_file_is_refused_before_anything_is_changed(self):
        for name in ("config/moonraker.conf", "moonraker.asvc", "config/.theme/navi.json", "config", "."):
            path = self.home / "printer_data" / name
            mode = stat.S_IMODE(path.stat().st_mode)
            path.chmod(mode & ~0o222)
            before = snapshot(self.root)
            with self.assertRaisesRegex(InstallError, "read-only"):
                self.install()
            self.assertEqual(before, snapshot(self.root), name)
            path.chmod(mode)
        self.assertEqual(self.commands, [])

    def test_a_configuration_behind_a_link_is_edited_where_it_lies(self):
        config = self.home / "printer_data/config"
        real = self.home / "dotfiles/moonraker.conf"
        real.parent.mkdir()
        (config / "moonraker.conf").rename(real)
        (config / "moonraker.conf").symlink_to(real)
        self.check_round_trip()
        self.assertTrue((config / "moonraker.conf").is_symlink())

    def test_the_mode_of_a_file_stays(self):
        moonraker = self.home / "printer_data/config/moonraker.conf"
        moonraker.chmod(0o640)
        self.install()
        self.assertEqual(stat.S_IMODE(moonraker.stat().st_mode), 0o640)
        settings = self.home / "printer_data/config/trammel.toml"
        self.assertEqual(stat.S_IMODE(settings.stat().st_mode), 0o600)

    def test_without_a_printer_the_folder_is_asked_for(self):
        shutil.rmtree(self.home / "printer_data")
        with self.assertRaisesRegex(InstallError, "--printer"):
            self.install()

    def test_a_path_that_systemd_would_read_otherwise_is_refused(self):
        for name in ("my printer", "100%", 'a"b', "a$b"):
            with self.assertRaisesRegex(InstallError, "--no-unit"):
                unit.unit_text("[Unit]\n[Service]\n", "trammel", "pi", self.home, self.program, self.home / name)

    def test_an_archive_for_another_processor_is_refused(self):
        (self.program / "release_info.json").write_text(json.dumps(RELEASE))
        self.assertEqual(printers.release_of(self.program, "amd64"), RELEASE)
        with self.assertRaisesRegex(InstallError, "trammel-arm64.zip"):
            printers.release_of(self.program, "arm64")
        (self.program / "release_info.json").write_text("{")
        with self.assertRaisesRegex(InstallError, "unpack"):
            printers.release_of(self.program, "amd64")


    def test_a_printer_with_a_load_cell_answers_taps(self):
        self.install()
        self.assertNotIn("--answer-taps", (self.units / "trammel.service").read_text())
        config = self.home / "printer_data/config"
        (config / "probes").mkdir()
        (config / "printer.cfg").write_text("[include trammel.cfg]\n[include probes/*.cfg] # mine\n[include printer.cfg]\n")
        (config / "printer-20260101_000000.cfg").write_text("[load_cell_probe]\n")  # Klipper's copy of an older one
        (config / "probes/cell.cfg").write_text("#[load_cell_probe]\n")
        self.install()
        self.assertNotIn("--answer-taps", (self.units / "trammel.service").read_text())
        (config / "probes/cell.cfg").write_text("[load_cell_probe]\nsensor_type: hx717\n")
        self.install()
        self.assertRegex((self.units / "trammel.service").read_text(), "ExecStart=.*/trammel/recordings --answer-taps\n")


class FailureTest(Home):
    """A failure changes nothing: neither on a fresh home nor on one that has trammel."""

    def check_unchanged(self, reason, fail):
        for prepare in (lambda: None, self.install):
            prepare()
            before = snapshot(self.root)
            with self.assertRaisesRegex(InstallError, reason):
                fail()
            self.assertEqual(before, snapshot(self.root))

    def test_a_mistyped_printer_is_named_and_nothing_is_taken_out(self):
        def fail():
            install.install(self.home, self.program, [self.home / "printer_daat"], self.units, "pi", RELEASE, "", self.run_as_root)

        self.check_unchanged("printer_daat/config/moonraker.conf is not there: --printer", fail)

    def test_an_archive_with_a_file_missing_takes_nothing_out(self):
        def fail():
            name = self.program / "share/trammel/klipper/trammel_laser.cfg"
            name.rename(name.with_suffix(".away"))
            try:
                self.install()
            finally:
                name.with_suffix(".away").rename(name)

        self.check_unchanged("trammel_laser.cfg is not there: unpack the release archive anew", fail)

    def test_what_sudo_refuses_is_rolled_back(self):
        shared = self.program / "share/trammel/klipper"
        for number, refused in enumerate(("install", "systemctl enable", "systemctl daemon-reload", "systemctl restart")):
            for there in (False, True):  # a new installation, one that is renewed
                if refused == "systemctl restart" and not there:
                    continue
                if there:
                    self.install()
                (shared / "trammel.cfg").write_text(f"# {number} {there}\n")
                (shared / "trammel@.service").write_text(f"[Unit]\n# {number} {there}\n[Service]\nExecStart=x\n")
                before = snapshot(self.root)
                self.refused = refused
                with self.assertRaises(InstallError):
                    self.install()
                self.refused = None
                self.assertEqual(before, snapshot(self.root), f"{refused}, {there}")
            self.uninstall()

    def test_a_full_disk_half_way_is_rolled_back(self):
        write_whole, names = edits.write_whole, []

        def full(path, data, mode, group=None):
            names.append(path.name)
            if path.name == "moonraker.conf" and b"update_manager trammel" in data:
                raise OSError(28, "No space left on device", str(path))
            write_whole(path, data, mode, group)

        before = snapshot(self.root)
        with unittest.mock.patch.object(edits, "write_whole", full):
            with self.assertRaisesRegex(InstallError, "No space left.*everything is as it was before"):
                self.install()
        self.assertIn("trammel.cfg", names)
        self.assertEqual(before, snapshot(self.root))

    def test_uninstalling_that_sudo_refuses_changes_nothing(self):
        self.install()
        before = snapshot(self.root)
        for self.refused in ("systemctl disable", "rm"):
            with self.assertRaisesRegex(InstallError, "everything is as it was before"):
                self.uninstall()
            self.assertEqual(before, snapshot(self.root))

    def test_a_file_of_another_user_is_refused_before_anything_is_taken_out(self):
        self.install()
        before = snapshot(self.root)
        (self.program / "share/trammel/klipper/trammel.cfg").write_text("# renewed\n")
        before["trammel/share/trammel/klipper/trammel.cfg"] = (0o644, b"# renewed\n")
        real = pathlib.Path.stat
        uid = os.geteuid()

        def stat_of(path, **arguments):
            found = real(path, **arguments)
            return os.stat_result(found[:4] + (uid + 1,) + found[5:]) if path.name == "trammel.cfg" else found

        with unittest.mock.patch.object(pathlib.Path, "stat", stat_of):
            with self.assertRaisesRegex(InstallError, "trammel.cfg belongs to another user"):
                self.install()
        self.assertEqual(before, snapshot(self.root))


class HostileTest(Home):
    """Names and contents that others laid out."""

    def test_macros_that_klipper_includes_stay_until_the_line_is_gone(self):
        config = self.home / "printer_data/config"
        (config / "mine").mkdir()
        (config / "printer.cfg").write_text("[include mine/*.cfg]\n[include trammel_l*.cfg]\n")
        (config / "mine/macros.cfg").write_text("[include ../trammel.cfg]\n")
        before = snapshot(self.root)
        self.install()
        self.assertRegex("\n".join(self.uninstall()), "mine/macros.cfg includes trammel.cfg, without which Klipper would not start")
        self.assertTrue((config / "trammel.cfg").exists())
        self.assertFalse((config / "trammel_laser.cfg").exists())  # a pattern that finds nothing stops no Klipper
        self.install()
        (config / "printer.cfg").write_text("[printer]\n")
        before["home/printer_data/config/printer.cfg"] = (0o644, b"[printer]\n")
        self.assertEqual(self.uninstall(), [])
        self.assertEqual(before, snapshot(self.root))

    def test_links_that_lead_nowhere_are_left_and_named(self):
        config = self.home / "printer_data/config"
        for name in ("trammel.cfg", "trammel.toml"):
            (config / name).symlink_to(self.root / "nowhere")
        (config / ".theme/navi.json").unlink()
        (config / ".theme/navi.json").symlink_to(self.root / "nowhere")
        remarks = "\n".join(self.install())
        for name in ("trammel.cfg", "trammel.toml", ".theme/navi.json"):
            self.assertEqual(os.readlink(config / name), str(self.root / "nowhere"))
        self.assertRegex(remarks, "trammel.cfg is there already")
        self.assertRegex(remarks, "navi.json leads nowhere")
        self.assertFalse((self.root / "nowhere").exists())

    def test_a_moonraker_conf_that_leads_nowhere_is_named(self):
        path = self.home / "printer_data/config/moonraker.conf"
        path.unlink()
        path.symlink_to(self.root / "nowhere")
        with self.assertRaisesRegex(InstallError, "moonraker.conf is a link to .*nowhere, which is not there"):
            install.install(self.home, self.program, [self.home / "printer_data"], None, "pi", RELEASE, "", self.run_as_root)

    def test_a_planted_part_file_is_not_written_through(self):
        for name in ("trammel.cfg", "moonraker.conf"):
            (self.home / f"printer_data/config/.{name}.trammel-part").symlink_to(self.root / "precious")
        (self.root / "precious").write_text("precious")
        self.install()
        self.assertEqual((self.root / "precious").read_text(), "precious")
        self.assertIn("trammel", self.read("config/trammel.cfg"))

    def test_a_pipe_under_a_name_of_ours_is_left(self):
        os.mkfifo(self.home / "printer_data/config/trammel.cfg")
        self.assertRegex("\n".join(self.install()), "trammel.cfg is there already")

    def test_a_navigation_in_utf_16_stays_byte_for_byte(self):
        path = self.home / "printer_data/config/.theme/navi.json"
        for form in ("utf-16", "utf-16-be", "utf-32"):
            path.write_bytes('[{"title": "KlipperFleet"}]'.encode(form))
            before = path.read_bytes()
            self.assertRegex("\n".join(self.install()), "navi.json is no JSON array in UTF-8")
            self.assertEqual(path.read_bytes(), before)
            self.uninstall()
        path.write_bytes(b"[" * 100_000)
        self.assertRegex("\n".join(self.install()), "navi.json is no JSON array")

    def test_a_damaged_manifest_is_named_before_anything_is_changed(self):
        manifest = self.home / ".trammel-installed.json"
        for damaged in (b"", b"{", b"[]", b'{"edits": 1}', b'{"edits": [1]}', b'{"edits": [{"kind": "file"}]}', b"[" * 100_000,
                        b'{"edits": [{"kind": "file", "path": "a", "sha256": ""}]}', b"\xff\xfe{\0}\0",
                        b'{"edits": [{"kind": "unit", "path": "/etc/passwd", "sha256": ""}]}',
                        b'{"edits": [{"kind": "folder", "path": "/a\\u0000b"}]}', b'{"edits": [{"kind": "reminder", "port": "x"}]}'):
            manifest.write_bytes(damaged)
            before = snapshot(self.root)
            for work in (self.install, self.uninstall):
                with self.assertRaisesRegex(InstallError, "trammel-installed.json is damaged"):
                    work()
                self.assertEqual(before, snapshot(self.root))
        manifest.unlink()
        manifest.symlink_to(self.root / "nowhere")
        with self.assertRaisesRegex(InstallError, "is a link"):
            self.install()

    def test_a_damaged_release_info_is_named(self):
        for damaged in (b"[]", b"{}", b"\xff", b'{"asset_name": 1, "project_owner": "a", "project_name": "b"}', b"[" * 100_000,
                        b'{"asset_name": "trammel-amd64.zip", "project_owner": "a\\n[x]", "project_name": "b"}'):
            (self.program / "release_info.json").write_bytes(damaged)
            with self.assertRaisesRegex(InstallError, "unpack the release archive anew"):
                printers.release_of(self.program, "amd64")

    def test_python_takes_nothing_from_the_current_folder_or_the_environment(self):
        shutil.copytree(SOURCE / "packaging/installer", self.program / "share/trammel/installer")
        shutil.copy(SOURCE / "packaging/install.sh", self.program)
        planted = self.root / "planted"
        planted.mkdir()
        for name in ("installer", "json", "signal", "runpy", "argparse", "sitecustomize", "usercustomize"):
            (planted / f"{name}.py").write_text(f"open({str(self.root / 'ran')!r}, 'w').write('{name}')\n")
        (planted / "python3").write_text(f"#!/bin/sh\ntouch {self.root}/ran\n")
        (planted / "python3").chmod(0o755)
        done = subprocess.run(["sh", str(self.program / "install.sh"), "--help"], cwd=planted, capture_output=True, text=True, check=False,
                              env={"PYTHONPATH": str(planted), "PATH": f"{planted}:.:{os.environ['PATH']}", "CDPATH": str(planted)})
        self.assertFalse((self.root / "ran").exists())
        self.assertIn("usage: install.sh", done.stdout, done.stderr)


class AddressTest(Home):
    """The printer's Moonraker, as Moonraker reads its own file."""

    def address(self, text, **included):
        config = self.home / "printer_data/config"
        (config / "moonraker.conf").write_bytes(text.encode())
        for name, more in included.items():
            (config / f"{name}.conf").write_text(more)
        return printers.address_of(self.home / "printer_data", edits.Plan())

    def test_a_bracket_in_a_comment_or_a_value_ends_no_section(self):
        self.assertEqual(self.address("[server]\nhost: 0.0.0.0\n# who: see [authorization]\nport: 7126\n"), "127.0.0.1:7126")
        self.assertEqual(self.address("[server]\nklippy_uds_address: /tmp/[a]\nport: 7126 # [b]\n[x]\nport: 1\n"), "127.0.0.1:7126")
        self.assertEqual(self.address("[x]\nport: 1\nlist:\n  [server]\n  port: 2\n[server]\nport=7126\n"), "127.0.0.1:7126")
        self.assertEqual(self.address("[server] # ours\r\nPORT : 7126\r\n"), "127.0.0.1:7126")

    def test_included_files_count_and_the_last_one_wins(self):
        self.assertEqual(self.address("[include server.conf]\n", server="[server]\nport: 7126\n"), "127.0.0.1:7126")
        self.assertEqual(self.address("[server]\nport: 1\n[include s*.conf]\n", server="[server]\nport: 7126\n"), "127.0.0.1:7126")
        self.assertEqual(self.address("[include moonraker.conf]\n[server]\nport: 7126\n"), "127.0.0.1:7126")

    def test_a_prefix_and_a_host_of_its_own_belong_to_the_address(self):
        self.assertEqual(self.address("[server]\nroute_prefix: /printer2/\n"), "127.0.0.1:7125/printer2")
        for host, reached in (("all", "127.0.0.1"), ("192.168.1.5", "192.168.1.5"), ("::", "[::1]"), ("fe80::1", "[fe80::1]")):
            self.assertEqual(self.address(f"[server]\nhost: {host}\n"), f"{reached}:7125")

    def test_what_is_no_address_is_refused(self):
        for text in ("[server]\nport: 0\n", "[server]\nport: 65536\n", "[server]\nport: x\n", '[server]\nroute_prefix: a"b\n',
                     "port: 7125\n", "[server]\nroute_prefix: a b\n", "[server]\0\nport: 1\n"):
            with self.assertRaises(InstallError, msg=text):
                self.address(text)

    def test_files_of_printers_in_the_field(self):
        field = pathlib.Path(os.environ.get("TRAMMEL_TEST_DATA", "")) / "field/06"
        if not field.is_dir():
            self.skipTest(f"there is no {field}")
        self.assertEqual(self.address((field / "moonraker.conf").read_text()), "127.0.0.1:7126")
        self.assertEqual(self.address((field / "route_prefix.conf").read_text()), "127.0.0.1:7125/printer2")

    def test_a_copy_of_a_printers_folder_is_no_second_printer(self):
        shutil.copytree(self.home / "printer_data", self.home / "backup")
        before = snapshot(self.root)
        with self.assertRaisesRegex(InstallError, "printer_data and .*backup both have their Moonraker at 127.0.0.1:7126"):
            self.install()
        self.assertEqual(before, snapshot(self.root))

    def test_a_32_bit_system_on_a_64_bit_kernel_is_named(self):
        (self.program / "release_info.json").write_text(json.dumps(RELEASE | {"asset_name": "trammel-arm64.zip"}))
        told = subprocess.CompletedProcess([], 0, stdout="armhf\n")
        with unittest.mock.patch("platform.machine", return_value="aarch64"), unittest.mock.patch("subprocess.run", return_value=told):
            self.assertEqual(printers.architecture(), "armhf")
            with self.assertRaisesRegex(InstallError, "programs of this system are for armhf.*64-bit system"):
                printers.release_of(self.program, printers.architecture())


class Moonraker(http.server.BaseHTTPRequestHandler):
    """Moonraker's database as v0.10 has it: a namespace ends with its last item."""

    def answer(self, status, result):
        data = json.dumps({"result": result} if status == 200 else {"error": {"code": status, "message": "not found"}}).encode()
        self.send_response(status)
        self.end_headers()
        self.wfile.write(data)

    def do_GET(self):
        items = self.server.items
        if self.path.startswith("/server/history/totals"):
            self.answer(200, {"job_totals": {"total_filament_used": 1500.5, "total_print_time": 7200.0}})
        else:
            self.answer(200 if items else 404, {"namespace": "maintenance", "key": None, "value": items})

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        assert body["namespace"] == "maintenance"
        self.server.items[body["key"]] = body["value"]
        self.answer(200, body)

    def do_DELETE(self):
        query = urllib.parse.parse_qs(urllib.parse.urlparse(self.path).query)
        self.answer(200, self.server.items.pop(query["key"][0]))

    def log_message(self, *_arguments):
        pass


class ReminderTest(Home):
    def setUp(self):
        super().setUp()
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Moonraker)
        self.server.items = {}
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        (self.home / "printer_data/config/moonraker.conf").write_text(f"[server]\nport: {self.server.server_port}\n")

    @property
    def items(self):
        return self.server.items

    def test_it_is_due_after_ninety_days_and_nothing_of_others_is_touched(self):
        theirs = {"a": {"name": "MAINTENANCE_INIT"}, "b": {"name": "Calibrate pressure advance", "end_time": None}}
        self.items.update(theirs)
        self.assertEqual(self.install(remind=True), [])
        entry = self.items[maintenance.KEY]
        self.assertAlmostEqual(entry["start_time"], time.time(), delta=60)
        self.assertEqual(entry["reminder"]["date"], {"bool": True, "value": 90})
        self.assertEqual((entry["reminder"]["type"], entry["end_time"], entry["start_filament"]), ("repeat", None, 1500.5))
        # What was calibrated since does not begin anew with each update.
        entry["start_time"] = 5
        self.install(remind=True)
        self.assertEqual(self.items[maintenance.KEY]["start_time"], 5)
        self.assertEqual(self.uninstall(), [])
        self.assertEqual(self.items, theirs)

    def test_without_being_asked_for_there_is_none(self):
        self.install()
        self.assertEqual(self.items, {})
        self.install(remind=True)
        self.install()
        self.assertEqual(self.items, {})

    def test_what_its_owner_performed_stays_and_reminds_no_more(self):
        self.install(remind=True)
        done = self.items[maintenance.KEY]
        self.items["next"] = done | {"last_entry": maintenance.KEY}
        done["end_time"] = 7
        self.items["last"] = self.items["next"] | {"last_entry": "next"}
        self.items["next"]["end_time"] = 8
        self.install(remind=True)
        self.assertEqual(set(self.items), {maintenance.KEY, "next", "last"})
        self.assertEqual(self.uninstall(), [])
        self.assertEqual(set(self.items), {maintenance.KEY, "next"})

    def test_one_that_its_owner_made_something_else_of_is_left_and_named(self):
        self.install(remind=True)
        self.items[maintenance.KEY]["name"] = "Grease the rods"
        self.assertRegex(self.uninstall()[0], "renamed to 'Grease the rods'")
        self.assertIn(maintenance.KEY, self.items)

    def test_where_it_would_keep_mainsail_from_the_owners_own_nothing_is_changed(self):
        (self.home / "printer_data/config/.theme/maintenance.json").write_text('{"entries": []}')
        before = snapshot(self.root)
        with self.assertRaisesRegex(InstallError, "open Mainsail"):
            self.install(remind=True)
        self.assertEqual(before, snapshot(self.root))

    def test_without_moonraker_nothing_is_installed_and_taking_out_says_what_stays(self):
        self.install(remind=True)
        self.server.shutdown()
        self.server.server_close()
        installed = snapshot(self.root)
        with self.assertRaisesRegex(InstallError, "does not answer"):
            self.install(remind=True)
        self.assertEqual(installed, snapshot(self.root))
        self.assertRegex(self.uninstall()[0], "stays among Mainsail's maintenance")


class DeathTest(Home):
    """The installer dies before each thing that it asks the system for, and is run again, or taken out."""

    def die_at(self, count, work):
        """Runs `work` in a process that dies before its count-th call of the system. @returns whether it died."""
        child = os.fork()
        if child == 0:
            left = count

            def hook(event, _arguments):
                nonlocal left
                if event in ("open", "os.rename", "os.mkdir", "os.remove", "os.rmdir", "os.chmod", "shutil.copyfile"):
                    left -= 1
                    if left < 0:
                        os._exit(DIED)

            sys.addaudithook(hook)
            try:
                work()
            except BaseException:  # pylint: disable=broad-except
                os._exit(1)
            os._exit(0)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        self.assertIn(status, (0, DIED))
        return status == DIED

    def check_deaths(self, work, prepare=lambda: None):
        before = snapshot(self.root)
        for after_death in (self.install, self.uninstall):
            count = 0
            while True:
                prepare()
                died = self.die_at(count, work)
                self.assertEqual(after_death() or [], [], count)
                self.assertEqual(self.uninstall(), [], count)
                self.assertEqual(before, snapshot(self.root), f"{after_death.__name__} after death {count}")
                if not died:
                    break
                count += 1
            self.assertGreater(count, 10)

    def test_death_while_installing_leaves_nothing_that_the_next_run_does_not_mend(self):
        self.printer("printer_1_data", moonraker=b"[server]", allowed=b"klipper", navigation=None)
        self.check_deaths(self.install)

    def test_death_while_uninstalling_too(self):
        self.check_deaths(self.uninstall, prepare=self.install)


class EditsTest(unittest.TestCase):
    def test_a_block_is_found_at_the_start_of_a_line_alone(self):
        record = {"text": "trammel\n", "glued": False}
        self.assertEqual(edits.without_block(b"mytrammel\ntrammel\nother\n", record), b"mytrammel\nother\n")
        self.assertIsNone(edits.without_block(b"mytrammel\n", record))


if __name__ == "__main__":
    unittest.main()
