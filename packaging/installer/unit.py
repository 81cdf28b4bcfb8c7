"""The service of each printer: the one thing for which the installer asks for root's rights, by sudo."""
import pathlib
import re

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


def bring(path, old, new, run):
    """Brings a service from one text to another; None: there is none. The same text twice: starts it anew.

    @param run  runs a command with a standard input; raises InstallError where it fails
    """
    if new is None:
        run(["sudo", "systemctl", "disable", "--now", path.stem])
        run(["sudo", "rm", str(path)])
        run(["sudo", "systemctl", "daemon-reload"])
        return
    if new != old:
        run(["sudo", "install", "-m", "644", "/dev/stdin", str(path)], new)
        run(["sudo", "systemctl", "daemon-reload"])
    run(["sudo", "systemctl", "enable", "--now", path.stem])
    if old is not None:
        run(["sudo", "systemctl", "restart", path.stem])


def put_back(file, run):
    """Takes back what bring() did, however far it came."""
    there, _ = edits.read_regular(file.path)
    if there != file.before:
        bring(file.path, there, file.before, run)
