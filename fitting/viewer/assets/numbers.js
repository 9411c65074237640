// Numbers as people read them.

// A value with its standard uncertainty, rounded to the uncertainty's second digit.
export function withUncertainty(value, sigma) {
  if (sigma === null || !(sigma > 0)) return short(value);
  const digits = 1 - Math.floor(Math.log10(sigma));
  if (digits < 0 || digits > 8) return `${short(value)} ± ${short(sigma, 2)}`;
  return `${minus(value.toFixed(digits))} ± ${sigma.toFixed(digits)}`;
}

export function short(value, digits = 4) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-4) return minus(value.toExponential(Math.min(digits - 1, 2)));
  return minus(String(Number(value.toPrecision(digits))));
}

function minus(text) {
  return text.replace(/-/g, "\u2212");
}

// Round numbers over a range, about as many as wanted.
export function ticks(low, high, wanted = 5) {
  const raw = (high - low) / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * 0.999);
  const out = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) {
    out.push(Number((k * step).toPrecision(12)));
  }
  return out;
}

// float32 numbers from their bytes in base64.
export function floatsOf(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

export const degrees = (radians) => (radians * 180) / Math.PI;
export const radians = (degree) => (degree * Math.PI) / 180;
