"""Installs and uninstalls: plan, manifest, edits; the manifest's records undone in reverse."""
import json
import pathlib

from . import InstallError, edits, maintenance, printers, unit

MANIFEST = ".trammel-installed.json"


def read_manifest(home):
    path = home / MANIFEST
    if not path.exists():
        return []
    try:
        return json.loads(path.read_bytes())["edits"]
    except (ValueError, KeyError, TypeError) as error:
        raise InstallError(f"{path}: {error}; without it nobody knows what was installed") from error


def undo(record, run):
    if record["kind"] == "unit":
        return unit.undo_unit(record, run)
    return maintenance.undo_reminder(record) if record["kind"] == "reminder" else edits.undo(record)


def uninstall(home, run, keep_reminders=False):
    """Undoes what the manifest of `home` holds, the last first. @returns remarks on what is left behind."""
    records = [record for record in read_manifest(home) if not (keep_reminders and record["kind"] == "reminder")]
    for record in records:
        if record["kind"] in ("block", "entry"):
            edits.refuse_unwritable(pathlib.Path(record["path"]))
    remarks = [undo(record, run) for record in reversed(records)]
    edits.part_of(home / MANIFEST).unlink(missing_ok=True)
    (home / MANIFEST).unlink(missing_ok=True)
    return [remark for remark in remarks if remark]


def plan(home, program, found, units, user, release, link, run, remind):
    """@returns (record, change) of each edit in their order, and remarks."""
    planned, remarks = [], []
    template = (program / "share/trammel/klipper/trammel@.service").read_text()
    for data in found:
        more, said = printers.plan_printer(data, program, release, link, units is not None)
        planned, remarks = planned + more, remarks + said
    for index, data in enumerate(found if units else []):
        name = unit.unit_name(index, data)
        text = unit.unit_text(template, name, user, home, program, data, printers.has_load_cell(data / "config"))
        if (units / f"{name}.service").exists():
            remarks.append(f"{units / name}.service is there already and is left")
        else:
            planned.append(unit.edit_unit(units, name, text, run))
    if remind:
        planned += [maintenance.edit_reminder(printers.port_of(data)) for data in found]
    return planned, remarks


def install(home, program, found, units, user, release, link, run, remind=False):
    """Installs for the printers `found`; what an earlier run installed is taken out first.

    @param units    systemd's folder of units; None: no service
    @param release  release_info.json
    @param link     page to which Mainsail's navigation is to lead, or ""
    @param remind   whether Mainsail's maintenance is to remind of calibrating
    @returns remarks on what was left as it was
    """
    if not found:
        raise InstallError(f"no printer: nowhere below {home} is a config/moonraker.conf; name its folder by --printer")
    for data in found if remind else []:
        maintenance.check(data, printers.port_of(data))
    remarks = uninstall(home, run, keep_reminders=remind)
    planned, said = plan(home, program, found, units, user, release, link, run, remind)
    records = [record for record, _ in planned]
    for record in records:
        if "path" in record and record["kind"] != "unit":
            edits.refuse_unwritable(pathlib.Path(record["path"]))
    text = json.dumps({"program": str(program), "edits": records}, indent=2)
    edits.write_whole(home / MANIFEST, text.encode() + b"\n", mode=0o600)
    for record, change in planned:
        edits.make(record, change)
    return remarks + said
