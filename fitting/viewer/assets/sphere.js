// The lit sphere; its light is dragged, or moved with the arrow keys.

import { buildProgram, beginPicture, useProgram } from "./gl.js";
import { surface } from "./plot.js";

export class Sphere {
  constructor(fit, glsl, canvas, caption) {
    this.fit = fit;
    this.canvas = canvas;
    const grey = fit.coloured || fit.count === 1 ? "" : "; these channels make no colour";
    caption.textContent = `drag the light, or use the arrow keys${grey}`;
    this.program = buildProgram(
      fit.shader.gl, glsl.screen, fit.shader.beginning + glsl.sphere,
    );
  }

  draw(view) {
    const { fit, canvas } = this;
    const { gl } = fit.shader;
    const { pen, width, height, scale } = surface(canvas);
    const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
    const sums = fit.colourSums(view.soloOf(fit));
    beginPicture(gl, w, h);
    gl.disable(gl.DEPTH_TEST);
    useProgram(gl, this.program, {
      ...sums, size: [w, h], light: view.light, exposure: 2 ** view.exposure,
    });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    pen.drawImage(gl.canvas, 0, 0, width, height);
    this.drawLight(pen, view, width, height);
  }

  // Where the light comes from: filled in front of the sphere, a ring behind it.
  drawLight(pen, { light }, width, height) {
    const radius = (0.5 * Math.min(width, height)) / 1.03;
    const x = width / 2 + radius * light[0], y = height / 2 - radius * light[1];
    pen.beginPath();
    pen.arc(x, y, 5, 0, 2 * Math.PI);
    pen.lineWidth = 2;
    pen.strokeStyle = "#000";
    pen.fillStyle = light[2] >= 0 ? "#FFD84D" : "rgba(0, 0, 0, 0)";
    pen.fill();
    pen.stroke();
    pen.lineWidth = 1;
    pen.strokeStyle = "#FFD84D";
    pen.stroke();
  }
}
