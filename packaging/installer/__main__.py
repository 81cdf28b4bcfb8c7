"""install.sh's command line."""
import argparse
import os
import pathlib
import pwd
import signal
import subprocess
import sys

from . import InstallError, install, printers

DESCRIPTION = """\
Makes trammel known to each printer of this user: its macros and a trammel.toml in the printer's config folder, a section
with which Moonraker updates trammel, and a service that calibrates when the printer's screen asks for it. What is there
already stays. Run again after anything went wrong; --uninstall takes all of it back."""


SYSTEM = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"}  # whatever the environment names


def run(words, text=None):
    """@param text  standard input; None: this process's own"""
    try:
        done = subprocess.run(words, input=text, check=False, env=os.environ | SYSTEM)
    except OSError as error:
        raise InstallError(f"{words[0]} cannot be run ({error}); --no-unit installs without a service") from error
    if done.returncode != 0:
        raise InstallError(f"{' '.join(words)} failed ({done.returncode}); run install.sh again once that is mended")


def parse(words):
    parser = argparse.ArgumentParser(prog="install.sh", description=DESCRIPTION,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=pathlib.Path, required=True, help=argparse.SUPPRESS)
    parser.add_argument("--printer", type=pathlib.Path, action="append", metavar="FOLDER",
                        help="only this printer's folder, such as ~/printer_data; may be given again")
    parser.add_argument("--no-unit", action="store_true", help="no service, for which sudo is asked")
    parser.add_argument("--link", default="", metavar="URL", help="add a link to this page to Mainsail's navigation")
    parser.add_argument("--remind", action="store_true",
                        help="add 'Calibrate pressure advance', due every 90 days, to Mainsail's maintenance")
    parser.add_argument("--uninstall", action="store_true", help="take out what was installed, and nothing else")
    return parser.parse_args(words)


def main():
    arguments = parse(sys.argv[1:])
    home = pathlib.Path.home()
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: sys.exit("install.sh: stopped; everything is as it was before"))
    try:
        if os.geteuid() == 0:
            raise InstallError("run as the printer's own user, not as root: sudo is asked for the service alone")
        if arguments.uninstall:
            remarks = install.uninstall(home, arguments.program, run)
            done = f"taken out; {arguments.program} itself is yours to remove"
        else:
            release = printers.release_of(arguments.program, printers.architecture())
            found = list(dict.fromkeys(folder.resolve() for folder in arguments.printer or printers.find_printers(home)))
            units = None if arguments.no_unit else pathlib.Path("/etc/systemd/system")
            user = pwd.getpwuid(os.getuid()).pw_name
            remarks = install.install(home, arguments.program, found, units, user, release, arguments.link, run, arguments.remind)
            done = (f"installed for {', '.join(map(str, found))}. Restart Moonraker; name the filament in trammel.toml; "
                    f"{arguments.program}/share/trammel/klipper/README.md says how to include trammel.cfg")
    except (InstallError, OSError) as error:
        sys.exit(f"install.sh: {error}")
    except KeyboardInterrupt:
        sys.exit("install.sh: stopped; everything is as it was before")
    for remark in remarks:
        print(f"note: {remark}")
    print(done)


if __name__ == "__main__":
    main()
