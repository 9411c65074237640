// Up to four weighted sums over the channels, 1/sr.
vec4 value(vec3 wi, vec3 wo) {
  vec4 sum = vec4(0.0);
  for (int row = 0; row < rows; ++row) {
    known_row = int(texelFetch(amplitudes, ivec2(BASIS, row), 0).r);
    float b[BASIS];
    basis(wi, wo, b);
    for (int j = 0; j < BASIS; ++j) {
      sum += b[j] * texelFetch(amplitudes, ivec2(j, row), 0);
    }
  }
  return sum;
}
