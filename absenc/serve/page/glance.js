// SPDX-License-Identifier: Apache-2.0
// All encoders at a glance: a card for each.
import {NOTHING, dial, element, positionText, setText, speedText, stateText, turnsText, wordsOf} from "./dom.js";

class Card {
  constructor(name) {
    this.dial = dial();
    this.state = element("p", {class: "state"});
    this.values = {};
    const list = element("dl");
    for (const label of ["position", "turns", "speed", "errors, last minute"]) {
      this.values[label] = element("dd");
      list.append(element("dt", {}, label), this.values[label]);
    }
    this.words = element("div", {class: "words"});
    const link = element("a", {href: `#encoder=${encodeURIComponent(name)}`}, name);
    this.node = element("li", {class: "card"}, element("h2", {}, link), this.dial.svg,
                        element("div", {}, this.state, list), this.words);
    this.shown = "";
  }

  show(one) {
    this.dial.svg.toggleAttribute("hidden", one.linear);
    this.dial.turn(one.angle_deg);
    const flagged = one.alarms ?? one.status ?? [];
    this.node.classList.toggle("bad", one.state !== "live" || flagged.length > 0);
    this.state.className = `state ${one.state}`;
    setText(this.state, stateText(one));
    setText(this.values.position, positionText(one));
    setText(this.values.turns, turnsText(one));
    setText(this.values.speed, speedText(one));
    setText(this.values["errors, last minute"], String(one.errors_last_minute));
    const words = wordsOf(one);
    const shown = JSON.stringify(words);
    if (shown === this.shown) return;
    this.shown = shown;
    this.words.replaceChildren(...words.map(([kind, text]) => element("p", {class: kind}, text)));
  }
}

export class Glance {
  constructor(main) {
    this.cards = new Map();
    this.list = element("ul", {class: "cards", "aria-label": "encoders"});
    main.replaceChildren(this.list);
  }

  trace = "";

  show(state) {
    const names = state.encoders.map((one) => one.encoder);
    if (names.join("\n") !== [...this.cards.keys()].join("\n")) {
      const cards = new Map();
      for (const name of names) cards.set(name, this.cards.get(name) ?? new Card(name));
      this.cards = cards;
      this.list.replaceChildren(...[...cards.values()].map((card) => card.node));
    }
    for (const one of state.encoders) this.cards.get(one.encoder).show(one);
  }

  /** Nothing is known any more: no value is shown. */
  lose() {
    for (const card of this.cards.values()) {
      card.show({state: "unknown", age_s: 0, linear: card.dial.svg.hasAttribute("hidden"), angle_deg: null,
                 position_mm: null, turns: null, speed: null, alarms: null, errors_last_minute: NOTHING, message: ""});
      setText(card.state, "not known: no connection to the server");
    }
  }

  take() {}
  close() {}
}
