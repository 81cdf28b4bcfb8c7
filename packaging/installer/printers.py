"""Finds the printers of a user, and what trammel needs in the folder of each."""
import configparser
import glob
import ipaddress
import json
import os
import pathlib
import platform
import re
import subprocess

from . import InstallError, edits

SECTION = "[update_manager trammel]"
MACROS = ("trammel.cfg", "trammel_laser.cfg")
SETTINGS = """\
# What trammel is to know of this printer. trammel config keys prints every key.
[moonraker]
address = "{address}"

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


def text_of(path, plan):
    """A file as it is planned to be. Raises InstallError where it is not there, or no text."""
    planned = plan.files.get(path.resolve())
    data = planned.now if planned else edits.read_regular(path, follow=True)[0]
    if data is None:
        raise InstallError(f"{path} is not there: --printer names the folder that holds config/moonraker.conf")
    try:
        text = data.decode()
    except ValueError as error:
        raise InstallError(f"{path} is no text in UTF-8 ({error}): save it as such") from error
    if "\0" in text:
        raise InstallError(f"{path} holds a byte of zero, which no text does: mend or restore it")
    return text


def moonraker_lines(path, plan, seen):
    """Yields the lines of moonraker.conf and of what it includes, without comments, as Moonraker reads them."""
    if path.resolve() in seen:
        return
    seen.add(path.resolve())
    indent = None  # of the last option; deeper lines are of its value
    for line in text_of(path, plan).splitlines():
        if not line.strip() or line.lstrip()[0] in "#;":
            continue
        line = re.sub(r" +[#;].*", "", line.expandtabs(4), count=1)
        depth = len(line) - len(line.lstrip())
        section = None if indent is not None and depth > indent else re.match(r"\s*\[([^]]+)\]", line)
        if section and section.group(1).startswith("include "):
            indent = None
            for more in sorted(glob.glob(str(path.parent / section.group(1)[8:].strip()))):
                yield from moonraker_lines(pathlib.Path(more), plan, seen)
            continue
        if section or indent is None or depth <= indent:
            indent = None if section else depth
        yield line


def moonraker_options(path, plan):
    """moonraker.conf and what it includes. Raises InstallError where Moonraker could not read it either."""
    options = configparser.ConfigParser(strict=False, interpolation=None)
    try:
        options.read_string("\n".join(moonraker_lines(path, plan, set())))
    except configparser.Error as error:
        raise InstallError(f"{path}: Moonraker cannot read it: {error}") from error
    return options


def host_of(listens):
    """The host by which a program of this computer reaches what listens there."""
    try:
        given = ipaddress.ip_address(listens)
    except ValueError:
        return "127.0.0.1" if listens in ("", "all", "localhost") else listens
    if given.version == 6:
        return "[::1]" if given.is_unspecified else f"[{given}]"
    return "127.0.0.1" if given.is_unspecified else str(given)


def address_of(data, plan):
    """Where the printer's Moonraker listens: host, port, and route_prefix where it has one."""
    path = data / "config/moonraker.conf"
    options = moonraker_options(path, plan)
    port = options.get("server", "port", fallback="7125").strip()
    if not re.fullmatch(r"[0-9]{1,5}", port) or not 0 < int(port) < 65536:
        raise InstallError(f"{path}: [server] port is {port!r}: it must be 1 to 65535")
    prefix = options.get("server", "route_prefix", fallback="").strip().strip("/")
    host = host_of(options.get("server", "host", fallback="").strip().lower())
    address = f"{host}:{port}" + (f"/{prefix}" if prefix else "")
    if not re.fullmatch(r"[!#-?A-\[\]-~]+", address):
        raise InstallError(f"{path}: [server] has {address!r}, which is no address")
    return address


def klipper_includes(path, seen):
    """Yields (file, what its include names) of printer.cfg and of what it includes, each file once."""
    if path in seen or not path.is_file():
        return
    seen.add(path)
    for pattern in re.findall(r"^\[include\s+([^\]]+)\]", path.read_text(errors="replace"), re.MULTILINE):
        named = str(path.parent / pattern.strip())
        yield path, named
        for more in sorted(glob.glob(named)):
            yield from klipper_includes(pathlib.Path(more), seen)


def includer_of(macros):
    """The file that includes `macros` by its name, without which Klipper would not start; None: none does."""
    for file, named in klipper_includes(macros.parent / "printer.cfg", set()):
        if not glob.has_magic(named) and pathlib.Path(named).resolve() == macros.resolve():
            return file
    return None


def has_load_cell(config):
    """Whether the printer can ask for the nozzle's contact, by TRAMMEL_TAP."""
    files = set()
    for _ in klipper_includes(config / "printer.cfg", files):
        pass
    return any(re.search(r"^\[load_cell_probe\]", path.read_text(errors="replace"), re.MULTILINE) for path in files)


def update_section(program, release, with_unit):
    """moonraker.conf's section by which Moonraker updates the program."""
    lines = [SECTION, "type: zip", "channel: stable", f"repo: {release['project_owner']}/{release['project_name']}",
             f"path: {program}"]
    return "\n" + "\n".join(lines + ["managed_services: trammel"] * with_unit) + "\n"


def plan_macros(plan, config, program):
    """The macros as new files; whatever else is called so stays."""
    records, remarks = [], []
    for name in MACROS:
        source = program / "share/trammel/klipper" / name
        text = archived(source)
        macros = config / name
        if not plan.has(macros):
            records.append(plan.add_file(macros, text))
        elif edits.is_odd(macros) or plan.file(macros).now != text:
            remarks.append(f"{macros} is there already and is left; this trammel's own is {source}")
    return records, remarks


def plan_link(plan, config, link):
    """An entry in Mainsail's navigation."""
    path = config / ".theme/navi.json"
    entry = {"title": "trammel", "href": link, "target": "_blank", "position": 85, "icon": ICON}
    folder_fits = path.parent.is_dir() or not os.path.lexists(path.parent)
    if folder_fits and not plan.has(path):
        stays = path.parent.is_dir() and path.parent not in plan.emptied
        folder = [] if stays else [plan.add_folder(path.parent)]
        return folder + [plan.add_file(path, json.dumps([entry], indent=2).encode() + b"\n")], []
    try:
        record = plan.add_entry(edits.target_of(path), entry)
    except InstallError as error:
        return [], [f"{error}; Mainsail gets no link to trammel"]
    if record is None:
        return [], [f"{path} is no JSON array in UTF-8 and is left: Mainsail gets no link to trammel"]
    return [record], []


def plan_permission(plan, data):
    """Moonraker's permission to restart the service."""
    path = data / "moonraker.asvc"
    if not path.exists():
        return [], [f"{path} is not there: Moonraker restarts no trammel after an update"]
    allowed = edits.target_of(path)
    if "trammel" in [line.strip() for line in plan.file(allowed).now.decode(errors="replace").splitlines()]:
        return [], []
    return [plan.add_block(allowed, "trammel\n", "trammel")], []


def plan_printer(plan, data, program, release, link, with_unit):
    """@returns the records of what is planned in one printer's folder, and remarks on what is left as it is."""
    config = data / "config"
    address = address_of(data, plan)
    records, remarks = plan_macros(plan, config, program)
    settings = config / "trammel.toml"
    if not plan.has(settings):
        # Its owner's alone: an API key may be written into it.
        records.append(plan.add_file(settings, SETTINGS.format(address=address).encode(), mode=0o600))
    if with_unit:
        more, said = plan_permission(plan, data)
        records, remarks = records + more, remarks + said
    moonraker = edits.target_of(config / "moonraker.conf")
    if moonraker_options(config / "moonraker.conf", plan).has_section(SECTION[1:-1]):
        remarks.append(f"{config} has a section {SECTION} already, which is left")
    else:
        records.append(plan.add_block(moonraker, update_section(program, release, with_unit), SECTION))
    if link:
        more, said = plan_link(plan, config, link)
        records, remarks = records + more, remarks + said
    return records, remarks


def archived(path):
    """A file of the unpacked archive."""
    data, _ = edits.read_regular(path, follow=True)
    if data is None:
        raise InstallError(f"{path} is not there: unpack the release archive anew")
    return data


def architecture():
    """Debian's name of what programs of this system are made for; a 64-bit kernel may carry a 32-bit system."""
    try:
        told = subprocess.run(["/usr/bin/dpkg", "--print-architecture"], capture_output=True, text=True, check=True, timeout=10)
        return told.stdout.strip()
    except (OSError, subprocess.SubprocessError):
        machine = {"x86_64": "amd64", "aarch64": "arm64"}.get(platform.machine(), platform.machine())
        return machine if platform.architecture()[0] == "64bit" else f"{machine}, 32 bit"


def release_of(program, wanted):
    """release_info.json of the unpacked archive, once it is for this system. @param wanted  of architecture()"""
    path = pathlib.Path(program) / "release_info.json"
    try:
        release = json.loads(archived(path).decode())
        asset = release["asset_name"]
        strange = [key for key in ("asset_name", "project_owner", "project_name") if not re.fullmatch(r"[\w.-]+", release[key])]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise InstallError(f"{path}: {error!r}; unpack the release archive anew") from error
    if strange:
        raise InstallError(f"{path}: strange {strange[0]}; unpack the release archive anew")
    if f"-{wanted}." in asset:
        return release
    if wanted in ("amd64", "arm64"):
        raise InstallError(f"this is {asset}, and this computer wants trammel-{wanted}.zip")
    raise InstallError(f"this is {asset}, and the programs of this system are for {wanted}, whatever its kernel is; no archive is "
                       "made for that: install a 64-bit system, or build trammel from its sources (docs/howto/install.md)")
