# SPDX-License-Identifier: Apache-2.0
"""Checks the page of `absenc serve` as Chromium renders it. ABSENC_SCREENSHOTS=FOLDER writes pictures."""
import os
import unittest

# Imported first, because page_scenes checks that selenium is installed.
from page_scenes import KINDS, Browser, config, hundred
from selenium.webdriver.common.by import By

from command_support import Emulator
from npm_support import tool
from serve_support import ServeCase, wait_until

WIDTHS = (390, 768, 1280, 1400, 1920, 3840)
SCREENSHOTS = os.environ.get("ABSENC_SCREENSHOTS")

# JavaScript that checks the layout of the shown page, and returns its faults as sentences.
MEASURE = """
const wrong = [];
const root = document.documentElement;
if (root.scrollWidth > innerWidth) wrong.push(`the page is ${root.scrollWidth} wide, the window ${innerWidth}`);
const seen = (node) => node.checkVisibility({checkOpacity: true, checkVisibilityCSS: true}) && !node.closest('.unseen, .skip, noscript, option');
const parse = (text) => { const [r, g, b, a = 1] = text.match(/[\\d.]+/g).map(Number); return {r, g, b, a}; };
const light = ({r, g, b}) => [r, g, b].map((value) => value / 255).map((value) => value <= .04045 ? value / 12.92 : ((value + .055) / 1.055) ** 2.4)
  .reduce((sum, value, i) => sum + value * [.2126, .7152, .0722][i], 0);
const ground = (node) => {
  for (let one = node; one !== null; one = one.parentElement) {
    const color = parse(getComputedStyle(one).backgroundColor);
    if (color.a > .99) return color;
  }
  return {r: 255, g: 255, b: 255};
};
const texts = [];
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
const dialog = document.querySelector('dialog[open]');
for (let node = walker.nextNode(); node !== null; node = walker.nextNode()) {
  const parent = node.parentElement;
  if (node.data.trim() === '' || !seen(parent) || ['SCRIPT', 'STYLE'].includes(parent.tagName)) continue;
  if (dialog !== null && !dialog.contains(parent)) continue;
  const range = document.createRange();
  for (const word of node.data.matchAll(/[^\\s\\u202f]+(\\u202f[^\\s\\u202f]+)*/g)) {
    range.setStart(node, word.index);
    range.setEnd(node, word.index + word[0].length);
    if (parent.closest('code') !== null || range.getClientRects().length < 2) continue;
    let before = null;
    for (let i = word.index; i < word.index + word[0].length; ++i) {
      range.setStart(node, i);
      range.setEnd(node, i + 1);
      const top = Math.round(range.getBoundingClientRect().top);
      // A path and a compound may be broken behind their separators.
      if (before !== null && top > before + 3 && !'/-?&=:_,'.includes(node.data[i - 1])) wrong.push(`"${word[0]}" is broken before its character ${i - word.index}`);
      before = top;
    }
  }
  range.selectNodeContents(node);
  const style = getComputedStyle(parent);
  const size = parseFloat(style.fontSize);
  if (size < 11) wrong.push(`"${node.data.trim()}" is only ${size} px high`);
  const [front, back] = [light(parse(style.color)), light(ground(parent))].sort((a, b) => b - a);
  const contrast = (front + .05) / (back + .05);
  const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
  if (contrast < (large ? 3 : 4.5) && !parent.closest(':disabled')) wrong.push(`"${node.data.trim()}" has a contrast of ${contrast.toFixed(2)}`);
  const frame = parent.closest('.scroll, .card, .box, header, dialog, .trouble, main').getBoundingClientRect();
  const scrolls = parent.closest('.scroll') !== null;
  const isSticky = parent.closest('header') !== null;
  for (const rect of range.getClientRects()) {
    if (rect.width === 0) continue;
    if (!scrolls && (rect.left < frame.left - 1 || rect.right > frame.right + 1 || rect.top < frame.top - 1 || rect.bottom > frame.bottom + 1)) {
      wrong.push(`"${node.data.trim()}" sticks out of its frame`);
    }
    texts.push({rect, words: node.data.trim(), isSticky, scrolls});
  }
}
// By line, so that a hundred cards take no time.
texts.sort((a, b) => a.rect.top - b.rect.top);
for (let i = 0; i < texts.length; ++i) {
  for (let k = i + 1; k < texts.length && texts[k].rect.top < texts[i].rect.bottom - 3; ++k) {
    const [one, other] = [texts[i], texts[k]];
    if (one.isSticky !== other.isSticky || one.scrolls || other.scrolls) continue;
    const wide = Math.min(one.rect.right, other.rect.right) - Math.max(one.rect.left, other.rect.left);
    const high = Math.min(one.rect.bottom, other.rect.bottom) - Math.max(one.rect.top, other.rect.top);
    if (wide > 1 && high > 3) wrong.push(`"${one.words}" and "${other.words}" overlap`);
  }
}
for (const node of document.querySelectorAll('body *')) {
  if (!seen(node) || node.closest('.scroll, svg, .plot, input, select') !== null || getComputedStyle(node).display === 'inline') continue;
  if (node.scrollWidth > node.clientWidth + 1 && node.clientWidth > 0) wrong.push(`<${node.tagName} class="${node.className}"> holds ${node.scrollWidth} pixels in ${node.clientWidth}`);
}
return wrong;
"""


class Look(ServeCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = Browser()
        cls.addClassCleanup(cls.browser.driver.quit)

    def served(self, kinds, ports=None):
        path = self.file("absenc.toml", config(kinds, ports))
        return self.server("--history", self.file("history"), "--token-file", self.tokens(), ABSENC_CONFIG=path)

    def tokens(self):
        path = self.file("tokens", "anna a-secret-of-nobody-else\n")
        os.chmod(path, 0o600)
        return path

    def open(self, server, ready, **place):
        self.browser.window(1400)
        self.browser.go(server.url, **place)
        wait_until(lambda: self.browser.ask(f"return Boolean({ready})"), ready)

    def draw(self):
        """Waits until the page has redrawn itself."""
        self.browser.driver.execute_async_script("""
            const done = arguments[0];
            requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(() => requestAnimationFrame(() => done()), 150)));""")

    def look(self, name, widths=WIDTHS):
        """Checks the scene `name` at each width in each theme."""
        shots = []
        for dark in (False, True):
            for width in widths:
                self.browser.window(width, 1250 if width < 500 else 2100 if width > 3000 else 1000, dark)
                self.draw()
                with self.subTest(name, width=width, dark=dark):
                    self.assertEqual(self.browser.ask(MEASURE), [])
                if SCREENSHOTS:
                    path = os.path.join(SCREENSHOTS, f"{name}-{width}-{'dark' if dark else 'light'}.png")
                    shots.append(self.browser.shot(path))
            with self.subTest(name, axe=True, dark=dark):
                self.assertEqual(self.axe(), [])
            if SCREENSHOTS:
                sheet(shots, os.path.join(SCREENSHOTS, f"sheet-{name}-{'dark' if dark else 'light'}.png"))
                shots = []
        errors = [entry["message"] for entry in self.browser.driver.get_log("browser")
                  if entry["level"] == "SEVERE" and "net::ERR" not in entry["message"] and "status of 40" not in entry["message"]]
        self.assertEqual(errors, [])

    def axe(self):
        with open(tool("axe-core/axe.min.js"), encoding="utf-8") as file:
            self.browser.ask(file.read())
        return self.browser.driver.execute_async_script("""
            const done = arguments[0];
            axe.run(document).then((found) => done(found.violations.map((one) => `${one.id}: ${one.nodes.map((node) => node.html).join(" ").slice(0, 300)}`)));""")

    READY = "document.querySelectorAll('.card .digits').length > 0 && document.querySelector('.spark .line')?.getAttribute('d')"
    ONE = "document.querySelector('.one .plot canvas') && document.querySelector('.commands button')"

    def test_all_kinds_with_lost_and_alarmed_encoder(self):
        emulator = Emulator(self.directory, "--motion", "rpm=20")
        self.addCleanup(emulator.end)
        server = self.served({"press-2": ("tformat", "latency=300"), **KINDS}, ports={"press-2": emulator.path})
        wait_until(lambda: server.encoder()["state"] == "live" and len(server.json("/api/minute")["encoders"][0]["seconds"]) > 2, "it was read")
        emulator.kill()
        wait_until(lambda: server.encoder()["state"] == "lost", "it is lost")
        self.open(server, self.READY)
        wait_until(lambda: self.browser.ask("return document.querySelector('.card')?.dataset.state") == "lost", "the ill are first")
        groups = self.browser.ask("return [...document.querySelectorAll('.pill:not([hidden])')].map((pill) => pill.dataset.group)")
        self.assertEqual(groups, ["lost", "alarm", "errors", "live", "good"])
        self.look("overview")
        for width in (1280, 1400, 1920, 3840):
            self.browser.window(width)
            self.draw()
            tops = self.browser.ask("return [...document.querySelectorAll('header .pill:not([hidden]), header input, header button#token')].map((one) => { const {top, bottom} = one.getBoundingClientRect(); return (top + bottom) / 2; })")
            self.assertLess(max(tops) - min(tops), 4, f"the bar has one line at {width}")
        for name in ("press-2", "elbow", "wrist", "shoulder", "slide-x", "axis-7", "table", "turret", "chain-a"):
            self.open(server, self.ONE, encoder=name)
            self.look(f"one-{name}", WIDTHS if name in ("press-2", "elbow", "slide-x") else (390, 1280, 1920))

    def test_tabs(self):
        server = self.served({name: KINDS[name] for name in ("wrist", "elbow", "table")})
        for tab, button, done in (("history", None, "document.querySelectorAll('#panel-history td').length > 0"),
                                  ("exchanges", None, "document.querySelectorAll('#panel-exchanges code').length > 1"),
                                  ("settings", "Read the settings", "document.querySelectorAll('#panel-settings td').length > 0"),
                                  ("memory", "Read the memory", "document.querySelectorAll('#panel-memory td').length > 0"),
                                  ("doctor", "Examine", "document.querySelector('#panel-doctor .finding')")):
            self.open(server, self.ONE, encoder="wrist", tab=tab)
            if button is not None:
                self.browser.driver.find_element(By.XPATH, f"//*[@role='tabpanel']//button[text()='{button}']").click()
            wait_until(lambda: self.browser.ask(f"return Boolean({done})"), done)
            self.browser.ask("document.querySelector('.tablist').scrollIntoView()")
            self.look(f"tab-{tab}", (390, 1400, 3840))

    def test_confirmation_dialogs(self):
        server = self.served({"elbow": KINDS["elbow"]})
        for command in ("zero", "set-overheat-threshold"):
            self.open(server, self.ONE, encoder="elbow")
            self.browser.ask("document.querySelector('details').open = true")
            self.browser.driver.find_element(By.CSS_SELECTOR, f"[data-command={command}]").click()
            wait_until(lambda: self.browser.ask("return document.querySelector('dialog').open"), "it asks")
            self.look(f"change-{command}", (390, 1400))

    def test_hundred_encoders(self):
        server = self.served(hundred())
        self.open(server, "document.querySelectorAll('.card .digits').length === 100")
        self.look("hundred")

    def test_redraw_writes_only_changes(self):
        """The page must write only values that changed, because writes are slow."""
        server = self.served(hundred())
        self.open(server, "document.querySelectorAll('.card .digits').length === 100")
        same, often = self.browser.driver.execute_async_script("""
            const done = arguments[0];
            (async () => {
              const {Overview} = await import("./overview.js");
              const state = await (await fetch("api/encoders")).json();
              const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
              const main = document.createElement("div");
              const view = new Overview(main, document.createElement("div"));
              view.show(state);
              await pause(500);  // the last minute has come
              view.draw(state);
              let changes = 0;
              new MutationObserver((list) => changes += list.length).observe(main, {subtree: true, childList: true, attributes: true, characterData: true});
              view.draw(state);
              await pause(0);
              const same = changes;
              let drawings = 0;
              const draw = view.draw;
              view.draw = function(...values) { drawings += 1; draw.apply(this, values); };
              const begun = performance.now();
              while (performance.now() - begun < 2000) {
                view.show(state);
                await pause(33);
              }
              view.close();
              done([same, drawings]);
            })();""")
        self.assertEqual(same, 0)
        # `often` is the number of redraws in 2 s: `show` was called 60 times, but with many encoders the view redraws
        # only about twice a second
        self.assertIn(often, range(1, 6))

    def test_one_encoder_and_none(self):
        path = self.file("absenc.toml", config({"elbow": ("tformat", "motion=rpm=60")}))
        server = self.without_history(ABSENC_CONFIG=path)
        self.open(server, self.READY)
        self.assertEqual(self.browser.ask("return document.querySelector('.pill:not([hidden])').textContent"), "● good")
        self.look("single")
        self.open(server, "document.querySelector('.one .plot canvas')", encoder="elbow")
        wait_until(lambda: "the server has no tokens" in self.browser.ask("return document.body.innerText"), "it says why")
        self.look("without-tokens", (390, 1400))
        # The server never sends an empty list of encoders, but the page must be able to show one.
        self.open(server, self.READY)
        self.browser.driver.execute_async_script("""
            const done = arguments[0];
            import("./overview.js").then(({Overview}) => {
              new Overview(document.getElementById("main"), document.getElementById("bar")).show({at_ms: Date.now(), encoders: [], history: null});
              done();
            });""")
        self.look("none")

    def test_lost_server(self):
        server = self.served(KINDS)
        for name, place in (("overview", {}), ("one", {"encoder": "shoulder"})):
            if name == "one":
                server = self.served(KINDS)
            self.open(server, self.ONE if place else self.READY, **place)
            server.process.kill()
            server.process.wait()
            wait_until(lambda: self.browser.ask("return !document.querySelector('#connection').hidden"), "it says so")
            self.look(f"gone-{name}", (390, 1400, 1920))
            self.assertNotIn("°", self.browser.ask("return [...document.querySelectorAll('.figure')].map((one) => one.textContent).join()"))


def sheet(paths, path):
    """Writes the pictures side by side, three in a row, to one file at `path`."""
    from PIL import Image
    pictures = [Image.open(one).convert("RGB") for one in paths]
    height = 560
    small = [one.resize((round(one.width * height / one.height), height), Image.LANCZOS) for one in pictures]
    rows = [small[i:i + 3] for i in range(0, len(small), 3)]
    whole = Image.new("RGB", (max(sum(one.width + 6 for one in row) for row in rows), len(rows) * (height + 6)), (128, 128, 128))
    for y, row in enumerate(rows):
        x = 0
        for one in row:
            whole.paste(one, (x, y * (height + 6)))
            x += one.width + 6
    whole.save(path)


if __name__ == "__main__":
    unittest.main()
