# The Poisson step as the thesis has it [Li2015, sec. 2.2.2]: divergence, sine transform in two dimensions,
# division by the Laplacian's eigenvalues, inverse transform. Reads 2 x 240 x 320 float32 slopes; prints the least
# processor time of a solution in seconds.
import sys
import time

import numpy
import scipy.fft

WIDTH, HEIGHT = 320, 240
ROUNDS = 40

slopes = numpy.fromfile(sys.argv[1], dtype=numpy.float32).reshape(2, HEIGHT, WIDTH)
eigenvalues = (
    2.0 * numpy.cos(numpy.pi * numpy.arange(1, WIDTH + 1) / (WIDTH + 1))[None, :]
    + 2.0 * numpy.cos(numpy.pi * numpy.arange(1, HEIGHT + 1) / (HEIGHT + 1))[:, None]
    - 4.0
).astype(numpy.float32)


def solve(u, v):
    divergence = numpy.gradient(u, axis=1) + numpy.gradient(v, axis=0)
    terms = scipy.fft.dstn(divergence, type=1, workers=1)
    return scipy.fft.idstn(terms / eigenvalues, type=1, workers=1)


least = float("inf")
for _ in range(ROUNDS):
    begun = time.process_time()
    heights = solve(slopes[0], slopes[1])
    least = min(least, time.process_time() - begun)
assert numpy.isfinite(heights).all()
print(least)
