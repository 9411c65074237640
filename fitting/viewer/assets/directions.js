// Unit vectors and grids of them; z is the normal, wi points to the source.

export function fromAngles(theta, phi) {
  const sine = Math.sin(theta);
  // Exactly on the horizon, as in Python.
  const cosine = Math.abs(theta - Math.PI / 2) < 1e-15 ? 0 : Math.cos(theta);
  return [sine * Math.cos(phi), sine * Math.sin(phi), cosine];
}

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

export function unit(a) {
  const size = Math.hypot(...a);
  return a.map((x) => x / size);
}

// Pairs of directions with four floats each, as textures want them.
export class Pairs {
  constructor(count) {
    this.sources = new Float32Array(4 * count);
    this.detectors = new Float32Array(4 * count);
    this.count = 0;
  }

  add(wi, wo) {
    this.sources.set(wi, 4 * this.count);
    this.detectors.set(wo, 4 * this.count);
    this.count += 1;
  }
}

// Where light of a direction goes from a smooth surface: mirrored, or refracted to a side
// with `index` relative to this one (totally reflected light goes straight on).
export function smoothExit(wi, through, index) {
  if (!through) return [-wi[0], -wi[1], wi[2]];
  const ratio = wi[2] > 0 ? index : 1 / index;
  const x = -wi[0] / ratio, y = -wi[1] / ratio;
  const sine2 = x * x + y * y;
  if (sine2 >= 1) return [-wi[0], -wi[1], -wi[2]];
  return [x, y, -Math.sign(wi[2] || 1) * Math.sqrt(1 - sine2)];
}

// A hemisphere in rings around a centre in it, each ring a share of the way to the horizon:
// `visit(direction, k, j, rho, longest)` for every share k and azimuth j.
export function aroundCentre(centre, shares, azimuths, visit) {
  const side = centre[2] >= 0 ? 1 : -1;
  const upright = Math.hypot(centre[0], centre[1]) < 1e-12;
  const a = upright ? [1, 0, 0] : unit(cross([0, 0, 1], centre));
  const b = cross(centre, a);
  for (let j = 0; j < azimuths.length; ++j) {
    const c = Math.cos(azimuths[j]), s = Math.sin(azimuths[j]);
    const t = [0, 1, 2].map((k) => c * a[k] + s * b[k]);
    const longest = Math.atan2(Math.abs(centre[2]), -side * t[2]);
    for (let k = 0; k < shares.length; ++k) {
      const rho = shares[k] * longest;
      const cr = Math.cos(rho), sr = Math.sin(rho);
      const wo = [0, 1, 2].map((q) => cr * centre[q] + sr * t[q]);
      // Rounding shall not send the last ring below the horizon.
      if (side * wo[2] < 0) wo[2] = 0;
      visit(wo, k, j, rho, longest);
    }
  }
}

// Shares of a way that grow exponentially from its beginning, and their derivative.
const GROWTH = 7;
export const graded = (u) => Math.expm1(GROWTH * u) / Math.expm1(GROWTH);
export const gradedSlope = (u) => (GROWTH * Math.exp(GROWTH * u)) / Math.expm1(GROWTH);

// Gauss-Legendre nodes and weights on [0, 1].
export function gauss(count) {
  const nodes = [], weights = [];
  for (let k = 0; k < count; ++k) {
    let x = Math.cos((Math.PI * (k + 0.75)) / (count + 0.5));
    let slope = 0;
    for (let step = 0; step < 20; ++step) {
      let [p, before] = [1, 0];
      for (let n = 0; n < count; ++n) {
        [p, before] = [((2 * n + 1) * x * p - n * before) / (n + 1), p];
      }
      slope = (count * (before - x * p)) / (1 - x * x);
      x -= p / slope;
    }
    nodes.push(0.5 * (1 - x));
    weights.push(1 / ((1 - x * x) * slope * slope));
  }
  return { nodes, weights };
}

export function range(count, from, to) {
  return Array.from({ length: count }, (_, k) => from + ((to - from) * k) / (count - 1));
}
