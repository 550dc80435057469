"""Gain of sound from outside that enters through the membrane, by reciprocity.

The solver plays a volume velocity Q at the microphone, which moves the membrane at x outwards with
the velocity v(x). By reciprocity, a pressure P(x) on the outside of the membrane gives the pressure
p = ∫ P v/Q dS at the microphone. In a diffuse field, sound comes from all directions n, each with
the share w_n of the power. The mean is then

    <p²> = 2 <P²> Σ w_n |∫ v/Q exp(iω n·x/c) dS|²

(Jacobsen 1979; the sum is the correlation sin(kr)/kr of Cook et al. 1955). The factor 2 is there
because a gripper stands on a table: the mean square at a wall is twice that in the room (Waterhouse
1955). The space between membrane and table is not modelled: it has no shadow and no resonances.
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
#: Side of the patches of membrane that move together: a tenth of a wavelength at 3 kHz. The error
#: at 10 kHz is 0.4 dB.
PATCH_M = 12e-3
#: Directions of the sound, equally distributed over the sphere.
DIRECTIONS = 32
#: Last samples, half a millisecond, whose mean is the final value of a response.
SETTLED = 22
#: Number of equally spaced frequencies of the gain, from 0 to half the sample rate.
TRANSFER_BINS = 513


class MembranePatches(NamedTuple):
    """Patches of the membrane, for W walls and P patches.

    Each wall has a `cell` (flat index, (W,)), a `patch` (W,) and an `area` (m², (W,)). Each patch
    has a `centre` (P, 3) in m (x, y, z), and a `motion` (P, 3): mass, resistance and stiffness per
    area (kg/m², Pa s/m, N/m³).
    """

    cell: NDArray
    patch: NDArray
    area: Real
    centre: Real
    motion: Real


def membrane_patches(walls: WallList, cells: Cells) -> MembranePatches:
    """Return walls in patches: the walls of a patch are in one cube of the side PATCH_M, and have
    equal mass, resistance and stiffness."""
    z, y, x = np.unravel_index(walls.cell, cells.shape)
    position = np.column_stack([cells.x[x], cells.y[y], cells.z[z]])
    motion = np.column_stack([walls.mass, walls.resistance, walls.stiffness])
    key = np.column_stack([np.floor(position / PATCH_M), motion])
    groups, patch = np.unique(key, axis=0, return_inverse=True)
    patch = patch.reshape(-1)
    total = np.bincount(patch, walls.area, len(groups))
    centre = np.column_stack(
        [np.bincount(patch, walls.area * axis, len(groups)) / total for axis in position.T]
    )
    return MembranePatches(walls.cell.astype(np.uint64), patch, walls.area, centre, groups[:, 3:])


def patch_velocity(push: Real, motion: Real, step_s: float) -> NDArray[np.complexfloating]:
    """Return the volume velocity (patches, TRANSFER_BINS) that `push` (patches, n) causes.

    `push` is the pressure times the area (N), sampled every `step_s`. With the spectrum P of
    `push`, the volume velocity of a patch is iω P / (k - ω²m + iωr). `push` remains at its final
    value and has no spectrum, so its differences are transformed and divided by those of a step.
    """
    length = 2 * (TRANSFER_BINS - 1)
    settled = push[:, -SETTLED:].mean(axis=1)
    folded = np.zeros((len(push), length))
    for begin in range(0, push.shape[1], length):
        block = push[:, begin : begin + length]
        folded[:, : block.shape[1]] += block
    # Around the circle, the signal ends with a step to 0: it becomes a step to the final value.
    change = folded - np.roll(folded, 1, axis=1)
    change[:, push.shape[1] % length] += settled
    spectrum = np.fft.rfft(change, axis=1)
    iw = 1j * np.pi / step_s * np.linspace(0, 1, TRANSFER_BINS)
    iw[0] = iw[1]  # a membrane without stiffness has no finite response at 0 Hz
    surfaces, surface = np.unique(motion, axis=0, return_inverse=True)
    mass, resistance, stiffness = surfaces.T[:, :, None]
    rate = iw / (-np.expm1(-iw * step_s) * (stiffness + iw * resistance + iw**2 * mass))
    spectrum *= rate[surface.reshape(-1)]
    return np.asarray(spectrum)


def diffuse_gain(
    velocity: NDArray[np.complexfloating], centre: Real, air: Air, step_s: float
) -> Real:
    """Return the rms pressure at the microphone per rms pressure in the room, (TRANSFER_BINS,).

    `velocity` (patches, TRANSFER_BINS) is the volume velocity of each patch per volume velocity at
    the microphone. `centre` (patches, 3) is in m, and samples of the spectra are every `step_s`.
    """
    delay = np.einsum("dk,ck->dc", directions(), centre) / air.sound_speed
    angle = np.ascontiguousarray(np.pi / step_s / (TRANSFER_BINS - 1) * delay.T)
    spectrum = np.ascontiguousarray(velocity.T)
    return np.sqrt(2 * _power(spectrum.real, spectrum.imag, np.cos(angle), np.sin(angle)))


@cache
def directions(count: int = DIRECTIONS) -> Real:
    """Return unit vectors (count, 3), equally distributed over the sphere: a Fibonacci lattice."""
    angle = np.arange(count) * np.pi * (3 - np.sqrt(5))
    height = 1 - (2 * np.arange(count) + 1) / count
    radius = np.sqrt(1 - height**2)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])


@njit(nogil=True, cache=True)
def _power(real, imag, cosine, sine):
    """Return the mean over directions of |Σ velocity exp(i n angle)|² over patches, (bins,).

    `real` and `imag` (bins, patches) are the parts of the velocity, `cosine` and `sine` (patches,
    directions) those of exp(i angle), the rotation from bin to bin. The loop over directions is the
    innermost one, so that it vectorises without a change of the order of any sum.
    """
    bins, patches = real.shape
    count = cosine.shape[1]
    power = np.zeros(bins)
    rotation_real = np.ones((patches, count))
    rotation_imag = np.zeros((patches, count))
    sum_real = np.empty(count)
    sum_imag = np.empty(count)
    for n in range(bins):
        sum_real[:] = 0.0
        sum_imag[:] = 0.0
        for k in range(patches):
            x = real[n, k]
            y = imag[n, k]
            for d in range(count):
                a = rotation_real[k, d]
                b = rotation_imag[k, d]
                sum_real[d] += a * x - b * y
                sum_imag[d] += a * y + b * x
                rotation_real[k, d] = a * cosine[k, d] - b * sine[k, d]
                rotation_imag[k, d] = a * sine[k, d] + b * cosine[k, d]
        for d in range(count):
            power[n] += sum_real[d] * sum_real[d] + sum_imag[d] * sum_imag[d]
    return power / count
