"""The device on which networks are trained: the CPU, which is the reference, or a GPU."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ajgdata.types import DataError
from ajgdata.types.extras import installed_version, require_extra

CPU = "cpu"
CUDA = "cuda"
#: Setting: a GPU if there is one, otherwise the CPU.
AUTO = "auto"
_device: ContextVar[str] = ContextVar("device", default=CPU)


@contextmanager
def training_on(device: str) -> Iterator[None]:
    """Train the networks of a block on `device`: `cpu`, `cuda`, or `auto` (a GPU if there is one).

    Raises DataError for `cuda` without a GPU.
    """
    token = _device.set(_available(device))
    try:
        yield
    finally:
        _device.reset(token)


def _available(device: str) -> str:
    """Return `cpu` or `cuda` for a setting."""
    if device == CPU:
        return CPU  # without an import of torch, which most jobs do not need
    if installed_version("torch"):
        import torch

        if torch.cuda.is_available():
            return CUDA
    if device == AUTO:
        return CPU
    require_extra("cnn", f"device={device}")
    problem = "PyTorch finds no GPU on this computer"
    raise DataError(f"device={device}", problem, "use device=cpu, or a CUDA build of torch")


def training_device() -> str:
    """Return the device on which networks are trained now: `cpu` or `cuda`."""
    return _device.get()


def device_facts() -> dict[str, str]:
    """Return the key `device` for the description of a result; empty for the CPU."""
    if training_device() == CPU:
        return {}
    return {"device": training_device()}
