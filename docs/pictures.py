#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes docs/pictures/*.png: the page of `absenc serve` in Chromium, and `absenc monitor` in a terminal of tmux.
Run by ./dev pictures."""
import html
import os
import re
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.realpath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "tests"))

from page_scenes import KINDS, Browser, config  # noqa: E402  first: it looks for selenium
from command_support import ABSENC, Emulator, end  # noqa: E402
from serve_support import Server, wait_until  # noqa: E402

PICTURES = os.path.join(HERE, "pictures")
MINUTE = 62  # seconds until the page's plot, which shows the last minute, is full
COLORS = ["#1c2128", "#ff8080", "#58c98c", "#e3b04b", "#7db7f5", "#d2a8ff", "#76d9e0", "#e9edf1"]


def picture(name):
    return os.path.join(PICTURES, name + ".png")


def page(browser, folder):
    """The overview with one encoder lost and one with an alarm, and the page of one."""
    # the picture shows the path of this port, so it gets a plausible name
    emulator = Emulator(tempfile.gettempdir(), "--motion", "rpm=20", name="press-2")
    path, tokens = os.path.join(folder, "absenc.toml"), os.path.join(folder, "tokens")
    with open(path, "w", encoding="utf-8") as file:
        file.write(config({"press-2": ("tformat", "latency=300"), **KINDS}, {"press-2": emulator.path}))
    with open(tokens, "w", encoding="utf-8") as file:
        file.write("anna a-token-for-the-pictures\n")
    os.chmod(tokens, 0o600)
    server = Server("--history", os.path.join(folder, "history"), "--token-file", tokens, ABSENC_CONFIG=path)
    try:
        wait_until(lambda: server.encoder()["state"] == "live", "the encoder is read")
        time.sleep(MINUTE)
        emulator.kill()
        wait_until(lambda: server.encoder()["state"] == "lost", "the encoder is lost")
        for name, width, height, dark, place in (
                ("serve-overview", 1400, 900, False, {}), ("serve-overview-dark", 1920, 1000, True, {}),
                ("serve-encoder", 1400, 900, False, {"encoder": "wrist"}),
                ("serve-phone", 390, 844, True, {"encoder": "elbow"})):
            browser.window(width, height, dark)
            browser.go(server.url, **place)
            wait_until(lambda: browser.ask("return Boolean(document.querySelector('.spark .line[d], .plot canvas'))"), "it is drawn")
            time.sleep(5)  # waits 5 seconds, in which the page draws live readings
            browser.shot(picture(name))
    finally:
        end(server.process)
        emulator.end()


def as_html(text):
    """The colours of a terminal (SGR) as HTML."""
    made, style = "", {}
    for part in re.split(r"(\x1b\[[0-9;]*m)", text):
        match = re.fullmatch(r"\x1b\[([0-9;]*)m", part)
        if match is None:
            css = ";".join(f"{key}:{value}" for key, value in style.items() if not key.startswith("-"))
            if style.get("-reverse"):
                css = f"background:{style.get('color', '#e9edf1')};color:#0e1216"
            made += f'<span style="{css}">{html.escape(part)}</span>' if css else html.escape(part)
            continue
        for code in [int(one or 0) for one in match[1].split(";")]:
            if code == 0:
                style = {}
            elif code == 1:
                style["font-weight"] = "bold"
            elif code == 2:
                style["opacity"] = ".65"
            elif code == 7:
                style["-reverse"] = True
            elif 30 <= code <= 37 or 90 <= code <= 97:
                style["color"] = COLORS[code % 10]
            elif code == 39:
                style.pop("color", None)
    return made


def monitor(browser, folder, columns, rows):
    """The screen of `absenc monitor` in a terminal of that size."""
    socket = os.path.join(folder, "tmux")
    path = os.path.join(folder, "monitor.toml")
    names = ("shoulder", "slide-x", "wrist", "elbow", "gripper", "turret")
    with open(path, "w", encoding="utf-8") as file:
        file.write(config({name: KINDS[name] for name in names}))
    tmux = ["tmux", "-S", socket, "-f", "/dev/null"]
    command = [ABSENC, "monitor", *names]
    subprocess.run([*tmux, "new-session", "-d", "-x", str(columns), "-y", str(rows), "-e", f"ABSENC_CONFIG={path}", "-e", "LANG=C.UTF-8", *command],
                   check=True)
    try:
        subprocess.run([*tmux, "set", "-g", "status", "off"], check=True)
        time.sleep(MINUTE / 2)
        text = subprocess.run([*tmux, "capture-pane", "-p", "-e", "-N"], check=True, capture_output=True, text=True).stdout
    finally:
        subprocess.run([*tmux, "kill-server"], check=False)
    lines = "\n".join((text.rstrip("\n").split("\n") + [""] * rows)[:rows])
    page_path = os.path.join(folder, "monitor.html")
    with open(page_path, "w", encoding="utf-8") as file:
        file.write('<!doctype html><meta charset="utf-8"><style>body{margin:0;background:#0e1216}'
                   "pre{margin:0;padding:12px;display:inline-block;color:#e9edf1;font:15px/1.25 'DejaVu Sans Mono',monospace}</style>"
                   f"<pre>{as_html(lines)}</pre>")
    browser.window(1400, 1000)
    browser.driver.get("file://" + page_path)
    width, height = browser.ask("const box = document.querySelector('pre').getBoundingClientRect(); return [Math.ceil(box.width), Math.ceil(box.height)]")
    browser.window(width, height)
    browser.shot(picture(f"monitor-{columns}x{rows}"))


def main():
    os.makedirs(PICTURES, exist_ok=True)
    browser = Browser()
    try:
        with tempfile.TemporaryDirectory() as folder:
            monitor(browser, folder, 80, 24)
            monitor(browser, folder, 120, 40)
            page(browser, folder)
    finally:
        browser.driver.quit()


if __name__ == "__main__":
    main()
