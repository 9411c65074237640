// The parameters of a fit as sliders: value, standard uncertainty, and what they mean.

import { short, withUncertainty } from "./numbers.js";

const STEPS = 1000;
// A common factor of all channels goes from 1/8 to 8.
const FACTOR = 8;

export class Sliders {
  constructor(fit, box, changed) {
    this.fit = fit;
    this.box = box;
    this.changed = changed;
    this.rows = [];
  }

  // Sliders for all channels together, or for one of them.
  build(solo) {
    this.solo = solo;
    this.rows = this.fit.parameters
      .filter((p) => !p.given)
      .map((p) => this.row(p, solo === null && p.value.length > 1));
    this.box.replaceChildren(...this.rows.map((r) => r.element));
    this.update();
  }

  row(p, together) {
    const element = document.createElement("div");
    element.className = "viewer-parameter";
    const id = `viewer-${this.fit.number}-${p.name.replace(/\W/g, "-")}`;
    const label = document.createElement("label");
    label.htmlFor = id;
    label.textContent = p.name;
    label.title = p.meaning;
    const now = document.createElement("output");
    now.htmlFor = id;
    const input = document.createElement("input");
    Object.assign(input, { id, type: "range", min: 0, max: STEPS, step: 1 });
    input.disabled = p.tied_to !== null;
    const about = document.createElement("small");
    about.id = `${id}-about`;
    about.textContent = this.about(p, together);
    input.setAttribute("aria-describedby", about.id);
    const row = { p, together, element, input, now };
    input.addEventListener("input", () => this.moved(row));
    element.append(label, now, input, about);
    return row;
  }

  about(p, together) {
    const unit = p.unit ? ` ${p.unit}` : "";
    const said = [p.meaning];
    if (together) said.push(`${p.value.length} channels, fitted${relative(p)}`);
    else {
      const c = p.value.length > 1 ? this.solo : 0;
      said.push(`fitted ${withUncertainty(p.value[c], p.sigma[c])}${unit}`);
      if (p.at_bound[c]) said.push("at its bound");
    }
    if (p.fixed) said.push("held fixed in the fit");
    if (p.tied_to !== null) said.push(`tied to ${p.tied_to}`);
    return said.join("; ");
  }

  moved(row) {
    const share = Number(row.input.value) / STEPS;
    if (row.together) {
      this.fit.scale(row.p.name, FACTOR ** (2 * share - 1));
    } else this.fit.change(row.p.name, valueAt(row.p, share), this.solo ?? 0);
    this.update();
    this.changed();
  }

  reset() {
    this.fit.reset();
    this.update();
    this.changed();
  }

  // Positions and texts from the values as they are.
  update() {
    for (const { p, together, input, now } of this.rows) {
      const all = this.fit.values.get(p.name);
      if (together) {
        const factor = this.fit.factors.get(p.name) ?? 1;
        input.value = String(Math.round((STEPS * (Math.log(factor) / Math.log(FACTOR) + 1)) / 2));
        const [low, high] = [Math.min(...all), Math.max(...all)];
        const span = low === high ? short(low, 3) : `${short(low, 3)} … ${short(high, 3)}`;
        now.textContent = `× ${short(factor, 3)}: ${span}`;
      } else {
        const value = all[all.length > 1 ? this.solo : 0];
        input.value = String(Math.round(STEPS * shareOf(p, value)));
        now.textContent = short(value, 4) + (p.unit ? ` ${p.unit}` : "");
      }
      input.setAttribute("aria-valuetext", now.textContent);
    }
  }
}

// The standard uncertainties of all channels, relative to their values.
function relative(p) {
  const all = p.sigma.map((s, c) => (100 * s) / Math.abs(p.value[c])).filter((s) => s > 0 && s < Infinity);
  if (!all.length) return "";
  const [low, high] = [short(Math.min(...all), 2), short(Math.max(...all), 2)];
  return low === high ? ` ± ${low} %` : ` ± ${low} to ${high} %`;
}

const isLogarithmic = (p) => !p.coefficient && p.scale === "log" && p.range[0] > 0;

function valueAt(p, share) {
  const [low, high] = p.range;
  return isLogarithmic(p) ? low * (high / low) ** share : low + (high - low) * share;
}

function shareOf(p, value) {
  const [low, high] = p.range;
  return isLogarithmic(p)
    ? Math.log(value / low) / Math.log(high / low)
    : (value - low) / (high - low);
}
