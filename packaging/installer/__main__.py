"""install.sh's command line."""
import argparse
import getpass
import os
import pathlib
import platform
import subprocess
import sys

from . import InstallError, install, printers

DESCRIPTION = """\
Makes trammel known to each printer of this user: its macros and a trammel.toml in the printer's config folder, a section
with which Moonraker updates trammel, and a service that calibrates when the printer's screen asks for it. What is there
already stays. Run again after anything went wrong; --uninstall takes all of it back."""


def run(words):
    done = subprocess.run(words, check=False)
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
    try:
        if os.geteuid() == 0:
            raise InstallError("run as the printer's own user, not as root: sudo is asked for the service alone")
        if arguments.uninstall:
            remarks = install.uninstall(home, run)
            done = f"taken out; {arguments.program} itself is yours to remove"
        else:
            release = printers.release_of(arguments.program, platform.machine())
            found = [folder.resolve() for folder in arguments.printer or printers.find_printers(home)]
            units = None if arguments.no_unit else pathlib.Path("/etc/systemd/system")
            remarks = install.install(home, arguments.program, found, units, getpass.getuser(), release, arguments.link,
                                      run, arguments.remind)
            done = (f"installed for {', '.join(map(str, found))}. Restart Moonraker; name the filament in trammel.toml; "
                    f"{arguments.program}/share/trammel/klipper/README.md says how to include trammel.cfg")
    except (InstallError, OSError) as error:
        sys.exit(f"install.sh: {error}")
    for remark in remarks:
        print(f"note: {remark}")
    print(done)


if __name__ == "__main__":
    main()
