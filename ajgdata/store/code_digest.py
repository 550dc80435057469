"""Digest of the code that a result depends on, found by following names through the sources.

Snakemake does not see changes in imported modules; a rule passes `code_digest` of the function that
it calls as a parameter. From that function every name is followed, through imports (at the top of a
module or inside a function) and through attributes of imported modules, to top-level definitions:
functions, classes as a whole, assignments. Statements at the top of a reached module that define
nothing (a registration, an `if`) always count. So an edit counts if and only if it is to something
that the function may use; comments, blank lines and docstrings never do.

Sources are parsed, not imported: this is quick enough to be done while Snakemake builds its graph;
what was found is kept for the next process (`kept_digests`).
What is named at run time only cannot be followed, and is given as a further entry: a module of
`importlib.import_module(f"...{name}")`, a data file. A constant such as `"package.module:name"`
is followed like the name, and so is the module of `f"package.module:{name}"`.
"""

from __future__ import annotations

import ast
import hashlib
import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ajgdata.store.kept_digests import KeptDigests, kept_beside

#: Where files are is no matter of what is in them, and the rules' inputs and outputs tell.
IGNORED = {"ajgdata.paths"}
#: Entries of what simulated responses follow from: code, and the table of what may be left out.
OMISSIONS_TABLE = "ajgdata/gripper/omissions.yaml"
GRIPPER_CODE = ("ajgdata.gripper", OMISSIONS_TABLE)
_PLACE = re.compile(r"([A-Za-z_]\w*(?:\.\w+)*):(\w*)")
#: What an import means: (module, name in it), None for the module itself.
Target = tuple[str, str | None]
#: `a.b.c` as ("a", "b", "c").
Dotted = tuple[str, ...]
#: (module, names in it, each in the one before).
Mention = tuple[str, Dotted]
Definition = tuple[str, str]
_DEFINITIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)


@cache
def code_digest(*entries: str) -> str:
    """Return the digest of all code that the `entries` may use, as 16 hexadecimal digits.

    An entry is `module:name`, a `module` (all of it), or a file beside a module, as
    `package/data.yaml`. Names are followed in ajgdata and in the packages of the entries. Raises
    ValueError for an entry that does not exist.
    """
    packages = {"ajgdata", *(re.split(r"[.:/]", entry)[0] for entry in entries)}
    code, kept = _code(*sorted(packages))
    return kept.of(entries, lambda: code.digest(*entries))


@cache
def _code(*packages: str) -> tuple[Code, KeptDigests]:
    folders = {name: _folder(name) for name in packages}
    return Code(folders), KeptDigests(folders, kept_beside(Path(__file__), packages))


def _folder(package: str) -> Path:
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise ValueError(f"there is no package {package}: install it, or correct its name")
    file = Path(spec.origin)
    return file.parent if spec.submodule_search_locations else file


class Code:
    """Sources of some packages, by the folder (or the file, of a module alone) of each."""

    def __init__(self, folders: Mapping[str, Path]) -> None:
        self.folders = dict(folders)
        self._modules: dict[str, _Module | None] = {}
        self._uses: dict[Definition, set[Definition]] = {}

    def digest(self, *entries: str) -> str:
        """Return the digest of what the `entries` reach; see `code_digest`."""
        digest = hashlib.sha256()
        for name in sorted(entry for entry in entries if "/" in entry):
            package, _, inside = name.partition("/")
            path = self.folders[package] / inside
            if not path.is_file():
                raise ValueError(f"there is no file {name}: correct its name")
            digest.update(name.encode() + b"\0" + path.read_bytes())
        reached = self.reached(*(entry for entry in entries if "/" not in entry))
        for module, names in sorted(reached.items()):
            for name in sorted(names):
                for part in self._parts(module, name):
                    others = " ".join(self._outside(module, part))
                    digest.update(f"{module}:{name}\0{part.text}\0{others}\0".encode())
        return digest.hexdigest()[:16]

    def reached(self, *entries: str) -> dict[str, set[str]]:
        """Return the names of the definitions that the `entries` reach, by module.

        The name "" stands for a module's statements that define nothing.
        """
        waiting = [one for entry in entries for one in self._definitions(self._entry(entry))]
        found: dict[str, set[str]] = defaultdict(set)
        while waiting:
            module, name = waiting.pop()
            if name not in found[module]:
                found[module].add(name)
                waiting += self._used(module, name)
        return dict(found)

    def _used(self, module: str, name: str) -> set[Definition]:
        """Return the definitions that one uses, each as (module, name)."""
        if (module, name) not in self._uses:
            mentions = {m for p in self._parts(module, name) for m in self._mentioned(module, p)}
            self._uses[module, name] = set().union(*map(self._definitions, mentions))
        return self._uses[module, name]

    def _definitions(self, mention: Mention) -> set[Definition]:
        """Return the definitions that a mention means, where they stand."""
        waiting, seen, found = [mention], set(), set()
        while waiting:
            one = waiting.pop()
            if one not in seen:
                seen.add(one)
                names, more = self._meant(*one)
                found |= {(one[0], name) for name in names}
                waiting += more
        return found

    def _entry(self, entry: str) -> Mention:
        module, _, name = entry.partition(":")
        parsed = self._module(module)
        if parsed is None or (name and name not in parsed.parts and name not in parsed.imports):
            raise ValueError(f"there is no {entry}: correct its name")
        return (module, (name,) if name else ())

    def _parts(self, module: str, name: str) -> list[_Part]:
        parsed = self._module(module)
        return parsed.parts.get(name, []) if parsed else []

    def _mentioned(self, module: str, part: _Part) -> Iterator[Mention]:
        """Yield what a statement of `module` uses."""
        parsed = self._module(module)
        assert parsed is not None
        for dotted in part.uses:
            if dotted[0] in part.imports:
                yield from _targets(part.imports[dotted[0]], dotted[1:])
            elif dotted[0] in parsed.parts or dotted[0] in parsed.imports or "*" in parsed.imports:
                yield (module, dotted)
        yield from part.places

    def _outside(self, module: str, part: _Part) -> list[str]:
        """Return what a statement uses of packages that are not followed, by the name it has."""
        parsed = self._module(module)
        imports = {**(parsed.imports if parsed else {}), **part.imports}
        return sorted(
            f"{name}={place}:{what or ''}"
            for name in {dotted[0] for dotted in part.uses} & set(imports)
            for place, what in imports[name]
            if place.partition(".")[0] not in self.folders
        )

    def _meant(self, module: str, dotted: Dotted) -> tuple[set[str], list[Mention]]:
        """Return which definitions of `module` the names `dotted`, one in the other, mean, and what
        they mean elsewhere: all of the module if there is no name."""
        parsed = self._module(module)
        if parsed is None:
            return set(), []
        if not dotted:
            return set(parsed.parts), [(module, (name,)) for name in parsed.imports if name != "*"]
        head, rest = dotted[0], dotted[1:]
        if head in parsed.parts:
            return {"", head}, []
        targets = [one for one in parsed.imports.get(head, ()) if one != (module, head)]
        if targets:
            return {""}, list(_targets(targets, rest))
        if self._module(f"{module}.{head}"):
            return {""}, [(f"{module}.{head}", rest)]
        return {"", "__getattr__"} & set(parsed.parts), list(_targets(parsed.imports["*"], dotted))

    def _module(self, name: str) -> _Module | None:
        if name not in self._modules:
            file = self._file(name)
            package = name if file and file.stem == "__init__" else name.rpartition(".")[0]
            text = file.read_text(encoding="utf-8") if file else ""
            self._modules[name] = _parsed(package, text) if file else None
        return self._modules[name]

    def _file(self, name: str) -> Path | None:
        package, _, inside = name.partition(".")
        if package not in self.folders or name in IGNORED:
            return None
        place = self.folders[package].joinpath(*filter(None, inside.split(".")))
        files = (place, place.with_suffix(".py"), place / "__init__.py")
        return next((file for file in files if file.is_file()), None)


def _targets(targets: Iterable[Target], rest: Dotted) -> Iterator[Mention]:
    return ((module, (name, *rest) if name else rest) for module, name in targets)


class _Module:
    """A parsed module: its definitions and its imports, by name."""

    def __init__(self, package: str, text: str) -> None:
        self.package = package
        self.parts: dict[str, list[_Part]] = {"": []}
        self.imports: dict[str, list[Target]] = defaultdict(list)
        self._add(_without_docstring(ast.parse(text).body))

    def _add(self, statements: Iterable[ast.stmt]) -> None:
        for node in statements:
            if isinstance(node, ast.Import | ast.ImportFrom):
                for name, target in _imports(node, self.package):
                    self.imports[name].append(target)
            elif isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
                self._add(node.body)  # what `__getattr__` gives stands there, too
            else:
                part = _Part(node, self.package)
                for name in _defined(node) or [""]:
                    self.parts.setdefault(name, []).append(part)
                if not isinstance(node, _DEFINITIONS):  # an import in a `try`, say
                    for name, targets in part.imports.items():
                        self.imports[name] += targets


class _Part:
    """A top-level statement: its code, and the names that stand in it.

    Each is found in one pass over the nodes of its syntax tree, of which there are 10^5.
    """

    def __init__(self, node: ast.stmt, package: str) -> None:
        self._package = package
        #: Names, with the attributes asked of them.
        self.uses: set[Dotted] = set()
        #: What its texts name: a module, or something in one.
        self.places: set[Mention] = set()
        #: What it imports itself, by the name that it gets.
        self.imports: dict[str, list[Target]] = defaultdict(list)
        tokens: list[str] = []
        waiting: list[Any] = [node]
        while waiting:
            waiting += self._read(waiting.pop(), tokens.append)
        #: Its code without comments, docstrings and layout.
        self.text = " ".join(tokens)

    def _read(self, node: Any, write: Callable[[str], None]) -> Iterable[Any]:
        """Write what a node is, and return what it consists of."""
        if isinstance(node, list):
            write(str(len(node)))
            return node
        if not isinstance(node, ast.AST):
            write(repr(node))
            return ()
        write(type(node).__name__)
        if isinstance(node, ast.Name | ast.Attribute):
            return self._read_name(node, write)
        if isinstance(node, ast.Constant):
            if isinstance(node.value, str) and (place := _PLACE.fullmatch(node.value)):
                self.places.add((place[1], (place[2],) if place[2] else ()))
        elif isinstance(node, ast.Import | ast.ImportFrom):
            for name, target in _imports(node, self._package):
                self.imports[name].append(target)
        else:
            _tidy(node)
        return [getattr(node, field, None) for field in node._fields]

    def _read_name(self, node: ast.expr, write: Callable[[str], None]) -> Iterable[ast.expr]:
        names = []
        while isinstance(node, ast.Attribute):
            names.append(node.attr)
            node = node.value
        if isinstance(node, ast.Name):
            names.append(node.id)
            self.uses.add(tuple(reversed(names)))
        write(".".join(names))
        return () if isinstance(node, ast.Name) else (node,)


#: Kept by content, since tests and plug-ins read some sources more than once.
_parsed = lru_cache(maxsize=1024)(_Module)


def _tidy(node: ast.AST) -> None:
    """Take what does not run out of a node: its docstring, and types that are only said."""
    if isinstance(node, ast.arg):
        _take_as_text(node, "annotation")
    elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        _take_as_text(node, "returns")
    elif isinstance(node, ast.ClassDef) and _is_record(node):
        for field in node.body:
            if isinstance(field, ast.AnnAssign):
                _take_as_text(field, "annotation")
    if isinstance(node, _DEFINITIONS):
        node.body = _without_docstring(node.body)


def _take_as_text(node: ast.AST, field: str) -> None:
    """Keep a type that is only said, so that what it names is not followed."""
    said = getattr(node, field)
    if said is not None and not isinstance(said, ast.Constant):
        setattr(node, field, ast.Constant(ast.unparse(said)))


def _is_record(node: ast.ClassDef) -> bool:
    """Return whether the types of a class's fields are only said: of a dataclass or NamedTuple."""
    named = {ast.unparse(one).partition("(")[0] for one in (*node.decorator_list, *node.bases)}
    return bool(named & {"dataclass", "dataclasses.dataclass", "NamedTuple"})


def _without_docstring(body: list[ast.stmt]) -> list[ast.stmt]:
    first = body[0] if body else None
    if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
        return body[1:] if isinstance(first.value.value, str) else body
    return body


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
    """Yield the names that an import gives, each with what it means; "*" for all of a module."""
    if isinstance(node, ast.Import):
        for alias in node.names:
            name = alias.asname or alias.name.partition(".")[0]
            yield name, (alias.name if alias.asname else name, None)
        return
    above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
    module = ".".join([*above, *([node.module] if node.module else [])])
    for alias in node.names:
        yield alias.asname or alias.name, (module, None if alias.name == "*" else alias.name)
