#!/usr/bin/env bash
# Resolve pyproject.toml into requirements.lock (needs `uv`; only maintainers run this, through `make lock`).
# torch's plain pin is kept without its CUDA packages: torch pins those itself, and a CPU build has none.
set -euo pipefail
cd "$(dirname "$0")/.."
groups=$(python3 -c 'import tomllib
with open("pyproject.toml", "rb") as file:
    print(*(f"--group={name}" for name in tomllib.load(file)["dependency-groups"]))')
torch='torch==2.13.0' # the tested version; pyproject.toml allows a range
{
  echo "# Versions this project is tested with (Python 3.11 and 3.13); used as pip constraints. Made by tools/lock.sh: do not edit."
  uv pip compile pyproject.toml --all-extras $groups --universal --python-version 3.11 --fork-strategy fewest \
    --no-header --no-annotate --quiet --constraint <(echo "$torch") "$@" |
    grep -vE '^(nvidia-|cuda-|triton==|torch==)' |
    cat - <(echo "$torch") | LC_ALL=C sort
} >requirements.lock.new
mv requirements.lock.new requirements.lock
