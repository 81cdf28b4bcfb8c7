"""Installs and uninstalls: plan, manifest, edits; the manifest's records undone in reverse."""
import json
import pathlib

from . import InstallError, edits, printers, unit

MANIFEST = ".trammel-installed.json"


def read_manifest(home):
    path = home / MANIFEST
    if not path.exists():
        return []
    try:
        return json.loads(path.read_bytes())["edits"]
    except (ValueError, KeyError, TypeError) as error:
        raise InstallError(f"{path}: {error}; without it nobody knows what was installed") from error


def uninstall(home, run):
    """Undoes what the manifest of `home` holds, the last first. @returns remarks on what is left behind."""
    records = read_manifest(home)
    for record in records:
        if record["kind"] in ("block", "entry"):
            edits.refuse_unwritable(pathlib.Path(record["path"]))
    remarks = [unit.undo_unit(record, run) if record["kind"] == "unit" else edits.undo(record)
               for record in reversed(records)]
    edits.part_of(home / MANIFEST).unlink(missing_ok=True)
    (home / MANIFEST).unlink(missing_ok=True)
    return [remark for remark in remarks if remark]


def plan(home, program, found, units, user, release, link, run):
    """@returns (record, change) of each edit in their order, and remarks."""
    planned, remarks = [], []
    template = (program / "share/trammel/klipper/trammel@.service").read_text()
    for data in found:
        more, said = printers.plan_printer(data, program, release, link, units is not None)
        planned, remarks = planned + more, remarks + said
    for index, data in enumerate(found if units else []):
        name = unit.unit_name(index, data)
        text = unit.unit_text(template, name, user, home, program, data)
        if (units / f"{name}.service").exists():
            remarks.append(f"{units / name}.service is there already and is left")
        else:
            planned.append(unit.edit_unit(units, name, text, run))
    return planned, remarks


def install(home, program, found, units, user, release, link, run):
    """Installs for the printers `found`; what an earlier run installed is taken out first.

    @param units    systemd's folder of units; None: no service
    @param release  release_info.json
    @param link     page to which Mainsail's navigation is to lead, or ""
    @returns remarks on what was left as it was
    """
    if not found:
        raise InstallError(f"no printer: nowhere below {home} is a config/moonraker.conf; name its folder by --printer")
    remarks = uninstall(home, run)
    planned, said = plan(home, program, found, units, user, release, link, run)
    records = [record for record, _ in planned]
    for record in records:
        if record["kind"] != "unit":
            edits.refuse_unwritable(pathlib.Path(record["path"]))
    text = json.dumps({"program": str(program), "edits": records}, indent=2)
    edits.write_whole(home / MANIFEST, text.encode() + b"\n", mode=0o600)
    for record, change in planned:
        edits.make(record, change)
    return remarks + said
