// Elementary functions to float32 accuracy, with nothing but arithmetic, square roots and
// bits: the language leaves the precision of its own to the hardware. Polynomials are those
// of Cephes (Moshier 1989) unless told otherwise.

const float LN2_HIGH = 0.693359375;
const float LN2_LOW = -2.12194440e-4;

// Add a term to a sum whose rounding errors are kept (Kahan 1965).
void f_add(inout float sum, inout float rest, float term) {
  float corrected = term - rest;
  float next = sum + corrected;
  rest = (next - sum) - corrected;
  sum = next;
}

// x 2^n, in two steps: 2^n alone may be beyond the floats.
float f_ldexp(float x, int n) {
  int half_n = n / 2;
  float first = intBitsToFloat((clamp(half_n, -126, 127) + 127) << 23);
  float second = intBitsToFloat((clamp(n - half_n, -126, 127) + 127) << 23);
  return x * first * second;
}

// e^r - 1 - r for |r| <= ln(2) / 2 and somewhat beyond.
float f_exp_rest(float r) {
  float p = 1.9875691500e-4;
  p = p * r + 1.3981999507e-3;
  p = p * r + 8.3334519073e-3;
  p = p * r + 4.1665795894e-2;
  p = p * r + 1.6666665459e-1;
  p = p * r + 5.0000001201e-1;
  return p * r * r;
}

float f_exp(float x) {
  x = clamp(x, -104.0, 89.0);
  float n = floor(x * 1.44269504088896341 + 0.5);
  float r = (x - n * LN2_HIGH) - n * LN2_LOW;
  return f_ldexp(1.0 + (r + f_exp_rest(r)), int(n));
}

float f_exp2(float x) {
  x = clamp(x, -150.0, 129.0);
  float n = floor(x + 0.5);
  float r = (x - n) * 0.693147180559945;
  return f_ldexp(1.0 + (r + f_exp_rest(r)), int(n));
}

// e^x - 1; by Taylor's series where the difference would cancel.
float f_expm1(float x) {
  if (abs(x) > 0.5) return f_exp(x) - 1.0;
  float p = 2.755731922e-6;
  p = p * x + 2.480158730e-5;
  p = p * x + 1.984126984e-4;
  p = p * x + 1.388888889e-3;
  p = p * x + 8.333333333e-3;
  p = p * x + 4.166666667e-2;
  p = p * x + 1.666666667e-1;
  p = p * x + 0.5;
  return x + p * x * x;
}

float f_log(float x) {
  if (!(x > 0.0)) return x == 0.0 ? uintBitsToFloat(0xff800000u) : uintBitsToFloat(0x7fc00000u);
  if (isinf(x)) return x;
  int bits = floatBitsToInt(x);
  // The mantissa in [sqrt(1/2), sqrt(2)).
  int e = (bits - 0x3f3504f3) >> 23;
  float m = intBitsToFloat(bits - (e << 23)) - 1.0;
  float n = float(e);
  float z = m * m;
  float p = 7.0376836292e-2;
  p = p * m - 1.1514610310e-1;
  p = p * m + 1.1676998740e-1;
  p = p * m - 1.2420140846e-1;
  p = p * m + 1.4249322787e-1;
  p = p * m - 1.6668057665e-1;
  p = p * m + 2.0000714765e-1;
  p = p * m - 2.4999993993e-1;
  p = p * m + 3.3333331174e-1;
  float y = m * z * p + n * LN2_LOW - 0.5 * z;
  return (m + y) + n * LN2_HIGH;
}

// log(1 + x) = 2 atanh(x / (2 + x)), by its series where 1 + x would lose digits.
float f_log1p(float x) {
  if (x < -0.3 || x > 0.45) return f_log(1.0 + x);
  float s = x / (2.0 + x);
  float z = s * s;
  float p = 1.0 / 13.0;
  p = p * z + 1.0 / 11.0;
  p = p * z + 1.0 / 9.0;
  p = p * z + 1.0 / 7.0;
  p = p * z + 0.2;
  p = p * z + 1.0 / 3.0;
  return 2.0 * (s + s * z * p);
}

float f_pow(float x, float y) {
  if (y == 0.0) return 1.0;
  if (x == 0.0) return y > 0.0 ? 0.0 : uintBitsToFloat(0x7f800000u);
  if (x < 0.0) {
    float whole = floor(y);
    if (whole != y) return uintBitsToFloat(0x7fc00000u);
    float size = f_exp(y * f_log(-x));
    return mod(whole, 2.0) == 0.0 ? size : -size;
  }
  return f_exp(y * f_log(x));
}

float f_cbrt(float x) {
  return x == 0.0 ? 0.0 : sign(x) * f_exp(f_log(abs(x)) / 3.0);
}

float f_rem(float x, float y) {
  return x - y * trunc(x / y);
}

// Sine of x plus a quarter turn per shift: octants by a value of pi/2 in three parts.
float f_sine_of_quarters(float x, int shift) {
  float n = floor(x * 0.636619772367581 + 0.5);
  float r = ((x - n * 1.5703125) - n * 4.83751296997e-4) - n * 7.54978995489e-8;
  int quarter = (int(n) + shift) & 3;
  float z = r * r;
  float s = r + r * z * (-1.6666654611e-1 + z * (8.3321608736e-3 - z * 1.9515295891e-4));
  float c = 1.0 - 0.5 * z
    + z * z * (4.166664568298827e-2 + z * (-1.388731625493765e-3 + z * 2.443315711809948e-5));
  float value = (quarter & 1) == 0 ? s : c;
  return quarter < 2 ? value : -value;
}

float f_sin(float x) {
  return f_sine_of_quarters(x, 0);
}

float f_cos(float x) {
  return f_sine_of_quarters(x, 1);
}

// Arc tangent of t in [0, 1].
float f_atan_unit(float t) {
  float start = 0.0;
  if (t > 0.414213562373095) {
    start = 0.785398163397448;
    t = (t - 1.0) / (t + 1.0);
  }
  float z = t * t;
  float p = 8.05374449538e-2;
  p = p * z - 1.38776856032e-1;
  p = p * z + 1.99777106478e-1;
  p = p * z - 3.33329491539e-1;
  return start + (p * z * t + t);
}

float f_atan2(float y, float x) {
  float ax = abs(x), ay = abs(y);
  float larger = max(ax, ay);
  if (larger == 0.0) return 0.0;
  float a = f_atan_unit(min(ax, ay) / larger);
  if (ay > ax) a = 1.57079632679489662 - a;
  if (x < 0.0) a = 3.14159265358979324 - a;
  return y < 0.0 ? -a : a;
}

float f_sinh(float x) {
  float m = f_expm1(abs(x));
  return 0.5 * sign(x) * (m + m / (m + 1.0));
}

float f_cosh(float x) {
  float e = f_exp(abs(x));
  return 0.5 * e + 0.5 / e;
}

float f_tanh(float x) {
  float m = f_expm1(-2.0 * abs(x));
  return -sign(x) * m / (2.0 + m);
}

float f_asinh(float x) {
  float a = abs(x);
  if (a > 1e8) return sign(x) * (f_log(a) + 0.693147180559945);
  return sign(x) * f_log1p(a + a * a / (1.0 + sqrt(a * a + 1.0)));
}

float f_erf_small(float x) {
  float z = x * x;
  float p = 7.853861353153693e-5;
  p = p * z - 8.010193625184903e-4;
  p = p * z + 5.188327685732524e-3;
  p = p * z - 2.685381193529856e-2;
  p = p * z + 1.128358514861418e-1;
  p = p * z - 3.761262582423300e-1;
  p = p * z + 1.128379165726710;
  return x * p;
}

// erfc for |x| > 1, of the positive side.
float f_erfc_large(float a) {
  float q = 1.0 / a;
  float y = q * q;
  float p;
  if (a < 2.0) {
    p = 2.326819970068386e-2;
    p = p * y - 1.387039388740657e-1;
    p = p * y + 3.687424674597105e-1;
    p = p * y - 5.824733027278666e-1;
    p = p * y + 6.210004621745983e-1;
    p = p * y - 4.944515323274145e-1;
    p = p * y + 3.404879937665872e-1;
    p = p * y - 2.741127028184656e-1;
    p = p * y + 5.638259427386472e-1;
  } else {
    p = -1.047766399936249e+1;
    p = p * y + 1.297719955372516e+1;
    p = p * y - 7.495518717768503;
    p = p * y + 2.921019019210786;
    p = p * y - 1.015265279202700;
    p = p * y + 4.218463358204948e-1;
    p = p * y - 2.820767439740514e-1;
    p = p * y + 5.641895067754075e-1;
  }
  // The square in two parts, the first one exact.
  float high = intBitsToFloat(floatBitsToInt(a) & 0xfffff000);
  float square = f_exp(-high * high) * f_exp(-(a - high) * (a + high));
  return square * q * p;
}

float f_erfc(float x) {
  if (abs(x) <= 1.0) return 1.0 - f_erf_small(x);
  float large = f_erfc_large(abs(x));
  return x < 0.0 ? 2.0 - large : large;
}

float f_erf(float x) {
  if (abs(x) <= 1.0) return f_erf_small(x);
  return sign(x) * (1.0 - f_erfc_large(abs(x)));
}
