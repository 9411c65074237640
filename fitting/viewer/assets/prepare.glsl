// What depends on parameters only: a row for every set, a column for every number.
uniform sampler2D parameters;
out float number;

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  float p[PARAMETERS];
  for (int k = 0; k < PARAMETERS; ++k) p[k] = texelFetch(parameters, ivec2(k, at.y), 0).r;
  float all[KNOWN];
  prepare(p, all);
  number = all[at.x];
}
