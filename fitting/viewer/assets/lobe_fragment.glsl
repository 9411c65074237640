// Facets of the lobe, coloured by their value.
in vec3 position;
in float share;
uniform sampler2D palette;
out vec4 colour;

void main() {
  vec3 n = normalize(cross(dFdx(position), dFdy(position)) + vec3(0.0, 0.0, 1e-20));
  float shade = 0.62 + 0.38 * abs(dot(n, normalize(vec3(0.3, -0.5, 0.8))));
  float at = clamp(share, 0.0, 1.0) * 255.0;
  colour = vec4(texelFetch(palette, ivec2(int(at), 0), 0).rgb * shade, 1.0);
}
