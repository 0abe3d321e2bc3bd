#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the load of the page of `absenc serve` on a browser, with 100 encoders: bench/page_load.py [SECONDS
[UPDATES]]"""
import os
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.realpath(__file__))), "tests"))
from page_scenes import Browser, config, hundred  # noqa: E402  first, because it locates selenium
from command_support import end  # noqa: E402
from serve_support import Server, wait_until  # noqa: E402

SECONDS = float(sys.argv[1]) if len(sys.argv) > 1 else 10
UPDATES = float(sys.argv[2]) if len(sys.argv) > 2 else 30
TICK = os.sysconf("SC_CLK_TCK")

# This script stores the replies to GET api/encoders, which the page shows, as text, so that the measurement includes
# parsing them.
RECORD = """
const done = arguments[arguments.length - 1];
(async () => {
  window.states = [];
  for (let i = 0; i < 40; ++i) {
    states.push(await (await fetch("api/encoders")).text());
    await new Promise((resolve) => setTimeout(resolve, 33));
  }
  done();
})();"""
FORCE = """
const [updates, done] = arguments;
import("./overview.js").then(({Overview}) => {
  const view = new Overview(document.getElementById("main"), document.getElementById("bar"));
  let count = 0;
  window.shown = () => count;
  const show = () => {
    const state = JSON.parse(states[count++ % states.length]);
    state.at_ms = Date.now();
    view.show(state);
  };
  show();
  if (updates > 0) setInterval(show, 1000 / updates);
  done();
});"""


def processes(root):
    """Returns the process `root` and all its descendants."""
    parents = {}
    for pid in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
                parents[int(pid)] = int(file.read().rsplit(")", 1)[1].split()[1])
        except OSError:
            pass
    found = [root]
    for pid in found:
        found += [child for child, parent in parents.items() if parent == pid]
    return found


def processor_seconds(root):
    total = 0
    for pid in processes(root):
        try:
            with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
                fields = file.read().rsplit(")", 1)[1].split()
                total += int(fields[11]) + int(fields[12])
        except OSError:
            pass
    return total / TICK


def measure(browser, what):
    driver = browser.driver
    driver.execute_cdp_cmd("Performance.enable", {})
    root = driver.service.process.pid

    def figures():
        metrics = {one["name"]: one["value"] for one in driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]}
        return {"browser": processor_seconds(root), **{key: metrics[key] for key in ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration", "TaskDuration")}}
    time.sleep(3)
    before, started = figures(), time.monotonic()
    time.sleep(SECONDS)
    after, seconds = figures(), time.monotonic() - started
    parts = ", ".join(f"{key.removesuffix('Duration').lower()} {100 * (after[key] - before[key]) / seconds:.1f} %" for key in after)
    print(f"{what}: {parts} of a core")


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "absenc.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(config(hundred()))
        server = Server("--history", "none", ABSENC_CONFIG=path)
        browser = Browser()
        try:
            browser.window(1920, 1080)
            browser.go(server.url)
            wait_until(lambda: browser.ask("return document.querySelectorAll('.card .digits').length === 100"), "100 cards are shown")
            measure(browser, "as sent")
            browser.driver.execute_async_script(RECORD)
            browser.driver.execute_async_script(FORCE, UPDATES)
            started = time.monotonic()
            measure(browser, f"{UPDATES:g} updates a second")
            print(f"shown: {browser.ask('return shown()') / (time.monotonic() - started):.1f} updates a second")
        finally:
            browser.driver.quit()
            end(server.process)


if __name__ == "__main__":
    main()
