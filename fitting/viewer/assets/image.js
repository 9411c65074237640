// The image slice: values over theta_h and theta_d at phi_d = 90 degrees, as colours.

import { Pairs } from "./directions.js";
import { radians, short } from "./numbers.js";
import { decadesOf, viridis } from "./palette.js";
import { axes } from "./plot.js";

const CELLS = 72;
// Values next to grazing would take the scale for themselves.
const STEEPEST = Math.cos(radians(80));

export class ImageSlice {
  constructor(fit, glsl, canvas, caption) {
    this.fit = fit;
    this.canvas = canvas;
    this.caption = caption;
    this.picture = document.createElement("canvas");
    this.picture.width = this.picture.height = CELLS;
  }

  draw(view) {
    const { fit } = this;
    const pairs = new Pairs(CELLS * CELLS);
    for (let row = 0; row < CELLS; ++row) {
      for (let column = 0; column < CELLS; ++column) {
        // The square root of theta_h is even, which widens the peak.
        const h = (Math.PI / 2) * ((column + 0.5) / CELLS) ** 2;
        const d = (Math.PI / 2) * (1 - (row + 0.5) / CELLS);
        pairs.add(...twoDirections(h, d));
      }
    }
    const values = fit.shader.evaluate(
      pairs.sources, pairs.detectors, fit.colourSums(view.soloOf(fit)),
    );
    const pen = this.picture.getContext("2d");
    const image = pen.createImageData(CELLS, CELLS);
    const { largest, decades } = extent(pairs, values);
    for (let k = 0; k < pairs.count; ++k) {
      const below = pairs.sources[4 * k + 2] <= 0 || pairs.detectors[4 * k + 2] <= 0;
      const f = Math.max(values[4 * k + 3], 0);
      const share = view.logarithmic ? 1 + Math.log10(f / largest) / decades : f / largest;
      image.data.set(below ? [0, 0, 0, 0] : [...viridis(share), 255], 4 * k);
    }
    pen.putImageData(image, 0, 0);
    const root = Math.sqrt;
    const plot = axes(this.canvas, {
      x: [0, root(90)], y: [0, 90], logarithmic: false,
      xLabel: "θh, degrees (square root)", yLabel: "θd, degrees", xTicks: [],
    });
    const { box } = plot;
    plot.pen.imageSmoothingEnabled = false;
    plot.pen.drawImage(
      this.picture, box.left, box.top, box.right - box.left, box.bottom - box.top,
    );
    plot.pen.textAlign = "center";
    plot.pen.textBaseline = "top";
    for (const t of [0, 2, 10, 30, 60, 90]) {
      plot.pen.fillText(short(t), plot.across(root(t)), box.bottom + 5);
    }
    const lowest = view.logarithmic ? short(largest / 10 ** decades, 2) : "0";
    this.caption.textContent = `dark ${lowest} to bright ${short(largest, 3)} 1/sr; φd = 90°`;
  }
}

// The scale of the colours.
function extent(pairs, values) {
  let [least, largest] = [Infinity, 1e-30];
  for (let k = 0; k < pairs.count; ++k) {
    const f = values[4 * k + 3];
    const z = Math.min(pairs.sources[4 * k + 2], pairs.detectors[4 * k + 2]);
    if (!(f > 0) || z < STEEPEST) continue;
    least = Math.min(least, f);
    largest = Math.max(largest, f);
  }
  return { largest, decades: decadesOf(Math.min(least, largest), largest) };
}

// wi and wo of a half vector and a difference angle across the plane of both normals.
function twoDirections(h, d) {
  const x = Math.sin(h) * Math.cos(d), z = Math.cos(h) * Math.cos(d), y = Math.sin(d);
  return [[x, y, z], [x, -y, z]];
}
