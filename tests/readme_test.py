# SPDX-License-Identifier: Apache-2.0
"""Tests that the README and other pages show real output, by running their examples."""
import os
import re
import select
import subprocess
import tempfile
import textwrap
import time
import unittest
from pathlib import Path

from command_support import ABSENC, PATIENCE, end
from mqtt_support import free_port
from python_support import PACKAGE

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
PAGES = ["README.md", *(f"docs/{name}.md" for name in ("read", "set-up", "record", "serve", "decode", "test-a-drive", "doctor", "cpp",
                                                        "python", "add-an-encoder", "write-a-unit"))]
PORT = "/dev/ttyUSB0"
# Languages of code blocks that this test does not run.
OTHERS = {"sh", "text", "cmake", "cpp", "yaml", "nginx", "caddy"}


def blocks(text):
    """Returns (language, content) of each code block of a page, in order."""
    return re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def commands(block):
    """Returns (command, lines of output shown below it) for each command of a code block."""
    found = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif found:
            found[-1][1].append(line)
    return found


def masked(text):
    """Returns the lines of the text with each number replaced by N, because numbers vary."""
    text = re.sub(r" \(\d+ failed(; this computer itself was up to [^)]*)?\)", "", text)
    text = re.sub(r", and this computer itself was up to [^;]*", "", text)
    return [re.sub(r"\s+", " ", re.sub(r"\d+(\.\d+)?", "N", line)).strip() for line in text.splitlines() if line.strip()]


class Page:
    """Runs the examples of a page in a temporary folder."""

    def __init__(self, name, folder):
        self.text = (SOURCE / name).read_text(encoding="utf-8")
        self.folder = folder
        self.running = []
        self.port = free_port()  # this port replaces the default port of `absenc serve` in the examples
        (folder / "bin").mkdir()
        (folder / "bin" / "absenc").symlink_to(ABSENC)
        self.environment = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}", "PYTHONPATH": str(PACKAGE), "HOME": str(folder),
                            "XDG_STATE_HOME": str(folder / "state"), "ABSENC_CONFIG": str(folder / "absenc.toml")}
        (folder / "absenc.toml").touch()
        for encoder in re.findall(rf"^<!-- tests: {PORT} is (.*) -->$", self.text, re.MULTILINE):
            self.start(f"absenc emulate {encoder} --pty {PORT}")

    def here(self, text):
        return text.replace("/tmp/", f"{self.folder}/").replace(PORT, f"{self.folder}/ttyUSB0").replace("127.0.0.1:8420", f"127.0.0.1:{self.port}")

    def start(self, command):
        """Starts the command in the background, and waits for its first line."""
        process = subprocess.Popen(["bash", "-c", "exec " + self.here(command)], cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.running.append(process)
        deadline = time.monotonic() + PATIENCE
        said = select.select([process.stdout, process.stderr], [], [], deadline - time.monotonic())[0]
        if not said or not said[0].readline():
            raise AssertionError(f"{command} did not become ready: {end(process)}")

    def run(self, command):
        wanted = re.search(r"# exit status (\d+)$", command)
        if command.endswith("&"):
            self.start(command.removesuffix("&"))
            return ""
        done = subprocess.run(["bash", "-c", self.here(command)], cwd=self.folder, env=self.environment, capture_output=True, text=True,
                              timeout=PATIENCE * 4, stdin=subprocess.DEVNULL, check=False)
        if done.returncode != int(wanted[1] if wanted else 0):
            raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}{done.stderr}")
        return done.stdout.replace(f"{self.folder}/ttyUSB0", PORT)

    def close(self):
        for process in self.running:
            end(process)


class Readme(unittest.TestCase):
    maxDiff = None

    def test_examples_of_each_page_run(self):
        for name in PAGES:
            with self.subTest(page=name), tempfile.TemporaryDirectory() as folder:
                page = Page(name, Path(folder))
                self.addCleanup(page.close)
                self.run_page(page)
                page.close()

    def run_page(self, page):
        for language, block in blocks(page.text):
            if language == "toml":
                with open(page.folder / "absenc.toml", "a", encoding="utf-8") as file:
                    file.write(page.here(block))
            elif language == "python":
                done = subprocess.run(["/usr/bin/python3", "-c", block], cwd=page.folder, env=page.environment, capture_output=True, text=True,
                                      timeout=PATIENCE * 4, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)
            elif language == "console":
                for command, shown in commands(block):
                    output = page.run(command)
                    if shown:
                        self.assertEqual(masked(output), masked("\n".join(shown)), command)
            elif language == "":
                self.assertNotRegex(block, r"(?m)^\$? ?absenc ", "a command in a block that nobody runs")
            else:
                self.assertIn(language, OTHERS)

    def test_readme_is_short_and_begins_with_picture(self):
        text = (SOURCE / "README.md").read_text(encoding="utf-8")
        self.assertLess(len(text.splitlines()), 220)
        self.assertLess(text.index("docs/pictures/serve-overview.png"), text.index("\n## "))
        for line in text.splitlines():
            self.assertTrue(len(line) <= 120 or line.startswith(("|", "!", "warning:", "good:")), line)

    def test_programs_equal_examples(self):
        shown = [block for language, block in blocks((SOURCE / "docs/cpp.md").read_text(encoding="utf-8")) if language == "cpp"]
        examples = ["read_by_name.cpp", "read_position.cpp"]
        self.assertEqual(len(shown), len(examples))
        for name, block in zip(examples, shown):
            example = (SOURCE / "examples" / name).read_text(encoding="utf-8")
            self.assertEqual(textwrap.dedent(example.split("// [readme]\n")[1].rsplit("\n", 1)[0]).strip(), block.strip())

    def test_code_of_unit_equals_source(self):
        """The code in docs/write-a-unit.md must be code of the unit nikon, which is compiled."""
        def stripped(text):
            return "\n".join(line.strip() for line in text.strip().splitlines())
        sources = [stripped(path.read_text(encoding="utf-8")) for path in (SOURCE / "absenc/protocol/nikon").glob("*.?pp")]
        shown = [block for language, block in blocks((SOURCE / "docs/write-a-unit.md").read_text(encoding="utf-8")) if language == "cpp"]
        self.assertGreater(len(shown), 10)
        for block in shown:
            self.assertTrue(any(stripped(block) in source for source in sources), block)

    def test_first_firmware_program_equals_source(self):
        shown = next(block for language, block in blocks((SOURCE / "docs/firmware.md").read_text(encoding="utf-8")) if language == "cpp")
        source = (SOURCE / "firmware/hookup/first_reading.cpp").read_text(encoding="utf-8")
        self.assertEqual(source.split("\n", 2)[2].strip(), shown.strip())

    def test_programs_of_drive_equal_sources(self):
        shown = [block.strip() for language, block in blocks((SOURCE / "docs/drive.md").read_text(encoding="utf-8")) if language == "cpp"]
        sources = [SOURCE / "firmware/hookup" / name for name in ("drive_tformat.cpp", "drive_biss.cpp")]
        self.assertEqual(shown, [path.read_text(encoding="utf-8").split("\n", 2)[2].strip() for path in sources])

    def test_links_lead_to_files_and_headings(self):
        for name in [*PAGES, "docs/encoders.md"]:
            text = (SOURCE / name).read_text(encoding="utf-8")
            links = re.findall(r"\]\((?!https?:)([^)]+)\)", text)
            for link in links:
                with self.subTest(page=name, link=link):
                    path, _, anchor = link.partition("#")
                    target = (SOURCE / name).parent / path if path else SOURCE / name
                    self.assertTrue(target.exists())
                    if anchor:
                        headings = re.findall(r"^#+ (.+)$", target.read_text(encoding="utf-8"), re.MULTILINE)
                        self.assertIn(anchor, [re.sub(r"[^\w -]", "", heading).lower().replace(" ", "-") for heading in headings])


if __name__ == "__main__":
    unittest.main()
