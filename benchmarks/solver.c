/* The solver's kernel in plain C, slab by slab as in ajgdata: the speed that a C compiler reaches. */
#include <stddef.h>

/* Four-point differences: reach is w/(1 + 3w) of each face. The velocities of slab k + 1 come before
   the pressures of slab k, which need them. */
void march(float *restrict p, float *restrict ux, float *restrict uy, float *restrict uz,
           const float *restrict gx, const float *restrict gy, const float *restrict gz,
           const float *restrict yield,
           const float *restrict rx, const float *restrict ry, const float *restrict rz,
           const size_t *lo, const size_t *hi,
           size_t slabs, size_t row, size_t slab, size_t steps)
{
    for (size_t n = 0; n < steps; n++)
        for (size_t above = 1; above < slabs; above++) {
            size_t first = lo[above], last = hi[above];
            for (size_t i = first; i < last; i++)
                ux[i] -= gx[i] * ((p[i + 1] - p[i]) - rx[i] * (p[i + 2] - p[i - 1]));
            for (size_t i = first; i < last; i++)
                uy[i] -= gy[i] * ((p[i + row] - p[i]) - ry[i] * (p[i + 2 * row] - p[i - row]));
            for (size_t i = first; i < last; i++)
                uz[i] -= gz[i] * ((p[i + slab] - p[i]) - rz[i] * (p[i + 2 * slab] - p[i - slab]));
            first = lo[above - 1], last = hi[above - 1];
            for (size_t i = first; i < last; i++) {
                float x = (ux[i] - ux[i - 1]) - (rx[i + 1] * ux[i + 1] - rx[i - 2] * ux[i - 2]);
                float y = (uy[i] - uy[i - row])
                          - (ry[i + row] * uy[i + row] - ry[i - 2 * row] * uy[i - 2 * row]);
                float z = (uz[i] - uz[i - slab])
                          - (rz[i + slab] * uz[i + slab] - rz[i - 2 * slab] * uz[i - 2 * slab]);
                p[i] -= yield[i] * (x + y + z);
            }
        }
}
