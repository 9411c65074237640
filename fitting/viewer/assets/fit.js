// One fit: what Python said of it, and the parameters as the sliders have them now.

import { ShaderModel } from "./model.js";
import { floatsOf } from "./numbers.js";

export class Fit {
  constructor(gl, given, glsl) {
    Object.assign(this, given);
    this.count = given.channels.length;
    this.shader = new ShaderModel(gl, given.shader, glsl, this.count);
    this.byName = new Map(given.parameters.map((p) => [p.name, p]));
    if (given.data) {
      this.angles = floatsOf(given.data.angles);
      this.measured = floatsOf(given.data.values);
    }
    this.reset();
  }

  reset() {
    this.values = new Map(this.parameters.map((p) => [p.name, [...p.value]]));
    // Of the fitted values, where all channels were changed together.
    this.factors = new Map();
    this.apply();
  }

  // Of a parameter in a channel; shared ones are the same in all.
  value(name, channel) {
    const own = this.values.get(name);
    return own[own.length > 1 ? channel : 0];
  }

  // Change a parameter, in one channel or, with a factor, in all; others may be tied to it.
  change(name, value, channel) {
    const own = this.values.get(name);
    if (own.length === 1) own[0] = value;
    else own[channel] = value;
    this.follow(name);
  }

  scale(name, factor) {
    const p = this.byName.get(name);
    const [low, high] = p.support;
    this.factors.set(name, factor);
    this.values.set(name, p.value.map(
      (v) => Math.min(Math.max(v * factor, low ?? -Infinity), high ?? Infinity),
    ));
    this.follow(name);
  }

  // Tied parameters keep their ratio to the one that leads them.
  follow(name) {
    const leader = this.byName.get(name);
    for (const p of this.parameters) {
      if (p.tied_to !== name) continue;
      const now = this.values.get(name);
      this.values.set(p.name, p.value.map((v, c) => {
        const k = leader.value.length > 1 ? c : 0;
        return leader.value[k] ? (v * now[k]) / leader.value[k] : now[k];
      }));
    }
    this.apply();
  }

  apply() {
    const rows = [];
    for (let c = 0; c < this.count; ++c) {
      for (const name of this.shader.shader.parameters) rows.push(this.value(name, c));
    }
    this.shader.setParameters(new Float32Array(rows));
    this.sums = new Map();
  }

  // Sums for the screen: red, green, blue, and the one number that stands for all.
  colourSums(solo) {
    const own = new Map();
    for (let c = 0; c < this.count; ++c) {
      const alone = solo === null ? null : c === solo ? 1 : 0;
      if (alone === 0) continue;
      const rgb = alone ? [Math.PI, Math.PI, Math.PI] : this.rgb[c];
      own.set(c, [...rgb, alone ?? this.luminance[c]]);
    }
    return this.kept("colour", own);
  }

  // Values of up to three channels, and the one number.
  curveSums(channels, solo) {
    const own = new Map();
    for (let c = 0; c < this.count; ++c) {
      const place = channels.indexOf(c);
      const weight = solo === null ? this.luminance[c] : c === solo ? 1 : 0;
      if (place < 0 && weight === 0) continue;
      own.set(c, [0, 1, 2].map((k) => (k === place ? 1 : 0)).concat(weight));
    }
    return this.kept("curves", own);
  }

  kept(name, weights) {
    const key = name + JSON.stringify([...weights]);
    if (this.sums.get(name)?.key !== key) {
      this.sums.set(name, { key, sums: this.shader.sums(weights, name) });
    }
    return this.sums.get(name).sums;
  }

  // The measured rows that a test of their four angles picks.
  rows(test) {
    const out = [];
    if (!this.data) return out;
    for (let k = 0; k < this.data.rows; ++k) {
      if (test(...this.angles.subarray(4 * k, 4 * k + 4))) out.push(k);
    }
    return out;
  }

  measuredIn(row, channel) {
    return this.measured[row * this.count + channel];
  }

  // What stands for all channels of a measured row; not a number where one is missing.
  measuredSum(row, solo) {
    if (solo !== null) return this.measuredIn(row, solo);
    let sum = 0;
    for (let c = 0; c < this.count; ++c) {
      if (this.luminance[c]) sum += this.luminance[c] * this.measuredIn(row, c);
    }
    return sum;
  }
}
