"""The virtual gripper block by block: the same sound as the virtual source."""

import numpy as np
import pytest

from ajgdata import gripper
from ajgdata.acquire.plant import LEAD, Plant, noise_floor, scene_noise, scene_response
from ajgdata.gripper import ImpulseResponse, SignalChain, excitation_sweep

SWEEP = excitation_sweep()
QUIET = SignalChain(noise_db_spl=None)
RNG = np.random.default_rng(0)
#: Rings for 20 ms, begins before its latency, and settles elsewhere than at zero.
RINGING = ImpulseResponse(
    samples=1e7 * RNG.standard_normal(900) * np.exp(-np.arange(900) / 200),
    static=1e5,
    sample_rate_hz=44_100,
    latency_samples=28,
    provenance={},
    membrane_kg_m2=0.3,
)
STEP = 2.0**-23


def through(plant: Plant, sound: np.ndarray, blocks=(1_024,)) -> np.ndarray:
    parts, at, turn = [], 0, 0
    while at < len(sound):
        block = sound[at : at + blocks[turn % len(blocks)]].astype(np.float32)
        parts.append(plant.process(block))
        at, turn = at + len(block), turn + 1
    return np.concatenate(parts, axis=1)


def test_the_card_gives_what_the_virtual_source_records():
    """Both round to 24 bits; the card plays float32, whose error of 2^-25 a sample of the sweep is
    amplified as all of it: by less than the response's sum of magnitudes. Within its latency from
    the end, `record` no longer knows how the speaker rings on."""
    response = scene_response(RINGING, QUIET)
    sound = np.r_[SWEEP, np.zeros(LEAD)]
    known = len(SWEEP) - RINGING.latency_samples
    heard = through(Plant(response), sound)[0, LEAD : LEAD + known]
    expected = gripper.record(RINGING, SWEEP, QUIET).samples[:known]
    assert np.abs(expected).max() > 0.05
    bound = STEP + 2**-25 * np.abs(response).sum()
    np.testing.assert_allclose(heard, expected, atol=bound, rtol=0)


def test_blocks_of_any_size_give_the_same():
    response = scene_response(RINGING, QUIET)
    whole = through(Plant(response), SWEEP, (len(SWEEP),))
    cut = through(Plant(response), SWEEP, (64, 1_024, 1, 4_096))
    np.testing.assert_allclose(cut[0], whole[0], atol=STEP, rtol=0)
    np.testing.assert_array_equal(cut[1], whole[1])
    np.testing.assert_array_equal(whole[1, LEAD:], SWEEP[:-LEAD].astype(np.float32))


def test_a_new_response_is_heard_from_the_next_block_on_and_the_old_one_dies_away():
    plant = Plant(np.array([0.0, 0.0, 0.5]))
    first = plant.process(np.ones(4, dtype=np.float32))[0]
    plant.set_response(np.array([0.25]))
    second = plant.process(np.ones(4, dtype=np.float32))[0]
    assert first.tolist() == [0, 0, 0.5, 0.5] and second.tolist() == [0.75, 0.75, 0.25, 0.25]


def test_noise_has_the_level_of_the_chain_and_what_is_too_loud_is_clipped():
    chain = SignalChain()
    heard = Plant(np.array([1.0]), noise_floor(chain)).process(np.zeros(44_100, np.float32))[0]
    silent = ImpulseResponse(np.zeros(1), 0.0, 44_100, 0, {}, membrane_kg_m2=0.3)
    expected = gripper.record(silent, 0 * SWEEP, chain, seed=1).samples
    # The deviation of n values has an error of 1/sqrt(2 n): five times for each of the two.
    assert heard.std() == pytest.approx(expected.std(), rel=10 / np.sqrt(2 * 44_100))
    assert noise_floor(QUIET) == 0
    loud = Plant(np.array([2.0])).process(np.array([1, -1], dtype=np.float32))[0]
    assert loud.tolist() == [1 - STEP, -1]


def test_sound_from_outside_goes_on_over_blocks_with_the_spectrum_of_a_recording():
    """Power in four bands against `gripper.record`, over 20 s: of B T degrees of freedom, a
    deviation of 1/sqrt(B T) each; five times that, and the filter's edges are 20 Hz wide."""
    chain = SignalChain(noise_db_spl=None, external_noise_dba=60, outside="mass_law")
    silent = ImpulseResponse(np.zeros(1), 0.0, 44_100, 0, {}, membrane_kg_m2=0.3)
    plant = Plant(np.zeros(1), seed=3)
    plant.set_response(np.zeros(1), scene_noise(silent, chain))
    assert scene_noise(silent, QUIET) is None
    blocks = np.diff(np.linspace(0, 20 * 44_100, 900).astype(int))
    live = np.concatenate([plant.process(np.zeros(n, np.float32))[0] for n in blocks])
    takes = np.concatenate(
        [gripper.record(silent, 0 * SWEEP, chain, seed=seed).samples for seed in range(20)]
    )
    spectra = [np.abs(np.fft.rfft(one)) ** 2 for one in (live, takes)]
    for low, high in ((100, 200), (200, 1_000), (1_000, 4_000), (4_000, 16_000)):
        mine, theirs = (one[20 * low : 20 * high].sum() for one in spectra)
        assert mine / theirs == pytest.approx(1, abs=5 * 2 / np.sqrt(20 * (high - low)))


def test_what_is_no_response_is_refused():
    with pytest.raises(ValueError, match="silent"):
        scene_response(RINGING, SignalChain(level_db_spl=None))
    for wrong in (np.zeros(0), np.zeros((2, 2)), np.array([np.nan])):
        with pytest.raises(ValueError, match="finite"):
            Plant(np.ones(1)).set_response(wrong)
