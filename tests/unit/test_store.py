"""The feature store: equal values through every reader, equal bytes for equal content."""

import gc
import os
import resource
import time
from dataclasses import replace

import h5netcdf
import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import ajgdata
from ajgdata.store.features import (
    CONVENTIONS,
    Column,
    Shard,
    concatenate,
    read_store,
    text_column,
    write_store,
)
from ajgdata.store.hdf5 import HEAPS, SEAL, check_texts, writing
from ajgdata.store.latents import Latents, read_latents, write_latents
from ajgdata.store.open_xarray import open_store
from ajgdata.types import DataError

FEATURE_ATTRS = {"long_name": "spectrum", "units": "1"}
NOTES = ["", "größe", "日本語", "a,b 'c'", "  "]


def sample(rows: int = 5, start: int = 0, **columns: Column) -> Shard:
    generator = np.random.default_rng(start)
    feature = generator.random((rows, 17), np.float32)
    feature[0, :3] = 0, 1e-45, 3e38  # smallest subnormal and nearly the largest
    return Shard(
        feature,
        np.arange(17) * 31.25,
        {
            "recording": text_column([f"s1/{start + n:03d}" for n in range(rows)]),
            "sha256": text_column([f"{start + n:064x}" for n in range(rows)]),
            "edge_mm": Column(np.r_[np.nan, np.arange(1.0, rows)], {"units": "mm"}),
            "note": text_column((NOTES * rows)[:rows]),
            "sample": Column(np.arange(rows, dtype=np.int32)),
            **columns,
        },
        {"data_set": "d", "source": "recorded", "settings": "{}"},
    )


def assert_same(one: Shard, other: Shard) -> None:
    np.testing.assert_array_equal(one.feature, other.feature)
    np.testing.assert_array_equal(one.frequency_hz, other.frequency_hz)
    assert set(one.columns) == set(other.columns)
    for name, column in one.columns.items():
        np.testing.assert_array_equal(column.values, other.columns[name].values, err_msg=name)
        assert dict(column.attrs) == dict(other.columns[name].attrs)


def test_equal_content_gives_equal_bytes(tmp_path):
    for name in ("a", "b"):
        write_store(tmp_path / name, sample(), FEATURE_ATTRS)
        time.sleep(1.1)  # HDF5's times count seconds
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b"]
    shuffled = replace(sample(), columns=dict(reversed(sample().columns.items())))
    write_store(tmp_path / "c", shuffled, FEATURE_ATTRS)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "c").read_bytes()


def test_read_back(tmp_path):
    write_store(tmp_path / "x.nc", sample(), FEATURE_ATTRS)
    read = read_store(tmp_path / "x.nc")
    assert_same(sample(), read)
    assert read.feature.dtype == np.float32
    assert read.columns["sample"].values.dtype == np.int32
    assert read.attrs == {"Conventions": "CF-1.11", **sample().attrs}


def test_xarray_reads_it(tmp_path):
    path = tmp_path / "results" / "features" / "d.nc"
    (tmp_path / "datasets").mkdir()
    write_store(path, sample(), FEATURE_ATTRS)
    with ajgdata.load_features("d", tmp_path) as opened:
        features = opened.load()
    assert features["feature"].dims == ("recording", "frequency")
    assert features["feature"].dtype == np.float32
    np.testing.assert_array_equal(features["feature"], sample().feature)
    np.testing.assert_array_equal(features["frequency"], np.arange(17) * 31.25)
    assert features["note"].values.tolist() == (NOTES * 5)[:5]
    assert features["recording"].values.tolist() == [f"s1/{n:03d}" for n in range(5)]
    np.testing.assert_array_equal(features["edge_mm"], [np.nan, 1, 2, 3, 4])
    assert features["edge_mm"].attrs["units"] == "mm"
    assert features["frequency"].attrs["units"] == "Hz"
    assert features["feature"].attrs["units"] == "1"
    assert set(features.data_vars) == {"feature"}
    assert features.attrs["source"] == "recorded"
    with xr.open_dataset(path) as plain:  # which knows nothing of this library
        for hidden in (HEAPS, SEAL):
            del plain.attrs[hidden]
        xr.testing.assert_identical(features, plain.load())
    chosen = features["feature"].sel(recording="s1/003", frequency=slice(100, 300))
    np.testing.assert_array_equal(chosen, sample().feature[3, 4:10])
    assert not np.isnan(features.where(features["edge_mm"] > 2, drop=True)["feature"]).any()


@pytest.mark.parametrize(
    "key",
    [
        (0, 3), (-1, slice(None)), (slice(None, None, -2), slice(10, 3, -3)), ([3, 0, 3], 2),
        ([4, 1], [0, 16, 0]), (slice(2, 2), slice(None)), (np.arange(5) % 2 == 0, slice(1, 4)),
        (slice(1, 4), [5, 5]),
    ],
)  # fmt: skip
def test_only_what_is_asked_for_and_in_every_way(tmp_path, key):
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    rows, bins = key
    expected = sample().feature[rows][..., bins]
    with open_store(path) as opened:
        assert not opened.variables["feature"]._in_memory
        chosen = opened.feature.isel(recording=rows, frequency=bins)
        np.testing.assert_array_equal(chosen.values, expected)


def test_a_part_of_a_store_keeps_it_open(tmp_path):
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    part = open_store(path).feature[1:3]
    gc.collect()
    np.testing.assert_array_equal(part.values, sample().feature[1:3])


def test_a_store_that_is_closed_gives_no_more(tmp_path):
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    with open_store(path) as opened:
        first = opened.feature[0].load()
    np.testing.assert_array_equal(first, sample().feature[0])
    with pytest.raises(ValueError, match="the store is closed"):
        opened.feature.load()


def test_plain_hdf5_readers_read_it(tmp_path):
    write_store(tmp_path / "x.nc", sample(), FEATURE_ATTRS)
    with h5py.File(tmp_path / "x.nc") as store:
        np.testing.assert_array_equal(store["feature"][...], sample().feature)
        assert [b"".join(row).decode() for row in store["note"][...]] == (NOTES * 5)[:5]
        assert store["edge_mm"].attrs["units"] == "mm"
    with h5netcdf.File(tmp_path / "x.nc") as store:
        assert store.dimensions["recording"].size == 5
        assert store["feature"].dimensions == ("recording", "frequency")
        assert store["note"].attrs["_Encoding"] == "utf-8"
        np.testing.assert_array_equal(store["sample"][...], np.arange(5))


def test_a_store_without_rows(tmp_path):
    empty = Shard(
        np.empty((0, 4), np.float32),
        np.arange(4.0),
        {"recording": text_column([]), "edge_mm": Column(np.empty(0), {"units": "mm"})},
        {},
    )
    path = tmp_path / "x.nc"
    write_store(path, empty, FEATURE_ATTRS)
    read = read_store(path)
    assert read.feature.shape == (0, 4)
    assert read.columns["recording"].values.tolist() == []
    assert read.columns["recording"].values.dtype.kind == "U"
    with open_store(path) as opened:
        assert opened["feature"].shape == (0, 4)
        assert opened["edge_mm"].shape == (0,)
    joined = concatenate([read, replace(sample(2), columns={
        "recording": text_column(["a", "b"]), "edge_mm": Column(np.ones(2))},
        feature=np.ones((2, 4), np.float32), frequency_hz=np.arange(4.0), attrs={})])  # fmt: skip
    assert joined.columns["recording"].values.tolist() == ["a", "b"]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_no_store_holds_anything_that_is_not_finite(tmp_path, bad):
    write_store(tmp_path / "x.nc", sample(), FEATURE_ATTRS)
    before = (tmp_path / "x.nc").read_bytes()
    spoilt = sample()
    spoilt.feature[2, 3] = bad
    with pytest.raises(ValueError, match="NaN or infinite"):
        write_store(tmp_path / "x.nc", spoilt, FEATURE_ATTRS)
    assert (tmp_path / "x.nc").read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_what_is_not_aligned_is_refused(tmp_path):
    short = sample(note=text_column(["one"]))
    with pytest.raises(ValueError, match="column note has 1 of 5 rows"):
        write_store(tmp_path / "x.nc", short, FEATURE_ATTRS)
    with pytest.raises(ValueError, match=r"17 bins but \(16,\) frequencies"):
        write_store(
            tmp_path / "x.nc", replace(sample(), frequency_hz=np.arange(16.0)), FEATURE_ATTRS
        )
    with pytest.raises(ValueError, match="NUL"):
        text_column(["a\0"])
    assert not list(tmp_path.iterdir())


def test_concatenation():
    both = concatenate([sample(3), sample(4, start=10)])
    assert both.feature.shape == (7, 17)
    np.testing.assert_array_equal(both.feature[3:], sample(4, start=10).feature)
    assert both.columns["recording"].values[3] == "s1/010"
    assert both.columns["edge_mm"].attrs == {"units": "mm"}
    with pytest.raises(ValueError, match="'s1/002' stands in two shards"):
        concatenate([sample(3), sample(3, start=2)])
    with pytest.raises(ValueError, match="differ in their columns"):
        concatenate([sample(3), sample(3, start=9, more=text_column(["x"] * 3))])
    with pytest.raises(ValueError, match="frequencies"):
        concatenate([sample(3), replace(sample(3, 9), frequency_hz=np.arange(17.0))])
    with pytest.raises(ValueError, match="settings"):
        concatenate([sample(3), replace(sample(3, 9), attrs={"settings": "{1}"})])


texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=12)


@settings(deadline=None, max_examples=40)
@given(st.lists(texts, min_size=1, max_size=6))
def test_any_text_comes_back(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("store") / "x.nc"
    made = Shard(
        np.zeros((len(values), 2), np.float32),
        np.arange(2.0),
        {"recording": text_column([str(n) for n in range(len(values))]), "t": text_column(values)},
        {},
    )
    write_store(path, made, FEATURE_ATTRS)
    assert read_store(path).columns["t"].values.tolist() == values
    with open_store(path) as opened:
        assert opened["t"].values.tolist() == values


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n", b"x" * 5000])
def test_what_is_no_store(tmp_path, content):
    path = tmp_path / "x.nc"
    path.write_bytes(content)
    with pytest.raises(DataError, match="not a readable feature store"):
        read_store(path)
    with h5py.File(path, "w") as other:
        other["something"] = 1
    for read in (read_store, open_store):
        with pytest.raises(DataError, match="not a readable feature store"):
            read(path)


def test_damage_is_noticed(tmp_path):
    """A flipped byte gives an error or changes nothing: all that is read carries a checksum."""
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    content = path.read_bytes()
    heap = content.index(b"GCOL")  # texts of attributes; HDF5 may never end in a damaged one
    beyond = heap + int.from_bytes(content[heap + 8 : heap + 16], "little")
    assert content.count(b"GCOL") == 1
    elsewhere = np.r_[:heap, beyond : len(content)]
    generator = np.random.default_rng(3)
    refused = 0
    for at in [*generator.choice(elsewhere, 300, False), *range(heap, beyond, 7)]:
        damaged = bytearray(content)
        damaged[at] ^= 0xFF
        path.write_bytes(damaged)
        try:
            read = read_store(path)
        except DataError:
            refused += 1
            continue
        assert not heap <= at < beyond
        assert_same(sample(), read)
        assert dict(read.attrs) == {"Conventions": CONVENTIONS, **sample().attrs}
    assert refused > (beyond - heap) // 7


def test_a_store_that_finds_no_room_is_told_and_never_there(tmp_path, capfd):
    """HDF5 would crash, or complain of each of its parts."""
    path = tmp_path / "folder" / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    whole = path.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for room in range(0, len(whole), len(whole) // 9):
        path.unlink(missing_ok=True)
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
        try:
            with pytest.raises(OSError, match="File too large"):
                write_store(path, sample(), FEATURE_ATTRS)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert list(path.parent.iterdir()) == []
    gc.collect()
    assert capfd.readouterr() == ("", "")
    write_store(path, sample(), FEATURE_ATTRS)
    assert path.read_bytes() == whole


def test_a_store_without_a_hash_of_its_texts_is_read_as_it_is(tmp_path):
    """As those that were published before there was one."""
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    with h5py.File(path, "r+") as store:
        del store.attrs[HEAPS], store.attrs[SEAL]
    assert_same(sample(), read_store(path))


def test_a_changed_text_of_latents_is_noticed(tmp_path):
    path = tmp_path / "latents.nc"
    columns = {"recording": text_column(["a", "b"]), "edge_mm": Column(np.r_[1, 2], {"units": "m"})}
    latent = {2: np.zeros((1, 1, 2, 2), np.float32)}
    none = np.full(2, -1)
    write_latents(path, Latents(latent, none, None, none, columns, {"settings": "of it"}))
    assert read_latents(path).attrs["settings"] == "of it"
    content = path.read_bytes()
    assert content.count(b"of it") == 1
    path.write_bytes(content.replace(b"of it", b"on it"))
    with pytest.raises(DataError, match="its texts are not those that were written"):
        read_latents(path)


def test_a_store_that_another_program_wrote_anew_says_how_to_read_it(tmp_path):
    path, copy = tmp_path / "x.nc", tmp_path / "copy.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    with xr.open_dataset(path) as opened:
        opened.to_netcdf(copy)
        for hidden in (HEAPS, SEAL):
            del opened.attrs[hidden]
        opened.to_netcdf(tmp_path / "dropped.nc")
    for read in (read_store, open_store):
        with pytest.raises(DataError, match=r"another program wrote it anew; .* drop _heaps and"):
            read(copy)
    np.testing.assert_array_equal(read_store(tmp_path / "dropped.nc").feature, sample().feature)


def test_a_file_that_is_replaced_while_it_is_opened_is_checked_itself(tmp_path):
    path, other = tmp_path / "x.nc", tmp_path / "other.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    write_store(other, sample(rows=300), FEATURE_ATTRS)
    with h5py.File(path) as store:
        other.replace(path)
        check_texts(store)
    assert len(read_store(path).feature) == 300


@pytest.mark.parametrize(
    "parts",
    [[0, 2**46], [2**62, 2**62], [-8, 16], [0, 0], [8, -8], [64, 8, 0, 8], [0, 9, 8, 8], [0, 8, 8]]
)  # fmt: skip
def test_a_list_of_texts_that_no_file_can_have_is_refused_unread(tmp_path, monkeypatch, parts):
    path = tmp_path / "x.nc"
    write_store(path, sample(), FEATURE_ATTRS)
    with h5py.File(path, "r+") as store:
        store.attrs[HEAPS] = np.array(parts, np.int64)
    read, pread = [], os.pread
    monkeypatch.setattr("os.pread", lambda *a: read.append(a) or pread(*a))
    with pytest.raises(DataError, match="its texts are not those"):
        read_store(path)
    assert len(read) <= 1


def test_what_looks_like_a_heap_within_one_does_no_harm(tmp_path):
    path = tmp_path / "x.nc"
    looks = [b"GCOL\1\0\0\0" + n.to_bytes(8, "little") for n in (0, 24, 40)]
    with writing(path) as store:
        store.attrs["settings"] = "of it"
        store.dimensions["n"] = 96
        store.create_variable("n", ("n",), data=np.frombuffer(b"".join(looks).ljust(96), np.uint8))
    content = path.read_bytes()
    assert content.count(b"GCOL\1\0\0\0") == 4
    with h5py.File(path) as store:
        check_texts(store)
        listed = store.attrs[HEAPS].tolist()
    assert (content.index(looks[1]), 16 + 40) in zip(listed[::2], listed[1::2], strict=True)


def test_load_features_says_what_to_do(tmp_path):
    (tmp_path / "datasets").mkdir()
    with pytest.raises(DataError, match=r"has not been made; run `snakemake` first"):
        ajgdata.load_features("d", tmp_path)
    with pytest.raises(FileNotFoundError, match="no project at"):
        ajgdata.load_features("d", "/")
