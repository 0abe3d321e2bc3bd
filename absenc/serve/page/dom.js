// SPDX-License-Identifier: Apache-2.0
// Creates elements, drawings and tables of the page. Texts are never inserted as markup.

/** Creates an element: element("p", {class: "why"}, "text", child). */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

/** Sets the text only if it differs, so that screen readers and selections are not disturbed. */
export function setText(node, text) {
  const only = node.firstChild;
  if (only === null || only !== node.lastChild || only.nodeType !== Node.TEXT_NODE) {
    if (node.textContent !== text) node.textContent = text;
  } else if (only.data !== text) {
    only.data = text;
  }
}

/** Sets the class only if it differs: a write makes the browser compute styles again. */
export function setClass(node, name) {
  if (node.className !== name) node.className = name;
}
export function toggleClass(node, name, on) {
  if (node.classList.contains(name) !== on) node.classList.toggle(name, on);
}
export function setHidden(node, on) {
  if (node.hasAttribute("hidden") !== on) node.toggleAttribute("hidden", on);
}

export function setChildren(node, ...children) {
  const made = element("div", {}, ...children);
  if (node.innerHTML === made.innerHTML) return;
  const label = node.contains(document.activeElement) ? document.activeElement.getAttribute("aria-label") : null;
  node.replaceChildren(...made.childNodes);
  if (label !== null) [...node.querySelectorAll("[aria-label]")].find((one) => one.getAttribute("aria-label") === label)?.focus({preventScroll: true});
}

const SVG = "http://www.w3.org/2000/svg";

function drawing(name, attributes = {}, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

/** Allows line breaks in a name after its separators only. */
export function breakable(text) {
  const parts = text.split(/(?<=[?&=:/_,])/);
  return parts.flatMap((part, i) => (i === 0 ? [part] : [element("wbr"), part]));
}

/** Converts a text in which `backquotes` mark command lines. */
export const rich = (text) => text.split("`").map((part, i) => (i % 2 === 1 ? element("code", {}, part) : part));

/** Creates a dial. `turn` sets the needle in degrees clockwise from the top; null hides it. */
export function dial() {
  const needle = drawing("line", {class: "needle", y1: 0, y2: -36});
  const ticks = Array.from({length: 12}, (_, i) => drawing("line", {class: "tick", y1: -46, y2: -40, transform: `rotate(${30 * i})`}));
  // the dial is hidden from screen readers: they get the number beside it
  const node = drawing("svg", {viewBox: "-50 -50 100 100", class: "dial off", "aria-hidden": "true"},
                       drawing("circle", {r: 46}), ...ticks, needle, drawing("circle", {class: "hub", r: 5}));
  let shown;
  return {
    node,
    turn(angle) {
      toggleClass(node, "off", angle === null);
      const turned = angle === null ? shown : angle.toFixed(1);
      if (turned !== shown) needle.setAttribute("transform", `rotate(${turned})`);
      shown = turned;
    },
  };
}

/** Creates a scale for linear encoders. `move` takes a share of the length, 0 to 1, or null. */
export function scale() {
  const filled = element("span", {class: "filled"});
  const mark = element("span", {class: "mark"});
  const end = element("span");
  const node = element("div", {class: "scale off", "aria-hidden": "true"}, element("div", {class: "track"}, filled, mark),
                       element("div", {class: "ends"}, element("span", {}, "0 mm"), end));
  let shown;
  return {
    node,
    move(share, length) {
      toggleClass(node, "off", share === null);
      setText(end, length);
      const moved = share === null ? shown : (100 * share).toFixed(2);
      if (moved !== shown) filled.style.width = mark.style.left = `${moved}%`;
      shown = moved;
    },
  };
}

const SPARK_S = 60;
// greatest width, in seconds, of the area of a small plot that marks the time without readings
const SPARK_LOST_S = 15;

/** Creates the small plot of the last minute. */
export function spark() {
  const line = drawing("path", {class: "line"});
  const gap = drawing("rect", {class: "gap", y: 0, height: 100, width: 0});
  const node = drawing("svg", {viewBox: "0 0 600 100", preserveAspectRatio: "none", class: "spark", "aria-hidden": "true"}, gap, line);
  return {
    node,
    /** Draws `points`, a list of [seconds, value]. `least`: smallest range of the y axis. */
    draw(points, now, least, live) {
      const last = points.at(-1)?.[0] ?? now;
      const end = live ? now : Math.min(now, last + SPARK_LOST_S);
      const shown = points.filter(([at, value]) => value !== null && at >= end - SPARK_S);
      const values = shown.map(([, value]) => value);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      const range = Math.max(high - low, least);
      const middle = (low + high) / 2;
      const x = (at) => 600 * (1 - (end - at) / SPARK_S);
      let before = -Infinity;
      const path = shown.map(([at, value]) => {
        const step = `${at - before > 3 ? "M" : "L"}${x(at).toFixed(1)} ${(50 - 88 * (value - middle) / range).toFixed(1)}`;
        before = at;
        return step;
      });
      line.setAttribute("d", path.join(""));
      const from = live ? 600 : Math.max(0, x(last));
      gap.setAttribute("x", from);
      gap.setAttribute("width", 600 - from);
      return values.length === 0 ? null : [low, high];
    },
  };
}

/** Creates a table; `cells` returns the texts or elements of a row. */
function narrowTable(head, list, cells, caption) {
  const line = (one) => element("tr", {}, ...cells(one).map((cell) => element("td", {}, cell)));
  return element("table", {"aria-label": caption},
                 element("thead", {}, element("tr", {}, ...head.map((text) => element("th", {scope: "col"}, text)))),
                 element("tbody", {}, ...list.map(line)));
}

/** Creates a table that scrolls if it is wider than the page. */
export function table(head, list, cells, caption) {
  return element("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": caption}, narrowTable(head, list, cells, caption));
}

/** Creates a table of [name, count] with bars beside the counts. */
export function histogram(head, list, caption) {
  const most = Math.max(1, ...list.map(([, count]) => count));
  const bar = (count) => element("span", {class: "bar", style: `width: ${100 * count / most}%`, "aria-hidden": "true"});
  const made = narrowTable([...head, "share"], list, ([name, count]) => [name, String(count), bar(count)], caption);
  made.className = "histogram";
  return made;
}

/** Creates a description list from [term, value] pairs. */
export function terms(list) {
  return element("dl", {}, ...list.map(([term, value]) => element("div", {}, element("dt", {}, term), element("dd", {}, value))));
}

/** Creates a group of buttons with one selected. `list`: [[value, text], ...]. */
export function choice(label, list, chosen, onChoice) {
  const buttons = list.map(([value, text]) => element("button", {
    type: "button", "aria-pressed": String(value === chosen), "data-value": value,
    onclick: () => onChoice(value)}, text));
  return element("div", {class: "choice", role: "group", "aria-label": label}, ...buttons);
}
