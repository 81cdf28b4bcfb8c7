#!/usr/bin/env python3
"""What an owner does with the panel, in a real browser, against a server and its printer.

    journey_test.py http://printer.test:PORT/ --photo GOOD.jpg --refused-photo BAD.jpg [--gone COMMAND --back COMMAND]
    journey_test.py mock --page FOLDER

The first drives a real server, whose printer must be ready and idle and may heat and move: a virtual one. The commands stop
and start that server. The second also tests the page alone against mock_panel.py; FOLDER has the built page.
printer.test is this machine: an insecure origin on purpose, as a printer's address in a home network is.
"""
import argparse
import json
import pathlib
import re
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

import web_driver

HERE = pathlib.Path(__file__).resolve().parent
SETTINGS = argparse.Namespace()
RUN_PATIENCE_S = 300  # a virtual printer's print
MEASURE_PATIENCE_S = 240  # a computer that is at work elsewhere
NUMBER = re.compile(r"\d+\.\d+ s")


class Mock:
    """mock_panel.py on a port of its own."""

    def __init__(self, page):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.page = page
        self.back()

    def back(self):
        self.process = subprocess.Popen([sys.executable, HERE / "mock_panel.py", self.page, str(self.port)])
        for _ in range(100):
            try:
                return self.fault("")
            except OSError:
                time.sleep(0.05)
        raise AssertionError("mock_panel.py did not start")

    def gone(self):
        self.process.terminate()
        self.process.wait()

    def fault(self, name, value=None):
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}/mock", json.dumps({"fault": name, "value": value}).encode())
        urllib.request.build_opener(urllib.request.ProxyHandler({})).open(request, timeout=5).close()


class Page(unittest.TestCase):
    """One browser for all journeys, one tab with the page for each."""

    @classmethod
    def setUpClass(cls):
        cls.driver = web_driver.Driver()
        cls.browser = cls.driver.browser()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()
        cls.driver.close()

    def setUp(self):
        self.browser.size(390, 844)
        self.browser.upload_speed(-1)
        self.visit()
        self.browser.script("sessionStorage.clear()")
        self.visit()
        self.browser.script("document.querySelector('#stop')?.click()")  # of a run that may end meanwhile
        self.browser.wait_gone("#run", RUN_PATIENCE_S)
        self.browser.log()

    def visit(self, query=""):
        self.browser.open(SETTINGS.url + query)
        self.browser.wait(lambda: self.browser.text("#in-force"), "for the value in force")

    def shot(self, name):
        """Saves what phone, desk and printer's screen show, light and dark."""
        if not SETTINGS.shots:
            return
        for scheme in ("light", "dark"):
            self.browser.scheme(scheme)
            for width, height in ((390, 844), (1400, 900), (480, 320)):
                self.browser.size(width, height)
                time.sleep(0.1)
                self.browser.screenshot(SETTINGS.shots / f"{name}-{width}x{height}-{scheme}.png")
        self.browser.scheme("light")
        self.browser.size(390, 844)

    def choose_photo(self, path):
        self.browser.click("#photograph")
        self.browser.click(f"#choice input[value={SETTINGS.pattern}]")
        self.browser.type("#camera", str(path))

    def measure(self, path, outcome):
        self.choose_photo(path)
        self.browser.wait_for(outcome, MEASURE_PATIENCE_S)

    def start_run(self):
        self.browser.click("#photo_pattern")
        if SETTINGS.material:
            self.browser.choose("#jobs dialog[open] select", SETTINGS.material)
        self.browser.click("#jobs dialog[open] .primary")
        self.browser.wait_for("#run")

    def stop_run(self):
        self.browser.click("#stop")
        self.browser.wait_gone("#run", RUN_PATIENCE_S)


class Journeys(Page):
    def test_photo_to_applied_value(self):
        page = self.browser
        self.shot("first")
        page.click("#photograph")
        page.wait_for("#choice")
        self.shot("choice")
        page.script("document.querySelector('#choice').close()")
        self.measure(SETTINGS.photo, "#answer")
        self.assertTrue(page.title().startswith("● "), page.title())
        value = NUMBER.search(page.text("#answer .value")).group()
        self.assertRegex(page.text("#answer .interval"), r"95 %: \d+\.\d+ to \d+\.\d+ s")
        self.assertIn("Good", page.text("#answer"))
        page.wait(lambda: page.script("return [...document.querySelectorAll('#answer > img')].every(i => i.naturalWidth > 0)"),
                  "for the picture")
        self.shot("answer")
        page.click("#use")
        page.wait_for("#used", RUN_PATIENCE_S)
        page.wait_text("#in-force", value)
        self.assertFalse(page.present("#use"))
        self.shot("used")
        page.reload()
        page.wait_text("#in-force", value)
        page.wait_text("#history", value[:6])
        self.assertEqual(page.log(), [])

    def test_refusal_and_another_photo(self):
        page = self.browser
        self.measure(SETTINGS.refused_photo, "#refusal")
        self.assertGreater(len(page.text("#refusal h2")), 20)
        self.assertFalse(page.present("#use"))
        self.assertRegex(page.text("#refusal"), "Refused|Cannot tell")
        self.assertEqual(page.script("return document.querySelectorAll('#refusal button').length"), 1)
        self.shot("refusal")
        self.measure(SETTINGS.photo, "#answer")
        page.wait_for("#tries")
        rows = page.script("return [...document.querySelectorAll('#tries tr')].map(row => row.innerText)")
        self.assertEqual(len(rows), 2)
        self.assertIn(page.text("#answer .value"), rows[0])
        page.click("#tries tr:last-child button")
        page.wait_for("#refusal")
        page.reload()
        page.wait_for("#tries")
        page.click("#tries button")
        page.wait_for("#answer")

    def test_a_run_is_started_seen_and_stopped(self):
        page = self.browser
        page.click("#photo_pattern")
        page.wait_for("#jobs dialog[open]")
        self.assertIn("Is the bed empty?", page.text("#jobs dialog[open]"))
        self.shot("empty")
        page.click("#jobs dialog[open] button.focus")
        page.wait_gone("#jobs dialog[open]")
        self.assertFalse(page.present("#run"))
        self.start_run()
        page.wait(lambda: page.script("return document.querySelector('#run progress')?.value > 0"), "for progress", RUN_PATIENCE_S)
        self.assertIn(page.text("#run .phase strong"), page.title())
        self.assertTrue(page.script("return document.querySelector('#photo_pattern').disabled"))
        self.shot("run")
        page.click("#emergency")
        page.wait_for("#run dialog[open]")
        self.shot("emergency")
        page.click("#run dialog[open] button.focus")
        self.assertTrue(page.present("#run"))
        self.stop_run()
        page.wait_text("#last-run", "stopped")
        self.assertTrue(page.title().startswith("● "), page.title())

    def test_reload_in_mid_run(self):
        page = self.browser
        self.start_run()
        page.wait(lambda: page.text("#run .phase strong") not in ("", "Starting"), "for a phase", RUN_PATIENCE_S)
        page.reload()
        page.wait_for("#run")
        self.stop_run()

    def test_two_tabs_see_the_same_run(self):
        page = self.browser
        first = page.tab()
        second = page.new_tab()
        try:
            page.tab(second)
            self.visit()
            page.tab(first)
            self.start_run()
            page.tab(second)
            page.wait_for("#run")
            self.stop_run()
            page.tab(first)
            page.wait_gone("#run")
            page.wait_text("#last-run", "stopped")
        finally:
            page.tab(second)
            page.call("DELETE", "/window")
            page.tab(first)

    def test_server_gone_and_back(self):
        if not SETTINGS.gone:
            self.skipTest("needs --gone and --back")
        page = self.browser
        self.measure(SETTINGS.photo, "#answer")
        shown = page.text("#answer .value")
        SETTINGS.gone()
        try:
            page.wait_text("#status", "Connection lost")
            self.assertEqual(page.text("#answer .value"), shown)
            for button in ("#use", "#photograph", "#photo_pattern"):
                self.assertTrue(page.script("return document.querySelector(arguments[0]).disabled", button), button)
            self.shot("lost")
        finally:
            SETTINGS.back()
        page.wait_text("#status", "Connected again", 30)
        self.assertEqual(page.text("#answer .value"), shown)
        page.wait(lambda: not page.script("return document.querySelector('#photo_pattern').disabled"), "for the buttons", 60)

    def test_copy_on_an_insecure_origin(self):
        page = self.browser
        self.assertFalse(page.script("return isSecureContext"))
        self.measure(SETTINGS.photo, "#answer")
        for firmware in ("Klipper", "Marlin"):
            page.choose("#firmware", firmware)
            line = page.wait(lambda: page.script("return document.querySelector('#line').value"), "for the line")
            page.click("#copy")
            page.wait_text("#copied", "Copied")
            page.script("const f = document.createElement('textarea'); f.id = 'paste'; document.body.append(f)")
            page.type("#paste", "\ue009v")
            self.assertEqual(page.script("const f = document.querySelector('#paste'); f.remove(); return f.value"), line)

    def test_a_large_upload_shows_progress(self):
        page = self.browser
        with tempfile.NamedTemporaryFile(suffix=".jpg") as large:
            large.write(SETTINGS.photo.read_bytes().ljust(20_000_000, b"\0"))
            large.flush()
            page.upload_speed(4_000_000)
            self.choose_photo(large.name)
            page.wait_for("#sending")
            shares = set()

            def sent():
                share = page.script("const p = document.querySelector('#sending progress'); return p && p.value / p.max")
                shares.add(share)
                if len(shares) == 5 and SETTINGS.shots:
                    page.screenshot(SETTINGS.shots / "sending.png")
                return not page.present("#sending")

            page.wait(sent, "for the upload")
            page.wait(lambda: page.present("#answer") or page.present("#refusal"), "for an outcome", MEASURE_PATIENCE_S)
        self.assertGreater(len([share for share in shares if share]), 3, shares)

    def test_embedded(self):
        page = self.browser
        page.size(400, 300)
        self.visit("?embed=1&theme=dark")
        self.assertFalse(page.present("#history"))
        self.assertFalse(page.present("#jobs"))
        self.assertEqual(page.script("return getComputedStyle(document.documentElement).backgroundColor"), "rgba(0, 0, 0, 0)")
        self.assert_in_window("#photograph", 300)
        if SETTINGS.shots:
            page.screenshot(SETTINGS.shots / "embed.png")
        self.measure(SETTINGS.photo, "#answer")
        self.assert_in_window("#use", 300)
        if SETTINGS.shots:
            page.screenshot(SETTINGS.shots / "embed-answer.png")

    def assert_in_window(self, selector, height):
        box = self.browser.script("const b = document.querySelector(arguments[0]).getBoundingClientRect();"
                                  "const seen = document.elementFromPoint((b.left + b.right) / 2, (b.top + b.bottom) / 2);"
                                  "return [b.top, b.bottom, seen?.id]", selector)
        self.assertTrue(0 <= box[0] and box[1] <= height and box[2] == selector[1:], f"{selector}: {box}")

    def test_nothing_is_wider_than_the_window(self):
        page = self.browser

        def check(what):
            for width in (320, 390, 1400):
                page.size(width, 700)
                self.assertLessEqual(page.script("return document.documentElement.scrollWidth"), width, what)

        check("first")
        self.measure(SETTINGS.refused_photo, "#refusal")
        check("refusal")
        self.measure(SETTINGS.photo, "#answer")
        check("answer")
        if SETTINGS.shots:
            for width in (320, 390, 1400):
                page.size(width, page.script("return document.documentElement.scrollHeight"))
                page.screenshot(SETTINGS.shots / f"whole-{width}.png")
        page.size(390, 844)
        self.start_run()
        check("run")
        page.size(390, 844)
        self.stop_run()

    def test_the_next_step_is_on_the_first_screen(self):
        for width, height in ((320, 568), (390, 844), (480, 320), (1400, 900)):
            self.browser.size(width, height)
            self.assert_in_window("#in-force", height)
            self.assert_in_window("#photograph", height)


class BrokenServer(Page):
    """What faults of the server do to the page: it names them, keeps what it shows, and recovers."""

    def setUp(self):
        if not SETTINGS.mock:
            self.skipTest("needs the mock")
        SETTINGS.mock.fault("")
        super().setUp()

    def tearDown(self):
        SETTINGS.mock.fault("")

    def test_an_error_is_shown_as_it_is(self):
        SETTINGS.mock.fault("error", "The bed <b>is</b> not empty.")
        self.browser.click("#photo_pattern")
        self.browser.click("#jobs dialog[open] .primary")
        self.browser.wait_text("#status", "The bed <b>is</b> not empty.")

    def test_an_error_at_the_start_does_not_stay(self):
        SETTINGS.mock.fault("error", "The folder of recordings is full.")
        self.browser.reload()
        self.browser.wait_text("#status", "The folder of recordings is full.")
        SETTINGS.mock.fault("")
        self.browser.wait_text("#in-force", " s")

    def test_uploads_that_are_refused(self):
        for status, part in ((413, "too large"), (415, "JPEG"), (500, "500")):
            SETTINGS.mock.fault("upload", status)
            self.choose_photo(SETTINGS.photo)
            self.browser.wait_text("#failed", part)
            self.assertIn(part, self.browser.text("#status"))
            self.browser.click("#failed button:not(.primary)")
            self.browser.script("document.querySelector('#choice').close()")
            self.visit()
        SETTINGS.mock.fault("upload", 500)
        self.choose_photo(SETTINGS.photo)
        self.browser.wait_for("#failed")
        SETTINGS.mock.fault("")
        self.browser.click("#failed .primary")
        self.browser.wait_for("#answer")

    def test_the_service_goes_while_it_measures(self):
        self.choose_photo(SETTINGS.photo)
        self.browser.wait_for("#measuring")
        SETTINGS.gone()
        self.browser.wait_text("#status", "Connection lost")
        self.assertTrue(self.browser.present("#measuring"))
        SETTINGS.back()
        self.browser.wait_for("#failed")  # the mock forgot the photo

    def test_a_page_below_another_servers_path(self):
        self.visit("server/trammel/")
        self.measure(SETTINGS.photo, "#answer")
        address = self.browser.script("return document.querySelector('#answer > img').src")
        self.assertRegex(address, r"/server/trammel/runs/photo-\d+/answer\.png$")
        address = self.browser.script("return document.querySelector('#answer a').href")
        self.assertRegex(address, r"/server/trammel/runs/photo-\d+/report\.html$")

    def test_a_printer_that_is_not_ready(self):
        lost = {"address": "voron.local", "readiness": "shutdown", "message": "Lost communication with MCU"}
        SETTINGS.mock.fault("status", {"printer": lost})
        self.visit()
        self.browser.wait_text(".warning", "Lost communication with MCU")
        self.measure(SETTINGS.photo, "#answer")
        for button in ("#use", "#photo_pattern", "#pressure_advance"):
            self.assertTrue(self.browser.script("return document.querySelector(arguments[0]).disabled", button), button)
        self.browser.click("#copy")
        self.browser.wait_text("#copied", "Copied")
        self.shot("not-ready")

    def test_a_pattern_without_a_material_asks_for_it(self):
        SETTINGS.mock.fault("status", {"jobs": [{"job": job, "arguments": [], "blocker": "name the material"}
                                                for job in ("photo_pattern", "pressure_advance")]})
        self.visit()
        self.browser.wait_text("#jobs", "name the material")
        self.assertFalse(self.browser.present("#pressure_advance"))
        self.browser.click("#photo_pattern")
        self.browser.choose("#jobs dialog[open] select", "petg")
        self.browser.click("#jobs dialog[open] .primary")
        self.browser.wait_for("#run")
        self.stop_run()

    def test_a_printer_is_set_up_and_back(self):
        page = self.browser
        page.wait_text("#setup", "new first line: [include trammel.cfg]")
        self.shot("setup")
        for button, there in (("#set-up", "#undo-set-up"), ("#undo-set-up", "#set-up")):
            page.click(button)
            page.click("#setup dialog[open] .primary")
            page.wait_for(there)
        page.wait_text("#status", "Done")

    def test_a_gcode_is_sent_and_named_until_removed(self):
        page = self.browser
        with tempfile.NamedTemporaryFile(suffix=".gcode") as gcode:
            gcode.write(b"G1 X1 good")
            gcode.flush()
            page.click("#photograph")
            page.click("#choice summary")
            page.type("#gcode", gcode.name)
            page.wait_text("#choice", pathlib.Path(gcode.name).name)
            page.type("#filament", "Generic PLA")
            self.assertEqual(page.script("return document.querySelector('#filament').value"), "Generic PLA")
            page.type("#camera", str(SETTINGS.photo))
            page.wait_for("#answer")
        sent = page.script("return performance.getEntriesByType('resource').map(entry => entry.name)")
        self.assertEqual(len([name for name in sent if "/gcodes?run=photo-" in name]), 1, sent)
        page.click("#answer #photograph")
        page.click("#choice details button")
        page.wait_for("#gcode")

    def test_a_slow_server(self):
        SETTINGS.mock.fault("slow", 2)
        self.browser.click("#photo_pattern")
        self.browser.click("#jobs dialog[open] .primary")
        self.browser.wait(lambda: self.browser.script("return document.querySelector('#photo_pattern').disabled"), "for a disabled button")
        self.browser.wait_for("#run")

    def test_a_server_that_answers_nothing_counts_as_lost(self):
        SETTINGS.mock.fault("deaf")
        self.browser.wait_text("#status", "Connection lost", 25)
        SETTINGS.mock.fault("")
        self.browser.wait_text("#status", "Connected again", 15)

    def test_broken_messages_are_ignored(self):
        SETTINGS.mock.fault("garbage")
        self.visit()
        self.start_run()
        self.stop_run()
        self.assertTrue(self.browser.present("#in-force"))

    def test_hostile_texts_stay_text(self):
        evil = "<img src=x onerror=\"document.title='bad'\">" + "W" * 300
        SETTINGS.mock.fault("status", {"in_force": evil, "proposal": {"run": "r", "answer": evil},
                                       "printer": {"address": evil, "readiness": evil, "message": evil}})
        self.visit()
        self.browser.wait_text("#proposal", "onerror")
        self.assertNotIn("bad", self.browser.title())
        self.assertLessEqual(self.browser.script("return document.documentElement.scrollWidth"), 390)

    def test_a_blocked_laser_and_two_printers(self):
        self.browser.wait_for("#pressure_advance")
        self.browser.choose("#printer", "1")
        self.browser.wait_text("#jobs", "no laser is set up")
        self.browser.wait_text("#in-force", "0.0200 s")
        self.assertFalse(self.browser.present("#pressure_advance"))
        self.browser.reload()
        self.browser.wait_text("#in-force", "0.0200 s")  # the chosen printer is remembered
        self.browser.choose("#printer", "0")
        self.browser.wait_for("#pressure_advance")

    def test_a_scan_whose_answer_is_used_or_dropped(self):
        for button in ("#drop", "#use-proposal"):
            self.browser.click("#pressure_advance")
            self.browser.click("#jobs dialog[open] .primary")
            self.browser.wait_for("#proposal", 30)
            self.assertIn("0.0266 s", self.browser.text("#proposal .value"))
            self.assertTrue(self.browser.title().startswith("● An answer waits"), self.browser.title())
            if button == "#drop":
                self.shot("proposal")
            self.browser.click(button)
            self.browser.wait_gone("#proposal")
        self.browser.wait_text("#in-force", "0.0266 s")

    def test_a_browser_without_storage(self):
        self.browser.devtools("Page.enable")
        script = self.browser.devtools("Page.addScriptToEvaluateOnNewDocument",
                                       source="Object.defineProperty(window, 'localStorage', {get() { throw new Error('none') }})")
        self.visit()
        self.measure(SETTINGS.photo, "#answer")
        self.browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])


def shell(command):
    return (lambda: subprocess.run(command, shell=True, check=True)) if command else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="the page's address, or mock")
    parser.add_argument("--page", type=pathlib.Path, help="folder of the built page, for the mock")
    parser.add_argument("--photo", type=pathlib.Path, help="a photo with a good answer")
    parser.add_argument("--refused-photo", type=pathlib.Path, help="a photo without an answer")
    parser.add_argument("--material", help="the pattern's material, where the settings have none")
    parser.add_argument("--pattern", default="trammel", help="what the photos show: the value of the page's choice")
    parser.add_argument("--gone", type=shell, help="command that stops the server")
    parser.add_argument("--back", type=shell, help="command that starts it again")
    parser.add_argument("--shots", type=pathlib.Path, help="folder for pictures of the page")
    known, rest = parser.parse_known_args(namespace=SETTINGS)
    web_driver.require()
    if known.shots:
        known.shots.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        known.mock = None
        if known.url == "mock":
            known.mock = Mock(known.page)
            known.url = f"http://printer.test:{known.mock.port}/"
            known.gone, known.back = known.mock.gone, known.mock.back
            known.photo, known.refused_photo = pathlib.Path(folder, "good.jpg"), pathlib.Path(folder, "refused.jpg")
            known.photo.write_bytes(b"\xff\xd8 good")
            known.refused_photo.write_bytes(b"\xff\xd8 poor")
        elif not (known.photo and known.refused_photo):
            parser.error("a real server needs --photo and --refused-photo")
        known.photo, known.refused_photo = known.photo.resolve(), known.refused_photo.resolve()
        try:
            outcome = unittest.main(argv=sys.argv[:1] + rest, exit=False).result
        finally:
            if known.mock:
                known.mock.gone()
    sys.exit(not outcome.wasSuccessful())


if __name__ == "__main__":
    main()
