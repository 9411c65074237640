// Plots of lines and points on a canvas, sharp on every screen.

import { short, ticks } from "./numbers.js";
import { themed } from "./palette.js";

const FONT = "12px system-ui, sans-serif";
const EDGES = { left: 58, right: 10, top: 10, bottom: 38 };

// The drawing surface of a canvas in CSS pixels, cleared.
export function surface(canvas) {
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  const { width, height } = sizeOf(canvas);
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height, scale };
}

export function sizeOf(canvas) {
  return { width: canvas.clientWidth || 320, height: canvas.clientHeight || 240 };
}

// Axes of a plot: `x`, `y` are ranges, `logarithmic` is about y. Returns how to place points.
export function axes(canvas, { x, y, logarithmic, xLabel, yLabel, xTicks }) {
  const { pen, width, height } = surface(canvas);
  const box = {
    left: EDGES.left, top: EDGES.top, right: width - EDGES.right, bottom: height - EDGES.bottom,
  };
  const across = (v) => box.left + ((v - x[0]) / (x[1] - x[0])) * (box.right - box.left);
  const share = logarithmic
    ? (v) => Math.log(v / y[0]) / Math.log(y[1] / y[0])
    : (v) => (v - y[0]) / (y[1] - y[0]);
  const up = (v) => box.bottom - share(v) * (box.bottom - box.top);
  pen.font = FONT;
  pen.lineWidth = 1;
  pen.fillStyle = themed(canvas, "quiet");
  pen.strokeStyle = themed(canvas, "rule");
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const t of xTicks ?? ticks(x[0], x[1])) {
    line(pen, across(t), box.top, across(t), box.bottom);
    pen.fillText(short(t), across(t), box.bottom + 5);
  }
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const t of logarithmic ? decades(y) : ticks(y[0], y[1])) {
    line(pen, box.left, up(t), box.right, up(t));
    pen.fillText(logarithmic ? power(t) : short(t), box.left - 6, up(t));
  }
  pen.fillStyle = themed(canvas, "ink");
  pen.textAlign = "center";
  pen.textBaseline = "bottom";
  pen.fillText(xLabel, (box.left + box.right) / 2, height - 3);
  pen.save();
  pen.translate(12, (box.top + box.bottom) / 2);
  pen.rotate(-Math.PI / 2);
  pen.textBaseline = "middle";
  pen.fillText(yLabel, 0, 0);
  pen.restore();
  return { pen, box, across, up };
}

export function curve({ pen, box, across, up }, xs, ys, colour, dash = []) {
  clipped(pen, box, () => {
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.setLineDash(dash);
    pen.beginPath();
    let down = false;
    xs.forEach((x, k) => {
      const at = up(ys[k]);
      if (!Number.isFinite(at)) down = false;
      else if (down) pen.lineTo(across(x), at);
      else {
        pen.moveTo(across(x), at);
        down = true;
      }
    });
    pen.stroke();
  });
}

export function marks({ pen, box, across, up }, xs, ys, colour, mark) {
  const size = xs.length > 400 ? 1.5 : 3;
  clipped(pen, box, () => {
    pen.strokeStyle = colour;
    pen.lineWidth = 1.2;
    pen.globalAlpha = xs.length > 400 ? 0.5 : 0.85;
    xs.forEach((x, k) => {
      const at = up(ys[k]);
      if (Number.isFinite(at)) drawMark(pen, across(x), at, size, mark);
    });
  });
}

export function drawMark(pen, x, y, size, mark) {
  pen.beginPath();
  if (mark === "square") pen.rect(x - size, y - size, 2 * size, 2 * size);
  else if (mark === "triangle") {
    pen.moveTo(x, y - 1.2 * size);
    pen.lineTo(x + 1.1 * size, y + 0.8 * size);
    pen.lineTo(x - 1.1 * size, y + 0.8 * size);
    pen.closePath();
  } else pen.arc(x, y, size, 0, 2 * Math.PI);
  pen.stroke();
}

export function line(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

function clipped(pen, box, draw) {
  pen.save();
  pen.beginPath();
  pen.rect(box.left, box.top, box.right - box.left, box.bottom - box.top);
  pen.clip();
  draw();
  pen.restore();
}

function decades([low, high]) {
  const few = Math.log10(high / low) < 2.5;
  const out = [];
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const step = Math.max(Math.ceil((last - first) / 6), 1);
  for (let k = few ? first - 1 : first; k <= last; k += step) {
    for (const m of few ? [1, 2, 5] : [1]) out.push(Number((m * 10 ** k).toPrecision(3)));
  }
  return out.filter((t) => t >= low && t <= high);
}

function power(value) {
  const k = Math.round(Math.log10(value));
  if (value >= 1e-3 && value <= 1e3) return short(value);
  if (value !== Number(`1e${k}`)) return short(value, 1);
  const digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const raised = [...String(Math.abs(k))].map((d) => digits[Number(d)]).join("");
  return `10${k < 0 ? "⁻" : ""}${raised}`;
}
