#!/usr/bin/env python3
"""A stand-in for the panel's server: the page's files, its protocol, and the faults of broken and slow servers.

    mock_panel.py FOLDER PORT     FOLDER has index.html, panel.js and panel.css

A photo is good if it holds the bytes "good". POST mock {"fault": NAME, "value": …} sets a fault: slow (seconds before each
answer), deaf (no answers), garbage (broken frames before each answer), error (each method fails with this text), upload
(an HTTP status), status (keys that replace those of the status).
"""
import http.server
import json
import mimetypes
import pathlib
import sys
import threading
import time

import web_socket

IMAGES = pathlib.Path(__file__).resolve().parents[2] / "docs/images"
CSP = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'"
NAMES = ["voron.local", "ender"]
BROKEN = ["{", "null", "[]", '"text"', '{"id": 99999}', '{"method": "run"}', '{"method": "run", "params": {"printer": 0}}']
PHASES = [("checking", 0.0), ("homing", 0.05), ("heating", 0.1), ("heating", 0.2), *(("printing", i / 10) for i in range(3, 9)),
          ("restoring", 0.95)]
STEP_S = {"photo_pattern": 2}  # a print that lasts while others look; the rest 0.5 s
GOOD_WORDS = "0.0365 s (95 %: 0.0331 to 0.0400 s)"
REFUSED = "The picture shows 18 of 21 lines. Take it again with all lines and the filled corner in it."
LINES = [("Klipper", "SET_PRESSURE_ADVANCE ADVANCE=0.0365", "pressure_advance under [extruder] in printer.cfg"),
         ("OrcaSlicer", "0.0365", "Pressure advance of the filament"), ("Marlin", "M900 K0.0365", "M500"),
         ("RepRapFirmware", "M572 D0 S0.0365", "config.g"),
         ("Bambu", "M900 K0.0365 L1000 M10", "the end of the filament's start G-code")]


class Panel:
    """The printers, and whoever watches them."""

    def __init__(self):
        self.lock, self.watchers, self.faults, self.photos = threading.RLock(), [], {}, {}
        self.seq = self.number = 0
        self.printers = [{"in_force": force, "run": None, "proposal": None, "setup": False} for force in ("0.0450 s", "0.0200 s")]
        self.results = [result("0.0412"), result("0.0450", applied=True), result("")]

    def notify(self, method, printer, **params):
        with self.lock:
            self.seq += 1
            params |= {"seq": self.seq, "printer": printer}
            for watcher in list(self.watchers):
                watcher.send(json.dumps({"jsonrpc": "2.0", "method": method, "params": params}))

    def start(self, printer, job, arguments):
        here = self.printers[printer]
        if here["run"] and not here["run"]["complete"]:
            raise ValueError("A job runs: wait for its end, or stop it.")
        self.number += 1
        here["stop"] = threading.Event()
        nothing = dict.fromkeys(("ended", "progress", "remaining_s", "end", "verdict"))
        here["run"] = nothing | {"run": f"{job}-{self.number}", "job": job, "arguments": arguments, "folder": "/x", "started": "",
                                 "phase": "starting", "message": "", "complete": False}
        threading.Thread(target=self.work, args=(printer, here["run"]), daemon=True).start()
        return {"run": here["run"]["run"]}

    def work(self, printer, run):
        here = self.printers[printer]
        steps = PHASES[:1] if run["job"] == "apply" else PHASES
        for index, (phase, progress) in enumerate(steps):
            run |= {"phase": phase, "progress": progress, "remaining_s": 20.0 * (len(steps) - index), "message": f"step {index + 1}"}
            self.notify("run", printer, run=dict(run))
            if here["stop"].wait(STEP_S.get(run["job"], 0.5)):
                break
        if run["job"] == "apply" and here["proposal"]:
            here["in_force"] = here["proposal"]["answer"].split(" = ")[1].split(" (")[0]
            here["proposal"] = None
        if run["job"] == "pressure_advance" and not here["stop"].is_set():
            here["proposal"] = {"run": run["run"], "job": run["job"], "folder": "/x", "arguments": {},
                                "answer": "pressure_advance = 0.0266 s (95 %: 0.0239 to 0.0293 s)"}
        run |= {"phase": "ended", "complete": True, "end": "stopped" if here["stop"].is_set() else "done", "progress": None,
                "remaining_s": None, "message": "everything is off"}
        self.notify("run", printer, run=dict(run))
        self.notify("changed", printer)

    def answer(self, method, params):
        if "error" in self.faults:
            raise ValueError(self.faults["error"])
        here = self.printers[printer := params.get("printer", 0)]
        if method == "printers":
            return {"printers": [{"printer": i, "name": name} for i, name in enumerate(NAMES)]}
        if method == "status":
            jobs = [{"job": job, "arguments": [], "blocker": "no laser is set up" if printer else None}
                    for job in ("pressure_advance", "photo_pattern", "apply")]
            status = {"api_version": 1, "version": "1.0", "printer": {"address": NAMES[printer], "readiness": "ready", "message": ""},
                      "jobs": jobs, "busy": False, "run": here["run"], "proposal": here["proposal"], "in_force": here["in_force"]}
            return status | self.faults.get("status", {})
        if method == "start":
            return self.start(printer, params["job"], params["arguments"])
        if method in ("stop", "emergency_stop"):
            here["stop"].set()
            return {"run": params.get("run")}
        if method == "dismiss":
            waited, here["proposal"] = here["proposal"], None
            self.notify("changed", printer)
            return {"dismissed": waited is not None}
        if "set" in method:
            here["setup"] = {"set_up": True, "undo_set_up": False}.get(method, here["setup"])
            changes = [{"file": "printer.cfg", "change": "new first line: [include trammel.cfg]"}]
            return {"has_macros": here["setup"], "can_undo": here["setup"], "changes": [] if here["setup"] else changes,
                    "missing": [{"section": "[respond]", "purpose": "dialogs"}]}
        if method == "history":
            return {"results": self.results[: params["last"]]}
        if method == "measure":
            time.sleep(1)
            good = b"good" in self.photos[params["run"]]
            self.results.insert(0, result("0.0365" if good else ""))
            return {"run": params["run"], "verdict": "good" if good else "refused", "words": GOOD_WORDS if good else REFUSED,
                    "value_s": 0.0365 if good else None, "interval95_s": [0.0331, 0.04] if good else None, "notices": [],
                    "lines": [dict(zip(("firmware", "text", "keep"), line)) for line in LINES] if good else [],
                    "pictures": ["answer.png", "photo.png"] if good else ["photo.png"], "report": "report.html" if good else None}
        if method == "use":
            here["proposal"] = {"run": params["run"], "job": "photo", "folder": "/x", "arguments": {},
                                "answer": f"pressure_advance = {GOOD_WORDS}"}
            return self.start(printer, "apply", {})
        raise ValueError(f"there is no method {method}")


def result(value, applied=False):
    answer = {"name": "pressure_advance", "unit": "s", "verdict": "good" if value else "refused", "reason": "" if value else REFUSED,
              "value": float(value) if value else None, "standard_uncertainty": 0.0014 if value else None,
              "interval95": [float(value) - 0.0027, float(value) + 0.0027] if value else None,
              "words": f"{value} s (95 %: 0.0338 to 0.0392 s)" if value else REFUSED}
    return {"utc": "2026-11-29T18:03:00Z", "instrument": "pressure_advance", "verdict": answer["verdict"], "reason": answer["reason"],
            "answers": [answer], "subject": {"filament": "Generic PLA"}, "folder": f"/x/{time.monotonic()}",
            "applied": [{"utc": "2026-11-29T18:05:00Z"}] if applied else []}


class Handler(http.server.BaseHTTPRequestHandler):
    panel, folder = Panel(), pathlib.Path(".")
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def reply(self, status, body, media="application/json"):
        body = body if isinstance(body, bytes) else json.dumps(body).encode()
        self.send_response(status)
        self.send_headers(("Content-Type", media), ("Content-Length", str(len(body))), ("Content-Security-Policy", CSP))
        self.wfile.write(body)

    def send_headers(self, *headers):
        for header in headers:
            self.send_header(*header)
        self.end_headers()

    def do_GET(self):
        path = self.path.partition("?")[0]
        name = path.rpartition("/")[2] or "index.html"
        if name == "ws":
            return self.serve_link()
        if "/runs/" in path:
            picture = "response-real-photo.png" if name == "answer.png" else "photo.jpg"
            return self.reply(200, (IMAGES / picture).read_bytes(), "image/png")
        if (self.folder / name).is_file():
            return self.reply(200, (self.folder / name).read_bytes(), mimetypes.guess_type(name)[0])
        self.reply(404, {"error": "not here"})

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        if self.path == "/mock":
            fault = json.loads(body)
            self.panel.faults = {fault["fault"]: fault.get("value")} if fault["fault"] else {}
        elif "upload" in self.panel.faults:
            return self.reply(self.panel.faults["upload"], b"no")
        elif self.path.endswith("/photos"):
            run = f"photo-{len(self.panel.photos) + 1}"
            self.panel.photos[run] = body
            return self.reply(200, {"run": run})
        self.reply(200, {})

    def serve_link(self):
        link = web_socket.WebSocket(self)
        self.panel.watchers.append(link)
        for text in link.texts():
            threading.Thread(target=self.serve_call, args=(link, json.loads(text)), daemon=True).start()
        self.panel.watchers.remove(link)

    def serve_call(self, link, call):
        faults, answer = self.panel.faults, {"jsonrpc": "2.0", "id": call["id"]}
        if "deaf" in faults:
            return
        time.sleep(faults.get("slow", 0))
        for broken in BROKEN if "garbage" in faults else ():
            link.send(broken)
        try:
            answer["result"] = self.panel.answer(call["method"], call["params"])
        except (ValueError, KeyError) as error:
            answer["error"] = {"code": -32003, "message": str(error)}
        link.send(json.dumps(answer))


def main():
    Handler.folder = pathlib.Path(sys.argv[1])
    http.server.ThreadingHTTPServer(("127.0.0.1", int(sys.argv[2])), Handler).serve_forever()


if __name__ == "__main__":
    main()
