# SPDX-License-Identifier: Apache-2.0
"""Runs Windows programs under wine, in a prefix of its own."""
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile

WINE = "/usr/lib/wine/wine64"
SERVER = "/usr/lib/wine/wineserver64"


class Prefix:
    """A new wine prefix with its server, which ends with the context."""

    def __init__(self):
        self.folder = tempfile.mkdtemp(prefix="absenc-wine-")
        self.environment = {**os.environ, "WINEPREFIX": self.folder, "WINEDEBUG": "-all",
                            "WINEDLLOVERRIDES": "mscoree=;mshtml="}  # no offer to install .NET and a browser
        for name in ("DISPLAY", "WAYLAND_DISPLAY"):
            self.environment.pop(name, None)

    def __enter__(self):
        # The server and the services of wine run until the end: none may keep a pipe of a test open.
        self.run([SERVER, "-p"])
        self.run([WINE, "wineboot", "--init"])
        return self

    def __exit__(self, *_):
        self.run([SERVER, "-k"])
        self.run([SERVER, "-w"])
        shutil.rmtree(self.folder, ignore_errors=True)

    def run(self, command):
        subprocess.run(command, env=self.environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, start_new_session=True, check=False, timeout=180)

    def link_port(self, number, path):
        """Makes COM<number> lead to the terminal at `path`, or nowhere if `path` is None."""
        link = os.path.join(self.folder, "dosdevices", f"com{number}")
        with contextlib.suppress(FileNotFoundError):
            os.unlink(link)
        if path is not None:
            os.symlink(os.path.realpath(path), link)

    def user_folder(self, name):
        """Returns the path of a folder of the user, "Roaming" (%APPDATA%) or "Local" (%LOCALAPPDATA%)."""
        users = os.path.join(self.folder, "drive_c", "users")
        user = next(one for one in os.listdir(users) if one != "Public")
        return os.path.join(users, user, "AppData", name)


def main():
    """Runs the command line in a new prefix, and returns its exit status."""
    with Prefix() as prefix:
        return subprocess.run(sys.argv[1:], env=prefix.environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
