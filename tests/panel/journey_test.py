#!/usr/bin/env python3
"""What an owner does with the panel, in a real browser, against a server and its printer.

    journey_test.py http://printer.test:PORT/ --photo GOOD.jpg --refused-photo BAD.jpg [--gone COMMAND --back COMMAND]
    journey_test.py mock --page FOLDER

The first drives a real server, whose printer must be ready and idle and may heat and move: a virtual one. The commands stop
and start that server. The second also tests the page alone against mock_panel.py; FOLDER has the built page.
printer.test is this machine: an insecure origin on purpose, as a printer's address in a home network is.
"""
import argparse
import hashlib
import json
import pathlib
import re
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
AXE = (HERE / "vendor/axe-core/axe.min.js").read_text(encoding="utf-8")
NUMBER = re.compile(r"\d+\.\d+ s")
ENTER = "\ue007"  # the key, as W3C WebDriver names it


class Mock:
    """mock_panel.py on a port of its own."""

    def __init__(self, page):
        self.port = web_driver.free_port()
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
        cls.browser = web_driver.BROWSERS[SETTINGS.browser]()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def setUp(self):
        self.browser.size(390, 844)
        self.browser.upload_speed()
        self.visit()
        self.browser.script("sessionStorage.clear()")
        self.visit()
        self.browser.script("document.querySelector('#stop')?.click()")  # of a run that may end meanwhile
        self.browser.wait_gone("#run", RUN_PATIENCE_S)
        self.browser.log()

    def visit(self, query=""):
        self.browser.open(SETTINGS.url + query)
        self.browser.wait(lambda: self.browser.text("#in-force"), "for the value in force")

    def look(self, name, sizes=((390, 844), (1400, 900), (480, 320))):
        """Checks what phone, desk and printer's screen show for people with impairments, light and dark. Saves pictures."""
        for scheme in ("light", "dark"):
            self.browser.scheme(scheme)
            for width, height in sizes if SETTINGS.shots else sizes[:1]:
                self.browser.size(width, height)
                time.sleep(0.2)  # colours change within 0.15 s
                if SETTINGS.shots:
                    self.browser.screenshot(SETTINGS.shots / f"{name}-{width}x{height}-{scheme}.png")
                found = self.browser.script(
                    AXE + "; return axe.run({ preload: false, resultTypes: ['violations'] })"
                    ".then(all => all.violations.flatMap(({ help, nodes }) => nodes.map(node => [help, node.html])))")
                self.assertEqual(found, [], f"{name}, {width} x {height}, {scheme}")
        self.browser.scheme("light")
        self.browser.size(*sizes[0])

    def choose_photo(self, path):
        self.browser.click("#photograph")
        self.browser.click(f"#choice input[value={SETTINGS.pattern}]")
        self.browser.type("#camera", str(path))

    def measure(self, path, outcome):
        self.choose_photo(path)
        self.browser.wait_for(outcome, MEASURE_PATIENCE_S)

    def unfold(self, number=1):
        """Opens the details of a row of the history, the newest first."""
        self.browser.script("document.querySelectorAll('#history .row button')[arguments[0] - 1].click()", number)
        self.browser.wait_for("#history .result")

    def history(self):
        return self.browser.script("return [...document.querySelectorAll('#history .row')].map(row => row.innerText)")

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
        self.look("first")
        page.click("#photograph")
        page.wait_for("#choice")
        self.look("choice")
        page.script("document.querySelector('#choice').close()")
        self.measure(SETTINGS.photo, "#answer")
        self.assertTrue(page.title().startswith("● "), page.title())
        value = NUMBER.search(page.text("#answer .value")).group()
        self.assertRegex(page.text("#answer .interval"), r"95 %: \d+\.\d+ to \d+\.\d+ s")
        self.assertIn("Good", page.text("#answer"))
        page.wait(lambda: page.script("return [...document.querySelectorAll('#answer > img')].every(i => i.naturalWidth > 0)"),
                  "for the picture")
        self.look("answer")
        page.click("#use")
        page.wait_for("#used", RUN_PATIENCE_S)
        page.wait_text("#in-force", value)
        self.assertFalse(page.present("#use"))
        self.look("used")
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
        self.look("refusal")
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
        self.look("empty")
        page.click("#jobs dialog[open] button.focus")
        page.wait_gone("#jobs dialog[open]")
        self.assertFalse(page.present("#run"))
        self.start_run()
        page.wait(lambda: page.script("return document.querySelector('#run progress')?.value > 0"), "for progress", RUN_PATIENCE_S)
        self.assertIn(page.text("#run .phase strong"), page.title())
        self.assertTrue(page.script("return document.querySelector('#photo_pattern').disabled"))
        self.look("run")
        page.click("#emergency")
        page.wait_for("#run dialog[open]")
        self.look("emergency")
        page.click("#run dialog[open] button.focus")
        self.assertTrue(page.present("#run"))
        self.stop_run()
        page.wait_text("#last-run", "stopped")
        self.assertTrue(page.title().startswith("● "), page.title())

    def test_a_laser_scan_is_stopped_in_mid_sweep_and_done_again(self):
        page = self.browser
        if SETTINGS.mock:
            self.skipTest("the mock's scan is over in a second")

        def scan():
            page.click("#pressure_advance")
            page.wait_for("#jobs dialog[open]")
            page.click("#jobs dialog[open] .primary")
            page.wait_text("#run .message", "scanning lines", RUN_PATIENCE_S)

        scan()
        page.wait(lambda: page.script("return document.querySelector('#live')?.naturalWidth > 100"), "for the camera's picture")
        self.stop_run()
        page.wait_text("#last-run", "stopped")
        self.assertFalse(page.present("#proposal"))
        scan()
        page.wait_gone("#run", RUN_PATIENCE_S)
        # A computer that is at work elsewhere places no frames, and says so.
        why = "return document.querySelector('#last-run')?.textContent ?? ''"  # also what is folded
        page.wait(lambda: page.present("#proposal") or re.search("frames|busy", page.script(why)), "for an answer")
        if page.present("#proposal"):
            self.assertRegex(page.text("#proposal"), r"95 %: \d+\.\d+ to \d+\.\d+ s")
            page.wait(lambda: page.script("return document.querySelector('#proposal img')?.naturalWidth > 0"), "for its graph")
            self.look("scanned")
            page.click("#drop")
            page.wait_gone("#proposal")

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
            page.close_tab()
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
            self.look("lost")
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

    def test_photos_as_phones_store_them(self):
        if not SETTINGS.phone_photos:
            self.skipTest("needs --phone-photos")
        for path in SETTINGS.phone_photos:
            begin = time.monotonic()
            self.measure(path, "#answer, #refusal")
            self.assertIn("Good", self.browser.text("#answer, #refusal"), path.name)
            print(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB, answered after {time.monotonic() - begin:.1f} s")

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
        # A ground of its own: the front end's may be dark where the owner's computer prefers light.
        self.assertEqual(page.script("return getComputedStyle(document.documentElement).backgroundColor"), "rgb(18, 22, 27)")
        self.assert_in_window("#photograph", 300)
        self.look("embed", [(400, 300)])
        self.measure(SETTINGS.photo, "#answer")
        self.assert_in_window("#use", 300)
        self.look("embed-answer", [(400, 300)])

    def assert_in_window(self, selector, height):
        box = self.browser.script("const b = document.querySelector(arguments[0]).getBoundingClientRect();"
                                  "const seen = document.elementFromPoint((b.left + b.right) / 2, (b.top + b.bottom) / 2);"
                                  "return [b.top, b.bottom, seen?.id]", selector)
        self.assertTrue(0 <= box[0] and box[1] <= height and box[2] == selector[1:], f"{selector}: {box}")

    def test_a_result_is_annotated_pinned_and_deleted(self):
        page = self.browser
        self.measure(SETTINGS.photo, "#answer")
        value = NUMBER.search(page.text("#answer .value")).group()
        page.wait(lambda: self.history() and value in self.history()[0], "for the result's row")
        self.unfold()
        page.wait(lambda: page.script("return document.querySelector('.result > img')?.naturalWidth > 0"), "for the picture")
        words = f"dry box, {time.time()}\nsecond line"
        page.type(".note-field", words.replace("\n", ENTER))
        page.click(".save-note")
        page.wait_text("#history .row", "second line")
        self.look("result")
        page.reload()
        page.wait_text("#history .row", "second line")
        self.unfold()
        self.assertEqual(page.script("return document.querySelector('.note-field').value"), words)
        page.click(".pin")
        page.wait_text("#history .row", "pinned")
        self.delete()
        page.wait_text("#status", "pinned")
        self.assertIn("second line", page.text("#history .row"))
        page.script("document.querySelector('.pin').scrollIntoView({block: 'center'})")  # away from the status line
        page.click(".pin")
        page.wait(lambda: "pinned" not in page.text("#history .row"), "for the result to be free")
        self.delete()
        page.wait(lambda: "second line" not in page.text("#history"), "for the row to go")
        page.reload()
        page.wait_for("#history")
        self.assertNotIn("second line", page.text("#history"))

    def delete(self):
        self.browser.click(".delete")
        self.browser.click(".result dialog[open] .danger")

    def test_two_results_are_compared_and_exported(self):
        page = self.browser
        for _ in range(2):
            self.measure(SETTINGS.photo, "#answer")
            self.visit()
        page.wait(lambda: len(self.history()) > 1, "for two rows")
        self.unfold()
        other = page.script("return document.querySelector('.compare').options[1].value")
        page.choose(".compare", other)
        page.wait_text(".changes", "no change that can be told")
        self.assertIn("95 %", page.text(".changes"))
        page.wait_for("#chart .point")
        self.look("compared")
        table = page.script("return fetch(document.querySelector('#export').href).then(answer => answer.text())")
        self.assertGreaterEqual(len(table.strip().splitlines()), 3, table)
        self.assertIn(other, table)

    def test_a_value_of_the_history_is_used_and_taken_back(self):
        page = self.browser
        before = page.text("#in-force")
        self.measure(SETTINGS.photo, "#answer")
        value = NUMBER.search(page.text("#answer .value")).group()
        self.visit()
        page.wait(lambda: self.history() and value in self.history()[0], "for the result's row")
        self.unfold()
        page.click(".use")
        page.wait_text("#in-force", value, RUN_PATIENCE_S)
        page.wait_text("#history .row", "set", RUN_PATIENCE_S)
        page.click(".take-back")
        page.click(".result dialog[open] .primary")
        page.wait_text("#in-force", before, RUN_PATIENCE_S)
        page.wait_text("#history .row", "taken back", RUN_PATIENCE_S)
        self.assertFalse(page.present(".take-back"))

    def test_nothing_is_wider_than_the_window(self):
        page = self.browser

        def check(what):
            for width in (320, 390, 1400):
                page.size(width, 700)
                wider = page.script("return [document.documentElement, ...document.querySelectorAll('dialog[open]')]"
                                    ".filter(e => e.scrollWidth > e.clientWidth).map(e => e.tagName)")
                self.assertEqual(wider, [], f"{what}, {width}")

        check("first")
        page.click("#photograph")
        page.wait_for("#choice")
        check("choice")
        self.assertLess(page.script("return document.querySelector('#choice h2').clientHeight"), 60)  # nothing is stretched
        page.click("#choice .buttons button:last-child")
        self.measure(SETTINGS.refused_photo, "#refusal")
        check("refusal")
        self.measure(SETTINGS.photo, "#answer")
        check("answer")
        page.wait(self.history, "for the history")
        self.unfold()
        page.type(".note-field", "W" * 300)
        page.click(".save-note")
        page.wait_text("#history .row", "WWW")
        page.script("document.querySelectorAll('details').forEach(one => one.open = true)")
        check("history")
        page.size(390, 844)
        self.assertEqual(page.script(
            "return [...document.querySelectorAll('button, select, textarea, summary, a, input:not([type=radio])')]"
            ".filter(e => e.checkVisibility() && e.getBoundingClientRect().height < 44).map(e => e.outerHTML)"), [])
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
        self.look("not-ready")

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
        self.look("setup")
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
                self.look("proposal")
            self.browser.click(button)
            self.browser.wait_gone("#proposal")
        self.browser.wait_text("#in-force", "0.0266 s")

    def test_a_value_is_copied_to_a_like_printer(self):
        page = self.browser
        page.wait_for("#history .row")
        self.unfold()
        self.assertRegex(page.text(".result"), r"Measured on voron.local, (today|yesterday|\d days ago)")
        value = NUMBER.search(self.history()[0]).group()
        page.click(".copy-to button")
        page.wait(lambda: page.script("return document.querySelector('#printer').value") == "1", "for the other printer")
        page.wait_text("#in-force", value, 30)
        page.choose("#printer", "0")
        page.wait_text("#in-force", " s")

    def test_what_is_due_leads_to_the_photo(self):
        page = self.browser
        page.wait_text("#due", "Generic PLA, 0.40 mm: the nozzle was changed")
        self.assertEqual(page.script("return document.querySelectorAll('#due button').length"), 3)
        self.look("due")
        page.click("#due button:nth-child(2)")
        page.wait_for("#choice")
        self.assertEqual(page.script("return document.querySelector('#filament').value"), "PETG Jet")
        page.script("document.querySelector('#choice').close()")
        page.choose("#printer", "1")
        page.wait_gone("#due")
        page.choose("#printer", "0")

    def test_a_scan_shows_its_camera_and_then_its_pictures(self):
        page = self.browser
        page.click("#pressure_advance")
        page.click("#jobs dialog[open] .primary")
        page.wait(lambda: page.present("#live") and page.script("return document.querySelector('#live').naturalWidth > 0"),
                  "for a frame")
        page.wait_text("#run .message", "line 5 of")
        frame = page.script("return document.querySelector('#live').src")
        page.wait(lambda: page.script("return document.querySelector('#live').src") not in (frame, None), "for the next frame")
        self.look("live")
        page.wait_for("#proposal", 30)
        asked = page.script("return performance.getEntriesByType('resource').filter(e => e.name.includes('now.jpg'))"
                            ".map(e => [e.startTime, e.responseEnd])")
        self.assertGreater(len(asked), 3)
        for before, after in zip(asked, asked[1:]):
            self.assertGreater(after[0], before[1] + 450)
        page.wait_for("#proposal > img")
        page.wait_text("#proposal", "Heights of the lines")
        self.assertIn("Response", page.text("#proposal"))
        self.look("scanned")
        page.click("#drop")
        page.wait_gone("#proposal")

    def test_tool_offsets_by_a_sheet(self):
        page = self.browser
        self.assertFalse(page.present("#offset_sheet"))
        page.click("#offsets summary")
        page.click("#offset_sheet")
        page.wait_text("#offsets dialog[open]", "its middle at X 150")
        page.type("#offsets dialog[open] input[name=tools]", "0,2")
        page.wait_text("#offsets dialog[open]", "T0,2 ready")
        self.look("sheet")
        page.click("#offsets dialog[open] .primary")
        page.wait_for("#run")
        page.wait_text("#last-run", "Scan the sheet", 60)
        with tempfile.NamedTemporaryFile(suffix=".tiff") as scan:
            scan.write(bytes(range(256)) * 100)
            scan.flush()
            page.type("#sheet", scan.name)
            sent = hashlib.sha256(pathlib.Path(scan.name).read_bytes()).hexdigest()[:8]
            page.wait_text("#run .message", f"sheet-tiff-{sent}")
        page.wait_text("#proposal", "T1 x +0.100", 60)
        page.wait(lambda: page.script("return document.querySelector('#proposal > img')?.naturalWidth > 0"), "for the arrows")
        self.look("offsets")
        page.click("#use-proposal")
        page.wait_gone("#proposal")

    def test_a_scan_that_is_refused(self):
        SETTINGS.mock.fault("upload", 415)
        self.browser.click("#offsets summary")
        self.browser.type("#sheet", str(SETTINGS.photo))
        self.browser.wait_text("#status", "PDF")
        self.browser.wait_for("#offset_scan")

    def test_taps_come_while_they_are_looked_at(self):
        page = self.browser
        page.wait_for("#taps")
        self.assertFalse(page.present("#taps .value"))
        page.click("#taps summary")
        newest = page.wait(lambda: page.text("#taps .row"), "for the taps")
        page.wait_for("#taps .point")
        SETTINGS.mock.fault("taps", 1)
        page.wait(lambda: page.text("#taps .row") != newest, "for a new tap")
        self.assertRegex(page.text("#taps .words"), r"^0\.\d{4} mm\s+95 %: ")
        page.script("document.querySelectorAll('#taps .row button')[2].click()")
        page.wait_for("#taps polyline")
        self.assertIn("drags plastic", page.text("#taps .row:has(+ .unfolded)"))
        self.assertFalse(page.present("#taps .unfolded circle"))
        page.click("#taps .row button")
        page.wait_text("#taps .unfolded", "contact")
        self.assertIn("at X 150.0, Y 140.5 mm", page.text("#taps .unfolded"))
        self.look("tap")
        page.choose("#printer", "1")
        page.wait_gone("#taps")
        page.choose("#printer", "0")

    def test_a_survey_picture_by_picture(self):
        page = self.browser
        page.click("#survey summary")
        for count in (1, 2, 3):
            page.type("#picture", str(SETTINGS.photo))
            page.wait_text("#survey", f"Pictures: {count}")
            page.wait(lambda: not page.script("return document.querySelector('#add-picture').disabled"), "for the answer")
        self.assertIn("In fewer than 6 pictures: 1, 2,", page.text("#survey"))
        page.wait_text("#survey .words", "no bar")
        for i, text in enumerate(("1", "2", "1000,5", "0.02")):
            page.type(f"#bars label:nth-of-type({i + 1}) input", text)
        self.look("bars")
        page.click("#save-bars")
        page.wait_text("#survey .words", "Good")
        page.wait_text("#bars summary", "Scale bars: 1")
        self.assertIn("within 0.039 mm", page.text("#survey"))
        self.look("survey")
        page.click("#survey td button")
        page.wait_text("#survey", "Pictures: 2")
        page.reload()
        page.click("#survey summary")
        page.wait_text("#survey", "Pictures: 2")
        page.click("#new-survey")
        page.wait_gone("#survey table")

    def test_a_long_history_is_filtered(self):
        page = self.browser
        page.wait_for("#more-rows")
        self.assertEqual(len(self.history()), 20)
        page.click("#more-rows")
        page.wait(lambda: len(self.history()) > 20, "for more rows")
        self.look("history")
        page.choose("#only-filament", "PETG Jet")
        page.wait(lambda: all("PETG Jet" in row for row in self.history()), "for the filament's rows")
        page.wait_text("#chart", "Pressure advance, PETG Jet")
        page.script("const point = [...document.querySelectorAll('#chart circle')].pop(), box = point.getBoundingClientRect();"
                    "point.dispatchEvent(new MouseEvent('click', {bubbles: true, clientX: box.left, clientY: box.top}))")
        page.wait_for(".result")
        self.assertEqual(page.text(".row:has(+ .unfolded)"), self.history()[-1])
        page.choose("#only-instrument", "tool_offset")
        page.wait(lambda: self.history() == [], "for no row of both")
        page.choose("#only-filament", "")
        page.wait_text("#history .row", "Tool offset")

    def test_a_result_without_files_can_only_be_read(self):
        page = self.browser
        page.wait_for("#history .row")
        gone = next(i for i, row in enumerate(self.history(), 1) if "0.0418" in row)
        self.unfold(gone)
        page.wait_text(".result", "were deleted")
        self.assertFalse(page.present(".delete"))
        self.assertFalse(page.present(".use"))

    def test_a_browser_without_storage(self):
        SETTINGS.mock.fault("script", "Object.defineProperty(window, 'localStorage', {get() { throw new Error('none') }});")
        self.visit()
        self.measure(SETTINGS.photo, "#answer")


def shell(command):
    return (lambda: subprocess.run(command, shell=True, check=True)) if command else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="the page's address, or mock")
    parser.add_argument("--browser", choices=web_driver.BROWSERS, default="chromium")
    parser.add_argument("--page", type=pathlib.Path, help="folder of the built page, for the mock")
    parser.add_argument("--photo", type=pathlib.Path, help="a photo with a good answer")
    parser.add_argument("--refused-photo", type=pathlib.Path, help="a photo without an answer")
    parser.add_argument("--phone-photos", type=pathlib.Path, nargs="*", help="more photos with a good answer")
    parser.add_argument("--material", help="the pattern's material, where the settings have none")
    parser.add_argument("--pattern", default="trammel", help="what the photos show: the value of the page's choice")
    parser.add_argument("--gone", type=shell, help="command that stops the server")
    parser.add_argument("--back", type=shell, help="command that starts it again")
    parser.add_argument("--shots", type=pathlib.Path, help="folder for pictures of the page")
    known, rest = parser.parse_known_args(namespace=SETTINGS)
    web_driver.require(known.browser)
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
