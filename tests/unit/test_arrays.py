"""The public functions on arrays: effects that are planted, so that each score is known."""

import numpy as np
import pytest
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.neighbors import KNeighborsClassifier

import ajgdata

CLASSES = 4
SESSIONS = 3
PLACEMENTS = 3
GRASPS = 4
SAMPLES = 2
BINS = 30
#: Independent units; the standard error of a score at the chance level of 25 % of 36 is 7 %.
ALL_PLACEMENTS = CLASSES * SESSIONS * PLACEMENTS
CHANCE = 1 / CLASSES
TOLERANCE = 4 * np.sqrt(CHANCE * (1 - CHANCE) / ALL_PLACEMENTS)

SHAPE = (CLASSES, SESSIONS, PLACEMENTS, GRASPS, SAMPLES)
OBJECT, SESSION, *_ = (axis.ravel() for axis in np.indices(SHAPE))
ROW = np.arange(OBJECT.size)
GRASP = ROW // SAMPLES
PLACEMENT = np.array([f"{s}/{n:02}" for s, n in zip(SESSION, GRASP // GRASPS, strict=True)])
LABEL = np.array(["ball", "bar", "cube", "ring"])[OBJECT]


def planted(effect: np.ndarray) -> np.ndarray:
    """Return features (n, BINS) that show the unit (n,) of each row, and nothing else but noise."""
    random = np.random.default_rng(0)
    unit = np.unique(effect, return_inverse=True)[1]
    patterns = random.normal(size=(unit.max() + 1, BINS))
    return np.exp(patterns[unit] + 0.05 * random.normal(size=(len(unit), BINS)))


#: Features of four worlds: what is recognised is the object, its effect in one session, one of its
#: placements, and one of its grasps.
WORLDS = {
    "object": planted(LABEL),
    "session": planted(np.char.add(LABEL, SESSION.astype(str))),
    "placement": planted(PLACEMENT),
    "grasp": planted(GRASP),
}


def folds_of(split: str) -> list[tuple[np.ndarray, np.ndarray]]:
    kind = "classification"
    match split:
        case "random":
            return ajgdata.random_folds(LABEL, kind)
        case "grasp":
            return ajgdata.grouped_folds(LABEL, GRASP, kind)
        case "placement":
            return ajgdata.placement_folds(LABEL, PLACEMENT, kind)
        case _:
            return ajgdata.grouped_folds(LABEL, SESSION, kind, folds=SESSIONS)


def score(features: np.ndarray, split: str, labels: np.ndarray = LABEL) -> ajgdata.Estimate:
    """Return the accuracy of the nearest neighbour, with an interval over placements."""
    result = ajgdata.cross_validate(
        features,
        labels,
        None if split == "random" else GRASP,
        kind="classification",
        model=KNeighborsClassifier(1),
        folds=folds_of(split),
    )
    return ajgdata.estimate_score(result, PLACEMENT)


#: Of two samples of a grasp, random folds separate four fifths; the others are guessed.
SEPARATED = 4 / 5 + CHANCE / 5


SPLITS = ("random", "grasp", "placement", "session")


@pytest.mark.parametrize(
    ("world", "expected"),
    [
        ("object", (1, 1, 1, 1)),
        ("session", (1, 1, 1, CHANCE)),
        ("placement", (1, 1, CHANCE, CHANCE)),
        ("grasp", (SEPARATED, CHANCE, CHANCE, CHANCE)),
    ],
)
def test_a_split_recognises_what_it_does_not_hold_out(world, expected):
    for split, value in zip(SPLITS, expected, strict=True):
        accuracy = score(WORLDS[world], split)
        assert abs(accuracy.value - value) < (0.05 if value == 1 else TOLERANCE), split
        assert accuracy.is_better_than_chance == (value > CHANCE), split


def test_the_placebo_of_a_split_shows_whether_a_score_is_due_to_the_object():
    """The placebo shows placements only; it counts in folds by grasp, not by placement."""
    placebo = WORLDS["placement"]
    by_grasp = ajgdata.placebo_test(score(WORLDS["object"], "grasp"), score(placebo, "grasp"))
    assert by_grasp.placebo.value > 0.95
    assert not by_grasp.is_better
    by_placement = ajgdata.placebo_test(
        score(WORLDS["object"], "placement"), score(placebo, "placement")
    )
    assert abs(by_placement.placebo.value - CHANCE) < TOLERANCE
    assert by_placement.is_better
    assert by_placement.gap.low > 0.5


def test_a_placebo_without_any_effect_is_at_chance():
    nothing = np.random.default_rng(1).normal(size=(len(LABEL), BINS))
    placebo = score(nothing, "grasp")
    assert abs(placebo.value - CHANCE) < 4 * np.sqrt(CHANCE * (1 - CHANCE) / len(LABEL))
    assert placebo.chance == CHANCE


@pytest.mark.parametrize(
    ("world", "published", "verdict"),
    [
        ("object", 0.99, "agrees"),
        ("object", 0.8, "better"),
        ("session", 0.9, "worse"),
        ("session", CHANCE, "inconclusive"),  # 36 placements: the interval is wide
    ],
)
def test_each_verdict_is_reached(world, published, verdict):
    interval = ajgdata.wilson_interval(published, 400)
    accuracy = score(WORLDS[world], "session")
    assert ajgdata.compare_with_published(accuracy, published, interval) == verdict


class Repeat(RegressorMixin, BaseEstimator):
    """A model that predicts its only feature."""

    def fit(self, x, y):
        self.fitted_ = True
        return self

    def predict(self, x):
        return x[:, 0]


def repeated(y_true: np.ndarray, y_pred: np.ndarray, **options):
    """Return a cross-validation with the predictions `y_pred` (n,), each of its own grasp."""
    options = {"kind": "regression", "model": Repeat(), **options}
    return ajgdata.cross_validate(y_pred[:, None], y_true, np.arange(len(y_true)), **options)


def test_the_estimate_of_an_error_is_the_mean_over_folds_with_its_interval():
    """Errors of 3 and 4 in turn; two folds with as many of both: the RMSE is sqrt(12.5)."""
    y_true = np.linspace(0.0, 1.0, 40)
    halves = [np.arange(n, 40, 2) for n in range(2)]
    errors = np.tile([3.0, 3.0, 4.0, 4.0], 10)
    result = repeated(y_true, y_true + errors, folds=[tuple(halves), tuple(halves[::-1])])
    rmse = ajgdata.estimate_score(result, np.arange(40))
    assert rmse.value == pytest.approx(np.sqrt(12.5))
    assert rmse.perfect == 0.0
    assert rmse.chance == pytest.approx(result.scores.chance["rmse"])
    # Squares of 9 and 16: the mean of 40 has a standard error of 3.5 / sqrt(40), its root that
    # over 2 sqrt(12.5).
    reach = 1.96 * 3.5 / np.sqrt(40) / (2 * np.sqrt(12.5))
    assert rmse.interval == pytest.approx((rmse.value - reach, rmse.value + reach), abs=0.03)


def test_a_period_counts_in_the_interval():
    """Errors of about one degree, for half of the targets across the end of the circle."""
    y_true = np.tile([0.0, 90.0], 20)
    noise = np.random.default_rng(0).normal(size=40)
    result = repeated(y_true, (y_true + noise) % 180, folds=2, period=180.0)
    rmse = ajgdata.estimate_score(result, np.arange(40))
    assert rmse.interval.low < rmse.value < rmse.interval.high < 2.0


def test_grasps_must_be_as_many_as_recordings():
    result = ajgdata.cross_validate(
        WORLDS["object"], LABEL, GRASP, kind="classification", model="knn_plain"
    )
    with pytest.raises(ValueError, match="3 grasps but 288 recordings"):
        ajgdata.estimate_score(result, [1, 2, 3])


@pytest.mark.parametrize(
    ("folds", "message"),
    [
        ([(ROW[4:], ROW[:4])], "must hold each of the 288 rows once"),
        ([(ROW[1:], ROW[:1]), (ROW[:1], ROW[1:])], "fold 0 trains and tests on group 0"),
    ],
)
def test_folds_that_leak_or_leave_rows_are_refused(folds, message):
    with pytest.raises(ValueError, match=message):
        ajgdata.cross_validate(
            WORLDS["object"], LABEL, GRASP, kind="classification", model="knn_plain", folds=folds
        )


def test_spectra_of_a_tone_by_default_settings():
    tone = np.sin(2 * np.pi * 3000 * np.arange(4410) / 44_100)
    values = ajgdata.spectrum(tone, 44_100)
    same = ajgdata.spectrum(tone, 44_100, ajgdata.FeatureSettings())
    np.testing.assert_array_equal(values, same)
    loudest_hz = ajgdata.frequencies_hz(44_100)[values.argmax()]
    assert abs(loudest_hz - 3000) <= 44_100 / 2048 / 2
