// The page: reads what Python wrote into it, and draws what changed.

import { Card } from "./card.js";
import { Controls } from "./controls.js";
import { Fit } from "./fit.js";
import { openGraphics } from "./gl.js";
import { View } from "./view.js";

const EVERYTHING = ["sphere", "lobe", "slice", "albedo", "image"];
// What has to be drawn anew after a change; of anything else everything.
const AFTER = {
  sphere: ["sphere"], camera: ["lobe"], exposure: ["sphere"],
  theta: ["lobe", "slice", "albedo"], logarithmic: ["lobe", "slice", "image"],
  through: ["slice", "albedo"], back: ["lobe", "slice", "albedo"],
};
// The albedo is thousands of evaluations, and waits until sliders rest.
const REST_MS = 120;

class Page {
  constructor(root, { fits, glsl }) {
    this.live = root.querySelector(".viewer-live");
    const gl = openGraphics();
    gl.canvas.addEventListener("webglcontextlost", () => fail(root, "the graphics hardware gave up; load the page again"));
    this.fits = fits.map((given, number) => new Fit(gl, { ...given, number }, glsl));
    this.view = new View(this.fits);
    this.stale = new Map();
    this.controls = new Controls(
      root.querySelector(".viewer-controls"), this.view, this.fits, (key) => this.changed(key),
    );
    this.controls.reset.addEventListener("click", () => this.reset());
    const box = root.querySelector(".viewer-fits");
    this.cards = this.fits.map((fit) => {
      const card = new Card(fit, glsl, this.view, this);
      box.append(card.element);
      card.sliders.build(this.view.soloOf(fit));
      return card;
    });
    const all = () => this.changed("all");
    new ResizeObserver(all).observe(box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", all);
    this.drawAll();
  }

  reset() {
    this.view.reset();
    this.controls.update();
    for (const card of this.cards) {
      card.fit.reset();
      card.sliders.build(null);
    }
    this.changed("all");
    this.say("everything as it was at first");
  }

  changed(what, only = null) {
    if (what === "channel") {
      for (const card of this.cards) card.sliders.build(this.view.soloOf(card.fit));
    }
    for (const card of this.cards) {
      if (only !== null && card !== only) continue;
      const own = this.stale.get(card) ?? new Set();
      for (const name of AFTER[what] ?? EVERYTHING) own.add(name);
      this.stale.set(card, own);
    }
    this.frame ??= requestAnimationFrame(() => this.draw());
    if (what === "sphere") this.say(this.view.lightSaid);
  }

  draw() {
    this.frame = null;
    let waiting = false;
    for (const [card, names] of this.stale) {
      waiting ||= names.delete("albedo");
      for (const name of names) card[name].draw(this.view);
      names.clear();
    }
    if (!waiting) return;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => {
      for (const card of this.cards) card.albedo.draw(this.view);
    }, REST_MS);
  }

  // Everything, at once.
  drawAll() {
    for (const card of this.cards) {
      for (const name of EVERYTHING) card[name].draw(this.view);
    }
    this.stale.clear();
  }

  say(text) {
    clearTimeout(this.saying);
    this.saying = setTimeout(() => (this.live.textContent = text), 300);
  }
}

function start(root) {
  const data = JSON.parse(root.querySelector(".viewer-data").textContent);
  try {
    // Kept where someone with a console finds it.
    root.page = new Page(root, data);
  } catch (error) {
    fail(root, error.message);
  }
}

function fail(root, why) {
  const failed = root.querySelector(".viewer-failed");
  failed.textContent = `The viewer does not work: ${why}.`;
  failed.hidden = false;
  root.querySelector(".viewer-controls").hidden = true;
}

for (const root of document.querySelectorAll("section.viewer")) start(root);
