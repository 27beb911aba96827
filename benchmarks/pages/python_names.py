"""Public functions and classes as Markdown: a heading, the signature, and the docstring with its sections as lists."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Any

from benchmarks.pages.markdown import cell, escaped, row, table
from benchmarks.pages.places import NAMES, PLACES

WIDTH = 100
PATHS = [path for paths in NAMES.values() for path in paths]
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Options|Example):$", re.MULTILINE)
ENTRY = re.compile(r"^    (?=\S)", re.MULTILINE)
WORDS = {"Args": "Arguments", "Attributes": "Fields", "Raises": "Raises"}


def section(name: str) -> str:
    """Returns an entry for each public name of a section of the page; that of a second name leads to the first."""
    first = {_object(path): path for path in reversed(PATHS)}
    return "\n\n".join(
        _entry(path, _object(path)) if first[_object(path)] == path
        else f"### {path}\n\nThe same as {_linked(f'`{first[_object(path)]}`')}." for path in NAMES[name]
    )  # fmt: skip


def without_entry() -> list[str]:
    """Returns the public names that stand in no section."""
    names = (f"{package}.{name}" for package in PLACES["public"] for name in import_module(package).__all__)
    return [name for name in names if name not in PATHS]


def _object(path: str) -> Any:
    module, _, name = path.rpartition(".")
    return getattr(import_module(module), name)


def _entry(path: str, thing: Any) -> str:
    if not inspect.isclass(thing):
        return f"### {path}\n\n{_code(_signature(thing))}\n\n{_docstring(thing)}"
    methods = (
        [] if path in PLACES["without_methods"] else [_method(thing.__name__, *found) for found in _methods(thing)]
    )
    return "\n\n".join([f"### {path}", _code(_head(thing)), _docstring(thing, _fields(thing)), *methods])


def _fields(thing: type) -> list[str]:
    return [name for name in vars(thing).get("__annotations__", {}) if not name.startswith("_")]


def _methods(thing: type) -> Iterator[tuple[str, Any, str]]:
    """Yields name, function and kind of the documented methods and properties of a class."""
    for name, member in vars(thing).items():
        found = getattr(member, "fget", None) or getattr(member, "__func__", member)
        if not name.startswith("_") and inspect.isfunction(found) and found.__doc__:
            kind = {property: "property", classmethod: "class method"}.get(type(member), "")
            yield name, found, kind


def _method(owner: str, name: str, function: Callable[..., Any], kind: str) -> str:
    signature = _signature(function) if kind != "property" else f"{name}{_returned(inspect.signature(function))}"
    return "\n\n".join([f"#### {owner}.{name}", _code(signature, kind), _docstring(function)])


def _code(text: str, kind: str = "") -> str:
    comment = f"# {kind}\n" if kind else ""
    return f"```python\n{comment}{text}\n```"


def _signature(function: Callable[..., Any], name: str = "") -> str:
    """Returns name, parameters and result of a function, on one line or with a line for each parameter."""
    found = inspect.signature(function)
    given, star = [], False
    for p in found.parameters.values():
        if p.name in ("self", "cls"):
            continue
        if p.kind is p.KEYWORD_ONLY and not star:
            given.append("*")
        star = star or p.kind in (p.KEYWORD_ONLY, p.VAR_POSITIONAL)
        marks = {p.VAR_POSITIONAL: "*", p.VAR_KEYWORD: "**"}.get(p.kind, "")
        type_ = "" if p.annotation is p.empty else f": {_type(p.annotation)}"
        given.append(f"{marks}{p.name}{type_}" + ("" if p.default is p.empty else f" = {p.default!r}"))
    name, result = name or function.__name__, _returned(found)
    line = f"{name}({', '.join(given)}){result}"
    return line if len(line) <= WIDTH else "\n".join([f"{name}(", *(f"    {one}," for one in given), f"){result}"])


def _type(annotation: Any) -> str:
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))


def _returned(found: inspect.Signature) -> str:
    return "" if found.return_annotation in (found.empty, "None") else f" -> {_type(found.return_annotation)}"


def _head(thing: type) -> str:
    """Returns the fields of a class with their comments as they stand in its source, or how it is made."""
    source = inspect.getsource(thing)
    body = ast.parse(source).body[0].body  # type: ignore[attr-defined]
    fields = [one for one in body if isinstance(one, ast.AnnAssign) and not _name(one).startswith("_")]
    bases = [one.__name__ for one in thing.__bases__ if f"{one.__module__}.{one.__name__}" in PATHS]
    head = f"class {thing.__name__}" + (f"({', '.join(bases)})" if bases else "")
    if not fields:
        made = thing.__init__ if "__init__" in vars(thing) else None
        return f"class {_signature(made, thing.__name__)}" if made else head
    lines = source.splitlines()
    first, last = fields[0].lineno - 1, fields[-1].end_lineno or 0
    while lines[first - 1].strip().startswith("#"):
        first -= 1
    return "\n".join([f"{head}:", *lines[first:last]])


def _name(field: ast.AnnAssign) -> str:
    return field.target.id if isinstance(field.target, ast.Name) else "_"


def _docstring(thing: Any, fields: Sequence[str] = ()) -> str:
    """Returns a docstring of Google's form as Markdown. fields: of a class; where its text describes them one after the
    other, as `name (shape): meaning.`, they become a list."""
    text, *sections = SECTION.split(inspect.getdoc(thing) or "")
    parts = [_with_fields(_linked(text.strip()), fields)]
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        if title == "Returns":
            parts.append(f"**Returns** {_linked(' '.join(body.split()))}")
        elif title == "Example":
            parts.append(_code(inspect.cleandoc(body)))
        elif title == "Options":
            options = (line.partition(": ") for line in body.strip().splitlines())
            rows = [row(f"`{cell(name)}`", cell(meaning).replace("*", r"\*")) for name, _, meaning in options]
            parts.append(table("option", "meaning", rows=rows))
        else:
            entries = (" ".join(one.split()).partition(": ") for one in ENTRY.split(body) if one.strip())
            parts.append(f"**{WORDS[title]}**\n\n" + "\n".join(f"- `{k}`: {_linked(v)}" for k, _, v in entries))
    return "\n\n".join(part for part in parts if part)


def _linked(text: str) -> str:
    """Returns a text in which the public names that stand in backticks lead to their entries."""
    classes = {name: path for path in PATHS if (name := path.rpartition(".")[2])[0].isupper()}

    def link(found: re.Match[str]) -> str:
        path = found[1] if found[1] in PATHS else classes.get(found[1])
        return f"[`{found[1]}`](#{path.lower().replace('.', '')})" if path else found[0]

    return escaped(re.sub(r"`([\w.]+)`", link, text))


def _with_fields(text: str, fields: Sequence[str]) -> str:
    name = "|".join(map(re.escape, fields))
    start = re.compile(rf"(?:(?<=[.;)\]] )|^)((?:{name})(?:\(\))?(?:, (?:{name}))*)((?: \([^:.]*\))?): ")
    return "\n\n".join(_listed(part, start) for part in text.split("\n\n")) if fields else text


def _listed(paragraph: str, start: re.Pattern[str]) -> str:
    text = " ".join(paragraph.split())
    found = list(start.finditer(text))
    if len(found) < 2:
        return paragraph
    ends = [*(one.start() for one in found[1:]), len(text)]
    meanings = (text[one.end() : end].strip(" ;") for one, end in zip(found, ends, strict=True))
    rows = [f"- `{one[1]}`{one[2]}: {meaning}" for one, meaning in zip(found, meanings, strict=True)]
    return "\n\n".join(filter(None, [text[: found[0].start()].strip(), "\n".join(rows)]))
