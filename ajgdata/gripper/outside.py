"""Sound from outside, through the membrane as the solver has it: a run the other way round.

Let a volume velocity Q at the microphone move the membrane's spot x by the velocity v(x) outwards.
By reciprocity a pressure P(x) on the outside of the membrane is heard as p = ∫ P v/Q dS at the
microphone. In a diffuse field, sound from all directions n with power w_n each, that is in the mean

    <p²> = 2 <P²> Σ w_n |∫ v/Q exp(iω n·x/c) dS|²

(Jacobsen 1979; the sum is the correlation sin(kr)/kr of Cook et al. 1955). The 2: the mean square
at a wall, and a gripper stands at its table, is twice that in the room (Waterhouse 1955). What lies
between membrane and table is not modelled: neither its shadow nor its resonances.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ajgdata.gripper.grid import Cells
from ajgdata.gripper.medium import Air
from ajgdata.gripper.walls import WallList

Real = NDArray[np.floating]
#: Side of the patches of membrane that are heard together; a tenth of a wavelength at 3 kHz, and at
#: 10 kHz errs by 0.4 dB.
PATCH_M = 12e-3
#: Directions that sound comes from, evenly over the sphere.
DIRECTIONS = 32
#: Samples, half a millisecond, whose mean is what a response settles at.
SETTLED = 22
#: Frequencies of the transfer, evenly from 0 to half the sample rate.
TRANSFER_BINS = 513


class MembranePatches(NamedTuple):
    """Patches of membrane: of each wall its cell, patch and area (m²); of each patch its centre
    (m; x, y, z) and per area m, r, k (SI)."""

    cell: NDArray
    patch: NDArray
    area: Real
    centre: Real
    motion: Real


def skin(walls: WallList, cells: Cells) -> MembranePatches:
    """Return the walls in patches, each of walls that lie together and are of one kind."""
    z, y, x = np.unravel_index(walls.cell, cells.shape)
    place = np.column_stack([cells.x[x], cells.y[y], cells.z[z]])
    surface = np.column_stack([walls.mass, walls.resistance, walls.stiffness])
    key = np.column_stack([np.floor(place / PATCH_M), surface])
    groups, patch = np.unique(key, axis=0, return_inverse=True)
    patch = patch.reshape(-1)
    total = np.bincount(patch, walls.area, len(groups))
    centre = np.column_stack(
        [np.bincount(patch, walls.area * axis, len(groups)) / total for axis in place.T]
    )
    return MembranePatches(walls.cell.astype(np.uint64), patch, walls.area, centre, groups[:, 3:])


@cache
def directions(count: int = DIRECTIONS) -> Real:
    """Return unit vectors (count, 3), evenly over the sphere: a Fibonacci lattice."""
    turn = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = 1 - (2 * np.arange(count) + 1) / count
    radius = np.sqrt(1 - height**2)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])


def patch_velocity(push: Real, motion: Real, step_s: float) -> NDArray[np.complexfloating]:
    """Return the volume velocity (patches, TRANSFER_BINS) that `push` (patches, n) causes.

    `push` is the pressure times area (N) every `step_s`; v = iω P / (k - ω²m + iωr) of each. It
    stays for ever at the mean of its last SETTLED, so it is differenced.
    """
    length = 2 * (TRANSFER_BINS - 1)
    settled = push[:, -SETTLED:].mean(axis=1)
    folded = np.zeros((len(push), length))
    for begin in range(0, push.shape[1], length):
        block = push[:, begin : begin + length]
        folded[:, : block.shape[1]] += block
    # The differences of what is folded, in turn, and the last step to what it settles at.
    change = folded - np.roll(folded, 1, axis=1)
    change[:, push.shape[1] % length] += settled
    spectrum = np.fft.rfft(change, axis=1)
    iw = 1j * np.pi / step_s * np.linspace(0, 1, TRANSFER_BINS)
    iw[0] = iw[1]  # a membrane without stiffness would move for ever
    surfaces, surface = np.unique(motion, axis=0, return_inverse=True)
    mass, resistance, stiffness = surfaces.T[:, :, None]
    rate = iw / (-np.expm1(-iw * step_s) * (stiffness + iw * resistance + iw**2 * mass))
    spectrum *= rate[surface.reshape(-1)]
    return np.asarray(spectrum)


def diffuse_gain(
    velocity: NDArray[np.complexfloating], centre: Real, air: Air, step_s: float
) -> Real:
    """Return the rms pressure at the microphone per rms pressure in the room, (TRANSFER_BINS,), for
    the `velocity` (patches, TRANSFER_BINS) of each patch per volume velocity at the microphone."""
    delay = np.einsum("dk,ck->dc", directions(), centre) / air.sound_speed
    turn = np.ascontiguousarray(np.pi / step_s / (TRANSFER_BINS - 1) * delay.T)
    spectrum = np.ascontiguousarray(velocity.T)
    return np.sqrt(2 * _power(spectrum.real, spectrum.imag, np.cos(turn), np.sin(turn)))


@njit(nogil=True, cache=True)
def _power(real, imag, cosine, sine):
    """Mean over directions of |Σ patches turnⁿ velocity_n|², (bins,), in a fixed order.

    The velocity, in parts, is (bins, patches), `cosine` and `sine` of a bin's turn (patches,
    directions): directions are innermost, so that it vectorises without reordering a sum.
    """
    bins, patches = real.shape
    count = cosine.shape[1]
    power = np.zeros(bins)
    a, b = np.ones((patches, count)), np.zeros((patches, count))
    across, along = np.empty(count), np.empty(count)
    for n in range(bins):
        across[:], along[:] = 0.0, 0.0
        for k in range(patches):
            x, y = real[n, k], imag[n, k]
            for d in range(count):
                cosine_part, sine_part = a[k, d], b[k, d]
                across[d] += cosine_part * x - sine_part * y
                along[d] += cosine_part * y + sine_part * x
                a[k, d] = cosine_part * cosine[k, d] - sine_part * sine[k, d]
                b[k, d] = cosine_part * sine[k, d] + sine_part * cosine[k, d]
        for d in range(count):
            power[n] += across[d] * across[d] + along[d] * along[d]
    return power / count
