/* One pass over the rows of a fit of lambert + ggx, by hand: what a step needs, for weights
   that all channels share and the objective l2. Sums: 15 products of the features
   {1/pi, S (1 - q), S q, S' (1 - q), S' q}, and per channel 5 products with the residual
   and its square. S = D V of GGX (Walter et al. 2007, eqs 33, 34; Heitz 2014, eq. 99),
   q = (1 - cos_d)^5, S' its derivative in alpha.
   cc -O3 -march=native -ffast-math -shared -fPIC pass_kernel.c -o pass_kernel.so -lm */
#include <math.h>

#define FEATURES 5
#define BLOCK 512

void pass(long n, int channels, double alpha, const double *a, const double *cos_i,
          const double *cos_o, const double *hx, const double *hy, const double *hz,
          const double *cos_d, const double *weight, const double *target, double *gram,
          double *gradient, double *cost)
{
    const double pi = 3.14159265358979323846, a2 = alpha * alpha;
    static __thread double f[FEATURES][BLOCK];
    for (long begin = 0; begin < n; begin += BLOCK) {
        long size = n - begin < BLOCK ? n - begin : BLOCK;
        double g[15] = {0};
        for (long k = 0; k < size; k++) {
            long r = begin + k;
            double w = weight[r];
            double s2 = hx[r] * hx[r] + hy[r] * hy[r], c2 = hz[r] * hz[r];
            double t = s2 + c2 * a2, ci = cos_i[r], co = cos_o[r];
            double ri = sqrt(a2 + (1 - a2) * ci * ci), ro = sqrt(a2 + (1 - a2) * co * co);
            double v = 1.0 / (co * ri + ci * ro);
            double s = 0.5 * a2 / (pi * t * t) * v;
            double ds = s * (2.0 / alpha - 4.0 * alpha * c2 / t
                             - v * alpha * (co * (1 - ci * ci) / ri + ci * (1 - co * co) / ro));
            double m = 1 - cos_d[r], q = m * m * m * m * m;
            double x0 = w / pi, x1 = w * s * (1 - q), x2 = w * s * q;
            double x3 = w * ds * (1 - q), x4 = w * ds * q;
            f[0][k] = x0; f[1][k] = x1; f[2][k] = x2; f[3][k] = x3; f[4][k] = x4;
            g[0] += x0 * x0; g[1] += x0 * x1; g[2] += x0 * x2; g[3] += x0 * x3;
            g[4] += x0 * x4; g[5] += x1 * x1; g[6] += x1 * x2; g[7] += x1 * x3;
            g[8] += x1 * x4; g[9] += x2 * x2; g[10] += x2 * x3; g[11] += x2 * x4;
            g[12] += x3 * x3; g[13] += x3 * x4; g[14] += x4 * x4;
        }
        for (int i = 0; i < 15; i++) gram[i] += g[i];
        for (int c = 0; c < channels; c++) {
            const double *y = target + (long)c * n + begin, *w = weight + begin;
            double a0 = a[3 * c], a1 = a[3 * c + 1], b = a[3 * c + 2];
            double z0 = 0, z1 = 0, z2 = 0, z3 = 0, z4 = 0, sum = 0;
            for (long k = 0; k < size; k++) {
                double r = a0 * f[0][k] + a1 * f[1][k] + b * f[2][k] - w[k] * y[k];
                z0 += r * f[0][k]; z1 += r * f[1][k]; z2 += r * f[2][k];
                z3 += r * f[3][k]; z4 += r * f[4][k]; sum += r * r;
            }
            double *z = gradient + FEATURES * c;
            z[0] += z0; z[1] += z1; z[2] += z2; z[3] += z3; z[4] += z4;
            *cost += sum;
        }
    }
}
