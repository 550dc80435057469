"""Similar fingerprints: known distances, invariance, exact search, tolerances."""

import numpy as np
import pytest

from ajgdata.features import similarity
from ajgdata.features.similarity import (
    equal_groups,
    fingerprints,
    nearer_than_own,
    nearest_distances,
    similar_between,
    similar_pairs,
    tolerance,
)


def brute_force(prints, grasps, limit):
    difference = prints[:, None].astype(float) - prints[None]
    distance = np.sqrt(np.square(difference).sum(axis=2))
    count = len(prints)
    return [
        (a, b)
        for a in range(count)
        for b in range(a + 1, count)
        if grasps[a] != grasps[b] and distance[a, b] <= limit
    ]


def test_distance_is_the_rms_difference_of_levels():
    frequency_hz = np.linspace(100, 9_000, 128)
    flat = np.ones(128)
    changed = np.where(np.arange(128) % 2, 1.2, 0.8)  # the mean remains 1
    first, second = fingerprints(np.array([flat, changed]), frequency_hz, "magnitude")
    expected = np.log(1.3 / 0.9) / 2  # FLOOR is added to both
    assert np.linalg.norm(first - second) == pytest.approx(expected, rel=1e-5)


def test_gain_power_and_sound_outside_the_band_change_nothing():
    frequency_hz = np.linspace(0, 22_050, 1025)
    values = np.random.default_rng(0).uniform(1, 2, 1025)
    louder = 7 * values
    louder[(frequency_hz < 50) | (frequency_hz > 9_500)] = 0
    prints = fingerprints(np.array([values, louder]), frequency_hz, "magnitude")
    np.testing.assert_allclose(prints[0], prints[1], atol=1e-6)
    power = fingerprints(values[np.newaxis] ** 2, frequency_hz, "power")
    np.testing.assert_allclose(power[0], prints[0], atol=1e-6)
    assert prints.shape == (2, 439)


@pytest.mark.parametrize("seed", range(4))
def test_search_is_exact(seed, monkeypatch):
    monkeypatch.setattr(similarity, "_BLOCK", 17)
    random = np.random.default_rng(seed)
    centres = random.normal(size=(5, 12))
    prints = centres[random.integers(0, 5, 150)] + 0.1 * random.normal(size=(150, 12))
    monkeypatch.setattr(similarity, "_PROJECTED", 5)
    prints = prints.astype(np.float32)
    grasps = random.integers(0, 60, 150).astype(str).tolist()
    for limit in (0.3, 0.5):
        pairs = similar_pairs(prints, grasps, limit)
        expected = brute_force(prints, grasps, limit)
        assert list(zip(pairs.first, pairs.second, strict=True)) == expected
        assert pairs.complete
        assert expected
        between = similar_between(prints[:70], prints[70:], grasps[:70], grasps[70:], limit)
        across = [(a, b - 70) for a, b in expected if a < 70 <= b]
        assert list(zip(between.first, between.second, strict=True)) == across


def test_search_stops_after_a_bounded_number_of_pairs(monkeypatch):
    monkeypatch.setattr(similarity, "MOST_PAIRS", 50)
    monkeypatch.setattr(similarity, "_BLOCK", 64)
    pairs = similar_pairs(np.zeros((500, 4), np.float32), [str(n) for n in range(500)], 0.1)
    assert not pairs.complete
    assert 50 <= len(pairs.first) < 50 + 64


def test_equal_groups():
    prints = np.array([[1, 2], [3, 4], [1, 2], [5, 6], [3, 4]], np.float32)
    assert equal_groups(prints) == [[0, 2], [1, 4]]


def test_tolerance_follows_from_recordings_of_one_grasp():
    prints = np.array([[0, 0], [0.1, 0], [5, 0], [5, 0.1]], np.float32)
    assert tolerance(prints, ["a", "a", "b", "b"]) == pytest.approx(0.05)
    assert tolerance(10 * prints, ["a", "a", "b", "b"]) == similarity.LARGEST_OF_COPIES
    assert tolerance(0 * prints, ["a", "a", "b", "b"]) == similarity.FORMAT


def independent(classes, grasps, deviation, seed=0):
    """Return fingerprints of grasps whose distance in a class is about `deviation`, their names,
    and the classes, which differ by 1."""
    random = np.random.default_rng(seed)
    centres = random.normal(size=(classes, 400)) / np.sqrt(2 * 400)
    noise = random.normal(size=(classes, grasps, 400)) * deviation / np.sqrt(2 * 400)
    prints = (centres[:, np.newaxis] + noise).reshape(-1, 400).astype(np.float32)
    return prints, [str(n) for n in range(len(prints))]


@pytest.mark.parametrize(
    ("classes", "grasps"),
    [(1, 3), (1, 8), (2, 2), (2, 6), (5, 20), (10, 2), (20, 4), (80, 1), (40, 15)],
)
@pytest.mark.parametrize("deviation", [0.02, 0.08, 0.3])
def test_grasps_of_few_or_many_objects_are_not_similar(classes, grasps, deviation):
    prints, names = independent(classes, grasps, deviation)
    limit = tolerance(prints, names)
    assert not len(similar_pairs(prints, names, limit).first)


@pytest.mark.parametrize(("classes", "grasps"), [(1, 3), (2, 3), (5, 20), (20, 4), (80, 1)])
@pytest.mark.parametrize("deviation", [0.02, 0.08, 0.3])
def test_copies_are_similar_among_few_or_many_objects(classes, grasps, deviation):
    """A copy that lacks a sixth of the sound has sqrt(p / (2 (1 - p))) of the distance: a third."""
    prints, names = independent(classes, grasps, deviation)
    copied = max(1, len(prints) // 8)
    change = np.random.default_rng(1).normal(size=(copied, 400)) / np.sqrt(400)
    share = min(similarity.LARGEST_OF_COPIES, deviation) / 3.2
    copies = prints[:copied] + (share * change).astype(np.float32)
    both = np.concatenate([prints, copies])
    names = [*names, *(f"copy {n}" for n in range(copied))]
    pairs = similar_pairs(both, names, tolerance(both, names))
    assert pairs.first.tolist() == list(range(copied))
    assert pairs.second.tolist() == list(range(len(prints), len(both)))


def test_tolerance_is_half_of_the_distance_of_nearest_neighbours():
    corners = 0.06 * np.eye(20, dtype=np.float32)  # all at the distance .06 sqrt(2)
    expected = 0.5 * 0.06 * np.sqrt(2)
    grasps = [str(n) for n in range(20)]
    assert tolerance(corners, grasps) == pytest.approx(expected)
    corners[1] = corners[0]  # two copies, in two grasps or in one, do not decide
    assert tolerance(corners, grasps) == pytest.approx(expected)
    assert tolerance(corners, ["0", *grasps[:1], *grasps[2:]]) == pytest.approx(expected)
    assert tolerance(10 * corners, grasps) == similarity.LARGEST_OF_COPIES
    assert tolerance(corners[:2], grasps[:2]) == similarity.FORMAT  # nothing to compare with


def test_format_is_the_tolerance_if_each_recording_has_a_copy():
    prints, names = independent(5, 4, 0.05)
    copies = prints + np.float32(1e-3 / 20) * (-1.0) ** np.arange(400)  # at the distance .001
    both = np.concatenate([prints, copies]).astype(np.float32)
    both_names = [*names, *(f"copy {n}" for n in names)]
    assert tolerance(both, both_names) == similarity.FORMAT
    assert len(similar_pairs(both, both_names, similarity.FORMAT).first) == 20


def test_nearest_distances_are_exact(monkeypatch):
    monkeypatch.setattr(similarity, "_NEAREST_BLOCK", 7)
    random = np.random.default_rng(0)
    prints = random.normal(size=(60, 9)).astype(np.float32)
    grasps = random.integers(0, 20, 60)
    distance = np.linalg.norm(prints[:, None].astype(float) - prints[None], axis=2)
    distance[grasps[:, None] == grasps[None]] = np.inf
    rows = np.array([3, 59, 0, 12, 13, 14, 15, 16, 17])
    nearest = nearest_distances(prints, [str(g) for g in grasps], rows)
    np.testing.assert_allclose(nearest, distance.min(axis=1)[rows], rtol=1e-5)
    assert nearest_distances(prints, ["one"] * 60, rows[:2]).tolist() == [np.inf, np.inf]


@pytest.mark.parametrize(
    ("window", "band_hz", "bands"),
    [
        (2048, (0, 22_050), 439),  # 50 Hz to 9.5 kHz
        (2048, (9_000, 20_000), 511),
        (2048, (12_000, 20_000), 371),
        (128, (0, 22_050), 64),  # without the bin of an offset
        (128, (9_000, 20_000), 32),
    ],
)
def test_a_band_outside_the_compared_band_is_compared(window, band_hz, bands):
    frequency_hz = np.arange(window // 2 + 1) * 44_100 / window
    frequency_hz = frequency_hz[(frequency_hz >= band_hz[0]) & (frequency_hz <= band_hz[1])]
    spectra = np.random.default_rng(0).uniform(1, 2, (2, len(frequency_hz)))
    prints = fingerprints(spectra, frequency_hz, "magnitude")
    assert prints.shape == (2, bands)
    assert np.linalg.norm(prints[0] - prints[1]) > similarity.LARGEST_OF_COPIES


def test_noise_has_the_distance_of_the_formula():
    """Noise with a share p removed is nearer than independent noise by sqrt(p / (2 (1 - p)))."""
    random = np.random.default_rng(0)
    frames = random.rayleigh(size=(400, 512))
    other = random.rayleigh(size=(400, 512))
    frequency_hz = np.linspace(100, 9_000, 512)
    parts = np.array([frames.sum(axis=0), frames[80:].sum(axis=0), other.sum(axis=0)])
    prints = fingerprints(parts, frequency_hz, "magnitude")
    copy = np.linalg.norm(prints[1] - prints[0])
    independent = np.linalg.norm(prints[2] - prints[0])
    assert copy / independent == pytest.approx(np.sqrt(0.2 / (2 * 0.8)), rel=0.1)


def test_no_recordings():
    empty = np.zeros((0, 128), np.float32)
    assert not len(similar_pairs(empty, [], 0.1).first)
    pairs = similar_between(empty, empty, [], [], 0.1)
    assert not len(nearer_than_own(pairs, empty, empty, [], []).first)
    assert tolerance(empty, []) == similarity.FORMAT
