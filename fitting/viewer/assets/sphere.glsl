// A sphere of the material, seen from afar, lit from one direction.
uniform vec2 size;
uniform vec3 light;
uniform float exposure;
out vec4 colour;

vec3 encoded(vec3 linear) {
  vec3 x = clamp(linear, 0.0, 1.0);
  return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}

void main() {
  vec2 p = (2.0 * gl_FragCoord.xy - size) / min(size.x, size.y) * 1.03;
  float r2 = dot(p, p);
  float inside = clamp((1.0 - sqrt(r2)) * 0.5 * min(size.x, size.y), 0.0, 1.0);
  if (inside == 0.0) {
    colour = vec4(0.0);
    return;
  }
  vec3 n = vec3(p, sqrt(max(1.0 - r2, 1e-6)));
  n = normalize(n);
  // Azimuth 0 of the sample goes around the vertical axis.
  vec3 t = normalize(cross(vec3(0.0, 1.0, 0.0), n));
  vec3 b = cross(n, t);
  vec3 wi = vec3(dot(light, t), dot(light, b), dot(light, n));
  vec3 wo = vec3(t.z, b.z, n.z);
  vec3 radiance = value(wi, wo).rgb * abs(wi.z) * exposure;
  colour = vec4(encoded(radiance), 1.0) * inside;
}
