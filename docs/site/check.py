#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks a folder of HTML: links lead to a file and an anchor in it, and no page loads anything from a network.

check.py FOLDER"""
import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADS = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "embed": "src", "object": "data"}
EXTERNAL = re.compile(r"https?://[\w.-]+\.[a-z]+(:\d+)?(/\S*)?$")


class Page(HTMLParser):
    """The anchors, links and loaded files of a page."""

    def __init__(self, text):
        super().__init__()
        self.anchors, self.links, self.loads = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.anchors.update(value for name, value in attrs if value and (name == "id" or (tag == "a" and name == "name")))
        if tag == "a" and values.get("href") is not None:
            self.links.append(values["href"])
        if tag == "link" and values.get("href") and set((values.get("rel") or "").split()) & {"stylesheet", "icon", "preload"}:
            self.loads.append(values["href"])
        if tag in LOADS and values.get(LOADS[tag]):
            self.loads.append(values[LOADS[tag]])
        self.loads += re.findall(r"url\(['\"]?([^'\")]+)", values.get("style") or "")


def problem_of_link(page, link, pages, folder):
    """Returns what is wrong with a link of a page, or None."""
    parts = urlsplit(link)
    if parts.scheme in ("http", "https"):
        return None if EXTERNAL.match(link) else "is no valid address"
    if parts.scheme == "javascript":
        return None
    if parts.scheme or parts.netloc:
        return "has an unknown scheme"
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    if not target.is_relative_to(folder) or not target.is_file():
        return "leads to no file"
    anchor = unquote(parts.fragment)
    if anchor and target in pages and anchor not in pages[target].anchors:
        return "leads to no anchor"
    return None


def problems(folder):
    """Returns a line for each broken link and each file that would be loaded from elsewhere."""
    folder = Path(folder).resolve()
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        name = path.relative_to(folder)
        for link in sorted(set(page.links)):
            if wrong := problem_of_link(path, link, pages, folder):
                found.append(f"{name}: {link} {wrong}")
        for address in sorted(set(page.loads)):
            if address.startswith(("data:", "javascript:")):
                continue
            if re.match(r"(\w+:)?//", address):
                found.append(f"{name}: loads {address} from a network")
            elif not (path.parent / unquote(urlsplit(address).path)).is_file():
                found.append(f"{name}: loads {address}, which is not there")
    for path in sorted(folder.rglob("*.css")):
        for address in re.findall(r"(?:url\(|@import\s+)['\"]?((?:https?:)?//[^'\")]+)", path.read_text(encoding="utf-8")):
            found.append(f"{path.relative_to(folder)}: loads {address} from a network")
    return found


if __name__ == "__main__":
    print(*problems(sys.argv[1]), sep="\n")
