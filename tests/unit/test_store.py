"""The feature store: equal values through every reader, equal bytes for equal content."""

import errno
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import ajgdata
from ajgdata.store.feature_array import frequency_axis
from ajgdata.store.features import (
    FeatureColumn,
    FeatureRows,
    Latents,
    read_latents,
    read_store,
    text_column,
    write_latents,
    write_store,
)
from ajgdata.types import DataError, one_line
from ajgdata.types.formats import FEATURES_FORMAT

NOTES = ["", "größe", "日本語", "a,b 'c'", "  "]


def sample(rows: int = 5, start: int = 0, **columns: FeatureColumn) -> FeatureRows:
    generator = np.random.default_rng(start)
    feature = generator.random((rows, 17), np.float32)
    feature[0, :3] = 0, 1e-45, 3e38  # smallest subnormal and nearly the largest
    return FeatureRows(
        feature,
        (frequency_axis(np.arange(17) * 31.25),),
        {
            "recording": text_column([f"s1/{start + n:03d}" for n in range(rows)]),
            "sha256": text_column([f"{start + n:064x}" for n in range(rows)]),
            "edge_mm": FeatureColumn(np.r_[np.nan, np.arange(1.0, rows)], {"units": "mm"}),
            "note": text_column((NOTES * rows)[:rows]),
            "sample": FeatureColumn(np.arange(rows, dtype=np.int32)),
            **columns,
        },
        {"data_set": "d", "source": "recorded", "settings": "{}"},
    )


def assert_same(first: FeatureRows, second: FeatureRows) -> None:
    np.testing.assert_array_equal(first.feature, second.feature)
    np.testing.assert_array_equal(first.frequency_hz, second.frequency_hz)
    assert set(first.columns) == set(second.columns)
    for name, column in first.columns.items():
        np.testing.assert_array_equal(column.values, second.columns[name].values, err_msg=name)
        assert dict(column.attrs) == dict(second.columns[name].attrs)


def test_equal_content_gives_equal_bytes(tmp_path):
    for name in ("a", "b"):
        write_store(tmp_path / name, sample())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    shuffled = replace(sample(), columns=dict(reversed(sample().columns.items())))
    write_store(tmp_path / "c", shuffled)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "c").read_bytes()


def test_read_back(tmp_path):
    write_store(tmp_path / "x.nc", sample())
    read = read_store(tmp_path / "x.nc")
    assert_same(sample(), read)
    assert read.feature.dtype == np.float32
    assert read.columns["sample"].values.dtype == np.int32
    assert read.attrs == {"Conventions": "CF-1.11", **sample().attrs}


def test_xarray_reads_it(tmp_path):
    path = tmp_path / "results" / "features" / "d.nc"
    (tmp_path / "datasets").mkdir()
    write_store(path, sample())
    with ajgdata.load_features("d", tmp_path) as opened:
        features = opened.load()
    assert features["feature"].dims == ("recording", "frequency")
    assert features["feature"].dtype == np.float32
    np.testing.assert_array_equal(features["feature"], sample().feature)
    np.testing.assert_array_equal(features["frequency"], np.arange(17) * 31.25)
    assert features["note"].values.tolist() == (NOTES * 5)[:5]
    np.testing.assert_array_equal(features["edge_mm"], [np.nan, 1, 2, 3, 4])
    assert features["edge_mm"].attrs["units"] == "mm"
    assert features["frequency"].attrs["units"] == "Hz"
    with xr.open_dataset(path) as plain:  # which knows nothing of this library
        xr.testing.assert_identical(features, plain.load())
    chosen = features["feature"].sel(recording="s1/003", frequency=slice(100, 300))
    np.testing.assert_array_equal(chosen, sample().feature[3, 4:10])


def test_no_store_holds_anything_that_is_not_finite(tmp_path):
    write_store(tmp_path / "x.nc", sample())
    before = (tmp_path / "x.nc").read_bytes()
    spoilt = sample()
    spoilt.feature[2, 3] = np.inf
    with pytest.raises(ValueError, match="NaN or infinite"):
        write_store(tmp_path / "x.nc", spoilt)
    assert (tmp_path / "x.nc").read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_what_is_no_store(tmp_path):
    path = tmp_path / "x.nc"
    path.write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(DataError, match="not a readable netCDF file"):
        read_store(path)


def test_a_file_that_may_not_be_read_is_not_called_damaged(tmp_path, monkeypatch):
    """HDF5 raises the error without a file name."""
    path = tmp_path / "x.nc"
    write_store(path, sample())

    def forbidden(*_, **__):
        raise PermissionError(errno.EACCES, "Unable to open file (errno = 13)")

    monkeypatch.setattr(xr, "open_dataset", forbidden)
    with pytest.raises(PermissionError) as caught:
        read_store(path)
    expected = "Permission denied. Change its permissions, or use an account that has them."
    assert one_line(caught.value) == f"{path}: {expected}"


def test_a_changed_byte_of_a_spectrum_is_noticed(tmp_path):
    path = tmp_path / "x.nc"
    write_store(path, sample())
    content = bytearray(path.read_bytes())
    content[content.index(sample().feature[1].tobytes())] ^= 1
    path.write_bytes(content)
    with pytest.raises(DataError, match="not a readable netCDF file"):
        read_store(path)


def test_a_file_without_spectra_is_no_store(tmp_path):
    path = tmp_path / "x.nc"
    other = xr.Dataset({"other": ("recording", [1.0])}, attrs={"format": FEATURES_FORMAT.version})
    other.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(DataError, match="not a readable netCDF file"):
        read_store(path)


def test_latents(tmp_path):
    path = tmp_path / "latents.nc"
    columns = {
        "recording": text_column(["a", "b"]),
        "edge_mm": FeatureColumn(np.r_[1, 2], {"units": "m"}),
    }
    latent = {
        2: np.arange(4, dtype=np.float32).reshape(1, 1, 2, 2),
        10: np.ones((1, 1, 2, 10), np.float32),
    }
    folds = np.array([0, 1])
    write_latents(path, Latents(latent, folds, columns, {"settings": "of it"}))
    read = read_latents(path)
    assert list(read.latent) == [2, 10]
    for dimension, values in latent.items():
        np.testing.assert_array_equal(read.latent[dimension], values)
    np.testing.assert_array_equal(read.validation_fold, folds)
    assert read.columns["recording"].values.tolist() == ["a", "b"]
    assert read.columns["edge_mm"].attrs == {"units": "m"}
    assert read.attrs["settings"] == "of it"
