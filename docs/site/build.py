#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Builds guide and references as one folder of HTML that needs no network: build.py BUILD_TREE OUTPUT

BUILD_TREE is a release build with the Python package and the man page. Warnings are errors. The index is
OUTPUT/html/index.html."""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import check

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
AWESOME = Path("/usr/share/doxygen-awesome-css/doxygen-awesome.css")
PAGES = ["README.md", "CONTRIBUTING.md", "docs/*.md", "absenc/protocol/*/README.md", "tests/abuse/README.md"]
# Lists of the pages in the index, each with the caption that stands above it; the README is the index itself. Sphinx
# reports a page that no list names as an error.
CONTENTS = {
    "Use": ["docs/read", "docs/set-up", "docs/record", "docs/serve", "docs/mqtt", "docs/tap", "docs/decode", "docs/doctor",
            "docs/test-a-drive", "docs/clock-cable", "docs/windows", "man/absenc.1"],
    "Program": ["docs/cpp", "cpp-reference", "docs/python", "python-reference", "docs/firmware", "docs/drive"],
    "Encoders": ["docs/encoders", "absenc/protocol/*/README", "docs/add-an-encoder", "docs/write-a-unit", "docs/line-faults", "docs/dump-format"],
    "Project": ["docs/architecture", "docs/benchmarks", "docs/stability", "CONTRIBUTING", "tests/abuse/README"],
}


def run(*command, **settings):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, **settings)
    return done.returncode, done.stdout


def contents():
    """Tables of contents for the sidebar."""
    text = ""
    for caption, pages in CONTENTS.items():
        lines = "\n".join(pages)
        text += f"\n```{{toctree}}\n:caption: {caption}\n:hidden:\n:glob:\n:maxdepth: 1\n\n{lines}\n```\n"
    return text


def staged(text):
    """A page of the repository for Sphinx, where the README is the index."""
    return re.sub(r"\]\(((?:\.\./)*)README\.md(#[^)]*)?\)", r"](\1index.md\2)", text)


def stage(build, source):
    """Copies the pages, with the files that they link to, into the folder that Sphinx reads."""
    for page in sorted(path for pattern in PAGES for path in ROOT.glob(pattern)):
        name = page.relative_to(ROOT)
        text = page.read_text(encoding="utf-8")
        target = source / (Path("index.md") if str(name) == "README.md" else name)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(staged(text) + (contents() if target.name == "index.md" else ""), encoding="utf-8")
        for link in re.findall(r"\]\((?!https?:|#)([^)#]+)", text):
            file = (page.parent / link).resolve()
            if file.suffix != ".md" and file.is_file():
                copy = source / file.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file, copy)
    for name in ("conf.py", "cpp-reference.md", "python-reference.md"):
        shutil.copyfile(HERE / name, source / name)
    (source / "_static").mkdir()
    shutil.copyfile(HERE / "guide.css", source / "_static/guide.css")
    status, page = run("mandoc", "-T", "html", "-O", "fragment", build / "manual/absenc.1")
    if status:
        raise SystemExit(page)
    (source / "man").mkdir()
    (source / "man/absenc.1.html").write_text(page, encoding="utf-8")
    (source / "man/absenc.1.md").write_text("# absenc(1)\n\n```{raw} html\n:file: absenc.1.html\n```\n", encoding="utf-8")


def sphinx(build, source, html, version):
    environment = {**os.environ, "ABSENC_PYTHON": str(build / "python"), "ABSENC_VERSION": version, "PYTHONDONTWRITEBYTECODE": "1"}
    status, said = run("/usr/bin/python3", "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-d", source.parent / "doctrees",
                       source, html, env=environment)
    return [line for line in said.splitlines() if line] or ([f"sphinx ended with status {status}"] if status else [])


def without_dead_links(html):
    """Removes Doxygen's links to lists of nested types on pages where all of these are private."""
    for page in html.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        if 'href="#nested-classes"' in text and 'name="nested-classes"' not in text:
            page.write_text(re.sub(r'<a href="#nested-classes">[^<]*</a>( &#124;)?', "", text), encoding="utf-8")


def doxygen(build, output, html, version):
    installed = output / "installed"
    status, said = run("cmake", "--install", build, "--component", "libabsenc-dev", "--prefix", installed)
    return [said] if status else doxygen_of(installed / "include", output, html, version)


def doxygen_of(headers, output, html, version):
    """Writes the reference of a folder of headers; returns the warnings."""
    html.mkdir(exist_ok=True)
    values = {"VERSION": version, "HEADERS": headers, "MAIN_PAGE": HERE / "api.md", "NAMESPACES": HERE / "namespaces.dox", "OUTPUT": html, "STYLE": AWESOME,
              "OWN_STYLE": HERE / "api.css"}
    text = re.sub(r"@(\w+)@", lambda name: str(values[name[1]]), (HERE / "Doxyfile.in").read_text(encoding="utf-8"))
    settings = output / "Doxyfile"
    settings.write_text(text, encoding="utf-8")
    status, said = run("doxygen", settings)
    warnings = html / "doxygen-warnings.txt"
    found = warnings.read_text(encoding="utf-8").splitlines() if warnings.exists() else []
    warnings.unlink(missing_ok=True)
    without_dead_links(html / "api")
    found = [line.replace(f"{headers}/", "") for line in found if line]
    return found or ([f"doxygen ended with status {status}: {said}"] if status else [])


def main(build, output):
    build, output = Path(build).resolve(), Path(output).resolve()
    version = (ROOT / "VERSION").read_text().strip()
    shutil.rmtree(output, ignore_errors=True)
    html, source = output / "html", output / "source"
    source.mkdir(parents=True)
    stage(build, source)
    problems = sphinx(build, source, html, version) + doxygen(build, output, html, version) + check.problems(html)
    for problem in problems:
        print(problem)
    print(f"{len(list(html.rglob('*.html')))} pages, {len(problems)} problems: {html / 'index.html'}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
