// A fitted model on the graphics hardware: parameters in, values at directions out.

import { buildProgram, floatTexture, runToTexture } from "./gl.js";

const WIDTH = 256;

export class ShaderModel {
  // `shader` is what Python translated, `glsl` the texts that all models share, `channels`
  // the number of sets of parameters.
  constructor(gl, shader, glsl, channels) {
    this.gl = gl;
    this.shader = shader;
    this.channels = channels;
    const { parameters, known, basis } = shader;
    const own = `#define BASIS ${basis}
#define KNOWN ${known}
#define PARAMETERS ${Math.max(parameters.length, 1)}
${glsl.functions}
${shader.constants}
`;
    this.beginning = `${own}${glsl.model}${shader.evaluate}\n${glsl.value}`;
    this.preparing = buildProgram(gl, glsl.screen, own + shader.prepare + glsl.prepare);
    this.points = buildProgram(gl, glsl.screen, this.beginning + glsl.points);
    this.width = Math.ceil(known / 4);
    this.known = floatTexture(gl, this.width, channels, 4, null);
    this.textures = {};
  }

  // Values of all parameters, a row per channel.
  setParameters(values) {
    const { gl, channels } = this;
    const { parameters, known, basis } = this.shader;
    this.textures.parameters = floatTexture(
      gl, Math.max(parameters.length, 1), channels, 1, values.length ? values : new Float32Array(channels),
      this.textures.parameters,
    );
    const all = runToTexture(
      gl, this.preparing, { parameters: this.textures.parameters }, this.known, this.width, channels,
    );
    const number = (c, k) => all[4 * this.width * c + k];
    this.factors = [];
    for (let c = 0; c < channels; ++c) {
      this.factors.push(Array.from({ length: basis }, (_, j) => number(c, known - basis + j)));
    }
    // Whether one set of shape parameters serves all channels.
    this.shared = true;
    for (let k = 0; k < known - basis; ++k) {
      for (let c = 1; c < channels; ++c) {
        if (!Object.is(number(c, k), number(0, k))) this.shared = false;
      }
    }
  }

  // Uniforms for sums over channels: `weights` maps a channel to its (up to four) weights.
  sums(weights, name) {
    const { basis } = this.shader;
    const rows = this.shared ? [0] : [...weights.keys()];
    const data = new Float32Array(4 * (basis + 1) * rows.length);
    for (const [c, own] of weights) {
      const row = this.shared ? 0 : rows.indexOf(c);
      for (let j = 0; j < basis; ++j) {
        for (let k = 0; k < own.length; ++k) {
          data[4 * (row * (basis + 1) + j) + k] += own[k] * this.factors[c][j];
        }
      }
    }
    rows.forEach((c, row) => (data[4 * (row * (basis + 1) + basis)] = c));
    this.textures[name] = floatTexture(
      this.gl, basis + 1, rows.length, 4, data, this.textures[name],
    );
    return { known_values: this.known, amplitudes: this.textures[name], rows: rows.length };
  }

  // Four numbers for each pair of directions, given as [x, y, z, 0, ...].
  evaluate(sources, detectors, sums) {
    const texture = this.evaluateToTexture(sources, detectors, sums, true);
    return texture.values.subarray(0, sources.length);
  }

  evaluateToTexture(sources, detectors, sums, read = true) {
    const { gl, textures } = this;
    const height = Math.max(Math.ceil(sources.length / 4 / WIDTH), 1);
    textures.sources = floatTexture(gl, WIDTH, height, 4, padded(sources, height), textures.sources);
    textures.detectors = floatTexture(
      gl, WIDTH, height, 4, padded(detectors, height), textures.detectors,
    );
    textures.result = floatTexture(gl, WIDTH, height, 4, null, textures.result);
    const own = { ...sums, sources: textures.sources, detectors: textures.detectors };
    const values = runToTexture(gl, this.points, own, textures.result, WIDTH, height, read);
    return { texture: textures.result, width: WIDTH, height, values };
  }
}

function padded(directions, height) {
  const out = new Float32Array(4 * WIDTH * height);
  out.set(directions);
  return out;
}
