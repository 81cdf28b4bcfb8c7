"""Browsers by W3C WebDriver, with Python's standard library alone: Chromium, Firefox and WebKitGTK."""
import base64
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

import proxy

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key that W3C WebDriver gives to references of elements
PATIENCE_S = 60
SKIPPED = 77  # ctest's SKIP_RETURN_CODE


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def require(name):
    """Ends the process as skipped where a browser is missing."""
    for program, package in BROWSERS[name].needs.items():
        if not shutil.which(program):
            print(f"SKIPPED: {program} is missing; apt install {package}")
            sys.exit(SKIPPED)


class WebDriverError(Exception):
    pass


class Browser:
    """A browser's window. Elements are named by CSS selectors.

    Each kind of browser starts in a folder of its own, answers `call`, and says how it does what W3C WebDriver lacks.
    """

    needs = {}  # programs, and the packages that have them

    def __init__(self):
        self.proxy = proxy.Proxy()
        self.folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.processes = []
        try:
            self.start(pathlib.Path(self.folder.name))
        except BaseException:
            self.close()
            raise

    def run(self, *command, output=subprocess.DEVNULL, **environment):
        """Starts a program that ends with the browser."""
        environment = os.environ | {"HOME": self.folder.name} | environment
        self.processes.append(subprocess.Popen(command, stdout=output, stderr=subprocess.DEVNULL, text=True, env=environment))
        return self.processes[-1]

    def capabilities(self):
        # The proxy gives the page the name of a printer: its origin is insecure, as a printer's is.
        return {"proxy": {"proxyType": "manual", "socksProxy": self.proxy.address, "socksVersion": 5}}

    def close(self):
        for process in reversed(self.processes):
            process.terminate()
            process.wait()
            if process.stdout:
                process.stdout.close()
        self.proxy.close()
        self.folder.cleanup()

    def size(self, width, height):
        """Sets the page's size in CSS pixels, also below the least size of a window."""
        raise NotImplementedError

    def scheme(self, name):
        """Sets the colours that the page's owner prefers: light or dark."""
        raise NotImplementedError

    def log(self):
        """Returns the messages of errors and warnings since the last call."""
        raise NotImplementedError

    def upload_speed(self, bytes_a_second=None):
        """Bounds the network's speed; None takes the bound away."""
        self.proxy.upload_speed = bytes_a_second

    def open(self, url):
        self.call("POST", "/url", {"url": url})

    def reload(self):
        self.call("POST", "/refresh")

    def title(self):
        return self.call("GET", "/title")

    def script(self, body, *arguments):
        return self.call("POST", "/execute/sync", {"script": body, "args": list(arguments)})

    def new_tab(self):
        """Opens a tab and returns its handle; `tab` changes to it."""
        return self.call("POST", "/window/new", {"type": "tab"})["handle"]

    def tab(self, handle=None):
        if handle is None:
            return self.call("GET", "/window")
        return self.call("POST", "/window", {"handle": handle})

    def close_tab(self):
        self.call("DELETE", "/window")

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.call("GET", "/screenshot")))

    def element(self, selector):
        return self.call("POST", "/element", {"using": "css selector", "value": selector})[ELEMENT]

    def present(self, selector):
        """Is an element there and visible?"""
        return self.script("const e = document.querySelector(arguments[0]); return !!e && e.checkVisibility();", selector)

    def text(self, selector):
        """Returns the visible text, or "" without the element."""
        return self.script("return document.querySelector(arguments[0])?.innerText ?? ''", selector)

    def click(self, selector):
        """Clicks as soon as the element is there, enabled and not covered."""
        def clicked():
            try:
                element = self.element(selector)
                if not self.call("GET", f"/element/{element}/enabled"):
                    return False
                self.call("POST", f"/element/{element}/click")
                return True
            except WebDriverError as error:
                if re.match("no such element|stale|element not interactable|element click intercepted", str(error)):
                    return False
                raise
        self.wait(clicked, f"to click {selector}")

    def type(self, selector, text):
        self.call("POST", f"/element/{self.element(selector)}/value", {"text": text})

    def choose(self, selector, value):
        """Chooses an option of a select by its value, as soon as it is there."""
        self.wait_for(selector)
        self.script("const e = document.querySelector(arguments[0]); e.value = arguments[1];"
                    "e.dispatchEvent(new Event('change', {bubbles: true}))", selector, value)

    def wait(self, condition, what, patience_s=PATIENCE_S):
        """Returns the condition's first true value."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            if value := condition():
                return value
            time.sleep(0.05)
        raise AssertionError(f"waited {patience_s} s in vain {what}; the page reads:\n{self.text('body')}")

    def wait_text(self, selector, part, patience_s=PATIENCE_S):
        return self.wait(lambda: part in self.text(selector) and self.text(selector), f"for '{part}' in {selector}", patience_s)

    def wait_for(self, selector, patience_s=PATIENCE_S):
        return self.wait(lambda: self.present(selector), f"for {selector}", patience_s)

    def wait_gone(self, selector, patience_s=PATIENCE_S):
        return self.wait(lambda: not self.present(selector), f"for {selector} to go", patience_s)


class HttpBrowser(Browser):
    """A browser whose driver is a program that speaks HTTP."""

    def begin(self, program, capabilities, **environment):
        port = free_port()
        self.address = f"http://127.0.0.1:{port}"
        self.run(program, f"--port={port}", **environment)
        self.path = ""
        self.wait(self.is_ready, f"for {program}")
        answer = self.call("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
        self.path = "/session/" + answer["sessionId"]

    def is_ready(self):
        try:
            return self.call("GET", "/status")["ready"]
        except OSError:
            return False

    def call(self, method, path, body=None):
        data = None if method in ("GET", "DELETE") else json.dumps(body or {}).encode()
        request = urllib.request.Request(self.address + self.path + path, data, method=method)
        request.add_header("Content-Type", "application/json")
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            value = json.load(error)["value"]
            raise WebDriverError(f"{value['error']}: {value['message']}") from None

    def close(self):
        try:
            if getattr(self, "path", ""):
                self.call("DELETE", "")
        finally:
            super().close()


class Chromium(HttpBrowser):
    needs = {"chromedriver": "chromium-driver"}

    def start(self, folder):
        # A sandbox needs rights that containers lack.
        options = {"args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]}
        if os.path.exists("/usr/bin/chromium"):
            options["binary"] = "/usr/bin/chromium"
        self.begin("chromedriver", self.capabilities() | {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}})

    def devtools(self, command, **parameters):
        return self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def size(self, width, height):
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def scheme(self, name):
        self.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def log(self):
        return [entry["message"] for entry in self.call("POST", "/se/log", {"type": "browser"})]


class Firefox(Browser):
    """Firefox by Marionette, as geckodriver speaks it: [type, number, command, parameters], each after its length."""

    needs = {"firefox-esr": "firefox-esr"}
    commands = {"POST /url": "Navigate", "POST /refresh": "Refresh", "GET /title": "GetTitle",
                "POST /execute/sync": "ExecuteScript", "GET /screenshot": "TakeScreenshot", "POST /window/new": "NewWindow",
                "GET /window": "GetWindowHandle", "POST /window": "SwitchToWindow", "DELETE /window": "CloseWindow",
                "POST /element": "FindElement", "GET /element/enabled": "IsElementEnabled",
                "POST /element/click": "ElementClick", "POST /element/value": "ElementSendKeys"}

    def start(self, folder):
        (folder / "user.js").write_text('user_pref("marionette.port", 0);', encoding="utf-8")
        # System access: the browser's own scripts reach what WebDriver lacks.
        self.run("firefox-esr", "--headless", "--marionette", "--remote-allow-system-access", "--no-remote", "--profile", folder)
        port = folder / "MarionetteActivePort"
        end = time.monotonic() + PATIENCE_S
        while not (port.exists() and port.read_text(encoding="utf-8")):
            if time.monotonic() > end:
                raise WebDriverError("firefox-esr did not start")
            time.sleep(0.05)
        self.link = socket.create_connection(("127.0.0.1", int(port.read_text(encoding="utf-8"))), timeout=120)
        self.answers = self.link.makefile("rb")
        self.message()  # of welcome
        self.request("WebDriver:NewSession", self.capabilities())

    def close(self):
        if hasattr(self, "link"):
            self.answers.close()
            self.link.close()
        super().close()

    def message(self):
        length = b""
        while not length.endswith(b":"):
            if not (digit := self.answers.read(1)):
                raise WebDriverError("firefox-esr ended")
            length += digit
        return json.loads(self.answers.read(int(length[:-1])))

    def request(self, command, parameters):
        data = json.dumps([0, 1, command, parameters]).encode()
        self.link.sendall(b"%d:" % len(data) + data)
        _, _, error, result = self.message()
        if error:
            raise WebDriverError(f"{error['error']}: {error['message']}")
        return result.get("value", result) if isinstance(result, dict) else result

    def call(self, method, path, body=None):
        parameters = dict(body or {})
        if match := re.fullmatch("/element/(.+)/(.+)", path):
            parameters["id"], path = match.group(1), f"/element/{match.group(2)}"
        return self.request("WebDriver:" + self.commands[f"{method} {path}"], parameters)

    def own_script(self, body, *arguments):
        """Runs a script as the browser's own."""
        self.request("Marionette:SetContext", {"value": "chrome"})
        try:
            return self.script(body, *arguments)
        finally:
            self.request("Marionette:SetContext", {"value": "content"})

    def size(self, width, height):
        self.own_script("const style = gBrowser.selectedBrowser.style;"
                        "for (const [side, px] of [['width', arguments[0]], ['height', arguments[1]]])"
                        "  for (const bound of ['', 'min-', 'max-']) style.setProperty(bound + side, px + 'px')", width, height)
        self.wait(lambda: self.script("return [innerWidth, innerHeight]") == [width, height], "for the size")

    def scheme(self, name):
        self.own_script("Services.prefs.setIntPref('layout.css.prefers-color-scheme.content-override', arguments[0])",
                        ["dark", "light"].index(name))

    def log(self):
        return self.own_script("const all = Services.console.getMessageArray(); Services.console.reset();"
                               "return all.filter(one => one instanceof Ci.nsIScriptError && one.sourceName.startsWith('http'))"
                               "  .map(one => one.errorMessage)")


class WebKit(HttpBrowser):
    """WebKitGTK's MiniBrowser, on a screen of its own."""

    needs = {"WebKitWebDriver": "webkit2gtk-driver", "Xvfb": "xvfb"}

    def start(self, folder):
        print("NOT CHECKED in WebKitGTK: messages of errors and warnings, and the preference of dark colours", file=sys.stderr)
        screen = self.run("Xvfb", "-displayfd", "1", "-screen", "0", "1600x1600x24", "-nolisten", "tcp", output=subprocess.PIPE)
        # Without it the window's own buttons make it 447 px wide.
        (folder / "gtk-3.0").mkdir()
        (folder / "gtk-3.0/gtk.css").write_text("* { min-width: 0; padding: 0; margin: 0; font-size: 1px }", encoding="utf-8")
        # The driver's own proxy setting would leave names to this computer.
        options = {"args": ["--automation", f"--proxy=socks5://{self.proxy.address}"]}
        self.begin("WebKitWebDriver", {"webkitgtk:browserOptions": options},
                   DISPLAY=":" + screen.stdout.readline().strip(), XDG_CONFIG_HOME=str(folder))

    def size(self, width, height):
        above = self.script("return outerHeight - innerHeight")
        self.call("POST", "/window/rect", {"width": width, "height": height + above})
        self.wait(lambda: self.script("return [innerWidth, innerHeight]") == [width, height], "for the size")

    def scheme(self, name):
        self.script("document.documentElement.dataset.theme = arguments[0]", name)  # the page's own switch

    def log(self):
        return []  # it tells nobody


BROWSERS = {"chromium": Chromium, "firefox": Firefox, "webkit": WebKit}
