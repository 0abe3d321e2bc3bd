#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs the Debian packages in a clean Debian 12 without a network, and tries them."""
import json
import re
import subprocess
import unittest

from root_support import PACKAGES, RELEASE, VERSION, RootCase, WholeInstallation, artefact, debian_12

# Tags of lintian that are allowed, and why.
ALLOWED = {}


class Installed(WholeInstallation, RootCase):
    archive = staticmethod(debian_12)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.case = cls()
        for package in PACKAGES:
            cls.case.put(artefact(f"{package}_*_amd64.deb"))
        cls.case.shell("dpkg -i /srv/*.deb", timeout=300)

    def test_command_loads_few_libraries(self):
        loaded = self.shell("ldd /usr/bin/absenc").splitlines()
        self.assertLessEqual(len(loaded), 20, loaded)
        self.assertEqual([line for line in loaded if re.search("hdf5|curl|gnutls|ldap", line)], [])

    def test_service_has_a_user_and_waits_for_its_configuration(self):
        self.assertIn("dialout", self.run_inside("id", "absenc"))
        unit = (self.root / "lib/systemd/system/absenc.service").read_text()
        self.assertIn("ConditionPathExists=/etc/absenc/absenc.toml", unit)
        self.assertIn("enabled", self.run_inside("systemctl", "--root=/", "is-enabled", "absenc.service"))
        self.assertEqual(self.run_inside("systemd-analyze", "verify", "/lib/systemd/system/absenc.service", status=None).count(
            "absenc.service:"), 0)


class Upgraded(RootCase):
    """A package with the files of version 0.1.0, and what becomes of it."""

    archive = staticmethod(debian_12)

    def test_upgrade_remove_and_purge(self):
        old = self.scratch / "old"
        for path, text in (("usr/bin/absenc", "#!/bin/sh\n"), ("usr/lib/systemd/system/absenc.service", "[Unit]\n"),
                           ("usr/share/doc/absenc/serve.md", "x\n")):
            file = old / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        (old / "DEBIAN").mkdir()
        (old / "DEBIAN/control").write_text("Package: absenc\nVersion: 0.1.0\nArchitecture: amd64\nMaintainer: a <a@b.invalid>\n"
                                            "Description: old\n")
        subprocess.run(["dpkg-deb", "--root-owner-group", "-b", old, self.root / "srv/old.deb"], check=True, capture_output=True)
        self.shell("dpkg -i /srv/old.deb; mkdir -p /etc/absenc /var/lib/absenc; echo x > /etc/absenc/absenc.toml;"
                   "echo x > /var/lib/absenc/history.sqlite")
        for package in ("absenc", "absenc-serve", "absenc-hdf5", "python3-absenc"):
            self.put(artefact(f"{package}_*_amd64.deb"))
        # apt installs the packages in this order, because absenc-serve breaks the old absenc
        self.shell("dpkg -i /srv/absenc_*.deb; dpkg -i /srv/absenc-*.deb /srv/python3-*.deb", timeout=300)
        self.assertIn(f"absenc {VERSION}", self.run_inside("absenc", "--version"))
        self.assertIn("absenc-serve", self.shell("dpkg -S lib/systemd/system/absenc.service"))
        self.shell("python3 -c 'import absenc'")  # Python compiles the modules
        self.shell("dpkg -r absenc-serve absenc-hdf5 python3-absenc absenc")
        for kept in ("etc/absenc/absenc.toml", "var/lib/absenc/history.sqlite"):
            self.assertTrue((self.root / kept).exists(), kept)
        self.assertFalse((self.root / "usr/lib/absenc").exists())
        self.assertFalse((self.root / "usr/lib/python3/dist-packages/absenc").exists())
        self.shell("dpkg -P absenc-serve absenc-hdf5 absenc")
        self.assertFalse((self.root / "var/lib/absenc").exists())
        self.assertTrue((self.root / "etc/absenc/absenc.toml").exists(), "the user wrote it, so it stays")
        self.assertEqual(self.shell("dpkg -l | grep absenc || true"), "")


class Artefacts(unittest.TestCase):
    def test_lintian(self):
        packages = sorted(RELEASE.glob("*.deb"))
        self.assertGreater(len(packages), 4)
        said = subprocess.run(["lintian", "--allow-root", "--tag-display-limit", "0", *packages], capture_output=True, text=True,
                              timeout=600).stdout
        tags = [line for line in said.splitlines() if line.startswith(("E:", "W:"))]
        self.assertEqual([line for line in tags if line.split(": ")[2].split()[0] not in ALLOWED], [])

    def test_sums_and_lists_are_complete(self):
        subprocess.run(["sha256sum", "--check", "--quiet", "SHA256SUMS"], cwd=RELEASE, check=True)
        names = {path.name for path in RELEASE.iterdir()}
        listed = {line.split()[1] for line in (RELEASE / "SHA256SUMS").read_text().splitlines()}
        self.assertEqual(listed, names - {"SHA256SUMS"})
        spdx = json.loads((RELEASE / "absenc.spdx.json").read_text())
        files = {one["packageFileName"] for one in spdx["packages"] if "packageFileName" in one}
        self.assertEqual(files, names - {"SHA256SUMS", "absenc.spdx.json", f"absenc-{VERSION}-licences.tar.gz"})
        known = {one["SPDXID"] for one in spdx["packages"]}
        for relation in spdx["relationships"]:
            self.assertIn(relation["relatedSpdxElement"], known)


if __name__ == "__main__":
    unittest.main()
