# SPDX-License-Identifier: Apache-2.0
"""The page of `absenc serve` in Debian's chromium: what somebody sees, does by keyboard and is told."""
import os
import re
import sys
import time
import unittest
import urllib.parse

SYSTEM_PYTHON = "/usr/bin/python3"  # the one that Debian's python3-selenium is for

try:
    from selenium import webdriver
except ImportError:
    if os.path.realpath(sys.executable) == os.path.realpath(SYSTEM_PYTHON) or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("serve_browser_test.py: selenium is not installed: sudo apt install python3-selenium chromium-driver")
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, "-B", *sys.argv])

from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from command_support import PATIENCE, Emulator
from serve_support import BUSY, TOKEN, ServeCase, SilentLine, wait_until

SCREENSHOTS = os.environ.get("ABSENC_SCREENSHOTS")  # a folder to look at them


class Page(ServeCase):
    @classmethod
    def setUpClass(cls):
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
            options.add_argument(argument)
        options.binary_location = "/usr/bin/chromium"
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        cls.browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
        cls.addClassCleanup(cls.browser.quit)
        cls.browser.set_page_load_timeout(PATIENCE)

    def setUp(self):
        super().setUp()
        self.emulator = Emulator(self.directory, "--singleturn", "1000")
        self.addCleanup(lambda: self.emulator.end())
        self.name = f"tformat:{self.emulator.path}"
        self.served = self.server(self.name, "sim:esl?motion=rpm=60", "sim:tformat?alarm=over_heat&fault=corrupt=0.2",
                                  "--token-file", self.tokens(), "--history", self.file("history"))
        self.browser.set_window_size(1200, 900)
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
        self.browser.get("about:blank")

    def open(self, hash_text=""):
        self.browser.get(self.served.url + hash_text)

    def text(self, selector="body"):
        try:
            return "\n".join(one.text for one in self.browser.find_elements(By.CSS_SELECTOR, selector))
        except StaleElementReferenceException:
            return ""

    def wait_for(self, words, selector="body"):
        return wait_until(lambda: words in self.text(selector) and self.text(selector), f"{selector} says {words!r}")

    def shot(self, name):
        if SCREENSHOTS:
            self.browser.save_screenshot(os.path.join(SCREENSHOTS, name + ".png"))

    def assert_no_errors(self):
        wrong = [entry for entry in self.browser.get_log("browser")
                 if entry["level"] == "SEVERE" and "net::ERR" not in entry["message"]
                 and "status of 40" not in entry["message"] and "status of 502" not in entry["message"]]
        self.assertEqual([entry["message"] for entry in wrong], [])

    def test_at_a_glance(self):
        self.open()
        self.wait_for("connected: 3 of 3 live", "#connection")
        words = self.wait_for("over_heat", ".alarm")
        self.assertIn("What to do:", words)
        moving = self.browser.find_elements(By.CSS_SELECTOR, ".card")[1]
        needle = moving.find_element(By.CSS_SELECTOR, ".needle")
        first, turned = moving.text, needle.get_attribute("transform")
        wait_until(lambda: moving.text != first and needle.get_attribute("transform") != turned, "it moves")
        self.shot("light")
        self.dark(True)
        paper = self.browser.execute_script("return getComputedStyle(document.body).backgroundColor")
        self.assertEqual(paper, "rgb(16, 19, 22)")
        self.shot("dark")
        self.browser.set_window_size(500, 800)
        self.assertLessEqual(self.too_wide(), 0)
        self.shot("phone")
        self.assert_no_errors()

    def test_what_is_not_reported_is_not_good(self):
        """A word without an error bit, one that has one, and turns that an alarm takes away."""
        served = self.without_history("sim:ssi", "sim:ssi?error_bit=active_high", "sim:tformat?alarm=battery_error")
        self.browser.get(served.url)
        self.wait_for("connected: 3 of 3 live", "#connection")
        self.wait_for("battery_error", ".alarm")
        words = [one.text for one in self.browser.find_elements(By.CSS_SELECTOR, ".card .words")]
        self.assertEqual(words[:2], ["alarms not reported", ""])
        self.assertIn("INVALID", self.text(".card:nth-child(3) dd"))
        self.browser.get(served.url + "#encoder=sim:ssi")
        self.wait_for("alarms not reported")
        self.shot("not-reported")
        self.assert_no_errors()

    def resize(self, width):
        """Also narrower than a window of this browser can be."""
        self.browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                                     {"width": width, "height": 1000, "deviceScaleFactor": 1, "mobile": False})
        self.addCleanup(self.browser.execute_cdp_cmd, "Emulation.clearDeviceMetricsOverride", {})

    def broken_words(self):
        """The words of values that do not stand on one line."""
        return self.browser.execute_script("""
            const broken = [];
            for (const node of document.querySelectorAll('dd')) {
              const text = node.firstChild;
              for (const word of text === null ? [] : text.data.matchAll(/\\S+/g)) {
                const range = document.createRange();
                range.setStart(text, word.index);
                range.setEnd(text, word.index + word[0].length);
                if (range.getClientRects().length > 1) broken.push(word[0]);
              }
            }
            return broken;""")

    def too_wide(self):
        return self.browser.execute_script("return document.documentElement.scrollWidth - innerWidth")

    def test_values_stand_on_one_line(self):
        """On a phone, a laptop and a large screen: turned, invalid, unknown and many."""
        encoders = ["sim:encolink?motion=rpm=-3000&multiturn=60000", "sim:tformat?alarm=battery_error", "sim:ssi",
                    "sim:esl?alarm=memory_error", "sim:tformat?fault=corrupt=0.2&model=23-bit&motion=rpm=3000"]
        served = self.without_history(*encoders)
        for width in (390, 1280, 1920):
            self.resize(width)
            for place in ["", *encoders]:
                self.browser.get("about:blank")
                self.browser.get(served.url + (place and "#encoder=" + urllib.parse.quote(place, safe="")))
                self.wait_for("connected: 5 of 5 live", "#connection")
                wait_until(lambda: "°" in self.text("dd") or "INVALID" in self.text("dd"), "there are values")
                self.shot(f"values-{width}-{encoders.index(place) if place else 'all'}")
                with self.subTest(place, width=width):
                    self.assertEqual(self.broken_words(), [])
                    self.assertLessEqual(self.too_wide(), 0)

    def test_the_lines_of_a_grid_have_labels_of_their_own(self):
        served = self.without_history("sim:encolink?multiturn=60000&motion=rpm=0.5")  # many degrees, of which few change
        self.browser.get(served.url + "#encoder=sim%3Aencolink%3Fmultiturn%3D60000%26motion%3Drpm%3D0.5")

        def labels():
            return self.browser.execute_script("""
                return Array.from(document.querySelectorAll('.plot'), (plot) =>
                  Array.from(plot.querySelectorAll('.dygraph-axis-label-y'), (label) => label.textContent));""")
        wait_until(lambda: any(float(one) > 1e7 for one in labels()[0]), "the position is drawn")
        for _ in range(20):  # while the range grows
            for plot in labels():
                self.assertEqual(len(set(plot)), len(plot), plot)
        cut = """return Array.from(document.querySelectorAll('.dygraph-axis-label-y'))
                   .filter((label) => label.scrollWidth > label.clientWidth).map((label) => label.textContent);"""
        self.assertEqual(self.browser.execute_script(cut), [])
        self.shot("grid")
        self.assert_no_errors()

    def test_a_plot_that_is_not_yet_drawn_anew_widens_nothing(self):
        self.open("#encoder=sim:esl%3Fmotion%3Drpm%3D60")
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, ".plot canvas"), "there are plots")
        self.browser.execute_script("document.querySelector('.plot').firstChild.style.width = '3000px'")
        self.assertLessEqual(self.too_wide(), 0)

    def test_an_encoder_is_lost_and_comes_back(self):
        self.open()
        self.wait_for("connected: 3 of 3 live", "#connection")
        self.emulator.kill()
        killed = time.monotonic()
        self.wait_for("no reading for", ".card:first-child .state")
        self.assertLess(time.monotonic() - killed, BUSY)
        values = self.text(".card:first-child dd").splitlines()
        self.assertEqual(values[:3], ["–", "–", "–"])
        self.shot("lost")
        self.emulator.end()
        self.emulator = Emulator(self.directory, "--singleturn", "1000")
        wait_until(lambda: self.text(".card:first-child .state") == "live", "it is back")

    def test_the_server_is_lost(self):
        self.open()
        self.wait_for("connected", "#connection")
        wait_until(lambda: "°" in self.text(".card dd"), "there are values")
        self.served.process.kill()
        killed = time.monotonic()
        self.wait_for("is lost", "#connection")
        self.assertLess(time.monotonic() - killed, BUSY + 1.5)
        self.assertNotIn("°", self.text(".card dd"))
        self.shot("server-lost")

    def test_by_keyboard_to_one(self):
        self.open()
        self.wait_for("connected", "#connection")
        for _ in range(20):
            self.browser.switch_to.active_element.send_keys(Keys.TAB)
            if "esl" in self.browser.switch_to.active_element.text:
                break
        self.browser.switch_to.active_element.send_keys(Keys.ENTER)
        self.wait_for("Last bad exchanges")
        self.wait_for("live", ".state")
        points = "return document.querySelectorAll('.plot canvas').length"
        wait_until(lambda: self.browser.execute_script(points) >= 4, "there are traces")

        def drawn():
            return self.browser.execute_script("""
                const canvas = document.querySelector('.plot canvas');
                return canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some(byte => byte !== 0);
            """)
        wait_until(drawn, "the trace is drawn")
        wait_until(lambda: "readings come" in self.text() or "back" in self.text("table"), "there are events")
        self.shot("one")
        self.assert_no_errors()

    def canvas_has(self, selector, color):
        """Whether a plot has points of this [red, green, blue]."""
        return self.browser.execute_script("""
            const [selector, [red, green, blue]] = arguments;
            return [...document.querySelectorAll(selector + " canvas")].some((canvas) => {
              const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
              for (let i = 0; i < data.length; i += 4) {
                if (data[i] === red && data[i + 1] === green && data[i + 2] === blue && data[i + 3] > 200) return true;
              }
              return false;
            });""", selector, color)

    def dark(self, on):
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": "prefers-color-scheme", "value": "dark" if on else "light"}]})

    def test_figures_of_one_in_trouble(self):
        self.open("#encoder=" + urllib.parse.quote("sim:tformat?alarm=over_heat&fault=corrupt=0.2"))
        self.wait_for("bad_checksum", ".histogram")
        # By the page itself, which makes them anew when something changes.
        labels = "return [...document.querySelectorAll('.histogram')].map((table) => table.getAttribute('aria-label'))"
        self.assertEqual(self.browser.execute_script(labels), ["replies by latency", "failed attempts by kind"])
        wait_until(lambda: re.search(r"to \d+ (µs|ms) \d+", self.text(".histogram")), "latencies are counted")
        widest = "return Math.max(...[...document.querySelectorAll('.bar')].map((bar) => bar.offsetWidth))"
        wait_until(lambda: self.browser.execute_script(widest) > 100, "there are bars")
        past = "[aria-label*='over_heat']"
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, past), "the plot of the past says its marks")
        wait_until(lambda: self.canvas_has(past, [0xb3, 0x16, 0x1c]), "the alarm is marked")
        self.shot_whole("figures-light")
        self.dark(True)
        label = "return getComputedStyle(document.querySelector('.dygraph-axis-label')).color"
        wait_until(lambda: self.browser.execute_script(label) == "rgb(232, 235, 238)", "numbers are light")
        wait_until(lambda: self.canvas_has(past, [0xff, 0x7b, 0x7b]), "marks too")
        self.shot_whole("figures-dark")
        self.browser.set_window_size(500, 800)
        wide = self.browser.execute_script("return document.documentElement.scrollWidth - innerWidth")
        self.assertLessEqual(wide, 0)
        self.shot_whole("figures-phone")
        self.assert_no_errors()

    def test_a_loss_is_marked_in_the_history(self):
        self.open("#encoder=" + self.name)
        self.wait_for("readings come", "table")
        self.wait_for("live", ".state")
        self.emulator.kill()
        past = "[aria-label*='marked: lost']"
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, past), "the plot of the past says it")
        wait_until(lambda: self.canvas_has(past, [0x8a, 0x5a, 0x00]), "it is marked although nothing is read after it")
        self.shot_whole("figures-lost")
        self.assert_no_errors()

    def shot_whole(self, name):
        if SCREENSHOTS:
            width, height = self.browser.execute_script(
                "return [innerWidth, document.documentElement.scrollHeight]")
            size = self.browser.get_window_size()
            self.browser.set_window_size(width, height + 200)
            self.shot(name)
            self.browser.set_window_size(size["width"], size["height"])

    def test_figures_go_with_the_server(self):
        self.open("#encoder=" + urllib.parse.quote("sim:tformat?alarm=over_heat&fault=corrupt=0.2"))
        self.wait_for("bad_checksum", "[aria-label='last bad exchanges']")
        self.served.process.kill()
        self.wait_for("not known", ".state")
        shown = "dd, .histogram td, [aria-label='last bad exchanges'] td"
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, shown), [])

    def test_zero_is_asked_twice_and_needs_a_token(self):
        self.open("#encoder=" + self.name)
        self.wait_for("live", ".state")
        select = wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, "select[aria-label=command] option") and
                            Select(self.browser.find_element(By.CSS_SELECTOR, "select[aria-label=command]")), "commands")
        select.select_by_value("zero")

        def run(token):
            self.browser.find_element(By.XPATH, "//button[text()='Run']").click()
            self.answer("Go on")
            self.assertEqual(self.served.encoder()["counts"], 1000)
            self.answer("Do it")
            if token:
                field = self.browser.find_element(By.CSS_SELECTOR, "#dialog input")
                wait_until(field.is_displayed, "it asks for the token")
                field.send_keys(token)
                self.answer("Use it")
        run("wrong")
        self.wait_for("needs a token", "[role=status]")
        self.assertEqual(self.served.encoder()["counts"], 1000)
        run(TOKEN)
        self.wait_for("zero: done", "[role=status]")
        wait_until(lambda: self.served.encoder()["counts"] == 0, "it is at zero")
        wait_until(lambda: "anna from 127.0.0.1" in self.text("table"), "the history on the page has it")
        self.shot("zero")

    def box(self, title):
        """The section under that heading."""
        return self.browser.find_element(By.XPATH, f"//section[h2='{title}']")

    def press(self, title, button):
        """The button in that section; by keyboard, as whoever sees no pointer does."""
        found = self.box(title).find_element(By.XPATH, f".//button[text()='{button}']")
        wait_until(lambda: found.is_displayed() and found.is_enabled(), f"{title} can be asked")
        found.send_keys(Keys.ENTER)

    def says(self, title, words):
        return wait_until(lambda: words in self.box(title).text and self.box(title).text, f"{title} says {words!r}")

    def look(self, name):
        """Light, dark and on a phone: nothing is wider than the window."""
        node = self.box("Doctor")
        for width, scheme in ((1200, "light"), (1200, "dark"), (500, "dark")):
            self.browser.set_window_size(width, 1400)
            self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia",
                                         {"features": [{"name": "prefers-color-scheme", "value": scheme}]})
            self.assertLessEqual(self.too_wide(), 0)
            self.browser.execute_script("arguments[0].scrollIntoView()", node)
            self.shot(f"{name}-{width}-{scheme}")

    def test_what_doctor_does_is_told_meanwhile(self):
        line = SilentLine()
        line.__enter__()
        self.addCleanup(line.__exit__, None, None, None)
        self.served = self.without_history(f"tformat:{line.path}?latency=200")
        self.open(f"#encoder=tformat:{line.path}?latency=200")
        self.press("Doctor", "Examine")
        self.says("Doctor", "it is examined, readings go on afterwards: reading")
        self.wait_for("examined: no reading for", ".state")
        self.assertFalse(self.box("Doctor").find_element(By.TAG_NAME, "button").is_enabled())
        self.shot("examined")
        self.says("Doctor", "fault: no_answer")
        wait_until(lambda: "failing" in self.text(".state"), "it is asked again")
        self.assert_no_errors()

    def test_doctor_names_what_is_wrong(self):
        name = "sim:tformat?alarm=over_heat&fault=corrupt=0.2"
        self.open("#encoder=" + name)
        self.press("Doctor", "Examine")
        words = self.says("Doctor", "warning: damaged_bits")
        for part in ("first: damaged_bits", "seen", "likely", "try", "warning: alarm"):
            self.assertIn(part, words)
        self.look("doctor")
        self.assert_no_errors()

    def test_memory_and_settings_are_those_of_the_encoder(self):
        good = {"Authorization": f"Bearer {TOKEN}"}
        self.assertEqual(self.served.command(self.name, "memory-write", good, argument=[1, 0x41, 2])[0], 200)
        self.assertEqual(self.served.command(self.name, "set-overheat-threshold", good, argument=[77])[0], 200)
        self.open("#encoder=" + self.name)
        self.press("Settings", "Read")
        self.assertIn("overheat_threshold_c 77 degC", self.says("Settings", "may be set to degrees"))
        wait_until(lambda: self.box("Memory").is_displayed(), "it has memory")
        Select(self.box("Memory").find_element(By.TAG_NAME, "select")).select_by_value("2")
        self.press("Memory", "Read")
        self.says("Memory", "127 bytes read at")
        first = self.box("Memory").find_element(By.CSS_SELECTOR, "tbody tr").text
        self.assertRegex(first, "^2 0x00 [0-9A-F]{2} 41 ")
        self.press("Doctor", "Examine")
        self.says("Doctor", "good: ")
        self.look("inside")
        self.emulator.kill()
        self.says("Memory", "no longer shown: the encoder is lost")
        self.assertNotIn("0x00", self.box("Memory").text)
        self.assertNotIn("77 degC", self.box("Settings").text)
        self.press("Settings", "Read")
        self.says("Settings", "was not done")
        self.press("Doctor", "Examine")
        self.says("Doctor", "fault: port_")
        self.assert_no_errors()

    def answer(self, words):
        button = self.browser.find_element(By.ID, "dialog-yes")
        wait_until(lambda: button.is_displayed() and button.text == words, f"it asks: {words}")
        button.click()


if __name__ == "__main__":
    unittest.main()
