"""Recordings on several grippers -> how well what was learned on some serves on others."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ajgdata.pipeline.embed import Logged, logged_of, summary, train_on, write_document
from ajgdata.pipeline.embed_measures import Run, probe_rows
from ajgdata.store.features import Column, Shard, read_store
from ajgdata.store.files import json_bytes, write_bytes
from ajgdata.types import Embedding, Kind

CALIBRATION = (0, 1, 2, 4)
PROBE_FOLDS = 5
BASE = ""  #: in place of a session: the recordings of the base data set
#: Of the median of a reference: bins that are quieter hold nothing to divide by.
FLOOR = 1e-3


def transfer_task(
    store: Path,
    base: Path,
    *,
    settings: Embedding,
    kinds: Mapping[str, Kind],
    seed: int,
    output: Path,
    cost: Path,
) -> None:
    """Write the accuracy of classifiers of the recordings `base` on the grippers of `store` that
    are held out, in each space and with each number of calibration grasps.

    A session of `store` is one gripper. Recordings of nothing are its reference; that of `base` is
    of the session with the same gripper and medium.
    """
    shard, wall, cpu = read_store(store), time.perf_counter(), time.process_time()
    try:
        content = _transfer(shard, read_store(base), settings, kinds, seed)
    except ValueError as error:
        content = {"skipped": str(error)}
    spent = {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}
    write_document(output, settings, {**shard.attrs, "seed": seed}, content)
    write_bytes(cost, json_bytes(spent))


def _transfer(
    shard: Shard, base: Shard, settings: Embedding, kinds: Mapping[str, Kind], seed: int
) -> dict[str, Any]:
    both = _together(shard, base, settings)
    if unknown := sorted(set(settings.held_out) - set(both.session)):
        raise ValueError(f"held_out: there is no session {unknown[0]!r}")
    spaces = dict(_spaces(both, settings, seed))
    return {
        "base": settings.base,
        "training_grippers": sorted(set(both.session) - {BASE, *settings.held_out}),
        "held_out_grippers": settings.held_out,
        "calibration": CALIBRATION,
        "dimension": settings.shown,
        "target": settings.instance,
        "chance": 1 / len(np.unique(both.logged.instance)),
        **_accuracies(both, spaces, settings, seed),
        "probes": list(_probes(both, spaces, settings, kinds, seed)),
    }


class _Both(NamedTuple):
    """Things of both stores; their features divided by references; their session, or BASE."""

    logged: Logged
    ratio: np.ndarray
    session: np.ndarray

    @property
    def on_base(self) -> np.ndarray:
        return np.flatnonzero(self.session == BASE)


def _together(shard: Shard, base: Shard, settings: Embedding) -> _Both:
    first, second = logged_of(shard, settings), logged_of(base, settings)
    columns = {
        name: Column(np.concatenate([column.values, second.columns[name].values]))
        for name, column in first.columns.items()
        if name in second.columns
    }
    joined = Logged(
        feature=np.concatenate([first.feature, second.feature]),
        instance=np.concatenate([first.instance, second.instance]),
        grasp=np.concatenate([first.grasp, second.grasp]),
        group=np.concatenate([first.group, second.group]),
        columns=columns,
    )
    reference = _references(shard, settings)
    session = first.column("session_id").astype(str)
    own = _same_gripper(shard, second)
    if missing := sorted({*session, own} - set(reference)):
        raise ValueError(f"session {missing[0]!r} has no recording of nothing to refer to")
    ratio = [
        first.feature / np.array([reference[one] for one in session]),
        second.feature / reference[own],
    ]
    sessions = np.concatenate([session, np.full(len(second.feature), BASE)])
    return _Both(joined, np.concatenate(ratio), sessions)


def _references(shard: Shard, settings: Embedding) -> dict[str, np.ndarray]:
    """Mean spectrum (n_features,) of nothing, of each session that has such recordings."""
    empty = shard.columns[settings.instance].values.astype(str) == ""
    session = shard.columns["session_id"].values
    found = {}
    for one in np.unique(session[empty]):
        mean = shard.feature[empty & (session == one)].mean(axis=0, dtype=np.float64)
        found[str(one)] = np.maximum(mean, FLOOR * np.median(mean))
    return found


def _same_gripper(shard: Shard, base: Logged) -> str:
    """The session whose gripper and medium are those of all of `base`."""
    makes = {*zip(base.column("gripper"), base.column("medium"), strict=True)}
    if len(makes) > 1:
        raise ValueError(f"base has several grippers: {sorted(makes)}")
    columns = [shard.columns[name].values for name in ("gripper", "medium", "session_id")]
    same = sorted({str(s) for g, m, s in zip(*columns, strict=True) if (g, m) in makes})
    if not same:
        raise ValueError(f"no session has the gripper of base, {makes.pop()}, to refer to")
    return same[0]


def _spaces(both: _Both, settings: Embedding, seed: int) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Points of all recordings in each space, once for each initialisation that it has."""
    from sklearn.base import clone
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    from ajgdata.embed.encoder import raw_scaling

    logged, base = both.logged, both.on_base
    yield "raw", [raw_scaling().fit(logged.feature[base]).transform(logged.feature)]
    own = np.empty(logged.feature.shape)
    for one in np.unique(both.session):
        rows = both.session == one
        own[rows] = raw_scaling().fit_transform(logged.feature[rows])
    yield "standardised", [own]
    yield "referenced", [raw_scaling().fit(both.ratio[base]).transform(both.ratio)]
    all_seen = np.flatnonzero(~np.isin(both.session, settings.held_out))
    for name, feature, rows, scaling in (
        ("pose_latent", logged.feature, base, raw_scaling()),
        ("gripper_latent", logged.feature, all_seen, raw_scaling()),
        ("standardised_latent", own, all_seen, make_pipeline(StandardScaler())),
        ("referenced_latent", both.ratio, all_seen, raw_scaling()),
    ):
        recordings = dataclasses.replace(logged, feature=feature)
        points = []
        for init in range(settings.inits):
            (encoder,) = train_on(
                recordings, rows, settings, [settings.shown], (seed, init), clone(scaling)
            )
            points.append(encoder.encode(feature))
        yield name, points


def _accuracies(
    both: _Both, spaces: Mapping[str, list[np.ndarray]], settings: Embedding, seed: int
) -> dict[str, Any]:
    """Of each held-out gripper: what a classifier brings along, and one of its own is worth."""
    from ajgdata.evaluate.latent_transfer import calibration_draws, transfer_accuracy

    thing, nothing = both.logged.instance, np.zeros(0, int)
    rows, within = [], []
    for gripper in settings.held_out:
        of_gripper = np.flatnonzero(both.session == gripper)
        most = max(CALIBRATION)
        draws = list(calibration_draws(thing, both.logged.grasp, of_gripper, most, seed))
        for name, points in spaces.items():
            runs = [(z, draw) for z in points for draw in draws]
            for n in CALIBRATION:
                scores = [transfer_accuracy(z, thing, both.on_base, draw, n) for z, draw in runs]
                row = {"space": name, "gripper": gripper, "calibration": n}
                rows.append({**row, **summary(scores)})
            scores = [transfer_accuracy(z, thing, nothing, draw, most) for z, draw in runs]
            within.append({"space": name, "gripper": gripper, **summary(scores)})
    return {"rows": rows, "within": within}


def _probes(
    both: _Both,
    spaces: Mapping[str, list[np.ndarray]],
    settings: Embedding,
    kinds: Mapping[str, Kind],
    seed: int,
) -> Iterator[dict[str, Any]]:
    """Which thing and which gripper it was, read of the held-out grippers: no encoder saw them."""
    from ajgdata.evaluate.splits import grouped_folds

    new = np.flatnonzero(np.isin(both.session, settings.held_out))
    instance, grasp = both.logged.instance[new], both.logged.grasp[new]
    folds = grouped_folds(instance, grasp, "classification", PROBE_FOLDS, seed)
    for name, points in spaces.items():
        runs: list[Run] = [(z, new[a], new[b]) for z in points for a, b in folds]
        for row in probe_rows(both.logged, runs, settings, kinds, unseen=False):
            yield {"space": name, "split": "grouped", **row}
