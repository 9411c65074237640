// Unit vectors and grids of them; z is the normal, wi points to the source.

export function fromAngles(theta, phi) {
  const sine = Math.sin(theta);
  // Exactly on the horizon, as in Python.
  const cosine = Math.abs(theta - Math.PI / 2) < 1e-15 ? 0 : Math.cos(theta);
  return [sine * Math.cos(phi), sine * Math.sin(phi), cosine];
}

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

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

// A hemisphere by half vectors: rings of them around the normal, each a share of the way
// that leads to the horizon, mirror a source into rings around a centre. Lobes of facets are
// round there, at grazing incidence as well. `visit(wo, k, j, area)` is called for every
// share k and azimuth j with the solid angle per unit of share and azimuth.
export function aroundCentre(centre, shares, azimuths, visit) {
  const side = centre[2] < 0 ? -1 : 1;
  const [x, y, z] = [-centre[0], -centre[1], Math.abs(centre[2])];
  const sine = Math.hypot(x, y), first = Math.atan2(y, x);
  for (let j = 0; j < azimuths.length; ++j) {
    // Where the mirrored direction is horizontal: tan(2 theta_h - pi / 2) tells.
    const longest = 0.5 * (Math.PI / 2 + Math.atan2(sine * Math.cos(azimuths[j]), z));
    const [c, s] = [Math.cos(first + azimuths[j]), Math.sin(first + azimuths[j])];
    for (let k = 0; k < shares.length; ++k) {
      const theta = shares[k] * longest;
      const h = [Math.sin(theta) * c, Math.sin(theta) * s, Math.cos(theta)];
      const along = dot([x, y, z], h);
      const wo = [2 * along * h[0] - x, 2 * along * h[1] - y, side * (2 * along * h[2] - z)];
      // Rounding shall not send the last ring below the horizon.
      if (side * wo[2] < 0) wo[2] = 0;
      visit(wo, k, j, 4 * along * Math.sin(theta) * longest);
    }
  }
}

// Azimuths of a turn from shares of its halves, which meet where the way to the horizon
// changes at grazing incidence.
export const turned = (shares) => [-1, 1].flatMap(
  (side) => shares.map((u) => side * (Math.PI / 2) + Math.PI * u),
);

// Shares of a way that grow exponentially from its beginning, and their derivative.
export const graded = (u, growth) => Math.expm1(growth * u) / Math.expm1(growth);
export const gradedSlope = (u, growth) => (growth * Math.exp(growth * u)) / Math.expm1(growth);

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
