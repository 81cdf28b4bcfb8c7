#!/usr/bin/env python3
"""Prints how long an owner waits: for the page on a computer six times slower than this, and for a photo's answer on one core.

    page_speed.py TRAMMEL TRAMMEL_SIM PAGE      PAGE is the folder of the built page, for the mock

First paint and first contentful paint count from the navigation, the interaction from the click until its dialog is painted
(Event Timing). Medians of 11 loads in Chromium, its cache empty. Also prints the memory of the idle service.
"""
import os
import pathlib
import re
import statistics
import sys
import tempfile
import time

import journey_test
import virtual_printer_test
import web_driver

LOADS = 11
SLOWER = 6
PHOTO = "3024x4032"  # 12 megapixels
CORE = {0}
# An event that is painted sooner than 16 ms after it is not reported.
SCRIPT = """
const paint = name => performance.getEntriesByName(name)[0]?.startTime;
const waits = window.events.filter(one => one.interactionId).map(one => one.duration);
return document.querySelector("#choice").open && paint("first-contentful-paint")
  && [paint("first-paint"), paint("first-contentful-paint"), Math.max(16, ...waits)]"""
WATCH = """
window.events = [];
new PerformanceObserver(list => window.events.push(...list.getEntries())).observe({type: "event", durationThreshold: 16})"""


def load(browser, url):
    browser.devtools("Network.clearBrowserCache")
    browser.open(url)
    browser.script(WATCH)
    browser.click("#photograph")
    return browser.wait(lambda: browser.script(SCRIPT), "for the dialog")


def print_page(name, url):
    browser = web_driver.Chromium()
    try:
        browser.size(390, 844)
        browser.devtools("Network.enable")
        browser.devtools("Emulation.setCPUThrottlingRate", rate=SLOWER)
        loads = [load(browser, url) for _ in range(LOADS)]
    finally:
        browser.close()
    for what, times in zip(("first paint", "first contentful paint", "interaction"), zip(*loads)):
        print(f"{name}: {what} {statistics.median(times):.0f} ms ({min(times):.0f} to {max(times):.0f})")


def print_photo(url, path):
    browser = web_driver.Chromium()
    try:
        browser.open(url)
        browser.click("#photograph")
        browser.click("#choice input[value=orca-line]")
        begin = time.monotonic()
        browser.type("#camera", str(path))
        browser.wait_for("#measuring")
        sent = time.monotonic()
        browser.wait_for("#answer")
        print(f"photo of {path.stat().st_size / 1e6:.1f} MB: sent in {sent - begin:.1f} s, "
              f"answered {time.monotonic() - sent:.1f} s later on one core")
    finally:
        browser.close()


def memory_mb(process):
    status = pathlib.Path(f"/proc/{process}/status").read_text(encoding="utf-8")
    return int(re.search(r"VmRSS:\s+(\d+) kB", status).group(1)) / 1000


def main(trammel, sim, page):
    trammel, sim = os.path.abspath(trammel), os.path.abspath(sim)
    web_driver.require("chromium")
    mock = journey_test.Mock(page)
    try:
        print_page("mock", f"http://printer.test:{mock.port}/")
    finally:
        mock.gone()
    with tempfile.TemporaryDirectory() as name:
        os.environ.update(HOME=name, XDG_STATE_HOME=name, XDG_DATA_HOME=name)
        folder = pathlib.Path(name)
        photo = virtual_printer_test.photo(sim, folder, "photo.jpg", PHOTO)
        all_cores = os.sched_getaffinity(0)
        os.sched_setaffinity(0, CORE)  # what is started here keeps it
        server = virtual_printer_test.Server(trammel, sim, folder)
        os.sched_setaffinity(0, all_cores)
        try:
            url = f"http://printer.test:{server.port}/"
            print_page("trammel serve", url)
            print(f"idle service: {memory_mb((folder / 'serve.pid').read_text()):.0f} MB")
            print_photo(url, photo)
        finally:
            server.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
