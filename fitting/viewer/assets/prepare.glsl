// What depends on parameters only: a row for every set, four numbers to a texel.
uniform sampler2D parameters;
out vec4 numbers;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float p[PARAMETERS];
  for (int k = 0; k < PARAMETERS; ++k) p[k] = texelFetch(parameters, ivec2(k, at.y), 0).r;
  float all[KNOWN];
  prepare(p, all);
  vec4 four;
  for (int k = 0; k < 4; ++k) four[k] = all[min(4 * at.x + k, KNOWN - 1)];
  numbers = four;
}
