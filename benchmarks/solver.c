/* The solver's kernel in plain C, slab by slab as ours: what a compiler makes of it. */
#include <stddef.h>

void march_air(float *restrict p, float *restrict ux, float *restrict uy, float *restrict uz,
               const float *restrict gx, const float *restrict gy, const float *restrict gz,
               const float *restrict yield, const size_t *lo, const size_t *hi,
               size_t slabs, size_t row, size_t slab, size_t steps)
{
    for (size_t n = 0; n < steps; n++)
        for (size_t k = 0; k < slabs; k++) {
            for (size_t i = lo[k]; i < hi[k]; i++) ux[i] -= gx[i] * (p[i + 1] - p[i]);
            for (size_t i = lo[k]; i < hi[k]; i++) uy[i] -= gy[i] * (p[i + row] - p[i]);
            for (size_t i = lo[k]; i < hi[k]; i++) uz[i] -= gz[i] * (p[i + slab] - p[i]);
            for (size_t i = lo[k]; i < hi[k]; i++)
                p[i] -= yield[i] * ((ux[i] - ux[i - 1]) + (uy[i] - uy[i - row])
                                    + (uz[i] - uz[i - slab]));
        }
}
