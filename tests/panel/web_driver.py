"""A browser by W3C WebDriver over HTTP: chromedriver and a headless Chromium, with Python's standard library alone."""
import base64
import json
import os
import re
import shutil
import subprocess
import sys
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key that W3C WebDriver gives to references of elements
PATIENCE_S = 60
SKIPPED = 77  # ctest's SKIP_RETURN_CODE


def require():
    """Ends the process as skipped where there is no browser."""
    if not shutil.which("chromedriver"):
        print("SKIPPED: chromedriver is missing; apt install chromium-driver")
        sys.exit(SKIPPED)


class WebDriverError(Exception):
    pass


class Driver:
    """A running chromedriver. Sessions are browsers of their own."""

    def __init__(self, program="/usr/bin/chromedriver"):
        self.process = subprocess.Popen([program, "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        for line in self.process.stdout:
            if match := re.search(r"successfully on port (\d+)", line):
                self.address = f"http://127.0.0.1:{match.group(1)}"
                return
        raise WebDriverError(f"{program} did not start")

    def request(self, method, path, body=None):
        data = None if method in ("GET", "DELETE") else json.dumps(body or {}).encode()
        request = urllib.request.Request(self.address + path, data, {"Content-Type": "application/json"}, method=method)
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        try:
            with opener.open(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            value = json.load(error)["value"]
            raise WebDriverError(f"{value['error']}: {value['message']}") from None

    def browser(self, arguments=()):
        return Browser(self, arguments)

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()


class Browser:
    """A browser's window. Elements are named by CSS selectors."""

    def __init__(self, driver, arguments):
        # A sandbox needs rights that containers lack. The name makes the page's origin insecure, as a printer's is.
        options = {"args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-proxy-server",
                            "--host-resolver-rules=MAP printer.test 127.0.0.1", "--window-size=1400,900", *arguments]}
        if os.path.exists("/usr/bin/chromium"):
            options["binary"] = "/usr/bin/chromium"
        capabilities = {"alwaysMatch": {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}}
        self.driver = driver
        self.path = "/session/" + driver.request("POST", "/session", {"capabilities": capabilities})["sessionId"]

    def call(self, method, path, body=None):
        return self.driver.request(method, self.path + path, body)

    def close(self):
        self.call("DELETE", "")

    def open(self, url):
        self.call("POST", "/url", {"url": url})

    def reload(self):
        self.call("POST", "/refresh")

    def title(self):
        return self.call("GET", "/title")

    def script(self, body, *arguments):
        return self.call("POST", "/execute/sync", {"script": body, "args": list(arguments)})

    def devtools(self, command, **parameters):
        return self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def size(self, width, height):
        """Sets the page's size in CSS pixels, also below the least size of a window."""
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def scheme(self, name):
        self.devtools("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": name}])

    def upload_speed(self, bytes_a_second):
        """Bounds the network's speed; -1 takes the bound away."""
        self.devtools("Network.enable")
        self.devtools("Network.emulateNetworkConditions", offline=False, latency=0, downloadThroughput=-1, uploadThroughput=bytes_a_second)

    def new_tab(self):
        """Opens a tab and returns its handle; `tab` changes to it."""
        return self.call("POST", "/window/new", {"type": "tab"})["handle"]

    def tab(self, handle=None):
        if handle is None:
            return self.call("GET", "/window")
        return self.call("POST", "/window", {"handle": handle})

    def log(self):
        """Returns the messages of errors and warnings since the last call."""
        return [entry["message"] for entry in self.call("POST", "/se/log", {"type": "browser"})]

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
        """Chooses an option of a select by its value."""
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
