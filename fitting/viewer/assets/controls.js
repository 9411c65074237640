// The controls that all fits share.

import { short } from "./numbers.js";

export class Controls {
  constructor(form, view, fits, changed) {
    this.view = view;
    this.form = form;
    this.updates = [];
    this.changed = changed;
    form.addEventListener("submit", (event) => event.preventDefault());
    const measured = [...new Set(fits.flatMap((f) => f.data?.incidences ?? []))];
    this.slider("incidence", "Incidence", { min: 0, max: 89, step: 0.1 }, "theta", "°");
    if (measured.length) this.jump(measured.filter((t) => t <= 90).sort((a, b) => a - b));
    if (fits.some((f) => f.anisotropic)) {
      this.slider("azimuth", "Azimuth of the source", { min: -180, max: 180, step: 0.1 }, "phi", "°");
    }
    const ways = new Set(fits.flatMap((f) => f.ways));
    if (ways.has("back") || ways.has("up")) this.tick("back", "Lit from the back", "back");
    if (ways.has("down") || ways.has("up")) this.tick("through", "Curves of transmitted light", "through");
    this.channels(fits);
    this.slider("exposure", "Exposure", { min: -6, max: 6, step: 0.1 }, "exposure", " EV");
    this.tick("logarithmic", "Logarithmic", "logarithmic");
    const reset = document.createElement("button");
    reset.type = "button";
    reset.textContent = "Reset everything";
    reset.className = "viewer-reset";
    this.reset = reset;
    form.append(reset);
    this.update();
  }

  field(id, label) {
    const box = document.createElement("div");
    box.className = "viewer-field";
    const name = document.createElement("label");
    name.htmlFor = `viewer-${id}`;
    name.textContent = label;
    box.append(name);
    this.form.append(box);
    return box;
  }

  slider(id, label, limits, key, unit) {
    const box = this.field(id, label);
    const input = document.createElement("input");
    const now = document.createElement("output");
    Object.assign(input, { id: `viewer-${id}`, type: "range", ...limits });
    now.htmlFor = input.id;
    input.addEventListener("input", () => this.set(key, Number(input.value)));
    box.append(now, input);
    this.updates.push(() => {
      input.value = String(this.view[key]);
      now.textContent = short(this.view[key], 3) + unit;
      input.setAttribute("aria-valuetext", now.textContent);
    });
  }

  tick(id, label, key) {
    const box = this.field(id, label);
    box.classList.add("viewer-tick");
    const input = document.createElement("input");
    Object.assign(input, { id: `viewer-${id}`, type: "checkbox" });
    input.addEventListener("change", () => this.set(key, input.checked));
    box.prepend(input);
    this.updates.push(() => (input.checked = this.view[key]));
  }

  // Angles of incidence that were measured.
  jump(thetas) {
    const input = this.choice("measured", "Measured at", [
      ["", "…"], ...thetas.map((t) => [String(t), `${short(t, 3)}°`]),
    ]);
    input.addEventListener("change", () => {
      if (input.value !== "") this.set("theta", Number(input.value));
    });
    this.updates.push(() => {
      input.value = thetas.includes(this.view.theta) ? String(this.view.theta) : "";
    });
  }

  channels(fits) {
    const names = [...new Set(fits.flatMap((f) => f.channels))];
    const all = fits.some((f) => f.coloured) ? "all, in colour" : "all";
    const input = this.choice("channel", "Channel", [["", all], ...names.map((n) => [n, n])]);
    input.addEventListener("change", () => this.set("channel", input.value || null));
    this.updates.push(() => (input.value = this.view.channel ?? ""));
  }

  choice(id, label, options) {
    const box = this.field(id, label);
    const input = document.createElement("select");
    input.id = `viewer-${id}`;
    for (const [value, text] of options) input.append(new Option(text, value));
    box.append(input);
    return input;
  }

  set(key, value) {
    this.view[key] = value;
    this.update();
    this.changed(key);
  }

  update() {
    for (const update of this.updates) update();
  }
}
