// Colours that everyone tells apart: Okabe and Ito's for lines (in the style sheet), viridis
// for magnitudes.

export const DASHES = [[], [7, 3], [2, 3]];
export const MARKS = ["circle", "square", "triangle"];

// Of viridis, from dark to light.
const STOPS = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37],
];

export function viridis(share) {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const k = Math.min(Math.floor(at), STOPS.length - 2);
  return STOPS[k].map((low, c) => low + (at - k) * (STOPS[k + 1][c] - low));
}

// How much of the range of values is shown on a logarithmic scale: all of it and a little
// more, within limits.
export function decadesOf(least, largest) {
  return Math.min(Math.max(1.3 * Math.log10(largest / Math.max(least, 1e-30)), 1), 5);
}

// A colour of the page's theme.
export function themed(element, name) {
  return getComputedStyle(element).getPropertyValue(`--viewer-${name}`).trim();
}

// Of the curve of that number.
export const lineColour = (element, k) => themed(element, `line-${k}`);
