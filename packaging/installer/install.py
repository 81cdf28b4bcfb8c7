"""Installs and uninstalls: a plan in memory, checks, the manifest, then the edits, all or none."""
import contextlib
import json
import pathlib
import re
import signal

from . import InstallError, edits, maintenance, printers, unit

MANIFEST = ".trammel-installed.json"
FIELDS = {
    "folder": {"path": str},
    "file": {"path": str, "sha256": str},
    "block": {"path": str, "text": str, "glued": bool, "mark": str},
    "entry": {"path": str, "text": str, "entry": dict},
    "unit": {"path": str, "sha256": str},
    "reminder": {"address": str},
}


def sound(record):
    """A record as this installer writes it. Raises ValueError."""
    if record.get("kind") == "reminder" and "port" in record:  # of an installer before
        record = {"kind": "reminder", "address": f"127.0.0.1:{int(record['port'])}"}
    fields = FIELDS.get(record.get("kind"), {"kind": None})
    if not all(isinstance(record.get(key), form) for key, form in fields.items() if form):
        raise ValueError(f"{json.dumps(record)[:200]} is no edit")
    path = record.get("path", "/")
    if not path.startswith("/") or "\0" in path:
        raise ValueError(f"{path!r} is no path of a file that was edited")
    if record["kind"] == "unit" and not re.fullmatch(r"trammel(-[\w.-]+)?\.service", pathlib.Path(path).name):
        raise ValueError(f"{path!r} is no service of trammel")
    return record


def read_manifest(home):
    """@returns what the manifest held, and its records"""
    path = home / MANIFEST
    data, _ = edits.read_regular(path)
    if data is None:
        return None, []
    try:
        return data, [sound(record) for record in json.loads(data.decode())["edits"]]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InstallError(f"{path} is damaged ({error}), and without it nobody knows what was installed: move it away; what it "
                           "lists then stays until it is taken out by hand") from error


def manifest_text(program, records):
    return json.dumps({"program": str(program), "edits": records}, indent=2).encode() + b"\n"


def undo_all(plan, records):
    """Undoes records in the plan, the last first. @returns remarks on what is left behind"""
    undone = {record["path"] for record in reversed(records) if record["kind"] != "reminder" and plan.undo(record)}
    left = {record["path"]: record for record in records if record["kind"] not in ("reminder", "folder")}
    return [remark for path, record in left.items() if path not in undone and (remark := plan.left_behind(record))]


def keep_included(plan, records):
    """Leaves macros that printer.cfg includes by name, without which Klipper would not start.

    @returns their records, which stay in the manifest, and remarks
    """
    kept, remarks = [], []
    for record in records:
        if record["kind"] != "file" or pathlib.Path(record["path"]).name not in printers.MACROS:
            continue
        file = plan.file(record["path"])
        if file.now is not None or file.before is None or not (by := printers.includer_of(file.path)):
            continue
        file.now = file.before
        kept.append(record)
        remarks.append(f"{by} includes {file.path.name}, without which Klipper would not start: it stays. Take that line out, then "
                       "run install.sh --uninstall again")
    return kept, remarks


def commit(plan, home, program, old, new, restarted, reminders, run):
    """Makes what was planned, or nothing of it.

    @param old, new   what the manifest holds and is to hold: its bytes and records; records
    @param restarted  paths of services that start anew, changed or not
    """
    manifest, data = home / MANIFEST, old[0]
    units = [file for file in plan.files.values() if file.of_root]
    lost = []

    def attempt(unmake):
        try:
            unmake()
        except (InstallError, OSError) as error:
            lost.append(str(error))

    with contextlib.ExitStack() as made:

        def step(make, unmake):
            made.callback(attempt, unmake)  # first: a step that fails half-way is taken back, too
            make()

        def note(records):
            text = manifest_text(program, records) if records else None
            if text is None:
                manifest.unlink(missing_ok=True)
            elif text != edits.read_regular(manifest)[0]:
                edits.write_whole(manifest, text, 0o600)

        def restore_manifest():
            if data is None:
                manifest.unlink(missing_ok=True)
            else:
                edits.write_whole(manifest, data, 0o600)

        try:
            edits.part_of(manifest).unlink(missing_ok=True)  # of an installer that was killed
            step(lambda: note(old[1] + [record for record in new if record not in old[1]]), restore_manifest)
            for record in old[1]:
                if record["kind"] not in ("folder", "unit", "reminder") and pathlib.Path(record["path"]).parent.is_dir():
                    edits.part_of(pathlib.Path(record["path"])).unlink(missing_ok=True)
            for file in units:
                if file.changes and file.now is None:
                    step(lambda file=file: unit.bring(file.path, file.before, None, run), lambda file=file: unit.put_back(file, run))
            plan.commit(step)
            for file in units:
                if file.path in restarted:
                    step(lambda file=file: unit.bring(file.path, file.before, file.now, run),
                         lambda file=file: unit.put_back(file, run))
            for address in reminders:
                if maintenance.add_reminder(address):
                    made.callback(attempt, lambda address=address: maintenance.undo_reminder(address))
            note(new)
            made.pop_all()
            return
        except BaseException as error:
            failure = error
            before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
            made.close()  # nobody keeps what was from coming back
            for number, handler in before.items():
                signal.signal(number, handler)
    if lost:
        raise InstallError(f"{failure or 'stopped'}; and this could not be put back: {'; '.join(lost)}") from failure
    if isinstance(failure, (InstallError, OSError)):
        raise InstallError(f"{failure}; everything is as it was before") from failure
    raise failure


def uninstall(home, program, run):
    """Undoes what the manifest of `home` holds. @returns remarks on what is left behind."""
    data, records = read_manifest(home)
    plan = edits.Plan()
    remarks = undo_all(plan, records)
    kept, said = keep_included(plan, records)
    plan.check()
    if records:
        edits.refuse_unwritable(home / MANIFEST)
    commit(plan, home, program, (data, records), kept, (), (), run)
    remarks += said + [maintenance.undo_reminder(record["address"]) for record in records if record["kind"] == "reminder"]
    return [remark for remark in remarks if remark]


def plan_units(plan, home, program, found, units, user):
    """@returns records of the printers' services, and remarks"""
    records, remarks = [], []
    template = printers.archived(program / "share/trammel/klipper/trammel@.service").decode()
    for index, data in enumerate(found):
        name = unit.unit_name(index, data)
        path = units / f"{name}.service"
        text = unit.unit_text(template, name, user, home, program, data, printers.has_load_cell(data / "config")).encode()
        if plan.has(path, of_root=True):
            remarks.append(f"{path} is there already and is left")
        else:
            plan.file(path).now = text
            records.append({"kind": "unit", "path": str(path), "sha256": edits.sha256(text)})
    return records, remarks


def addresses_of(found, plan):
    """Where each printer's Moonraker listens. Raises InstallError where two are one: a copy of a folder drives no printer."""
    addresses = {}
    for data in found:
        address = printers.address_of(data, plan)
        if address in addresses:
            raise InstallError(f"{addresses[address]} and {data} both have their Moonraker at {address}: name the printer's own folder "
                               "by --printer, or give each a port of its own")
        addresses[address] = data
    return list(addresses)


def install(home, program, found, units, user, release, link, run, remind=False):
    """Installs for the printers `found`; what an earlier run installed and this one does not is taken out.

    @param units    systemd's folder of units; None: no service
    @param release  release_info.json
    @param link     page to which Mainsail's navigation is to lead, or ""
    @param remind   whether Mainsail's maintenance is to remind of calibrating
    @returns remarks on what was left as it was
    """
    if not found:
        raise InstallError(f"no printer: nowhere below {home} is a config/moonraker.conf; name its folder by --printer")
    data, old = read_manifest(home)
    plan = edits.Plan()
    remarks = undo_all(plan, old)
    addresses = addresses_of(found, plan)
    for printer, address in zip(found, addresses):
        if remind:
            maintenance.check(printer, address)
    new = []
    for printer in found:
        records, said = printers.plan_printer(plan, printer, program, release, link, units is not None)
        new, remarks = new + records, remarks + said
    records, said = plan_units(plan, home, program, found, units, user) if units else ([], [])
    new, remarks = new + records, remarks + said
    kept, said = keep_included(plan, [record for record in old if record not in new])
    new, remarks = kept + new, remarks + said
    reminders = [{"kind": "reminder", "address": address} for address in addresses if remind]
    new += reminders
    plan.check()
    edits.refuse_unwritable(home / MANIFEST)
    commit(plan, home, program, (data, old), new, {pathlib.Path(record["path"]) for record in records},
           [record["address"] for record in reminders], run)
    gone = [record for record in old if record["kind"] == "reminder" and record not in reminders]
    return [remark for remark in remarks + [maintenance.undo_reminder(record["address"]) for record in gone] if remark]
