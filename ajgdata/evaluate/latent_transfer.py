"""From gripper to gripper: how well a classifier of one serves on another, in different spaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from sklearn.base import clone
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from ajgdata.evaluate.embedding_data import EmbeddingData, embedding_data, train_on
from ajgdata.models.baselines import raw_scaling
from ajgdata.store.features import Column, Shard
from ajgdata.types import Embedding, NotPossibleError

BASE = ""  #: in place of a session: the recordings of the base data set
#: Of the median of a reference: bins that are quieter hold nothing to divide by.
FLOOR = 1e-3
#: Of a thing there may be one calibration grasp: more neighbours than one would outvote it.
NEAREST = 1


@dataclass(frozen=True, eq=False)
class Draw:
    """Rows of a gripper: `calibration` in the order in which grasps are given to the classifier,
    one of each thing at a time, and `test`."""

    calibration: tuple[np.ndarray, ...]
    test: np.ndarray


def calibration_draws(
    thing: np.ndarray, grasp: np.ndarray, rows: np.ndarray, grasps: int, seed: int
) -> Iterator[Draw]:
    """Yield disjoint choices of test grasps, the others being there to calibrate with.

    `thing`, `grasp` (n,) are labels, `rows` those of one gripper; of each thing `grasps` are for
    calibration and as many as then are left of the rarest thing are tested on. There are as many
    draws as fit without testing a grasp twice; the order is drawn from `seed`. Raises ValueError
    where a thing has no grasp left to test on.
    """
    generator = np.random.default_rng(seed)
    orders = []
    for label in np.unique(thing[rows]):
        names = np.unique(grasp[rows][thing[rows] == label])
        if len(names) <= grasps:
            raise NotPossibleError(f"{label!r} has {len(names)} grasps, all needed to calibrate")
        orders.append([rows[grasp[rows] == name] for name in generator.permutation(names)])
    fewest = min(map(len, orders))
    tested = fewest - grasps
    for start in range(0, fewest - tested + 1, tested):
        turned = [order[start:] + order[:start] for order in orders]
        yield Draw(
            tuple(np.concatenate([order[tested + n] for order in turned]) for n in range(grasps)),
            np.concatenate([part for order in turned for part in order[:tested]]),
        )


def transfer_accuracy(
    space: np.ndarray, thing: np.ndarray, base: np.ndarray, draw: Draw, grasps: int
) -> float:
    """Return the accuracy on the test rows of `draw`, by the nearest of the rows `base` and of so
    many calibration grasps. `space` (n, d), `thing` (n,)."""
    known: Sequence[np.ndarray] = [base, *draw.calibration[:grasps]]
    rows = np.concatenate(known)
    model = KNeighborsClassifier(NEAREST).fit(space[rows], thing[rows])
    return float(np.mean(model.predict(space[draw.test]) == thing[draw.test]))


class BothGrippers(NamedTuple):
    """Things of two stores; their features over references (n, f); their session (n,), or BASE."""

    data: EmbeddingData
    ratio: np.ndarray
    session: np.ndarray

    @property
    def on_base(self) -> np.ndarray:
        """Return the rows of the base data set."""
        return np.flatnonzero(self.session == BASE)


def both_grippers(shard: Shard, base: Shard, settings: Embedding) -> BothGrippers:
    """Return the things of `shard`, each of whose sessions is one gripper, and then of `base`.

    Recordings of nothing are a session's reference; that of `base` is of the session with the same
    gripper and medium. Raises ValueError for a session without such recordings, for a base of
    several grippers, and for one whose gripper no session has.
    """
    some = first, second = embedding_data(shard, settings), embedding_data(base, settings)
    thinned = any(one.available for one in some)
    columns = {
        name: Column(np.concatenate([column.values, second.columns[name].values]))
        for name, column in first.columns.items()
        if name in second.columns
    }
    joined = EmbeddingData(
        feature=np.concatenate([first.feature, second.feature]),
        instance=np.concatenate([first.instance, second.instance]),
        grasp=np.concatenate([first.grasp, second.grasp]),
        group=np.concatenate([first.group, second.group]),
        columns=columns,
        available=sum(one.available or len(one.feature) for one in some) if thinned else 0,
    )
    reference = _references(shard, settings)
    session = first.column("session_id").astype(str)
    own = _same_gripper(shard, second)
    if missing := sorted({*session, own} - set(reference)):
        raise NotPossibleError(f"session {missing[0]!r} has no recording of nothing to refer to")
    ratio = [
        first.feature / np.array([reference[one] for one in session]),
        second.feature / reference[own],
    ]
    sessions = np.concatenate([session, np.full(len(second.feature), BASE)])
    return BothGrippers(joined, np.concatenate(ratio), sessions)


def _references(shard: Shard, settings: Embedding) -> dict[str, np.ndarray]:
    """Return the mean spectrum (f,) of nothing, of each session that has such recordings."""
    empty = shard.columns[settings.instance].values.astype(str) == ""
    session = shard.columns["session_id"].values
    found = {}
    for one in np.unique(session[empty]):
        mean = shard.feature[empty & (session == one)].mean(axis=0, dtype=np.float64)
        found[str(one)] = np.maximum(mean, FLOOR * np.median(mean))
    return found


def _same_gripper(shard: Shard, base: EmbeddingData) -> str:
    """Return the session whose gripper and medium are those of all of `base`."""
    makes = {*zip(base.column("gripper"), base.column("medium"), strict=True)}
    if len(makes) > 1:
        raise NotPossibleError(f"base has several grippers: {sorted(makes)}")
    columns = [shard.columns[name].values for name in ("gripper", "medium", "session_id")]
    same = sorted({str(s) for g, m, s in zip(*columns, strict=True) if (g, m) in makes})
    if not same:
        raise NotPossibleError(f"no session has the gripper of base, {makes.pop()}, to refer to")
    return same[0]


def transfer_spaces(
    both: BothGrippers, settings: Embedding, seed: int
) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Yield the points (n, d) of all recordings in each space, once for each initialisation.

    Encoders never see the sessions that are held out.
    """
    data, base = both.data, both.on_base
    yield "raw", [raw_scaling().fit(data.feature[base]).transform(data.feature)]
    own = np.empty(data.feature.shape)
    for one in np.unique(both.session):
        rows = both.session == one
        own[rows] = raw_scaling().fit_transform(data.feature[rows])
    yield "standardised", [own]
    yield "referenced", [raw_scaling().fit(both.ratio[base]).transform(both.ratio)]
    all_seen = np.flatnonzero(~np.isin(both.session, settings.held_out))
    for name, feature, rows, scaling in (
        ("pose_latent", data.feature, base, raw_scaling()),
        ("gripper_latent", data.feature, all_seen, raw_scaling()),
        ("standardised_latent", own, all_seen, make_pipeline(StandardScaler())),
        ("referenced_latent", both.ratio, all_seen, raw_scaling()),
    ):
        recordings = dataclasses.replace(data, feature=feature)
        points = []
        for init in range(settings.inits):
            (encoder,) = train_on(
                recordings, rows, settings, [settings.shown], (seed, init), clone(scaling)
            )
            points.append(encoder.encode(feature))
        yield name, points
