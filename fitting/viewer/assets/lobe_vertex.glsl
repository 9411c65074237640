// A vertex of the lobe: its direction, as far out as the model's value says.
uniform sampler2D detectors;
uniform sampler2D values;
uniform mat4 camera;
uniform float largest;
uniform float decades;
uniform int logarithmic;
uniform int width;
out vec3 position;
out float share;

void main() {
  ivec2 at = ivec2(gl_VertexID % width, gl_VertexID / width);
  float f = max(texelFetch(values, at, 0).a, 0.0);
  share = clamp(1.0 + log2(max(f / largest, 1e-30)) / (3.321928 * decades), 0.0, 1.0);
  float far = logarithmic == 1 ? share : f / largest;
  position = texelFetch(detectors, at, 0).xyz * far;
  gl_Position = camera * vec4(position, 1.0);
}
