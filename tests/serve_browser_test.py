# SPDX-License-Identifier: Apache-2.0
"""Tests the page of `absenc serve` in Chromium."""
import os
import signal
import subprocess
import time
import unittest
import urllib.parse

from page_scenes import Browser  # imported first, because page_scenes checks that selenium is installed
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

from command_support import Emulator
from serve_support import BUSY, TOKEN, ServeCase, SilentLine, of, wait_until


class Page(ServeCase):
    @classmethod
    def setUpClass(cls):
        cls.window = Browser()
        cls.browser = cls.window.driver
        cls.addClassCleanup(cls.browser.quit)

    def setUp(self):
        super().setUp()
        self.emulator = Emulator(self.directory, "--singleturn", "1000")
        self.addCleanup(lambda: self.emulator.end())
        self.name = f"tformat:{self.emulator.path}?latency=300"  # the latency allows for a busy machine
        self.served = self.server(self.name, "sim:esl?motion=rpm=60", "sim:tformat?alarm=over_heat&fault=corrupt=0.2",
                                  "--token-file", self.tokens(), "--history", self.file("history"))
        self.window.window(1200, 900)
        self.browser.get("about:blank")

    def open(self, hash_text=""):
        self.browser.get(self.served.url + hash_text)

    def text(self, selector="body"):
        """Returns the visible text of the elements that match, read in one step."""
        return self.browser.execute_script("""
            return [...document.querySelectorAll(arguments[0])].filter((one) => one.getClientRects().length > 0)
                   .map((one) => one.innerText).join("\\n");""", selector)

    def wait_for(self, words, selector="body"):
        return wait_until(lambda: words in self.text(selector) and self.text(selector), f"{selector} says {words!r}")

    def assert_no_errors(self):
        wrong = [entry for entry in self.browser.get_log("browser")
                 if entry["level"] == "SEVERE" and "net::ERR" not in entry["message"]
                 and "status of 40" not in entry["message"] and "status of 502" not in entry["message"]]
        self.assertEqual([entry["message"] for entry in wrong], [])

    def pills(self):
        return self.browser.execute_script("return [...document.querySelectorAll('.pill:not([hidden])')].map((pill) => pill.textContent)")

    def card(self, name):
        return f".card:has(a[href='#encoder={urllib.parse.quote(name, safe='')}'])"

    def test_overview(self):
        served = self.without_history("sim:tformat", "sim:esl?motion=rpm=60", "sim:tformat?alarm=over_heat")
        self.browser.get(served.url)
        wait_until(lambda: self.pills() == ["▲ 1 alarm", "● 2 good"], "the bar says who is well")
        words = self.wait_for("Over heat.", ".card.bad .words")
        self.assertIn("clear-alarms", words)
        self.assertEqual(self.text(".card:first-child .state"), "▲ alarm")
        moving = self.card("sim:esl?motion=rpm=60")

        def shown():
            needle = self.browser.find_element(By.CSS_SELECTOR, moving + " .needle")
            return self.text(moving + " .digits"), needle.get_attribute("transform")
        first = shown()
        wait_until(lambda: all(now != before for now, before in zip(shown(), first)), "figure and needle move")
        spark = moving + " .spark .line"
        wait_until(lambda: "L" in (self.browser.find_element(By.CSS_SELECTOR, spark).get_attribute("d") or ""), "there is a trace")
        self.assert_no_errors()

    def test_digits_keep_their_place(self):
        """The decimal point and the unit must not move on the page when the value changes."""
        name = "sim:tformat?motion=rpm=60"
        served = self.without_history(name)
        self.browser.get(served.url)
        self.wait_for("°", ".unit")
        wait_until(lambda: len(self.text(".digits")) == 7, "it had a value of three digits")
        left = "return document.querySelector('.unit').getBoundingClientRect().left"
        places, values = set(), set()
        while len(values) < 8 or not any(len(value) < 7 for value in values):
            places.add(self.browser.execute_script(left))
            values.add(self.text(".digits"))
        self.assertEqual(len(places), 1, (places, values))

    def test_distinguishes_good_from_not_reported(self):
        """The page must distinguish alarms that are not reported from a good state."""
        served = self.without_history("sim:ssi", "sim:ssi?error_bit=active_high", "sim:tformat?alarm=battery_error")
        self.browser.get(served.url)
        wait_until(lambda: self.pills() == ["▲ 1 alarm", "○ 1 live, alarms not reported", "● 1 good"], "the bar tells them apart")
        self.assertEqual(self.text(self.card("sim:ssi") + " .words"), "Alarms not reported.")
        self.assertEqual(self.text(self.card("sim:ssi?error_bit=active_high") + " .words"), "")
        self.assertIn("turns INVALID", self.text(self.card("sim:tformat?alarm=battery_error") + " .below"))
        self.browser.get(served.url + "#encoder=sim:ssi")
        self.wait_for("Alarms not reported.", ".side")
        self.assert_no_errors()

    def test_groups_filter_encoders(self):
        served = self.without_history(*(f"sim:tformat?singleturn={i}" for i in range(4)), "sim:ssi")
        self.browser.get(served.url)
        wait_until(lambda: len(self.pills()) == 2, "the bar has two groups")
        cards = "return document.querySelectorAll('.card').length"
        self.browser.find_element(By.CSS_SELECTOR, "[data-group=live]").send_keys(Keys.ENTER)
        wait_until(lambda: self.browser.execute_script(cards) == 1, "only that one is shown")
        self.browser.find_element(By.CSS_SELECTOR, "[data-group=live]").send_keys(Keys.ENTER)
        wait_until(lambda: self.browser.execute_script(cards) == 5, "all are shown")
        field = self.browser.find_element(By.CSS_SELECTOR, "[type=search]")
        field.send_keys("singleturn=3")
        wait_until(lambda: self.browser.execute_script(cards) == 1, "only that one is shown")
        field.send_keys("nothing")
        self.wait_for("No encoder matches.", ".none")
        self.browser.find_element(By.XPATH, "//button[text()='Show all']").click()
        wait_until(lambda: self.browser.execute_script(cards) == 5, "all are shown")

    def test_grid_labels_are_distinct(self):
        # the turns are large numbers that change slowly, so that the labels need many digits
        name = "sim:encolink?multiturn=60000&motion=rpm=0.5"
        served = self.without_history(name)
        self.window.go(served.url, encoder=name, unit="turns")

        def labels():
            return self.browser.execute_script("""
                return Array.from(document.querySelectorAll('.dygraph-axis-label-y'), (label) => label.textContent);""")
        wait_until(lambda: any(float(one) > 59000 for one in labels()), "the turns are drawn")
        # All axis labels must differ. This is checked repeatedly, because the value range of the plot grows.
        for _ in range(20):
            texts = labels()
            self.assertEqual(len(set(texts)), len(texts), texts)
        cut = """return Array.from(document.querySelectorAll('.dygraph-axis-label-y'))
                   .filter((label) => label.scrollWidth > label.clientWidth).map((label) => label.textContent);"""
        self.assertEqual(self.browser.execute_script(cut), [])
        self.assert_no_errors()

    def test_link_to_range(self):
        name = "sim:esl?motion=rpm=60"
        self.open()
        self.window.go(self.served.url, encoder=name)
        self.wait_for("10 min", ".choices")
        self.browser.find_element(By.CSS_SELECTOR, "[data-value='10m']").send_keys(Keys.ENTER)
        self.browser.find_element(By.CSS_SELECTOR, "[data-value=rpm]").send_keys(Keys.ENTER)
        self.browser.find_element(By.ID, "tab-exchanges").send_keys(Keys.ENTER)
        address = self.browser.current_url
        self.browser.get("about:blank")
        self.browser.get(address)
        pressed = "return [...document.querySelectorAll('.choice [aria-pressed=true]')].map((one) => one.dataset.value)"
        wait_until(lambda: self.browser.execute_script(pressed) == ["10m", "rpm"], "range and unit are those of the link")
        self.assertEqual(self.browser.find_element(By.ID, "tab-exchanges").get_attribute("aria-selected"), "true")
        wait_until(lambda: "rpm" in self.text(".dygraph-axis-label-y"), "its axis has the unit")
        self.assert_no_errors()

    def test_encoder_is_lost_and_returns(self):
        card = self.card(self.name)
        self.open()
        self.wait_for("2.747", card + " .digits")
        self.emulator.kill()
        killed = time.monotonic()
        wait_until(lambda: "lost" in self.text(card + " .state") or "no reply" in self.text(card + " .state"), "it is lost")
        self.assertLess(time.monotonic() - killed, BUSY)
        self.assertEqual(self.text(card + " .digits"), "—")
        self.assertRegex(self.text(card + " .below"), r"^last 2\.747°( ·)?\s\d+ m?s ago$")
        self.emulator.end()
        self.emulator = Emulator(self.directory, "--singleturn", "1000")
        wait_until(lambda: self.text(card + " .digits") == "2.747", "it is back")

    def test_page_of_lost_encoder_shows_its_history(self):
        self.open()
        wait_until(lambda: self.served.json("/api/minute")["encoders"][0]["seconds"], "it was read for a second")
        self.emulator.kill()
        wait_until(lambda: self.served.encoder()["state"] == "lost", "it is lost")
        self.window.go(self.served.url, encoder=self.name)
        self.wait_for("No reading since", ".side")
        self.wait_for("last 2.747°", ".below")
        wait_until(lambda: self.canvas_has(".plot", [0x0b, 0x5c, 0xad]), "its past is drawn")
        off = "return document.querySelector('[data-command=zero]')?.disabled"
        wait_until(lambda: self.browser.execute_script(off), "no command can be given")

    def test_encoder_without_readings_has_no_axes(self):
        served = self.without_history("tformat:" + self.file("nothing"))
        self.window.go(served.url, encoder="tformat:" + self.file("nothing"))
        self.wait_for("There has been no reading since the server started.")
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, ".plot canvas"), [])

    def test_link_to_unknown_encoder_suggests_name(self):
        served = self.without_history("sim:tformat")
        self.window.go(served.url, encoder="sim:tfornat")
        self.wait_for('There is no encoder "sim:tfornat" here; did you mean sim:tformat?', "#connection")

    def test_invalid_link_is_unknown_encoder(self):
        served = self.without_history("sim:tformat")
        self.browser.get(served.url + "#encoder=%")
        self.wait_for('There is no encoder "%" here', "#connection")

    def test_page_of_removed_encoder_reports_removal(self):
        both = '[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\n[encoder.wrist]\nprotocol = "esl"\nport = "sim"\n'
        served = self.without_history(ABSENC_CONFIG=self.file("absenc.toml", both))
        self.window.go(served.url, encoder="elbow")
        self.wait_for("good", ".state")
        self.file("absenc.toml", both[both.index("[encoder.wrist]"):])
        served.process.send_signal(signal.SIGHUP)
        self.wait_for("elbow is no longer served: it was removed from absenc.toml", "#connection")
        self.wait_for("not served", ".state")
        self.assertEqual(self.text(".digits"), "—")
        self.assertNotIn("onnection to the server", self.text())
        self.file("absenc.toml", both)
        served.process.send_signal(signal.SIGHUP)
        self.wait_for("good", ".state")
        wait_until(lambda: self.text("#connection") == "", "the page is as before")
        self.assert_no_errors()

    def test_server_is_lost(self):
        self.open()
        self.wait_for("°", ".unit")
        self.served.process.kill()
        killed = time.monotonic()
        self.wait_for("No connection to the server", "#connection")
        self.assertLess(time.monotonic() - killed, BUSY + 1.5)
        self.assertEqual(set(self.text(".digits").split()), {"—"})
        self.assertEqual(self.pills(), ["▲ 3 not known"])

    def test_keyboard_reaches_encoder_page(self):
        self.open()
        self.wait_for("good", ".pill")
        for _ in range(20):
            ActionChains(self.browser).send_keys(Keys.TAB).perform()
            if "esl" in self.browser.switch_to.active_element.text:
                break
        ActionChains(self.browser).send_keys(Keys.ENTER).perform()
        self.wait_for("What is wrong")
        self.wait_for("good", ".state")
        wait_until(lambda: self.canvas_has(".plot", [0x0b, 0x5c, 0xad]), "the trace is drawn")
        wait_until(lambda: "back" in self.text("#panel-history"), "there are events")
        tab = self.browser.find_element(By.ID, "tab-history")
        tab.send_keys(Keys.ARROW_RIGHT)
        self.assertEqual(self.browser.switch_to.active_element.text, "Exchanges")
        self.wait_for("Replies by latency")
        self.assert_no_errors()

    def canvas_has(self, selector, color):
        """Returns whether a plot has pixels of the colour [red, green, blue]."""
        return self.browser.execute_script("""
            const [selector, [red, green, blue]] = arguments;
            return [...document.querySelectorAll(selector + " canvas")].some((canvas) => {
              const {data} = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
              for (let i = 0; i < data.length; i += 4) {
                const off = [red, green, blue].map((wanted, part) => Math.abs(wanted - data[i + part]));
                if (Math.max(...off) <= 2 && data[i + 3] > 100) return true;
              }
              return false;
            });""", selector, color)

    def dark(self, on):
        self.browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [
            {"name": "prefers-color-scheme", "value": "dark" if on else "light"}]})

    def test_exchange_figures(self):
        self.window.go(self.served.url, encoder="sim:tformat?alarm=over_heat&fault=corrupt=0.2", range="10m", tab="exchanges")
        self.wait_for("bad checksum", ".histogram")
        # The tables are read in one step, because the page may redraw them at every change.
        labels = "return [...document.querySelectorAll('.histogram')].map((table) => table.getAttribute('aria-label'))"
        wait_until(lambda: self.browser.execute_script(labels) == ["replies by latency", "failed attempts by kind"], "there are both")
        widest = "return Math.max(...[...document.querySelectorAll('.histogram .bar')].map((bar) => bar.offsetWidth))"
        wait_until(lambda: self.browser.execute_script(widest) > 100, "there are bars")
        past = ".plot[aria-label*='over heat']"
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, past), "the plot of the past says its marks")
        wait_until(lambda: self.canvas_has(past, [0xb3, 0x16, 0x1c]), "the alarm is marked")
        self.dark(True)
        wait_until(lambda: self.canvas_has(past, [0xff, 0x80, 0x80]), "in the colour of the dark theme, too")
        self.assert_no_errors()

    def test_history_marks_loss(self):
        self.window.go(self.served.url, encoder=self.name, range="10m")
        self.wait_for("2.747", ".digits")
        wait_until(lambda: self.served.json(of(self.name, "history"))["rows"], "the history has a second")
        self.emulator.kill()
        past = ".plot[aria-label*='marked: lost']"
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, past), "the plot of the past says it")
        wait_until(lambda: self.canvas_has(past, [0xb3, 0x16, 0x1c]), "it is marked although nothing is read after it")
        self.assert_no_errors()

    def test_figures_disappear_with_server(self):
        self.window.go(self.served.url, encoder="sim:tformat?alarm=over_heat&fault=corrupt=0.2", tab="exchanges")
        self.wait_for("bad checksum", "[aria-label='last bad exchanges']")
        self.served.process.kill()
        self.wait_for("not known", ".state")
        shown = "dd, .histogram td, [aria-label='last bad exchanges'] td"
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, shown), [])
        self.assertEqual(self.text(".digits"), "—")

    def test_change_shows_before_after_and_name_and_needs_token(self):
        self.open("#encoder=" + self.name)
        self.wait_for("2.747", ".digits")
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, "[data-command=zero]"), "there are commands")
        self.browser.find_element(By.CSS_SELECTOR, "[data-command=zero]").click()
        words = self.wait_for("named in the history", "dialog")
        for part in ("2.747°", "0.000°"):
            self.assertIn(part, words)
        yes = self.browser.find_element(By.ID, "dialog-yes")
        token = self.browser.find_element(By.ID, "dialog-token")
        token.send_keys("another-secret-than-that")
        yes.click()  # the dialog does not accept the click: its checkbox about the safety of the machine is not set
        self.assertEqual(self.text("#dialog-wrong"), "")
        self.browser.find_element(By.ID, "dialog-safe").click()
        yes.click()
        self.wait_for("the token is wrong", "#dialog-wrong")
        self.assertEqual(self.served.encoder()["counts"], 1000)
        token.clear()
        token.send_keys(TOKEN)
        yes.click()
        self.wait_for("Zero: done", ".status")
        wait_until(lambda: self.served.encoder()["counts"] == 0, "it is at zero")
        wait_until(lambda: "anna from 127.0.0.1" in self.text("#panel-history"), "the history on the page has it")
        self.browser.find_element(By.CSS_SELECTOR, "[data-command=reset-multiturn]").click()
        self.assertIn("anna", self.wait_for("named in the history", "dialog"))
        self.wait_for("0 turns; no alarms", "dialog")
        self.assertEqual(self.browser.find_elements(By.ID, "dialog-token"), [])
        self.assert_no_errors()

    def ask_for(self, command):
        """Opens the dialog in which a user confirms the command."""
        wait_until(lambda: self.browser.find_elements(By.CSS_SELECTOR, f"[data-command={command}]"), "there are commands")
        self.browser.execute_script("document.querySelector('dialog').close()")
        wait_until(lambda: self.text("#dialog-body") == "", "the one before is gone")
        self.browser.execute_script("""
            document.querySelector("details").open = true;
            document.querySelector(`[data-command=${arguments[0]}]`).click();""", command)

    def before_and_after(self, before, after):
        shown = "return [...document.querySelectorAll('dialog dl > div:not([hidden]) dd')].map((one) => one.textContent).slice(0, 2)"
        wait_until(lambda: self.browser.execute_script(shown) == [before, after], f"it says {before} and {after}")

    def test_dialog_shows_value_before_change(self):
        good = {"Authorization": f"Bearer {TOKEN}"}
        self.assertEqual(self.served.command(self.name, "memory-write", good, argument=[3, 0x41])[0], 200)
        self.open("#encoder=" + self.name)
        self.ask_for("set-overheat-threshold")
        self.before_and_after("overheat enabled yes, overheat threshold 90 °C", "overheat threshold: degrees ?")
        self.browser.find_element(By.CSS_SELECTOR, "dialog input").send_keys("80")
        self.before_and_after("overheat enabled yes, overheat threshold 90 °C", "overheat threshold: degrees 80")
        self.ask_for("memory-write")
        self.before_and_after("the byte at the address", "?")
        fields = self.browser.find_elements(By.CSS_SELECTOR, "dialog .field input")
        fields[0].send_keys("3")
        fields[1].send_keys("66")
        self.before_and_after("0x41 (65)", "0x42 (66)")
        self.assert_no_errors()

    def test_values_have_names_and_units(self):
        self.window.go(self.served.url, encoder=self.name, tab="exchanges")
        words = self.wait_for("1000 counts", "#panel-exchanges")
        self.assertIn("position within the turn", words)
        self.press("Settings", "Read the settings")
        words += self.wait_for_panel("Settings", "35 °C")
        self.window.go(self.served.url, encoder="sim:esl?motion=rpm=60", tab="exchanges")
        words += self.wait_for("channel 1 status", "#panel-exchanges")
        for part in ("data id", "data_id", "degC", " SF\n", "ch1"):
            self.assertNotIn(part, words)

    def test_live_trace_begins_with_stored_points(self):
        self.open()
        self.window.go(self.served.url, encoder="sim:esl?motion=rpm=60")
        wait_until(lambda: self.canvas_has(".plot", [0x0b, 0x5c, 0xad]), "the trace is drawn")
        asked = self.browser.execute_script("return performance.getEntriesByType('resource').map((one) => one.name.split('/').pop().split('?')[0])")
        self.assertIn("points", asked)
        self.assertNotIn("minute", asked)

    def test_alarm_is_acknowledged_with_token_and_remains(self):
        name = "sim:tformat?alarm=over_heat&fault=corrupt=0.2"
        self.window.go(self.served.url, encoder=name)
        button = "document.querySelector('[data-acknowledge=over_heat]')"
        wait_until(lambda: self.browser.execute_script(f"return Boolean({button})"), "it can be acknowledged")
        self.browser.execute_script(f"{button}.click()")
        self.wait_for("The alarm stays raised", "dialog")
        self.browser.find_element(By.ID, "dialog-token").send_keys(TOKEN)
        self.browser.find_element(By.ID, "dialog-yes").click()
        self.wait_for("Acknowledged by anna", ".side.bad")
        wait_until(lambda: not self.browser.execute_script(f"return Boolean({button})"), "once is enough")
        self.assertEqual(self.text(".now-box .state"), "▲ alarm, seen")
        wait_until(lambda: "acknowledged" in self.text("#panel-history"), "the history has it")
        self.assertIn("anna from 127.0.0.1", self.text("#panel-history"))
        self.browser.get("about:blank")
        self.open()  # opens the page again, as a second user would
        self.wait_for("Acknowledged by anna", self.card(name) + " .words")
        self.assertEqual(self.text(self.card(name) + " .state"), "▲ alarm, seen")
        self.assert_no_errors()

    def test_browser_notifications(self):
        recorder = self.browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": """
            window.notifications = [];
            window.Notification = class {
              static permission = "default";
              static async requestPermission() { return this.permission = "granted"; }
              constructor(title, {body, tag}) { notifications.push([title, body, tag]); }
              close() {}
            };"""})
        self.addCleanup(self.browser.execute_cdp_cmd, "Page.removeScriptToEvaluateOnNewDocument", recorder)
        emulator = Emulator(self.directory, name="another", stdin=subprocess.PIPE)
        self.addCleanup(lambda: emulator.end())
        name = f"tformat:{emulator.path}?latency=300"
        served = self.without_history(name)
        self.browser.get(served.url)
        self.wait_for("good", ".pill")
        notifications = "return notifications"

        def order(line):
            emulator.process.stdin.write(line)
            self.assertTrue(emulator.line().startswith("ok"))
        order(b"alarm over_speed\n")
        self.wait_for("1 alarm", ".pill")
        # The page shows no notification before the user has allowed notifications.
        self.assertEqual(self.browser.execute_script(notifications), [])
        self.browser.find_element(By.ID, "notify").click()
        wait_until(lambda: self.browser.find_element(By.ID, "notify").get_attribute("aria-pressed") == "true", "it is on")
        order(b"alarm over_heat\n")
        wait_until(lambda: self.browser.execute_script(notifications), "the alarm is notified")
        title, body, tag = self.browser.execute_script(notifications)[0]
        self.assertEqual(title, f"{name}: over heat")
        self.assertIn("let it cool", body)
        self.assertEqual(tag, f"{name} alarm over_heat")
        emulator.kill()
        wait_until(lambda: [one for one in self.browser.execute_script(notifications) if one[0] == f"{name}: lost"], "the loss is notified")
        self.browser.find_element(By.ID, "notify").click()
        wait_until(lambda: self.browser.find_element(By.ID, "notify").get_attribute("aria-pressed") == "false", "it is off")
        self.assert_no_errors()

    def test_without_tokens_page_explains_them(self):
        served = self.without_history("sim:tformat")
        self.browser.get(served.url + "#encoder=sim:tformat")
        self.wait_for("--token-file FILE", ".commands")
        self.assertEqual(self.browser.find_elements(By.CSS_SELECTOR, "[data-command]"), [])

    def panel(self, title):
        tab = self.browser.find_element(By.ID, f"tab-{title.lower()}")
        if tab.get_attribute("aria-selected") != "true":
            tab.send_keys(Keys.ENTER)
        return self.browser.find_element(By.ID, f"panel-{title.lower()}")

    def press(self, title, button):
        """Presses the button of the tab `title` by keyboard, as users without a pointer do."""
        wait_until(lambda: self.browser.find_elements(By.ID, f"tab-{title.lower()}") and
                   self.browser.find_element(By.ID, f"tab-{title.lower()}").is_displayed(), f"there is {title}")
        found = self.panel(title).find_element(By.XPATH, f".//button[text()='{button}']")
        wait_until(lambda: found.is_displayed() and found.is_enabled(), f"{title} can be asked")
        found.send_keys(Keys.ENTER)

    def wait_for_panel(self, title, words):
        return wait_until(lambda: words in self.panel(title).text and self.panel(title).text, f"{title} says {words!r}")

    def test_doctor_shows_progress(self):
        line = SilentLine()
        line.__enter__()
        self.addCleanup(line.__exit__, None, None, None)
        self.served = self.without_history(f"tformat:{line.path}?latency=200")
        self.open(f"#encoder=tformat:{line.path}?latency=200")
        self.press("Doctor", "Examine")
        self.wait_for_panel("Doctor", "the encoder is being examined, readings continue afterwards: reading")
        self.wait_for("examined", ".state")
        self.assertFalse(self.panel("Doctor").find_element(By.TAG_NAME, "button").is_enabled())
        self.wait_for_panel("Doctor", "fault: no answer")
        wait_until(lambda: "no reply" in self.text(".state"), "it is asked again")
        self.assert_no_errors()

    def test_doctor_shows_findings(self):
        name = "sim:tformat?alarm=over_heat&fault=corrupt=0.2"
        self.window.go(self.served.url, encoder=name)
        self.press("Doctor", "Examine")
        words = self.wait_for_panel("Doctor", "warning: damaged bits")
        for part in ("first: damaged_bits", "seen", "likely", "try", "warning: alarm"):
            self.assertIn(part, words)
        self.assert_no_errors()

    def test_memory_and_settings_equal_encoder(self):
        good = {"Authorization": f"Bearer {TOKEN}"}
        self.assertEqual(self.served.command(self.name, "memory-write", good, argument=[1, 0x41, 2])[0], 200)
        self.assertEqual(self.served.command(self.name, "set-overheat-threshold", good, argument=[77])[0], 200)
        self.open("#encoder=" + self.name)
        self.press("Settings", "Read the settings")
        self.assertIn("overheat threshold 77 °C", self.wait_for_panel("Settings", "may be set to degrees"))
        Select(self.panel("Memory").find_element(By.TAG_NAME, "select")).select_by_value("2")
        self.press("Memory", "Read the memory")
        self.wait_for_panel("Memory", "127 bytes read at")
        first = self.panel("Memory").find_element(By.CSS_SELECTOR, "tbody tr").text
        self.assertRegex(first, "^2 0x00 [0-9A-F]{2} 41 ")
        self.press("Doctor", "Examine")
        self.wait_for_panel("Doctor", "good: ")
        self.emulator.kill()
        self.wait_for_panel("Memory", "no longer shown: the encoder is lost")
        self.assertNotIn("0x00", self.panel("Memory").text)
        self.assertNotIn("77 °C", self.panel("Settings").text)
        self.press("Settings", "Read the settings")
        self.wait_for_panel("Settings", "was not done")
        self.press("Doctor", "Examine")
        self.wait_for_panel("Doctor", "fault: port ")
        self.assert_no_errors()


if __name__ == "__main__":
    unittest.main()
