"""An entry of Mainsail's maintenance list, which reminds of calibrating: in Moonraker's database, where Mainsail keeps them.

Nothing of others is written. The entry has a key that is always the same; what Mainsail makes of it when its owner performs
it follows by `last_entry`.
"""
import json
import time
import urllib.error
import urllib.parse
import urllib.request

from . import InstallError

NAMESPACE = "maintenance"
KEY = "7e9f0f66-3a0c-5b0e-9a55-74726d6c7061"
NAME = "Calibrate pressure advance"
NOTE = ("trammel: TRAMMEL_PA with a laser, TRAMMEL_PA_PATTERN and a phone without one; each filament, and after each change of the "
        "nozzle (TRAMMEL_NEW_NOZZLE)")
DAYS = 90  # as trammel history due has it
TIMEOUT_S = 10
MOST_BYTES = 16 << 20
DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # Moonraker is on this computer


def call(address, path, method="GET", body=None, **query):
    """What Moonraker answers; None where it knows no such item. Raises InstallError."""
    url = f"http://{address}{path}" + ("?" + urllib.parse.urlencode(query) if query else "")
    request = urllib.request.Request(url, data=None if body is None else json.dumps(body).encode(), method=method,
                                     headers={"Content-Type": "application/json"})
    try:
        with DIRECT.open(request, timeout=TIMEOUT_S) as answer:
            return json.loads(answer.read(MOST_BYTES))["result"]
    except urllib.error.HTTPError as error:
        if error.code == 404:
            return None
        wants_login = " (it wants a login)" if error.code == 401 else ""
        raise InstallError(f"Moonraker at {address} refuses {path}{wants_login}: {error}; leave --remind out") from error
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InstallError(f"Moonraker at {address} does not answer {path}: {error}; start it, or leave --remind out") from error


def entries_at(address):
    """Mainsail's entries by their keys; None where Mainsail never made any."""
    found = call(address, "/server/database/item", namespace=NAMESPACE)
    entries = found and found.get("value")
    return entries if isinstance(entries, dict) else None


def ours(entries):
    """Keys of our entry and of those that followed it, as long as they have its name."""
    keys, more = set(), {KEY}
    while more:
        keys |= more
        more = {key for key, entry in entries.items() if isinstance(entry, dict) and entry.get("last_entry") in keys} - keys
    return [key for key in entries if key in keys and isinstance(entries[key], dict) and entries[key].get("name") == NAME]


def is_open(entry):
    return entry.get("end_time") is None


def check(data, address):
    """Raises InstallError where an entry cannot be added, before anything is changed."""
    defaults = data / "config/.theme/maintenance.json"
    if entries_at(address) is None and defaults.exists():
        raise InstallError(f"{defaults} is taken in when Mainsail is opened for the first time, and no more once there is an "
                           "entry: open Mainsail, then run install.sh --remind again")


def add_reminder(address):
    """@returns whether there was none yet"""
    entries = entries_at(address) or {}
    if any(is_open(entries[key]) for key in ours(entries)) or KEY in entries:
        return False  # of an earlier installation: how long ago the last calibration was stays
    totals = (call(address, "/server/history/totals") or {}).get("job_totals", {})
    never = {"bool": False, "value": None}
    call(address, "/server/database/item", "POST", {"namespace": NAMESPACE, "key": KEY, "value": {
        "name": NAME, "note": NOTE, "perform_note": None,
        "start_time": time.time(), "end_time": None,
        "start_filament": totals.get("total_filament_used", 0), "end_filament": None,
        "start_printtime": totals.get("total_print_time", 0), "end_printtime": None,
        "last_entry": None,
        "reminder": {"type": "repeat", "filament": never, "printtime": never, "date": {"bool": True, "value": DAYS}}}})
    return True


def undo_reminder(address):
    """Takes the entry out that reminds; what its owner performed stays in Mainsail's history.

    @returns a remark where something is left behind, else None.
    """
    try:
        entries = entries_at(address) or {}
        for key in ours(entries):
            if is_open(entries[key]):
                call(address, "/server/database/item", "DELETE", namespace=NAMESPACE, key=key)
    except InstallError as error:
        return f"'{NAME}' stays among Mainsail's maintenance (History), delete it there: {error}"
    if KEY in entries and entries[KEY].get("name") != NAME:
        return f"the reminder was renamed to '{entries[KEY].get('name')}' in Mainsail and is left"
    return None
