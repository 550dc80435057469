"""Packages of the wheel; everything else is in pyproject.toml, which cannot say this.

`reports/`, which people edit, stands at the top of the project; in a wheel it is part of the
package.
"""

from setuptools import find_packages, setup

REPORTS = [
    "ajgdata.reports",
    "ajgdata.reports.experiments",
    "ajgdata.reports.pages",
    "ajgdata.reports.templates",
]

setup(
    packages=[*find_packages(include=["ajgdata*"]), *REPORTS],
    package_dir={"ajgdata.reports": "reports"},
)
