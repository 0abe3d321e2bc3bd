# SPDX-License-Identifier: Apache-2.0
"""Tests the guide and the references as HTML."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
BUILD = Path(os.environ["ABSENC"]).parent.parent
sys.path.insert(0, str(SOURCE / "docs/site"))

import build  # noqa: E402: the module is in the folder of the pages
import check  # noqa: E402


class Documents(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory(prefix="absenc-docs-")
        cls.addClassCleanup(folder.cleanup)
        cls.html = Path(folder.name) / "html"
        cls.done = subprocess.run(["/usr/bin/python3", "-B", SOURCE / "docs/site/build.py", BUILD, folder.name], capture_output=True,
                                  text=True, check=False, timeout=800)

    def test_build_has_no_problems(self):
        self.assertEqual((self.done.returncode, self.done.stderr), (0, ""), self.done.stdout)
        self.assertRegex(self.done.stdout, r"^\d+ pages, 0 problems: ")

    def test_has_guide_and_references(self):
        for page, text in (("index.html", "absenc reads"), ("docs/read.html", "absenc identify"), ("absenc/protocol/ssi/README.html", "SSI"),
                           ("python-reference.html", "absenc.open"), ("man/absenc.1.html", "EXIT STATUS"),
                           ("api/classabsenc_1_1client_1_1Encoder.html", "Encoder"), ("api/namespaceabsenc_1_1client.html", "open"), ("api/structabsenc_1_1Reading.html", "singleturn_bits")):
            with self.subTest(page):
                shown = re.sub(r"<[^>]*>", "", (self.html / page).read_text(encoding="utf-8"))
                self.assertTrue(text in " ".join(shown.split()), f"{text!r} is not on {page}")

    def test_every_namespace_is_described(self):
        """Doxygen omits the functions of a namespace without a description, and gives no warning."""
        described = set(re.findall(r"\\namespace (\S+)", (SOURCE / "docs/site/namespaces.dox").read_text(encoding="utf-8")))
        opened_in = {}
        for path in (self.html.parent / "installed/include").rglob("*.hpp"):
            names, before = [], ""
            for line in path.read_text(encoding="utf-8").splitlines():
                if opened := re.match(r"(?:inline )?namespace ([\w:]+) \{", line):
                    names.append(opened[1])
                    name = "::".join(names)
                    internal = names[-1] in ("detail", "script", "shown", "vector_texts") or name in ("absenc::esl::choices", "absenc::esl::request")
                    # Doxyfile.in lists the internal namespaces; these need no description.
                    if not internal:
                        opened_in[name] = path
                    if before.startswith("///"):  # the namespace needs a description in only one of its headers
                        described.add(name)
                elif line.startswith("}  // namespace"):
                    names.pop()
                before = line
        for name, path in opened_in.items():
            self.assertIn(name, described, path)

    def test_only_installed_headers_are_shown(self):
        shown = {path.name for path in (self.html / "api").glob("*_8hpp_source.html")}
        self.assertIn("emulate_8hpp_source.html", shown)
        self.assertFalse({name for name in shown if "test" in name})


class Checks(unittest.TestCase):
    def problems(self, text, **files):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "page.html").write_text(text, encoding="utf-8")
            for name, content in files.items():
                (Path(folder) / name.replace("_", ".")).write_text(content, encoding="utf-8")
            return check.problems(folder)

    def test_links(self):
        other = {"other_html": '<p id="here">'}
        self.assertEqual(self.problems('<a href="other.html#here">a</a> <a href="https://example.org/a#b">b</a>', **other), [])
        for link in ("none.html", "other.html#there", "#there", "../page.html", "https://", "file:///etc"):
            with self.subTest(link):
                self.assertEqual(len(self.problems(f'<a href="{link}">a</a>', **other)), 1)

    def test_loaded_files(self):
        for text in ('<script src="https://example.org/a.js"></script>', '<link rel="stylesheet" href="//example.org/a.css">',
                     '<img src="none.png">', '<p style="background: url(http://example.org/a.png)">'):
            with self.subTest(text):
                self.assertEqual(len(self.problems(text)), 1)
        for style in ("@import 'https://example.org/a.css';", "p { background: url(http://example.org/a.png) }"):
            with self.subTest(style):
                self.assertEqual(len(self.problems("<p>", a_css=style)), 1)

    def test_undocumented_declaration_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            headers = Path(folder) / "headers"
            headers.mkdir()
            (headers / "toy.hpp").write_text("/// A toy.\nstruct Toy {\n  int size;\n};\n", encoding="utf-8")
            self.assertIn("toy.hpp:3: error: Member size", "\n".join(build.doxygen_of(headers, Path(folder), Path(folder) / "html", "1")))


if __name__ == "__main__":
    unittest.main()
