// SPDX-License-Identifier: Apache-2.0
// Elements and texts. Everything that came from elsewhere is put in as text, never as markup.

/** element("p", {class: "why"}, "text", child) */
export function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== false) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children);
  return made;
}

/** Only when it is another: so screen readers and selections are left in peace. */
export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

const SVG = "http://www.w3.org/2000/svg";

/** A dial whose needle `turn` sets, in degrees clockwise from the top; null: no needle. */
export function dial() {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "-50 -50 100 100");
  svg.setAttribute("class", "dial off");
  svg.setAttribute("aria-hidden", "true");  // the number stands beside it
  const add = (name, attributes) => {
    const part = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) part.setAttribute(key, value);
    svg.append(part);
    return part;
  };
  add("circle", {r: 46});
  for (let angle = 0; angle < 360; angle += 30) {
    add("line", {class: "tick", y1: -46, y2: -40, transform: `rotate(${angle})`});
  }
  const needle = add("line", {class: "needle", y1: 8, y2: -36});
  return {
    svg,
    turn(angle) {
      svg.classList.toggle("off", angle === null);
      if (angle !== null) needle.setAttribute("transform", `rotate(${angle})`);
    },
  };
}

/** `cells` makes the texts or elements of a row. */
function narrowTable(head, list, cells, caption) {
  const line = (one) => element("tr", {}, ...cells(one).map((cell) => element("td", {}, cell)));
  return element("table", {"aria-label": caption},
                 element("thead", {}, element("tr", {}, ...head.map((text) => element("th", {scope: "col"}, text)))),
                 element("tbody", {}, ...list.map(line)));
}

/** One that may be wider than the page. */
export function table(head, list, cells, caption) {
  return element("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": caption}, narrowTable(head, list, cells, caption));
}

/** A table of [name, count], with bars beside the counts for those who see them. */
export function histogram(head, list, caption) {
  const most = Math.max(1, ...list.map(([, count]) => count));
  const bar = (count) => element("span", {class: "bar", style: `width: ${100 * count / most}%`, "aria-hidden": "true"});
  const made = narrowTable([...head, ""], list, ([name, count]) => [name, String(count), bar(count)], caption);
  made.className = "histogram";
  return made;
}

export const NOTHING = "–";

export function duration(seconds) {
  if (seconds < 1) return `${Math.round(seconds * 1000)} ms`;
  if (seconds < 120) return `${seconds.toFixed(1)} s`;
  if (seconds < 7200) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}

export function positionText(one) {
  if (one.angle_deg !== null) return `${one.angle_deg.toFixed(3)}°`;
  if (one.position_mm !== null) return `${one.position_mm.toFixed(4)} mm`;
  if (one.state !== "live") return NOTHING;
  return one.singleturn_valid === null ? "unknown" : "INVALID";
}

export function turnsText(one) {
  if (one.turns !== null) return String(one.turns);
  return one.multiturn_valid === false ? "INVALID" : NOTHING;
}

export function speedText(one) {
  return one.speed === null ? NOTHING : `${one.speed.toFixed(1)} ${one.speed_unit}`;
}

export function stateText(one) {
  return one.state === "live" ? "live" : `${one.state}: no reading for ${duration(one.age_s)}`;
}

export function alarmText(alarm) {
  const action = alarm.action ? ` What to do: ${alarm.action}.` : "";
  return `${alarm.channel ? alarm.channel + " " : ""}${alarm.name}: ${alarm.meaning}.${action}`;
}

/** [class, text] of each line below an encoder: alarms, or that nobody has reported them, and why it is not live. */
export function wordsOf(one) {
  const words = (one.alarms ?? []).map((alarm) => ["alarm", alarmText(alarm)]);
  if (one.state === "live" && one.alarms === null) {
    if (one.status?.length) words.push(["alarm", `status: ${one.status.join(" ")}`]);
    words.push(["faint", "alarms not reported"]);
  }
  if (one.message) words.push(["why", one.message]);
  return words;
}

/** A value of a reply: flags are a list of names, and what does not hold is null. */
export function fieldText(value, missing = "INVALID") {
  if (value === null) return missing;
  return Array.isArray(value) ? value.join(" ") || "none" : String(value);
}

const dialog = document.getElementById("dialog");

/** True when it was answered with yes; with `field`, what was written, or null. */
export function ask(title, text, yes, field = null) {
  document.getElementById("dialog-title").textContent = title;
  document.getElementById("dialog-text").textContent = text;
  document.getElementById("dialog-yes").textContent = yes;
  const label = document.getElementById("dialog-field");
  const input = label.querySelector("input");
  label.hidden = field === null;
  label.querySelector("span").textContent = field ?? "";
  input.value = "";
  dialog.returnValue = "no";
  dialog.showModal();
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => {
      const agreed = dialog.returnValue === "yes";
      if (field === null) resolve(agreed);
      else resolve(agreed ? input.value.trim() : null);
      input.value = "";
    }, {once: true});
  });
}
