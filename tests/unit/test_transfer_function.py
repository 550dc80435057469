"""Deconvolution against responses that are known, errors against those that noise makes."""

import numpy as np
import pytest
from scipy.signal import fftconvolve

from ajgdata.acquire.excitation import excitation_samples
from ajgdata.features.maker import feature_maker
from ajgdata.features.spectrum import frequencies_hz
from ajgdata.features.transfer_function import REGULARISATION, Deconvolution
from ajgdata.types import (
    ChirpTrain,
    FeatureSettings,
    LinearSweep,
    LogSweep,
    MaximumLengthSequence,
    Multitone,
)

RATE, TAPS = 44_100, 512
TRANSFER = FeatureSettings(kind="transfer_function", window=TAPS, hop=TAPS, normalisation="none")


def response(seed: int = 0, samples: int = 300) -> np.ndarray:
    """Noise that dies away within `samples`."""
    noise = np.random.default_rng(seed).standard_normal(samples)
    return noise * np.exp(-np.arange(samples) / 40) * np.hanning(2 * samples)[samples:]


def heard(played: np.ndarray, h: np.ndarray) -> np.ndarray:
    """What is recorded while the sound plays: its end is not heard to die away."""
    return fftconvolve(played, h)[: len(played)]


def taken_apart(solver: Deconvolution, estimate: np.ndarray, h: np.ndarray) -> np.ndarray:
    true = np.zeros(solver.taps)
    true[solver.lead : solver.lead + len(h)] = h
    return estimate - true


@pytest.mark.parametrize("length_s", [0.1, 0.5])
def test_a_sequence_gives_the_response_back_to_its_regularisation(length_s):
    """White: every eigenvalue of XᵀX is Σx² to 1/sqrt(n) or so, λ 1e-4 of it: that is the bias."""
    played = excitation_samples(MaximumLengthSequence(length_s=length_s), RATE)
    solver, h = Deconvolution(played, TAPS), response()
    error = taken_apart(solver, solver.impulse_response(heard(played, h)), h)
    assert np.linalg.norm(error) < 2 * REGULARISATION * np.linalg.norm(h)
    assert np.linalg.norm(error) > 0.5 * REGULARISATION * np.linalg.norm(h)


@pytest.mark.parametrize("kind", [LogSweep, LinearSweep, Multitone, ChirpTrain])
def test_every_kind_gives_the_transfer_function_back_within_its_band(kind):
    """Shrunk by λ/(|X(f)|² + λ); least energy per hertz has the logarithmic sweep at the top, 8 dB
    below its mean, and at the edges of a band of 20 Hz to 20 kHz all have less."""
    played = excitation_samples(kind(length_s=1.0, silence_s=0.02), RATE)
    h = response()
    found = Deconvolution(played, TAPS).transfer_function(heard(played, h))
    frequency = np.fft.rfftfreq(TAPS, 1 / RATE)
    inside = (frequency > 200) & (frequency < 16_000)
    true = np.fft.rfft(h, TAPS)
    error = np.linalg.norm((found - true)[inside]) / np.linalg.norm(true[inside])
    assert error < 20 * REGULARISATION
    outside = frequency > 21_500
    assert np.abs(found[outside]).max() < 0.2 * np.abs(true).max()  # not played: not made up


@pytest.mark.parametrize("late", [-40, 0, 100])
def test_a_latency_moves_the_response_and_leaves_the_feature(late):
    played, h = excitation_samples(MaximumLengthSequence(length_s=0.25), RATE), response()
    recording = np.roll(heard(played, h), late)
    recording[: max(late, 0)] = 0
    if late < 0:
        recording[late:] = heard(np.concatenate([played, np.zeros(40)]), h)[late:]
    solver = Deconvolution(played, TAPS)
    error = taken_apart(solver, np.roll(solver.impulse_response(recording), -late), h)
    assert np.linalg.norm(error) < 2e-3 * np.linalg.norm(h)
    feature = solver.feature(recording, RATE, TRANSFER)
    assert np.abs(feature - np.abs(np.fft.rfft(h, TAPS))).max() < 5e-3 * feature.max()


def test_a_feature_has_the_axis_of_the_stft_and_its_normalisation():
    settings = FeatureSettings(kind="transfer_function", band_hz=(100, 12_000))
    played = excitation_samples(LinearSweep(length_s=0.25), RATE)
    recording = heard(played, response())
    feature = feature_maker(settings, RATE, played)(recording)
    assert feature.shape == frequencies_hz(RATE, settings).shape and feature.dtype == np.float32
    assert feature.sum() == pytest.approx(1, abs=1e-5)
    louder = feature_maker(settings, RATE, played)(3 * recording)
    assert np.allclose(louder, feature, rtol=1e-5)
    power = settings.model_copy(update={"quantity": "power", "normalisation": "none"})
    size = settings.model_copy(update={"normalisation": "none"})
    of_power, of_size = (feature_maker(s, RATE, played)(recording) for s in (power, size))
    assert np.allclose(of_power, of_size**2, rtol=1e-5)
