// Values in the plane of incidence, with the measured points that lie in it.

import { fromAngles, Pairs, range, smoothExit } from "./directions.js";
import { degrees, radians, short } from "./numbers.js";
import { DASHES, lineColour, MARKS } from "./palette.js";
import { axes, curve, marks } from "./plot.js";

const FARTHEST = 89.5;
const IN_PLANE = Math.sin(radians(0.3));
const NEAR_DEG = 1.0;
const DECADES = 5;

export class Slice {
  constructor(fit, glsl, canvas, caption) {
    this.fit = fit;
    this.canvas = canvas;
    this.caption = caption;
  }

  draw(view) {
    const { fit } = this;
    const solo = view.soloOf(fit);
    const channels = solo === null ? fit.chosen : [solo];
    const wi = view.incidence(fit);
    const angles = signedAngles(degrees(Math.acos(Math.abs(
      smoothExit(wi, view.through, fit.index)[2],
    ))));
    const side = wi[2] >= 0 === !view.through ? 1 : -1;
    const pairs = new Pairs(angles.length);
    for (const angle of angles) pairs.add(wi, detector(angle, view.phi, side));
    const values = fit.shader.evaluate(
      pairs.sources, pairs.detectors, fit.curveSums(channels, solo),
    );
    const found = this.inPlane(view, side);
    const curves = channels.map((_, k) => angles.map((_, n) => values[4 * n + k]));
    const points = channels.map((c) => found.rows.map((r) => fit.measuredIn(r, c)));
    this.values = { angles, curves };
    const all = curves.concat(points).flat().filter((v) => v > 0);
    const largest = Math.max(...all, 1e-12);
    const least = Math.max(all.reduce((a, b) => Math.min(a, b), largest), largest / 10 ** DECADES);
    const plot = axes(this.canvas, {
      x: [-90, 90],
      y: view.logarithmic ? [Math.min(least / 1.3, largest / 10), 1.4 * largest] : [0, 1.08 * largest],
      logarithmic: view.logarithmic,
      xLabel: "angle of the detector, degrees",
      yLabel: "1/sr",
      xTicks: [-90, -60, -30, 0, 30, 60, 90],
    });
    channels.forEach((_, k) => {
      const colour = lineColour(this.canvas, k);
      curve(plot, angles, curves[k], colour, DASHES[k]);
      marks(plot, found.angles, points[k], colour, MARKS[k]);
    });
    this.say(view, channels, found);
  }

  // Rows in the plane, and their signed angles in degrees.
  inPlane(view, side) {
    const { fit } = this;
    const rows = fit.rows((ti, pi, tr, pr) =>
      view.isNear(fit, ti, pi, radians(NEAR_DEG))
      && (tr <= Math.PI / 2 ? 1 : -1) === side
      && Math.abs(Math.sin(tr) * Math.sin(pr - pi)) < IN_PLANE);
    const angles = rows.map((row) => {
      const [, pi, tr, pr] = fit.angles.subarray(4 * row, 4 * row + 4);
      const theta = degrees(tr > Math.PI / 2 ? Math.PI - tr : tr);
      return Math.cos(pr - pi) <= 1e-7 ? theta : -theta;
    });
    return { rows, angles };
  }

  say(view, channels, found) {
    const { fit } = this;
    const marked = ["○", "□", "△"];
    this.caption.replaceChildren();
    channels.forEach((c, k) => {
      const name = document.createElement("span");
      name.className = "viewer-key";
      name.textContent = `${marked[k]} ${fit.channels[c]}`;
      name.style.color = `var(--viewer-line-${k})`;
      this.caption.append(name, " ");
    });
    this.caption.append(fit.data ? pointsSaid(fit, view, found.rows.length) : "no measurement at hand");
  }
}

function pointsSaid(fit, view, count) {
  if (count) return `${count} measured points`;
  const nearest = fit.data.incidences
    .reduce((a, b) => (Math.abs(b - view.theta) < Math.abs(a - view.theta) ? b : a), Infinity);
  if (!Number.isFinite(nearest)) return "nothing was measured here";
  return Math.abs(nearest - view.theta) <= NEAR_DEG
    ? "no measured points in this plane"
    : `no measured points: the nearest incidence is ${short(nearest, 3)}°`;
}

// Degrees over the plane, closer where a lobe peaks.
function signedAngles(peak) {
  const fine = range(40, Math.log(0.01), Math.log(20)).map(Math.exp);
  const all = range(359, -FARTHEST, FARTHEST);
  for (const centre of [peak, -peak]) {
    all.push(centre, ...fine.map((d) => centre + d), ...fine.map((d) => centre - d));
  }
  return all.filter((a) => Math.abs(a) <= FARTHEST).sort((a, b) => a - b);
}

// Positive angles are where the mirror direction is.
function detector(angle, phi, side) {
  const theta = radians(Math.abs(angle));
  const azimuth = radians(phi) + (angle >= 0 ? Math.PI : 0);
  return fromAngles(side > 0 ? theta : Math.PI - theta, azimuth);
}
