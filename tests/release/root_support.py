# SPDX-License-Identifier: Apache-2.0
"""Clean Linux systems in folders, in which the artefacts of ./dev release are tried without a network."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parents[2]))
VERSION = (SOURCE / "VERSION").read_text().strip()
RELEASE = Path(os.environ.get("ABSENC_RELEASE", SOURCE / f"build/release-{VERSION}"))
ROOTS = SOURCE / "build/release-roots"
sys.path.insert(0, str(SOURCE / "tests"))
from capture_support import write_each_format
from command_support import absenc

PACKAGES = ("absenc", "absenc-serve", "absenc-hdf5", "libabsenc-dev", "python3-absenc")
# Command that runs a program with another root folder (chroot): the program has no network but its own loopback, and
# none of its processes outlives the test.
ISOLATED = ["unshare", "--net", "--mount", "--pid", "--fork", "--kill-child", "sh", "-ec",
            'ip link set lo up 2>/dev/null || true; mount --bind /dev "$1/dev"; mount -t proc proc "$1/proc"; '
            'mount -t devpts -o newinstance,ptmxmode=0666 devpts "$1/dev/pts" 2>/dev/null || true; '
            'root=$1; shift; exec chroot "$root" "$@"', "sh"]


def artefact(pattern):
    found = sorted(RELEASE.glob(pattern))
    if len(found) != 1:
        raise AssertionError(f"{RELEASE} has {len(found)} of {pattern}, but should have 1")
    return found[0]


def base(name, suite, packages):
    """Returns the archive of a root with these packages; makes it once, from Debian's archive."""
    path = ROOTS / f"{name}.tar"
    wanted = f"{suite} {' '.join(packages)}\n"
    made_of = ROOTS / f"{name}.packages"
    if not path.is_file() or not made_of.is_file() or made_of.read_text() != wanted:
        ROOTS.mkdir(parents=True, exist_ok=True)
        subprocess.run(["mmdebstrap", "--variant=minbase", f"--include={','.join(packages)}", suite, path], check=True,
                       capture_output=True, timeout=600)
        made_of.write_text(wanted)
    return path


def dependencies(package, architecture="amd64"):
    """Returns the names of the packages that this package of absenc needs."""
    fields = subprocess.run(["dpkg-deb", "-f", artefact(f"{package}_*_{architecture}.deb"), "Depends"], check=True,
                            capture_output=True, text=True).stdout
    return set(re.findall(r"(?:^|, )([a-z0-9.+-]+)", fields.strip()))


def debian_12():
    """Returns the archive of a root with all that the packages of absenc need, and the tools with which they are tried."""
    tools = {"iproute2", "curl", "ca-certificates", "systemd", "python3-h5py"}
    return base("bookworm-with-dependencies", "bookworm", sorted(tools.union(*map(dependencies, PACKAGES)) - set(PACKAGES)))


class RootCase(unittest.TestCase):
    """A test in a root that is unpacked for each class."""

    archive = None  # function that returns the path of the archive that is unpacked as root folder
    isolated = ISOLATED
    programs = "/usr/sbin:/usr/bin:/sbin:/bin"  # the folders with programs (PATH)

    @classmethod
    def setUpClass(cls):
        if os.geteuid() != 0:
            raise AssertionError("a clean root needs root: run ./dev release --test as root")
        cls.scratch = Path(tempfile.mkdtemp(prefix="absenc-root-"))
        cls.addClassCleanup(shutil.rmtree, cls.scratch)
        cls.root = cls.scratch / "root"
        cls.root.mkdir()
        if cls.archive is not None:
            subprocess.run(["tar", "-xf", cls.archive(), "-C", cls.root, "--exclude=./dev/*"], check=True)
        for folder in ("dev", "proc", "tmp", "srv"):
            (cls.root / folder).mkdir(exist_ok=True)

    def run_inside(self, *command, status=0, timeout=120):
        done = subprocess.run([*self.isolated, str(self.root), *map(str, command)], stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=timeout,
                              env={"PATH": self.programs, "HOME": "/srv", "LC_ALL": "C.UTF-8",
                                   "DEBIAN_FRONTEND": "noninteractive"})
        if status is not None:
            self.assertEqual(done.returncode, status, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
        return done.stdout + done.stderr

    def put(self, path, name=None):
        shutil.copy(path, self.root / "srv" / (name or Path(path).name))

    def shell(self, script, **settings):
        return self.run_inside("sh", "-euc", script, **settings)

    def try_the_command(self, command):
        """Tries what each installation of the command can do."""
        self.put(SOURCE / "examples/tformat.txt")
        self.assertRegex(self.run_inside(command, "--version"), rf"^absenc {re.escape(VERSION)}\n")
        self.assertIn("tformat", self.run_inside(command, "list"))
        self.assertIn("turns", self.run_inside(command, "read", "sim:tformat"))
        # one reply in the capture tformat.txt is damaged on purpose
        self.assertIn("bad_checksum", self.run_inside(command, "decode", "tformat", "/srv/tformat.txt", "--csv", status=1))
        self.assertIn("tformat", self.run_inside(command, "identify", "/srv/tformat.txt"))
        self.try_each_format(command)
        self.assertIn("good", self.run_inside(command, "doctor", "sim:tformat", "--readings", "100"))
        self.run_inside(command, "record", "sim:tformat", "--output", "/srv/log.csv", "--count", "3")
        self.assertTrue((self.root / "srv/log.csv").read_text().startswith("# absenc record 1\n"))
        (self.root / "srv/log.csv").unlink()
        said = self.shell(f"""
            {command} emulate tformat --tcp 0 --for 20 >/tmp/emulator 2>&1 & emulator=$!
            while ! grep -q '^ready: tcp' /tmp/emulator; do kill -0 $emulator; done
            {command} read "tformat:$(sed -n 's/^ready: //p' /tmp/emulator | grep tcp)" --count 2
            kill $emulator""")
        self.assertEqual(said.count("no alarms"), 2, said)

    def try_each_format(self, command):
        """Decodes captures in each format, as the command of this computer does."""
        folder = self.root / "srv/captures"
        folder.mkdir()
        for path, (protocol, *options) in write_each_format(folder):
            with self.subTest(path.name):
                here = absenc("decode", protocol, str(path), *options, "--json")
                inside = self.run_inside(command, "decode", protocol, str(path).removeprefix(str(self.root)), *options, "--json",
                                         status=here.returncode)
                self.assertEqual(inside, (here.stdout + here.stderr).replace(str(self.root), ""))
                self.assertIn('"singleturn"', inside)
        shutil.rmtree(folder)


class WholeInstallation:
    """What an installation of all packages can do, for classes with RootCase."""

    def test_command(self):
        self.try_the_command("absenc")

    def test_waveforms(self):
        for ending in ("sr", "vcd", "csv"):
            with self.subTest(ending):
                name = f"/srv/wave.{ending}"
                self.run_inside("absenc", "wave", "tformat", name)
                self.assertIn("deg", self.run_inside("absenc", "decode", "tformat", name))

    def test_hdf5(self):
        self.run_inside("absenc", "record", "sim:tformat", "--output", "/srv/log.h5", "--count", "3")
        said = self.run_inside("/usr/bin/python3", "-c", "import h5py; print(sum(h5py.File('/srv/log.h5')['singleturn_valid'][:] == 1))")
        self.assertEqual(said, "3\n")

    def test_server_with_its_page(self):
        said = self.shell("""
            absenc serve sim:tformat --listen 127.0.0.1:8420 --history none >/tmp/serve 2>&1 & server=$!
            while ! grep -q '^http' /tmp/serve; do kill -0 $server; done
            curl -fsS http://127.0.0.1:8420/ | head -c 300
            echo
            curl -fsS http://127.0.0.1:8420/openapi.json | head -c 100
            kill $server""")
        self.assertIn("<!doctype html>", said.lower())
        self.assertIn("openapi", said)

    def test_python(self):
        self.assertIn("True", self.run_inside("python3", "-c", "import absenc; print(absenc.open('sim:tformat').read().valid)"))
