"""Optional packages: the extras of pyproject.toml, and errors if a package of an extra is missing.

`pip install ajgdata` brings what loading, import, checks, features and models of scikit-learn need.
`pip install "ajgdata[EXTRA]"` adds the packages of an extra. The metadata of the installed package
list them.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, metadata, requires, version

from ajgdata.types.errors import DataError

PACKAGE = "ajgdata"
#: Package that contains FFmpeg, and suffixes of the names of files that FFmpeg decodes.
FFMPEG = "av"
FFMPEG_SUFFIXES = (".m4a", ".mp4", ".aac", ".wma")
#: Names of modules that differ from the name of their package by more than an underscore.
PACKAGES = {"bs4": "beautifulsoup4", "markdown_it": "markdown-it-py", "umap": "umap-learn"}
#: A requirement of an extra: package, extras of the package, and name of our extra.
_REQUIREMENT = re.compile(
    r"(?P<package>[\w.-]+)(?:\[(?P<extras>[\w, -]+)\])?[^;]*;.*extra == [\"'](?P<extra>[\w-]+)"
)


def extras() -> list[str]:
    """Return the names of the extras, in the order of pyproject.toml."""
    return metadata(PACKAGE).get_all("Provides-Extra") or []


@functools.cache
def packages_of(extra: str) -> list[str]:
    """Return the packages of an extra, with those of the other extras that it includes."""
    packages = []
    for requirement in requires(PACKAGE) or ():
        match = _REQUIREMENT.match(requirement)
        if match is None or match["extra"] != extra:
            continue
        if match["package"] == PACKAGE:
            included = [name.strip() for name in match["extras"].split(",")]
            packages += [package for name in included for package in packages_of(name)]
        else:
            packages.append(match["package"])
    return list(dict.fromkeys(packages))


def missing_packages(extra: str) -> list[str]:
    """Return the packages of an extra that are not installed."""
    return [package for package in packages_of(extra) if not installed_version(package)]


def installed_version(package: str) -> str:
    """Return the version of an installed package; "" if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def require_extra(extra: str, where: object) -> None:
    """Raise DataError if a package of an extra is not installed.

    The message begins with `where`, which is a command or an option, and has the command that
    installs the extra.
    """
    missing = missing_packages(extra)
    if missing:
        raise _missing_error(missing[0], extra, where)


def require_version(expected: str) -> None:
    """Raise DataError if the installed package has another version than the workflow."""
    installed = version(PACKAGE)
    if installed != expected:
        problem = f"is of version {expected}, but ajgdata {installed} is installed"
        fix = f'run `pip install "{PACKAGE}=={expected}"`, or use the workflow of the package'
        raise DataError("workflow/Snakefile", problem, fix)


@contextmanager
def optional_packages(where: object) -> Iterator[None]:
    """Raise the DataError of `require_extra` if a block imports a package that is not installed.

    Other packages than those of the extras are errors of the installation or of the code:
    ModuleNotFoundError is then not changed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        module = (error.name or "").partition(".")[0]
        package = PACKAGES.get(module, module.replace("_", "-"))
        for extra in extras():
            if package in packages_of(extra):
                raise _missing_error(package, extra, where) from None
        raise


def _missing_error(package: str, extra: str, where: object) -> DataError:
    return DataError(where, f"{package} is not installed", f'run `pip install "ajgdata[{extra}]"`')
