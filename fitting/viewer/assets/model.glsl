// What every program that evaluates the model begins with. A row is a set of shape
// parameters: one for all channels, or one for each channel that is shown.

uniform sampler2D known_values;
// For every row the factors of the basis functions, and behind them which row of
// known_values belongs to it.
uniform sampler2D amplitudes;
uniform int rows;

int known_row;

float known(int k) {
  return texelFetch(known_values, ivec2(k >> 2, known_row), 0)[k & 3];
}
