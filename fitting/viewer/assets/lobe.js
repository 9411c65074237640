// The lobe: how much goes where for light from one direction, as a surface to turn around.

import { aroundCentre, fromAngles, graded, Pairs, range, smoothExit, turned } from "./directions.js";
import { beginPicture, buildProgram, floatTexture, useProgram } from "./gl.js";
import { radians, short } from "./numbers.js";
import { decadesOf, themed, viridis } from "./palette.js";
import { line, surface } from "./plot.js";

const RINGS = 97;
const AZIMUTHS = 144;
const GROWTH = 4.5;
const SCALE = 0.9;
// How far from the shown direction of incidence measured ones may be.
const NEAR_DEG = 1.0;

export class Lobe {
  constructor(fit, glsl, canvas, caption) {
    const { gl } = fit.shader;
    this.fit = fit;
    this.canvas = canvas;
    this.caption = caption;
    this.program = buildProgram(gl, glsl.lobe_vertex, glsl.lobe_fragment);
    const colours = new Float32Array(4 * 256);
    for (let k = 0; k < 256; ++k) colours.set(viridis(k / 255).map((c) => c / 255), 4 * k);
    this.palette = floatTexture(gl, 256, 1, 4, colours);
    const sides = fit.ways.some((w) => w === "down" || w === "up") ? [false, true] : [false];
    this.through = sides;
    this.indices = triangles(sides.length);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.indices, gl.STATIC_DRAW);
  }

  draw(view) {
    const { fit, canvas } = this;
    const { gl } = fit.shader;
    const wi = view.incidence(fit);
    const solo = view.soloOf(fit);
    const mesh = this.evaluate(wi, solo);
    const { pen, width, height, scale } = surface(canvas);
    const project = camera(view, width, height, this.through.length > 1);
    ground(pen, canvas, project);
    const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
    beginPicture(gl, w, h);
    gl.enable(gl.DEPTH_TEST);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffer);
    useProgram(gl, this.program, {
      detectors: fit.shader.textures.detectors, values: mesh.texture, palette: this.palette,
      camera: project.matrix, largest: mesh.largest, decades: mesh.decades, width: mesh.width,
      logarithmic: view.logarithmic ? 1 : 0,
    });
    gl.drawElements(gl.TRIANGLES, this.indices.length, gl.UNSIGNED_INT, 0);
    pen.drawImage(gl.canvas, 0, 0, width, height);
    arrow(pen, project, wi);
    this.points(pen, project, view, mesh, solo);
    const scaled = view.logarithmic ? `logarithmic over ${short(mesh.decades, 2)} decades` : "linear";
    this.caption.textContent = `to ${short(mesh.largest, 3)} 1/sr, ${scaled}${this.measured}`;
  }

  // Values on the mesh of directions, and the largest of them.
  evaluate(wi, solo) {
    const { fit } = this;
    const pairs = new Pairs(this.through.length * RINGS * AZIMUTHS);
    const shares = range(RINGS, 0, 1).map((u) => graded(u, GROWTH));
    const azimuths = turned(range(AZIMUTHS / 2 + 1, 0, 1).slice(0, -1).map((u) => u * u * (3 - 2 * u)));
    for (const through of this.through) {
      const centre = smoothExit(wi, through, fit.index);
      aroundCentre(centre, shares, azimuths, (wo) => pairs.add(wi, wo));
    }
    const mesh = fit.shader.evaluateToTexture(
      pairs.sources, pairs.detectors, fit.colourSums(solo),
    );
    const all = Array.from({ length: pairs.count }, (_, k) => mesh.values[4 * k + 3]);
    const positive = all.filter((f) => f > 0).sort((a, b) => a - b);
    mesh.largest = positive.at(-1) ?? 1e-30;
    mesh.decades = decadesOf(positive[Math.floor(0.02 * positive.length)] ?? 1e-30, mesh.largest);
    return mesh;
  }

  points(pen, project, view, { largest, decades }, solo) {
    const { fit } = this;
    const rows = fit.rows((ti, pi) => view.isNear(fit, ti, pi, radians(NEAR_DEG)));
    this.measured = rows.length ? `; ${rows.length} measured points` : "";
    pen.strokeStyle = themed(this.canvas, "ink");
    pen.lineWidth = 1;
    pen.globalAlpha = rows.length > 500 ? 0.45 : 0.9;
    for (const row of rows) {
      const f = fit.measuredSum(row, solo);
      if (!(f > 0)) continue;
      const [, pi, tr, pr] = fit.angles.subarray(4 * row, 4 * row + 4);
      const turn = fit.anisotropic ? 0 : radians(view.phi) - pi;
      const far = length(f / largest, view.logarithmic ? decades : 0);
      const [x, y] = project.at(fromAngles(tr, pr + turn).map((v) => v * far));
      pen.beginPath();
      pen.arc(x, y, 1.8, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }
}

// How far out a share of the largest value is; without decades the scale is linear.
function length(share, decades) {
  return decades ? Math.min(Math.max(1 + Math.log10(share) / decades, 0), 1.2) : share;
}

function triangles(sides) {
  const out = [];
  for (let side = 0; side < sides; ++side) {
    const at = (k, j) => (side * AZIMUTHS + (j % AZIMUTHS)) * RINGS + k;
    for (let j = 0; j < AZIMUTHS; ++j) {
      for (let k = 0; k + 1 < RINGS; ++k) {
        out.push(at(k, j), at(k + 1, j), at(k, j + 1));
        out.push(at(k, j + 1), at(k + 1, j), at(k + 1, j + 1));
      }
    }
  }
  return new Uint32Array(out);
}

// An orthographic view of the unit ball: x to the right, z up, turned by the camera.
function camera({ cameraTurn, cameraHeight }, width, height, both) {
  const [ca, sa] = [Math.cos(cameraTurn), Math.sin(cameraTurn)];
  const [ch, sh] = [Math.cos(cameraHeight), Math.sin(cameraHeight)];
  const right = [-sa, ca, 0];
  const up = [-sh * ca, -sh * sa, ch];
  const near = [ch * ca, ch * sa, sh];
  // Of half a ball, the middle of the picture is above its centre.
  const small = Math.min(width, both ? height : (1 + 0.45 * ch) * height);
  const sunk = both ? 0 : 0.17 * small * ch;
  const [fx, fy] = [(SCALE * small) / width, (SCALE * small) / height];
  const matrix = new Float32Array(16);
  for (let k = 0; k < 3; ++k) {
    matrix.set([fx * right[k], fy * up[k], -0.4 * near[k], 0], 4 * k);
  }
  matrix[13] = (-2 * sunk) / height;
  matrix[15] = 1;
  const along = (v, axis) => v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
  const at = (v) => [
    width / 2 + (SCALE * small * along(v, right)) / 2,
    height / 2 + sunk - (SCALE * small * along(v, up)) / 2,
  ];
  return { matrix, at };
}

// The plane of the sample with rings every 30 degrees and its azimuths 0 and 90.
function ground(pen, canvas, project) {
  pen.strokeStyle = themed(canvas, "rule");
  pen.lineWidth = 1;
  for (const theta of [30, 60, 90]) {
    pen.beginPath();
    for (let phi = 0; phi <= 360; phi += 5) {
      const [x, y, z] = fromAngles(radians(90), radians(phi));
      const far = Math.sin(radians(theta));
      pen.lineTo(...project.at([x * far, y * far, z]));
    }
    pen.stroke();
  }
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = themed(canvas, "quiet");
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  for (const phi of [0, 90, 180, 270]) {
    const [x, y] = fromAngles(radians(90), radians(phi));
    line(pen, ...project.at([0, 0, 0]), ...project.at([x, y, 0]));
    pen.fillText(`${phi}°`, ...project.at([1.09 * x, 1.09 * y, 0]));
  }
  line(pen, ...project.at([0, 0, 0]), ...project.at([0, 0, 1]));
}

// The light that comes in.
function arrow(pen, project, wi) {
  const [x0, y0] = project.at(wi.map((v) => 1.05 * v));
  const [x1, y1] = project.at(wi.map((v) => 0.06 * v));
  for (const [colour, thick] of [["#000", 4], ["#FFD84D", 2]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = thick;
    line(pen, x0, y0, x1, y1);
    const long = Math.hypot(x1 - x0, y1 - y0);
    if (long > 12) {
      const [ux, uy] = [(x1 - x0) / long, (y1 - y0) / long];
      pen.beginPath();
      pen.moveTo(x1 - 9 * ux + 4 * uy, y1 - 9 * uy - 4 * ux);
      pen.lineTo(x1, y1);
      pen.lineTo(x1 - 9 * ux - 4 * uy, y1 - 9 * uy + 4 * ux);
      pen.stroke();
    }
  }
}
