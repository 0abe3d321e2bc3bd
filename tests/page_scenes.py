# SPDX-License-Identifier: Apache-2.0
"""Opens the page of `absenc serve` in Chromium, for tests and for ./dev pictures."""
import os
import sys
import urllib.parse

SYSTEM_PYTHON = "/usr/bin/python3"  # the Python interpreter that has Debian's package python3-selenium

try:
    from selenium import webdriver
except ImportError:
    if os.path.realpath(sys.executable) == os.path.realpath(SYSTEM_PYTHON) or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("page_scenes.py: selenium is not installed: sudo apt install python3-selenium chromium-driver")
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, "-B", *sys.argv])

from selenium.webdriver.chrome.service import Service

# Each entry: name of an encoder, its protocol and options.
KINDS = {
    "shoulder": ("tformat", "motion=rpm=60"),
    "slide-x": ("biss", "model=linear-26-1um&motion=sine=20,0.1&singleturn=33554432"),
    "axis-7": ("raa38-can", "motion=sine=40,0.05"),
    "table": ("esl", "motion=rpm=12"),
    "turret": ("ssi", "singleturn=1024"),
    "chain-a": ("biss-chain", "motion=rpm=3"),
    "spindle": ("tformat", "model=23-bit&motion=rpm=-90&multiturn=30512"),
    "lift": ("biss", "model=linear-32-0.05um&singleturn=1579271"),
    "gripper": ("amt21", "motion=rpm=-30&max_rpm=100"),
    "wrist": ("tformat", "motion=sine=4,0.08&singleturn=15000&multiturn=3&fault=corrupt=0.02&seed=1"),
    "elbow": ("tformat", "alarm=battery_alarm&singleturn=49789&multiturn=12"),
}


def config(kinds, ports=None):
    """Returns the text of an absenc.toml with these encoders. `ports`: those not on sim, by name."""
    text = ""
    for name, (protocol, options) in kinds.items():
        text += f'[encoder.{name}]\nprotocol = "{protocol}"\nport = "{(ports or {}).get(name, "sim")}"\nrate_hz = 100\n'
        for option in filter(None, options.split("&")):
            key, value = option.split("=", 1)
            text += f'{key} = "{value}"\n' if not value.lstrip("-").isdigit() else f"{key} = {value}\n"
        text += "\n"
    return text


def hundred():
    """Returns a hundred encoders of all kinds, in the form of KINDS."""
    kinds = list(KINDS.items())
    return {f"{name}-{i:02}": kind for i in range(100) for name, kind in [kinds[i % len(kinds)]]}


class Browser:
    """A Chromium browser with an adjustable window size."""

    def __init__(self, *arguments):
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu", "--hide-scrollbars", *arguments):
            options.add_argument(argument)
        options.binary_location = "/usr/bin/chromium"
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        self.driver = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        self.driver.set_page_load_timeout(60)

    def window(self, width, height=1000, dark=False):
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                    {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]})

    def go(self, url, **place):
        self.driver.get("about:blank")
        values = "&".join(f"{key}={urllib.parse.quote(value, safe='')}" for key, value in place.items())
        self.driver.get(url + (values and "#" + values))

    def ask(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def shot(self, path):
        self.driver.save_screenshot(path)
        return path
