"""Digest of the code that a result depends on, found by following names through the sources.

Snakemake does not see changes in imported modules; a rule passes `code_digest` of the function that
it calls as a parameter. From that function every name is followed, through imports (at the top of a
module or inside a function) and through attributes of imported modules, to top-level definitions:
functions, classes as a whole, assignments. Statements at the top of a reached module that define
nothing (a registration, an `if`) always count. So an edit counts if and only if it is to something
that the function may use; comments, blank lines and docstrings never do.

Sources are parsed, not imported: this is quick enough to be done while Snakemake builds its graph.
What is named at run time only cannot be followed, and is given as a further entry: a module of
`importlib.import_module(f"...{name}")`, a data file. A constant such as `"package.module:name"`
is followed like the name, and so is the module of `f"package.module:{name}"`.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, cached_property, lru_cache
from importlib.util import find_spec
from pathlib import Path

#: Where files are is no matter of what is in them, and the rules' inputs and outputs tell.
IGNORED = {"ajgdata.paths"}
OURS = "ajgdata"
_PLACE = re.compile(r"([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+)(?::(\w*))?")
#: (module, name in it): None for the module itself.
Target = tuple[str, str | None]
Dotted = tuple[str, ...]
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


@cache
def code_digest(*entries: str) -> str:
    """Return the digest of all code that the `entries` may use, as 16 hexadecimal digits.

    An entry is `module:name`, a `module` (all of it), or a file beside a module, as
    `package/data.yaml`. Names are followed in ajgdata and in the packages of the entries. Raises
    ValueError for an entry that does not exist.
    """
    packages = {OURS, *(re.split(r"[.:/]", entry)[0] for entry in entries)}
    return _code(*sorted(packages)).digest(*entries)


@cache
def _code(*packages: str) -> Code:
    return Code({name: _folder(name) for name in packages})


def _folder(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        raise ValueError(f"there is no package {package}: install it, or correct its name")
    return Path(next(iter(spec.submodule_search_locations)))


class Code:
    """Sources of some packages, by the folder of each."""

    def __init__(self, folders: Mapping[str, Path]) -> None:
        self.folders = dict(folders)
        self._modules: dict[str, _Module | None] = {}

    def digest(self, *entries: str) -> str:
        """Return the digest of what the `entries` reach; see `code_digest`."""
        digest = hashlib.sha256()
        files = sorted(entry for entry in entries if "/" in entry)
        for name in files:
            package, _, inside = name.partition("/")
            path = self.folders[package] / inside
            if not path.is_file():
                raise ValueError(f"there is no file {name}: correct its name")
            digest.update(name.encode() + b"\0" + path.read_bytes())
        reached = self.reached(*(entry for entry in entries if "/" not in entry))
        for module, names in sorted(reached.items()):
            parsed = self._module(module)
            assert parsed is not None
            for name in sorted(names):
                for part in parsed.parts[name]:
                    digest.update(f"{module}:{name}\0{part.text}\0".encode())
        return digest.hexdigest()[:16]

    def reached(self, *entries: str) -> dict[str, set[str]]:
        """Return the names of the definitions that the `entries` reach, by module.

        The name "" stands for a module's statements that define nothing.
        """
        found: dict[str, set[str]] = defaultdict(set)
        waiting = [target for entry in entries for target in self._entry(entry)]
        while waiting:
            module, name = waiting.pop()
            parsed = self._module(module)
            if name is None or parsed is None or name in found[module]:
                continue
            if not found[module] and name:
                waiting.append((module, ""))
            found[module].add(name)
            for part in parsed.parts.get(name, ()):
                for dotted in part.uses:
                    waiting += self._used(module, parsed, part, dotted)
                for place in part.places:
                    waiting += self._place(*place)
        return {m: n for m, names in found.items() if (n := names & set(self._names(m)))}

    def _entry(self, entry: str) -> list[Target]:
        module, _, name = entry.partition(":")
        parsed = self._module(module)
        if parsed is None or (name and not self._place(module, name)):
            raise ValueError(f"there is no {entry}: correct its name")
        return self._place(module, name)

    def _names(self, module: str) -> Iterable[str]:
        parsed = self._module(module)
        return parsed.parts if parsed else ()

    def _used(self, module: str, parsed: _Module, part: _Part, dotted: Dotted) -> list[Target]:
        """Return the definitions that `dotted`, which stands in `part`, may mean."""
        head, rest = dotted[0], dotted[1:]
        if head in part.imports:
            return [one for to in part.imports[head] for one in self._imported(to, rest)]
        return self._named(module, parsed, head, rest)

    def _named(self, module: str, parsed: _Module, name: str, rest: Dotted) -> list[Target]:
        if name in parsed.parts:
            return [(module, name)]
        return [one for to in parsed.imports.get(name, ()) for one in self._imported(to, rest)]

    def _imported(self, target: Target, rest: Dotted) -> list[Target]:
        module, name = target
        return self._inside(module, (*([name] if name else []), *rest))

    def _inside(self, module: str, names: Dotted) -> list[Target]:
        """Return what `names`, one in the other, are of `module`: the whole module if nothing."""
        parsed = self._module(module)
        if parsed is None:
            return []
        if not names:
            return [(module, one) for one in parsed.parts] + [
                one for name in parsed.imports for one in self._named(module, parsed, name, ())
            ]
        if names[0] in parsed.parts or names[0] in parsed.imports:
            return [(module, ""), *self._named(module, parsed, names[0], names[1:])]
        if self._module(f"{module}.{names[0]}"):
            return [(module, ""), *self._inside(f"{module}.{names[0]}", names[1:])]
        return [(module, name) for name in ("", "__getattr__") if name in parsed.parts]

    def _place(self, module: str, name: str) -> list[Target]:
        """Return what a text `module:name` or `module` means."""
        if self._module(module) or "." not in module or name:
            return self._inside(module, (name,) if name else ())
        parent, _, last = module.rpartition(".")
        return self._inside(parent, (last,)) if self._module(parent) else []

    def _module(self, name: str) -> _Module | None:
        if name not in self._modules:
            package, _, inside = name.partition(".")
            self._modules[name] = None
            if package in self.folders and name not in IGNORED:
                stem = self.folders[package].joinpath(*inside.split(".")) if inside else None
                files = [stem.with_suffix(".py")] if stem else []
                files.append((stem or self.folders[package]) / "__init__.py")
                for file in files:
                    if file.is_file():
                        is_package = file.name == "__init__.py"
                        text = file.read_text(encoding="utf-8")
                        self._modules[name] = _parsed(name, is_package, text)
                        break
        return self._modules[name]


class _Module:
    """A parsed module: its definitions and its imports, by name."""

    def __init__(self, name: str, is_package: bool, text: str) -> None:
        self.package = name if is_package else name.rpartition(".")[0]
        self.parts: dict[str, list[_Part]] = {"": []}
        self.imports: dict[str, list[Target]] = defaultdict(list)
        self._add(_without_docstring(ast.parse(text).body))

    def _add(self, statements: Iterable[ast.stmt]) -> None:
        for node in statements:
            if isinstance(node, ast.Import | ast.ImportFrom):
                for name, target in _imports(node, self.package):
                    self.imports[name].append(target)
            elif isinstance(node, ast.If) and _is_type_checking(node.test):
                self._add(node.body)  # what `__getattr__` gives stands there, too
            else:
                part = _Part(node, self.package)
                for name in _defined(node) or [""]:
                    self.parts.setdefault(name, []).append(part)
                if not isinstance(node, _DEFINITIONS):  # an import in a `try`, say
                    for name, targets in part.imports.items():
                        self.imports[name] += targets


class _Part:
    """A top-level statement: its code, and the names that stand in it."""

    def __init__(self, node: ast.stmt, package: str) -> None:
        self._node, self._package = node, package

    @cached_property
    def _nodes(self) -> list[ast.AST]:
        """All that it consists of, the outer of nested nodes first; docstrings are removed."""
        nodes = []
        for node in ast.walk(self._node):
            if isinstance(node, _DEFINITIONS):
                node.body = _without_docstring(node.body) or [ast.Pass()]
            nodes.append(node)
        return nodes

    @cached_property
    def text(self) -> str:
        """Its code without comments and docstrings."""
        assert self._nodes
        return ast.unparse(self._node)

    @cached_property
    def uses(self) -> set[Dotted]:
        """Names, with the attributes asked of them."""
        found: set[Dotted] = set()
        inner = set()
        for node in self._nodes:
            if isinstance(node, ast.Attribute | ast.Name) and id(node) not in inner:
                names: list[str] = []
                inside: ast.expr = node
                while isinstance(inside, ast.Attribute):
                    names.append(inside.attr)
                    inside = inside.value
                    inner.add(id(inside))
                if isinstance(inside, ast.Name):
                    found.add((inside.id, *reversed(names)))
        return found

    @cached_property
    def places(self) -> set[tuple[str, str]]:
        """Texts that name a module, or a definition in one."""
        texts = (node.value for node in self._nodes if isinstance(node, ast.Constant))
        found = (_PLACE.fullmatch(text) for text in texts if isinstance(text, str))
        return {(one[1], one[2] or "") for one in found if one}

    @cached_property
    def imports(self) -> dict[str, list[Target]]:
        """What it imports itself, by the name that it gets."""
        found: dict[str, list[Target]] = defaultdict(list)
        for node in self._nodes:
            if isinstance(node, ast.Import | ast.ImportFrom):
                for name, target in _imports(node, self._package):
                    found[name].append(target)
        return found


@lru_cache(maxsize=4096)
def _parsed(name: str, is_package: bool, text: str) -> _Module:
    return _Module(name, is_package, text)


def _without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    first = body[0] if body else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
        return body[1:] if isinstance(first.value.value, str) else body
    return body


def _is_type_checking(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def _defined(node: ast.stmt) -> list[str]:
    """Names that a top-level statement defines; none for what always counts."""
    if isinstance(node, _DEFINITIONS):
        return [node.name]
    if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        if all(isinstance(one, ast.Name | ast.Tuple) for one in targets):
            return [n.id for one in targets for n in ast.walk(one) if isinstance(n, ast.Name)]
    return []


def _imports(node: ast.Import | ast.ImportFrom, package: str) -> Iterator[tuple[str, Target]]:
    if isinstance(node, ast.Import):
        for alias in node.names:
            yield (
                (alias.asname, (alias.name, None))
                if alias.asname
                else (
                    alias.name.partition(".")[0],
                    (alias.name.partition(".")[0], None),
                )
            )
        return
    module = node.module or ""
    if node.level:
        above = package.split(".")[: len(package.split(".")) - node.level + 1]
        module = ".".join([*above, *([module] if module else [])])
    for alias in node.names:
        whole = alias.name == "*"
        yield ("*", (module, None)) if whole else (alias.asname or alias.name, (module, alias.name))
