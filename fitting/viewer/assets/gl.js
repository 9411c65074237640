// The one WebGL context of the page: programs, textures of floats, and drawing to them.

const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

export class GraphicsError extends Error {}

export function openGraphics() {
  const canvas = document.createElement("canvas");
  const options = { alpha: true, premultipliedAlpha: true, antialias: true };
  const gl = canvas.getContext("webgl2", options);
  if (!gl) {
    throw new GraphicsError("this browser has no WebGL 2, or it is switched off");
  }
  if (!gl.getExtension("EXT_color_buffer_float")) {
    throw new GraphicsError("this graphics hardware cannot draw to floating point numbers");
  }
  return gl;
}

export function buildProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, HEADER + text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
    const logs = gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s));
    throw new GraphicsError(`a shader does not compile: ${logs.join(" ")}`.trim());
  }
  const uniforms = new Map();
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
  for (let k = 0; k < count; ++k) {
    const { name, type } = gl.getActiveUniform(program, k);
    uniforms.set(name, { type, at: gl.getUniformLocation(program, name) });
  }
  return { program, uniforms };
}

// A texture of floats, of one or four numbers per texel; data may be null.
export function floatTexture(gl, width, height, parts, data, old = null) {
  const texture = old ?? gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  const [inside, outside] = parts === 1 ? [gl.R32F, gl.RED] : [gl.RGBA32F, gl.RGBA];
  gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, outside, gl.FLOAT, data);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  }
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) {
    gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
  }
  return texture;
}

// Select a program and give it its uniforms: numbers, arrays of them, or textures.
export function useProgram(gl, { program, uniforms }, values) {
  gl.useProgram(program);
  let unit = 0;
  for (const [name, { type, at }] of uniforms) {
    const value = values[name];
    if (type === gl.SAMPLER_2D) {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, value);
      gl.uniform1i(at, unit++);
    } else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, value);
    else if (type === gl.FLOAT_VEC3) gl.uniform3fv(at, value);
    else if (type === gl.FLOAT_VEC2) gl.uniform2fv(at, value);
    else if (type === gl.INT) gl.uniform1i(at, value);
    else gl.uniform1f(at, value);
  }
}

// Run a program for every texel of a texture of floats, and read what it wrote.
export function runToTexture(gl, program, values, texture, width, height, read = true) {
  const frame = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  gl.viewport(0, 0, width, height);
  gl.disable(gl.DEPTH_TEST);
  useProgram(gl, program, values);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  let out = null;
  if (read) {
    out = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, out);
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.deleteFramebuffer(frame);
  return out;
}

// Make the picture that is drawn next as large as wanted, and empty.
export function beginPicture(gl, width, height) {
  if (gl.canvas.width !== width || gl.canvas.height !== height) {
    gl.canvas.width = width;
    gl.canvas.height = height;
  }
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
}
