// SPDX-License-Identifier: Apache-2.0
// Overview page: a card for each encoder, with filter and counts in the bar.
import {breakable, dial, element, rich, scale, setClass, setHidden, setText, spark, toggleClass} from "./dom.js";
import {request} from "./server.js";
import {GROUPS, GROUP_WORDS, MORE_WORDS, SHAPES, belowFigure, condition, figure, numberText, faultLines} from "./words.js";

const MANY = 30;           // number of encoders above which the cards are small
const FEW = 3;
// With more than MANY encoders, two redraws of the overview are at least DRAW_MS milliseconds per encoder apart.
const DRAW_MS = 5;
const ORDER_MS = 2000;     // minimum time between two automatic reorderings of the cards, in milliseconds
const MINUTE_S = 60;
const MOST_WORDS = 2;

/** Creates the large figure with its unit, for a card or the page of an encoder. */
export function figureNode() {
  const digits = element("span", {class: "digits"});
  // invisible text that keeps the large number of a card as wide as the widest value shown so far
  const widest = element("span", {class: "widest", "aria-hidden": "true"});
  const unit = element("span", {class: "unit"});
  const node = element("p", {class: "figure"}, element("span", {class: "number"}, widest, digits), unit);
  let sizes;
  let most = 0;
  return {
    node,
    show(encoder) {
      const {text, unit: name, width} = figure(encoder);
      setText(digits, text);
      setText(unit, name);
      const wanted = `--digits: ${width}; --beside: ${encoder.linear ? "0rem" : "var(--dial)"}`;
      if (wanted !== sizes) node.setAttribute("style", sizes = wanted);
      if (name !== "" && text.length > most) {
        most = text.length;
        widest.textContent = text.replace(/\d/g, "0");
      }
      toggleClass(node, "word", name === "");
    },
  };
}

/** Returns the quantity of the small plot as a column of its points: 1 for position, 2 for speed. */
export function sparkColumn(points, linear) {
  if (linear) return 1;
  const places = points.map((row) => row[1]).filter((place) => place !== null);
  const turning = places.length > 1 && Math.max(...places) - Math.min(...places) > 720;
  return turning ? 2 : 1;
}

/** Shows texts in separate spans, none of which is broken across lines. */
export function showParts(node, parts) {
  while (node.childElementCount > parts.length) node.lastChild.remove();
  while (node.childElementCount < parts.length) node.append(element("span"));
  parts.forEach((part, i) => {
    setText(node.children[i], part);
    setClass(node.children[i], /INVALID/.test(part) ? "bad" : "");
  });
}

export function showState(node, {kind, word}) {
  setClass(node, `state ${kind}`);
  setText(node.firstChild, SHAPES[kind]);
  setText(node.lastChild, word);
}
export const stateNode = () => element("p", {class: "state"}, element("span", {"aria-hidden": "true"}), " ", element("span"));

class Card {
  constructor(name) {
    this.name = name;
    this.points = [];
    this.dial = dial();
    this.scale = scale();
    this.figure = figureNode();
    this.state = stateNode();
    this.kindName = element("p", {class: "faint kind"});
    this.below = element("p", {class: "below"});
    this.words = element("div", {class: "words"});
    this.spark = spark();
    this.caption = element("span");
    this.range = element("span");
    this.trace = element("div", {class: "trace"}, element("p", {class: "caption faint"}, this.caption, this.range), this.spark.node);
    this.rate = element("span");
    this.errors = element("span");
    const link = element("a", {href: `#encoder=${encodeURIComponent(name)}`}, ...breakable(name));
    this.node = element("li", {class: "card"},
      element("div", {class: "head"}, element("h2", {}, link), this.state), this.kindName,
      element("div", {class: "now"}, element("div", {}, this.figure.node, this.below), this.dial.node),
      this.scale.node, this.words, this.trace, element("p", {class: "foot faint"}, this.rate, this.errors));
  }

  show(encoder, at_ms, isSmall) {
    this.encoder = encoder;
    this.condition = condition(encoder);
    setClass(this.node, `card ${this.condition.kind}`);
    if (this.node.dataset.state !== encoder.state) this.node.dataset.state = encoder.state;
    showState(this.state, this.condition);
    setText(this.kindName, encoder.protocol_name);
    this.figure.show(encoder);
    setHidden(this.dial.node, encoder.linear);
    this.dial.turn(encoder.angle_deg);
    setHidden(this.scale.node, !encoder.linear || encoder.length_mm === null);
    if (encoder.linear && encoder.length_mm !== null) {
      this.scale.move(encoder.position_mm === null ? null : encoder.position_mm / encoder.length_mm, `${numberText(encoder.length_mm)} mm`);
    }
    showParts(this.below, belowFigure(encoder, at_ms, isSmall));
    this.showWords(faultLines(encoder));
    const live = encoder.state === "live";
    setText(this.rate, live ? `${numberText(encoder.rate_hz, encoder.rate_hz < 10 ? 1 : 0)} readings/s` : "0 readings/s");
    setText(this.errors, encoder.errors_last_minute === null ? "" : `${numberText(encoder.errors_last_minute)} ${encoder.errors_last_minute === 1 ? "error" : "errors"}/min`);
    setClass(this.errors, encoder.errors_last_minute > 0 ? "warn" : "");
    const second = Math.floor(at_ms / 1000);
    if (second === this.second) return;
    this.second = second;
    if (live && encoder.continued_position !== null) this.points.push([second, encoder.continued_position, encoder.speed]);
    while (this.points.length > MINUTE_S + 5) this.points.shift();
    this.drawTrace(second, live);
  }

  showWords(list) {
    const shown = list.slice(0, MOST_WORDS);
    if (list.length > shown.length) shown.push(["bad", `And ${list.length - shown.length} more.`, ""]);
    const text = JSON.stringify(shown);
    if (text === this.shownWords) return;
    this.shownWords = text;
    const first = (words) => /^.*?[.!?](?= [A-Z]|$)/.exec(words)?.[0] ?? words;
    this.words.replaceChildren(...shown.map(([kind, strong, words]) => element("p", {class: kind}, element("strong", {}, strong), element("span", {class: "more"}, strong && words ? " " : "", ...rich(strong ? words : first(words))))));
  }

  seed(seconds) {
    const first = this.points[0]?.[0] ?? Infinity;
    this.points.unshift(...seconds.filter(([at]) => at < first));
    this.second = 0;
  }

  drawTrace(now, live) {
    const column = sparkColumn(this.points, this.encoder.linear);
    // Continues a rotary position past the end of a turn: a step of more than half a turn between two points, as from
    // 359 to 1 degree, becomes the short step, here 2 degrees.
    let turns = 0;
    const unwrapped = this.points.map((row, i) => {
      const step = i > 0 ? row[1] - this.points[i - 1][1] : 0;
      if (column === 1 && !this.encoder.linear && Math.abs(step) > 180) turns -= Math.round(step / 360);
      return [row[0], row[column] === null ? null : row[column] + (column === 1 ? 360 * turns : 0)];
    });
    const unit = column === 2 ? this.encoder.speed_unit : this.encoder.linear ? "mm" : "°";
    const least = column === 2 ? 1 : this.encoder.linear ? .1 : .5;
    const range = this.spark.draw(unwrapped, now, least, live);
    this.trace.toggleAttribute("hidden", range === null);
    if (range === null) return;
    setText(this.caption, `${column === 2 ? "speed" : "position"}, ${live ? "last minute" : "before"}`);
    const suffix = unit === "°" ? unit : ` ${unit}`;
    const decimals = unit === "°" || unit === "mm" ? 2 : 1;
    const offset = unit === "°" ? 360 * Math.floor(range[0] / 360) : 0;
    const [low, high] = range.map((value) => numberText(value - offset, decimals));
    setText(this.range, low === high ? low + suffix : `${low} to ${high}${suffix}`);
  }
}

export class Overview {
  constructor(main, bar) {
    this.cards = new Map();
    this.list = element("ul", {class: "cards", "aria-label": "encoders"});
    this.none = element("div", {class: "none", hidden: true}, element("h2", {}, "No encoder is served"),
      element("p", {}, "Name encoders after ", element("code", {}, "absenc serve"), ", or write them into absenc.toml and send the server SIGHUP. Without hardware, try:"),
      element("p", {}, element("code", {}, "absenc serve \"sim:tformat?motion=rpm=60\" sim:esl")));
    this.noMatch = element("p", {class: "none", hidden: true}, "No encoder matches. ", element("button", {type: "button", onclick: () => this.clearFilter()}, "Show all"));
    main.replaceChildren(this.none, this.noMatch, this.list);
    // The filter buttons are created once, so that a button does not lose the focus.
    this.groups = new Map(GROUPS.map((group) => {
      const [shape, words, more] = [element("span", {"aria-hidden": "true"}), element("span"), element("span", {class: "where-wide"})];
      return [group, {shape, words, more, node: element("button", {type: "button", class: "pill", hidden: true, "data-group": group, onclick: () => this.choose(group)}, shape, words, more)}];
    }));
    this.pills = element("div", {class: "pills", role: "group", "aria-label": "show only"}, ...[...this.groups.values()].map(({node}) => node));
    this.filter = element("input", {type: "search", placeholder: "Filter", "aria-label": "filter by name", oninput: () => this.arrange(true)});
    this.order = element("select", {"aria-label": "order", onchange: () => this.arrange(true)},
      element("option", {value: "ill"}, "Ill first"), element("option", {value: "name"}, "By name"), element("option", {value: "given"}, "As configured"));
    this.tools = element("div", {class: "tools"}, this.filter, this.order);
    bar.replaceChildren(this.pills, this.tools);
    this.group = null;
    this.arranged = 0;
    this.seed();
  }

  trace = "";

  async seed() {
    try {
      const {status, body} = await request("api/minute");
      if (status === 200) this.minutes = new Map(body.encoders.map((encoder) => [encoder.encoder, encoder.seconds]));
    } catch {
      // an error is ignored here, because the event stream reports an unreachable server
    }
    for (const card of this.cards.values()) this.seedCard(card);
  }

  seedCard(card) {
    const seconds = this.minutes?.get(card.name);
    if (seconds === undefined) return;
    this.minutes.delete(card.name);
    card.seed(seconds);
  }

  /** Draws a state of the server. If there are many encoders, not every state is drawn. */
  show(state) {
    const wait = state.encoders.length > MANY && this.cards.size > 0 ? this.drawn + DRAW_MS * state.encoders.length - performance.now() : 0;
    clearTimeout(this.later);
    if (wait > 0) this.later = setTimeout(() => this.draw(state), wait);
    else this.draw(state);
  }

  draw(state) {
    this.drawn = performance.now();
    this.given = state.encoders.map((encoder) => encoder.encoder);
    const changed = this.given.join("\n") !== [...this.cards.keys()].join("\n");
    if (changed) {
      this.cards = new Map(this.given.map((name) => [name, this.cards.get(name) ?? new Card(name)]));
      for (const card of this.cards.values()) this.seedCard(card);
    }
    for (const encoder of state.encoders) this.cards.get(encoder.encoder).show(encoder, state.at_ms, this.given.length > MANY);
    this.none.toggleAttribute("hidden", this.given.length > 0);
    this.list.classList.toggle("many", this.given.length > MANY);
    this.list.classList.toggle("few", this.given.length <= FEW);
    this.tools.toggleAttribute("hidden", this.given.length <= FEW);
    this.showPills();
    this.arrange(changed);
  }

  showPills() {
    const counts = Object.fromEntries(GROUPS.map((group) => [group, []]));
    for (const card of this.cards.values()) counts[card.condition.group].push(card);
    const total = this.cards.size;
    for (const [group, {node, shape, words, more}] of this.groups) {
      const [first] = counts[group];
      const count = counts[group].length;
      node.toggleAttribute("hidden", count === 0);
      if (count === 0) continue;
      const {kind} = first.condition;
      setClass(node, `pill ${kind}`);
      node.setAttribute("aria-pressed", String(this.group === group));
      setText(shape, `${SHAPES[kind]} `);
      setText(words, group === "good" && count === total ? (total === 1 ? "good" : `all ${total} good`) : GROUP_WORDS[group](count));
      setText(more, MORE_WORDS[group] ?? "");
    }
  }

  choose(group) {
    this.group = this.group === group ? null : group;
    this.showPills();
    this.arrange(true);
  }

  clearFilter() {
    this.filter.value = "";
    this.choose(this.group);
  }

  arrange(now) {
    if (!now && performance.now() - this.arranged < ORDER_MS) return;
    this.arranged = performance.now();
    const rank = (card) => GROUPS.indexOf(card.condition.group) + (card.condition.isSeen ? .5 : 0);
    const cards = [...this.cards.values()];
    if (this.order.value === "ill") cards.sort((a, b) => rank(a) - rank(b));
    if (this.order.value === "name") cards.sort((a, b) => a.name.localeCompare(b.name, "en", {numeric: true}));
    const written = this.filter.value.trim().toLowerCase();
    const matches = (card) => (this.group === null || card.condition.group === this.group) &&
      `${card.name} ${card.encoder.protocol_name}`.toLowerCase().includes(written);
    const shown = cards.filter(matches);
    this.noMatch.toggleAttribute("hidden", shown.length > 0 || cards.length === 0);
    const nodes = shown.map((card) => card.node);
    if (nodes.length === this.list.childElementCount && nodes.every((node, i) => node === this.list.children[i])) return;
    // The focused card is not moved, because a moved node loses the focus.
    const kept = nodes.find((node) => node.contains(document.activeElement));
    for (const node of [...this.list.children]) {
      if (node !== kept) node.remove();
    }
    if (kept) kept.before(...nodes.slice(0, nodes.indexOf(kept)));
    this.list.append(...nodes.slice(kept ? nodes.indexOf(kept) + 1 : 0));
  }

  /** Shows every encoder as not known, so that no old value looks current. */
  lose() {
    clearTimeout(this.later);
    for (const card of this.cards.values()) {
      const last = card.encoder.state === "live" ? {...card.encoder, at_ms: Date.now() - card.encoder.age_s * 1000} : card.encoder.last_reading;
      card.show({...card.encoder, state: "unknown", angle_deg: null, position_mm: null, turns: null, speed: null, alarms: null, status: null,
                 errors_last_minute: null, message: null, last_reading: last}, Date.now());
    }
    this.showPills();
  }

  take() {}
  close() {
    clearTimeout(this.later);
  }
}
