"""Finds the printers of a user, and what trammel needs in the folder of each."""
import glob
import json
import pathlib
import re

from . import InstallError, edits

SECTION = "[update_manager trammel]"
MACROS = ("trammel.cfg", "trammel_laser.cfg")
SETTINGS = """\
# What trammel is to know of this printer. trammel config keys prints every key.
[moonraker]
address = "127.0.0.1:{port}"

[filament]
# Nothing is heated on a guess. What is loaded: pla, petg, abs, asa, tpu, pc or pa.
# material = "pla"
"""
# A caliper's two jaws around a part, on 24 x 24 (Mainsail draws it).
ICON = "M2,4H22V7H20V20H17V7H7V15H4V7H2V4M9,10H15V20H9V10Z"


def find_printers(home):
    """The data folders below `home`: printer_data, printer_1_data …, each with config/moonraker.conf."""
    found = sorted(path.parent.parent for path in home.glob("*/config/moonraker.conf"))
    first = home / "printer_data"
    return [first] * (first in found) + [data for data in found if data != first]


def moonraker_port(text):
    """The port of [server] in moonraker.conf; Moonraker's own default where none is set."""
    server = re.search(r"^\[server\][^\[]*?^port\s*[:=]\s*(\d+)", text, re.MULTILINE)
    return int(server.group(1)) if server else 7125


def port_of(data):
    return moonraker_port((data / "config/moonraker.conf").read_text(errors="replace"))


def klipper_files(path, seen):
    """printer.cfg and what it includes, each once."""
    if path in seen or not path.is_file():
        return
    seen.add(path)
    for pattern in re.findall(r"^\[include\s+([^\]]+)\]", path.read_text(errors="replace"), re.MULTILINE):
        for more in sorted(glob.glob(str(path.parent / pattern.strip()))):
            klipper_files(pathlib.Path(more), seen)


def has_load_cell(config):
    """Whether the printer can ask for the nozzle's contact, by TRAMMEL_TAP."""
    files = set()
    klipper_files(config / "printer.cfg", files)
    return any(re.search(r"^\[load_cell_probe\]", path.read_text(errors="replace"), re.MULTILINE) for path in files)


def update_section(program, release, with_unit):
    """moonraker.conf's section by which Moonraker updates the program."""
    lines = [SECTION, "type: zip", "channel: stable", f"repo: {release['project_owner']}/{release['project_name']}",
             f"path: {program}"]
    return "\n" + "\n".join(lines + ["managed_services: trammel"] * with_unit) + "\n"


def has_section(config):
    """Whether moonraker.conf, or a file that it may include, has the section already."""
    header = re.compile(r"^\[update_manager\s+trammel\]", re.MULTILINE)
    return any(header.search(path.read_text(errors="replace")) for path in sorted(config.rglob("*.conf")))


def plan_macros(config, program):
    """The macros as new files; whatever else is called so stays."""
    planned, remarks = [], []
    for name in MACROS:
        source = program / "share/trammel/klipper" / name
        macros = config / name
        if not macros.exists():
            planned.append(edits.edit_file(macros, source.read_bytes()))
        elif macros.read_bytes() != source.read_bytes():
            remarks.append(f"{macros} is there already and is left; this trammel's own is {source}")
    return planned, remarks


def plan_link(config, link):
    """An entry in Mainsail's navigation."""
    path = config / ".theme/navi.json"
    entry = {"title": "trammel", "href": link, "target": "_blank", "position": 85, "icon": ICON}
    if not path.exists():
        folder = [] if path.parent.exists() else [edits.edit_folder(path.parent)]
        return folder + [edits.edit_file(path, json.dumps([entry], indent=2).encode() + b"\n")], []
    edit = edits.edit_entry(path.resolve(), entry)
    if edit is None:
        return [], [f"{path} is no JSON array and is left: Mainsail gets no link to trammel"]
    return [edit], []


def plan_printer(data, program, release, link, with_unit):
    """@returns the edits of one printer's folder, and remarks on what is left as it is."""
    config = data / "config"
    moonraker = (config / "moonraker.conf").resolve()
    planned, remarks = plan_macros(config, program)
    settings = config / "trammel.toml"
    if not settings.exists():
        port = port_of(data)
        # Its owner's alone: an API key may be written into it.
        planned.append(edits.edit_file(settings, SETTINGS.format(port=port).encode(), mode=0o600))
    if with_unit:
        allowed = (data / "moonraker.asvc").resolve()
        if not allowed.exists():
            remarks.append(f"{allowed} is not there: Moonraker restarts no trammel after an update")
        elif "trammel" not in [line.strip() for line in allowed.read_text(errors="replace").splitlines()]:
            planned.append(edits.edit_block(allowed, "trammel\n", "trammel"))
    if has_section(config):
        remarks.append(f"{config} has a section {SECTION} already, which is left")
    else:
        planned.append(edits.edit_block(moonraker, update_section(program, release, with_unit), SECTION))
    if link:
        more, said = plan_link(config, link)
        planned, remarks = planned + more, remarks + said
    return planned, remarks


def release_of(program, machine):
    """release_info.json of the unpacked archive, once it is for this computer's processor."""
    path = pathlib.Path(program) / "release_info.json"
    try:
        release = json.loads(path.read_bytes())
    except (OSError, ValueError) as error:
        raise InstallError(f"{path}: {error}; unpack the release archive anew") from error
    architecture = {"x86_64": "amd64", "aarch64": "arm64"}.get(machine, machine)
    if architecture not in release["asset_name"]:
        raise InstallError(f"this is {release['asset_name']}, and this computer wants trammel-{architecture}.zip")
    return release
