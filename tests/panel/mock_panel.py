#!/usr/bin/env python3
"""A stand-in for the panel's server: the page's files, its protocol, and the faults of broken and slow servers.

    mock_panel.py FOLDER PORT     FOLDER has index.html, panel.js and panel.css

A photo is good if it holds the bytes "good". POST mock {"fault": NAME, "value": …} sets a fault: slow (seconds before each
answer), deaf (no answers), garbage (broken frames before each answer), error (each method fails with this text), upload
(an HTTP status), status (keys that replace those of the status), script (what the page's script begins with), taps (so many
more).
"""
import datetime
import hashlib
import http.server
import json
import math
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
          ("scanning", 0.9), ("scanning", 0.92), ("restoring", 0.95)]
DUE = [("Generic PLA", "the nozzle was changed"), ("PETG Jet", "the last answer is 200 days old"), ("ASA", "no answer yet"),
       ("TPU", "no answer yet")]
STEP_S = {"photo_pattern": 5}  # a print that lasts while others look; the rest 0.5 s
GOOD_WORDS = "0.0365 s (95 %: 0.0331 to 0.0400 s)"
REFUSED = "The picture shows 18 of 21 lines. Take it again with all lines and the filled corner in it."
OFFSETS = "tool offsets T1 x +0.100, y -0.050 mm (95 %: within 0.0020 mm)"
LINES = [("Klipper", "SET_PRESSURE_ADVANCE ADVANCE=0.0365", "pressure_advance under [extruder] in printer.cfg"),
         ("OrcaSlicer", "0.0365", "Pressure advance of the filament"), ("Marlin", "M900 K0.0365", "M500"),
         ("RepRapFirmware", "M572 D0 S0.0365", "config.g"),
         ("Bambu", "M900 K0.0365 L1000 M10", "the end of the filament's start G-code")]


class Panel:
    """The printers, and whoever watches them."""

    def __init__(self):
        self.lock, self.watchers, self.faults, self.photos = threading.RLock(), [], {}, {}
        self.seq = self.number = 0
        self.pictures, self.bars = [], []
        self.printers = [{"in_force": force, "run": None, "proposal": None, "setup": False} for force in ("0.0450 s", "0.0200 s")]
        self.results, self.frames = first_results(), 0

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
                                 "phase": "starting", "message": "", "complete": False, "looks": job == "pressure_advance"}
        threading.Thread(target=self.work, args=(printer, here["run"]), daemon=True).start()
        return {"run": here["run"]["run"]}

    def work(self, printer, run):
        here = self.printers[printer]
        steps = PHASES[:1] if run["job"] == "apply" else PHASES
        for index, (phase, progress) in enumerate(steps):
            run |= {"phase": phase, "progress": progress, "remaining_s": 20.0 * (len(steps) - index),
                    "message": run["arguments"].get("file") or f"line {index + 1} of {len(steps)}"}
            self.notify("run", printer, run=dict(run))
            if here["stop"].wait(STEP_S.get(run["job"], 0.5)):
                break
        if run["job"] == "apply" and here["proposal"]:
            if " = " in here["proposal"]["answer"]:
                here["in_force"] = here["proposal"]["answer"].split(" = ")[1].split(" (")[0]
            here["proposal"] = None
        if run["job"] == "pressure_advance" and not here["stop"].is_set():
            measured = result("0.0266", run=run["run"])
            self.results.insert(0, measured | {"pictures": ["answer.png", "height_maps.png", "response.png"]})
            here["proposal"] = {"run": run["run"], "job": run["job"], "folder": "/x", "arguments": {},
                                "answer": "pressure_advance = 0.0266 s (95 %: 0.0239 to 0.0293 s)"}
        if run["job"] == "offset_scan" and not here["stop"].is_set():
            self.results.insert(0, offsets(0, run["run"]))
            here["proposal"] = {"run": run["run"], "job": run["job"], "folder": "/x", "arguments": {}, "answer": OFFSETS}
        run |= {"phase": "ended", "complete": True, "end": "stopped" if here["stop"].is_set() else "done", "progress": None,
                "remaining_s": None, "message": "everything is off"}
        self.notify("run", printer, run=dict(run))
        self.notify("changed", printer)

    def survey(self, run, bars=None, without=None, printer=0):
        self.bars = bars or self.bars
        self.pictures = [name for name in self.pictures if name != without]
        seen = len(self.pictures)
        good = seen > 2 and self.bars
        return {"run": run, "verdict": "good" if good else "cannot_tell",
                "reason": "" if good else "no bar" if seen > 2 else f"{seen} of {seen} pictures show four coded targets; 6 are the least",
                "pictures": [{"picture": name, "targets": 12, "reason": None} for name in self.pictures],
                "targets": [{"target": str(i), "pictures": seen - i % 2, "standard_uncertainty_mm": [0.01, 0.01, 0.02] if good else None}
                            for i in range(1, 9)],
                "bars": self.bars, "advice": ["more pictures from the +z side"], "notices": [], "unchecked": [],
                "files": ["report.html", "surveyed.csv", "surveyed.json"] if good else ["report.html"]}

    def answer(self, method, params):
        if "error" in self.faults:
            raise ValueError(self.faults["error"])
        here = self.printers[printer := params.get("printer", 0)]
        if method == "printers":
            return {"printers": [{"printer": i, "name": name, "subject": name, "nozzle": "0.40"} for i, name in enumerate(NAMES)],
                    "surveys": True}
        if method == "survey":
            return self.survey(**params)
        if method == "taps":
            newest = 19 + self.faults.get("taps", 0)
            return {"taps": [] if printer else [tap(i) for i in range(newest, newest - 20, -1)], "watching": printer == 0}
        if method == "tap":
            one = tap(int(params["tap"][4:]))
            z_mm = [abs(i - 150) / 1000 - 0.05 for i in range(300)]
            force_g = [max(0, 0.02 - z) * 5000 + 3 * math.sin(i) for i, z in enumerate(z_mm)]
            return one | {"curve": {"time_s": [i / 1000 for i in range(300)], "z_mm": z_mm, "force_g": force_g,
                                    "contact_time_s": 0.22, "contact_force_g": 0.5 if one["contact_z_mm"] else None}}
        if method == "due":
            due = [{"instrument": "pressure_advance", "subject": {"filament": filament, "nozzle": "0.40"}, "reasons": [reason],
                    "last_good": ""} for filament, reason in DUE]
            return {"due": [] if printer else due}
        if method in ("compare", "annotate", "delete"):
            return getattr(self, method)(params)
        if method == "undo":
            return self.take_back(printer, params["instrument"])
        if method == "status":
            by_paper = () if printer else ("offset_sheet", "offset_scan")
            jobs = [{"job": job, "arguments": [], "blocker": "no laser is set up" if printer else None}
                    for job in ("pressure_advance", "photo_pattern", "apply", *by_paper)]
            status = {"api_version": 1, "version": "1.0", "printer": {"address": NAMES[printer], "readiness": "ready", "message": ""},
                      "jobs": jobs, "busy": False, "run": here["run"], "proposal": here["proposal"], "in_force": here["in_force"]}
            return status | self.faults.get("status", {})
        if method == "offer":
            tools = params["arguments"].get("tools", "0,1")
            paper = f"Is A4 paper taped flat on the COLD bed, its middle at X 150, Y 150, and are T{tools} ready?"
            return {"question": paper if params["job"] == "offset_sheet" else ""}
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
            self.results.insert(0, result("0.0365" if good else "", run=params["run"]))
            return {"run": params["run"], "verdict": "good" if good else "refused", "words": GOOD_WORDS if good else REFUSED,
                    "value_s": 0.0365 if good else None, "interval95_s": [0.0331, 0.04] if good else None, "notices": [],
                    "lines": [dict(zip(("firmware", "text", "keep"), line)) for line in LINES] if good else [],
                    "pictures": ["answer.png", "photo.png"] if good else ["photo.png"], "report": "report.html" if good else None}
        if method == "use":
            return self.use(printer, params["run"])
        raise ValueError(f"there is no method {method}")

    def found(self, run):
        for one in self.results:
            if one["run"] == run:
                return one
        raise ValueError(f"there is no run '{run}'")

    def compare(self, params):
        before, after = (self.found(params[key]) for key in ("before", "after"))
        if before["instrument"] != after["instrument"]:
            raise ValueError("These results are of different instruments.")
        change = (after["answers"][0]["value"] or 0) - (before["answers"][0]["value"] or 0)
        differs = abs(change) > 0.004
        words = f"{change:+.4f} s (95 %: {change - 0.004:+.4f} to {change + 0.004:+.4f} s)"
        filaments = [one["subject"].get("filament") for one in (before, after)]
        return {"changes": [{"name": "pressure_advance", "unit": "s", "differs": differs,
                             "words": words + (": it changed" if differs else ": no change that can be told")}],
                "others": [] if filaments[0] == filaments[1] else [f"another filament: {filaments[0]}, then {filaments[1]}"]}

    def annotate(self, params):
        one = self.found(params["run"])
        if len(params.get("note", "").encode()) > 500:
            raise ValueError("A note has at most 500 bytes.")
        one |= {key: params[key] for key in ("note", "pinned") if key in params}
        return {key: one[key] for key in ("run", "note", "pinned")}

    def delete(self, params):
        one = self.found(params["run"])
        if one["pinned"]:
            raise ValueError(f"{one['run']} is pinned: unpin it first.")
        self.results.remove(one)
        return {}

    def use(self, printer, run):
        here = self.printers[printer]
        one = self.found(run)
        here["proposal"] = {"run": run, "job": "photo", "folder": "/x", "arguments": {},
                            "answer": f"pressure_advance = {one['answers'][0]['words']}"}
        before = float(here["in_force"][:-2])
        one["applied"].append({"utc": utc(0), "machine": NAMES[printer], "step": "applied", "before": before})
        return self.start(printer, "apply", {})

    def take_back(self, printer, instrument):
        one = max((one for one in self.results if one["instrument"] == instrument and one["applied"]),
                  key=lambda one: one["applied"][-1]["utc"])
        before = one["applied"][-1]["before"]
        one["applied"][-1] |= {"step": "undone", "utc": utc(0)}
        self.printers[printer]["proposal"] = {"run": one["run"], "job": "apply", "folder": "/x", "arguments": {},
                                              "answer": f"pressure_advance = {before:.4f} s (95 %)"}
        return self.start(printer, "apply", {})


def utc(days_ago):
    return f"{datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(days=days_ago):%Y-%m-%dT%H:%M:%S.%fZ}"


def first_results():
    older = [result(f"{0.0412 + 0.0011 * (i % 4 - 2):.4f}", 20 + 9 * i, "Generic PLA" if i % 3 else "PETG Jet")
             for i in range(20)]
    return [result("0.0412", 2), result("0.0450", 12, applied=True), result("", 13), offsets(14),
            result("0.0418", 15) | {"run": None, "pictures": [], "report": None}, *older]


def result(value, days_ago=0, filament="Generic PLA", applied=False, run=None):
    answer = {"name": "pressure_advance", "unit": "s", "verdict": "good" if value else "refused", "reason": "" if value else REFUSED,
              "value": float(value) if value else None, "standard_uncertainty": 0.0014 if value else None,
              "interval95": [float(value) - 0.0027, float(value) + 0.0027] if value else None,
              "words": f"{value} s (95 %: {float(value) - 0.0027:.4f} to {float(value) + 0.0027:.4f} s)" if value else REFUSED}
    folder = run or f"pressure_advance-{time.monotonic_ns()}"
    return {"utc": utc(days_ago), "instrument": "pressure_advance", "verdict": answer["verdict"], "reason": answer["reason"],
            "answers": [answer], "folder": folder, "run": folder, "note": "", "pinned": False, "notices": [],
            "subject": {"printer": NAMES[0], "nozzle": "0.40", "filament": filament, "nozzle_c": "215", "bed_c": "60"},
            "pictures": ["answer.png", "photo.png", "response.png"] if value else ["photo.png"], "report": "report.html",
            "applied": [{"utc": utc(days_ago), "machine": NAMES[0], "step": "applied", "before": 0.02}] if applied else []}


def tap(number):
    """Returns a tap: one a minute, 20 is of now. One is refused."""
    good, z_mm = number != 18, 0.02 + 0.0004 * (number % 5 - 2)
    return {"tap": f"tap-{number}", "utc": utc((20 - number) / 1440), "verdict": "good" if good else "refused",
            "words": f"{z_mm:.4f} mm (95 %: {z_mm - 0.0005:.4f} to {z_mm + 0.0005:.4f} mm)" if good else "",
            "reason": "" if good else "The nozzle drags plastic: clean it and tap again.",
            "contact_z_mm": z_mm if good else None, "interval95_mm": [z_mm - 0.0005, z_mm + 0.0005] if good else None,
            "firmware_z_mm": 0.0251, "x_mm": 150, "y_mm": 140.5}


def offsets(days_ago, run=None):
    one = result("0.1002", days_ago, run=run)
    one["answers"] = [one["answers"][0] | {"name": f"tool_1_d{axis}", "unit": "mm", "words": words} for axis, words in
                      (("x", "+0.1002 mm (95 %: +0.0980 to +0.1024 mm)"), ("y", "-0.0500 mm (95 %: -0.0520 to -0.0480 mm)"))]
    return one | {"instrument": "tool_offset", "pictures": ["answer.png"], "report": None, "subject": {"printer": NAMES[0]}}


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
        if name == "now.jpg":
            self.panel.frames += 1
            if self.panel.frames == 1:
                return self.reply(404, {"error": "none yet"})
        if "/runs/" in path:
            picture = "response-real-photo.png" if name == "answer.png" else "photo.jpg"
            return self.reply(200, (IMAGES / picture).read_bytes(), "image/png")
        if name == "history.csv":
            rows = ["utc,run,value", *(f"{one['utc']},{one['run']},{one['answers'][0]['value']}" for one in self.panel.results)]
            return self.reply(200, "\n".join(rows).encode(), "text/csv")
        if (self.folder / name).is_file():
            begin = self.panel.faults.get("script", "").encode() if name == "panel.js" else b""
            return self.reply(200, begin + (self.folder / name).read_bytes(), mimetypes.guess_type(name)[0])
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
        elif "/surveys?" in self.path:
            self.panel.pictures.append(f"photo-{len(self.panel.pictures) + 1:03}.jpg")
            return self.reply(200, {"run": "survey-1"})
        elif "/sheets?" in self.path:
            name = f"sheet-{self.headers['Content-Type'].rpartition('/')[2]}-{hashlib.sha256(body).hexdigest()[:8]}"
            return self.reply(200, {"file": name})
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
