"""The service of each printer: the one thing for which the installer asks for root's rights, by sudo."""
import pathlib
import re
import tempfile

from . import InstallError, edits


def unit_name(index, data):
    """trammel for the first printer; the others' restart with it, as Moonraker restarts that one."""
    return "trammel" if index == 0 else f"trammel-{data.name}"


def unit_text(template, name, user, home, program, data, answers_taps=False):
    """The template of klipper/ for one user, program and printer's folder.

    @param template      text of trammel@.service
    @param answers_taps  whether it answers TRAMMEL_TAP, too
    """
    for path in (program, data):
        if re.search(r"[\s%\"'\\$]", str(path)):
            raise InstallError(f"{path}: systemd wants a path without blanks, quotes, % and $; move it, or give --no-unit")
    text = template[template.index("[Unit]") :]
    for old, new in (
        ("/usr/bin/trammel", f"{program}/bin/trammel"),
        ("/home/%i/trammel/trammel.toml", f"{data}/config/trammel.toml"),
        ("/home/%i/trammel", f"{data}/trammel"),
        ("/home/%i", str(home)),
        ("%i", user),
    ):
        text = text.replace(old, new)
    if answers_taps:
        text = re.sub(r"^(ExecStart=.*)$", r"\1 --answer-taps", text, count=1, flags=re.MULTILINE)
    return text if name == "trammel" else text.replace("[Service]", "PartOf=trammel.service\n\n[Service]", 1)


def edit_unit(units, name, text, run):
    """@param run  runs a command; raises InstallError where it fails"""
    path = units / f"{name}.service"
    data = text.encode()

    def change():
        with tempfile.NamedTemporaryFile() as copy:
            copy.write(data)
            copy.flush()
            run(["sudo", "install", "-m", "644", copy.name, str(path)])
        run(["sudo", "systemctl", "daemon-reload"])
        run(["sudo", "systemctl", "enable", "--now", name])

    return {"kind": "unit", "path": str(path), "sha256": edits.sha256(data)}, change


def undo_unit(record, run):
    path = pathlib.Path(record["path"])
    if not path.exists():
        return None
    if edits.sha256(path.read_bytes()) != record["sha256"]:
        return f"{path} was changed since and is left: sudo systemctl disable --now {path.stem}"
    run(["sudo", "systemctl", "disable", "--now", path.stem])
    run(["sudo", "rm", str(path)])
    run(["sudo", "systemctl", "daemon-reload"])
    return None
