// Directional albedo: what of the light from one direction goes to one side, all in all.

import {
  aroundCentre, dot, fromAngles, gauss, graded, gradedSlope, Pairs, smoothExit, turned,
} from "./directions.js";
import { radians, short } from "./numbers.js";
import { DASHES, lineColour } from "./palette.js";
import { axes, curve } from "./plot.js";

const THETAS = [0, 10, 20, 30, 40, 50, 57, 64, 70, 75, 80, 84, 87];
const SHARES = 24;
// In each half of the turn.
const AZIMUTHS = 16;
const GROWTH = 7;

export class Albedo {
  constructor(fit, glsl, canvas, caption) {
    this.fit = fit;
    this.canvas = canvas;
    this.caption = caption;
  }

  draw(view) {
    const { fit } = this;
    const solo = view.soloOf(fit);
    const channels = solo === null ? fit.chosen : [solo];
    const found = this.compute(view, channels, solo);
    this.values = { thetas: THETAS, curves: found };
    const largest = Math.max(...found.flat(), 0.02);
    const top = largest > 0.5 ? Math.max(1.08, 1.08 * largest) : 1.15 * largest;
    const plot = axes(this.canvas, {
      x: [0, 90], y: [0, top], logarithmic: false, xLabel: "angle of incidence, degrees",
      yLabel: view.through ? "transmittance" : "albedo", xTicks: [0, 15, 30, 45, 60, 75, 90],
    });
    if (top > 1) curve(plot, [0, 90], [1, 1], getComputedStyle(this.canvas).color, [2, 4]);
    channels.forEach((_, k) => {
      curve(plot, THETAS, found[k], lineColour(this.canvas, k), DASHES[k]);
    });
    const at = channels.map((_, k) => short(interpolated(found[k], view.theta), 3)).join(", ");
    this.caption.textContent = view.theta <= THETAS.at(-1)
      ? `at ${short(view.theta, 3)}°: ${at}` : "";
  }

  compute(view, channels, solo) {
    const { fit } = this;
    const pairs = new Pairs(THETAS.length * 4 * SHARES * AZIMUTHS);
    const weights = [];
    for (const theta of THETAS) {
      const from = view.back ? Math.PI - radians(theta) : radians(theta);
      quadrature(fromAngles(from, radians(view.phi)), view.through, fit.index, pairs, weights);
    }
    const values = fit.shader.evaluate(
      pairs.sources, pairs.detectors, fit.curveSums(channels, solo),
    );
    const each = pairs.count / THETAS.length;
    return channels.map((_, c) => THETAS.map((_, t) => {
      let sum = 0;
      for (let k = t * each; k < (t + 1) * each; ++k) sum += weights[k] * values[4 * k + c];
      return sum;
    }));
  }
}

// Nodes that close up on the mirror direction (or the way through) and, of reflected light,
// on the way back. Each grid counts what is nearer to its own centre, so smoothly shared that
// little of the peak at the other one, where its nodes are far apart, is left.
function quadrature(wi, through, index, pairs, weights) {
  const across = gauss(SHARES), around = gauss(AZIMUTHS);
  const shares = across.nodes.map((u) => graded(u, GROWTH));
  const along = across.nodes.map((u, k) => gradedSlope(u, GROWTH) * across.weights[k]);
  const turns = around.weights.map((w) => Math.PI * w);
  const straight = [-wi[0], -wi[1], -wi[2]];
  const centres = [smoothExit(wi, through, index), through ? straight : wi];
  centres.forEach((centre, which) => {
    const other = centres[1 - which];
    aroundCentre(centre, shares, turned(around.nodes), (wo, k, j, area) => {
      const own = (1 - dot(wo, centre) + 1e-9) ** 2;
      const theirs = (1 - dot(wo, other) + 1e-9) ** 2;
      const part = theirs / (own + theirs);
      pairs.add(wi, wo);
      weights.push(area * along[k] * turns[j % AZIMUTHS] * part * Math.abs(wo[2]));
    });
  });
}

function interpolated(values, theta) {
  const k = Math.min(Math.max(THETAS.findIndex((t) => t >= theta), 1), THETAS.length - 1);
  const share = (theta - THETAS[k - 1]) / (THETAS[k] - THETAS[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}
