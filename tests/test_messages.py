"""The list of all messages, `messages.txt`, is up to date. After a change of messages, write it again:

    python -m tests.test_messages

The list contains, for each module, the texts that are raised, issued as warnings, or printed. A name or an expression
in braces stands for a value, and | separates alternatives. If a value is itself a text of the package, an indented line
`name = text` contains this text. The test finds these texts: it follows a name to its assignments, a parameter to the
calls of its function, and a call to the returned values.

The test does not find texts in default values, loop variables, unpacked tuples, fields of a dataclass, `__str__` and
`error.args`, and in a built-in exception that is assigned to a name before it is raised. Single words that are parts of
a message are not listed.

The list leaves out internal assertions, texts of Python, click and the operating system, help texts, labels of figures,
and texts of the explorer's page except its refusals.
"""

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from vibrodrive import errors

HERE = Path(__file__).parent
LIST = HERE / "messages.txt"

PRINT = {"say", "echo", "warn", "print", "leave", "os.write", "exit", *errors.__all__}
"""Functions and exceptions whose arguments are messages. An exception may be created before it is raised."""

LINES = {"line", "refusal"}  # functions that return messages
FAULTS = {"wrong", "faults"}  # variables whose values are messages about a file

SENTENCES = {"bad": "{} = {}: must be {}", "bad_axes": "axes = {}: must be {}", "unknown": "{} = {}: must be one of {}"}
"""Functions of model/parameters.py that build messages."""

JOIN = {"join", "replace", "sorted", "items", *SENTENCES}  # calls whose arguments are parts of a message
OTHER = {"args", "comparators", "format_spec", "generators", "keys", "keywords", "slice", "test"}  # no parts of a text


def name_of(node: Any) -> str:
    """Return "a" for `a`, `b.a`, `a(…)` and `a[…]`."""
    if isinstance(node, (ast.Call, ast.Subscript)):
        return name_of(node.func if isinstance(node, ast.Call) else node.value)
    return getattr(node, "id", "") or getattr(node, "attr", "")


def parts(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes of an expression whose values become parts of its text."""
    yield node
    for field, value in ast.iter_fields(node):
        if field not in OTHER or (field == "args" and name_of(node) in JOIN):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from parts(child)


def words(node: ast.AST) -> str:
    """Return the literal text in an expression."""
    literals = (n.value for n in parts(node) if isinstance(n, ast.Constant) and isinstance(n.value, (str, bytes)))
    return "".join(v if isinstance(v, str) else v.decode() for v in literals).strip()


def written(node: Any) -> str:
    """Return the text of an expression as a user reads it, with unknown values in braces and alternatives after |."""
    match node:
        case ast.Constant(value=str(text)):
            return text.replace("\n", " ")
        case ast.Constant(value=bytes(text)):
            return text.decode().replace("\n", " ")
        case ast.JoinedStr(values=some):
            return "".join(map(written, some))
        case ast.List(elts=some):
            return ", ".join(map(written, some)) or "[]"
        case ast.IfExp(body=one, orelse=other) | ast.BoolOp(values=[one, other]):
            return f"({written(one)} | {written(other)})"
        case ast.FormattedValue(value=inner) | ast.Lambda(body=inner) | ast.Starred(value=inner):
            return written(inner)
        case ast.Call(func=ast.Attribute(attr="join"), args=[inner]):
            return written(inner)
        case ast.Call(func=ast.Attribute(attr="encode", value=inner)):
            return written(inner)
        case ast.GeneratorExp(elt=inner) | ast.ListComp(elt=inner):
            return f"{written(inner)}, …"
        case ast.BinOp(op=ast.Add(), left=one, right=other):
            return written(one) + written(other)
        case ast.Call(args=args) if name_of(node) in SENTENCES:
            return SENTENCES[name_of(node)].format(*map(written, args))
    return "{" + ast.unparse(node) + "}"


def is_text(annotation: Any) -> bool:
    """Return True if a value with this annotation can be a text."""
    return annotation is not None and "str" in ast.unparse(annotation)


def outside(node: Any) -> Iterator[Any]:
    """Yield the nodes that contain a node, from inside outwards."""
    while node := getattr(node, "parent", None):
        yield node


def assigned(node: ast.AST) -> tuple[list[Any], list[Any]]:
    """Return (targets, values) of an assignment or of an addition to a list."""
    match node:
        case ast.Assign(targets=targets, value=value):
            return targets, [value]
        case ast.AnnAssign() | ast.AugAssign() | ast.NamedExpr() if node.value:
            return [node.target], [node.value]
        case ast.Call(func=ast.Attribute(attr="append" | "extend", value=target), args=values):
            return [target], values
    return [], []


class Package:
    """Expressions of the package.

    given : lists of expressions or files, with keys of three kinds:
        (function, name): values assigned to the name in the function, or at module level if function is None
        (kind, name): calls, returned values, properties or attributes with this name
        (path, name): file from which the module at this path imports the name
    messages : expressions that are messages
    """

    def __init__(self) -> None:
        self.given: dict[tuple[Any, str], list[Any]] = defaultdict(list)
        self.messages: list[Any] = []
        for path in sorted((HERE.parent / "vibrodrive").rglob("*.py")):
            module = path.relative_to(HERE.parent).as_posix()
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                node.path = module
                for child in ast.iter_child_nodes(node):
                    child.parent = node
                self.read(node)

    def read(self, node: Any) -> None:
        """Add the values and messages of one node."""
        scope = next((n for n in outside(node) if isinstance(n, ast.FunctionDef)), None)
        targets, values = assigned(node)
        for target in targets:
            self.given["attribute" if isinstance(target, ast.Attribute) else scope, name_of(target)] += values
            self.messages += values * (name_of(target) in FAULTS)
        match node:
            case ast.Call(args=args):
                self.given["call", name_of(node)].append(node)
                if (ast.unparse(node.func) if name_of(node) == "write" else name_of(node)) in PRINT:
                    self.messages += args
                elif name_of(node) == "update":  # of a progress line
                    self.messages += [a for a in args if isinstance(a, ast.Lambda)]
            case ast.ImportFrom(module=str(module), names=names):
                for alias in names:
                    self.given[node.path, alias.name].append(module.replace(".", "/") + ".py")
            case ast.Raise(exc=ast.Call(args=args)):
                self.messages += args
            case ast.Return(value=value) | ast.Yield(value=value) if value and is_text(scope.returns):
                self.given["property" if scope.decorator_list else "return", scope.name].append(value)
                self.messages += [value] * (scope.name in LINES)

    def sources(self, node: ast.AST) -> list[Any]:
        """Return the expressions that give the value of a name, of an attribute or of a call."""
        name, given = name_of(node), self.given
        match node:
            case ast.Call(func=ast.Name()):
                homes = {node.path, *given[node.path, name]}
                return [value for value in given["return", name] if value.path in homes]
            case ast.Call(func=ast.Attribute()):
                return given["return", name]
            case ast.Attribute() if not isinstance(node.parent, ast.Subscript):
                return given["property", name] + given["attribute", name]
            case ast.Name():
                for f in (n for n in outside(node) if isinstance(n, ast.FunctionDef)):
                    if given[f, name] or any(a.arg == name for a in ast.walk(f.args) if isinstance(a, ast.arg)):
                        return given[f, name] + self.passed(f, name)
                return given[None, name]
        return []

    def passed(self, function: Any, name: str) -> list[Any]:
        """Return the values that calls of `function` give to its parameter `name`, or [] if `name` cannot be a text."""
        parameters = [a for a in ast.walk(function.args) if isinstance(a, ast.arg)]
        if not any(a.arg == name and is_text(a.annotation) for a in parameters):
            return []
        of_class = isinstance(function.parent, ast.ClassDef)
        called = function.parent.name if function.name == "__init__" else function.name
        calls = [c for c in self.given["call", called] if c.path == function.path or not called.startswith("_")]
        names = [a.arg for a in parameters[of_class:]]
        values = [dict(zip(names, c.args, strict=False)) | {k.arg: k.value for k in c.keywords} for c in calls]
        return [at[name] for at in values if name in at]


def collect() -> str:
    """Return the list of messages as text."""
    package = Package()
    labels: dict[Any, str] = {}
    todo = [(m, "") for m in package.messages]
    while todo:
        node, label = todo.pop()
        match node:
            case ast.IfExp(body=one, orelse=other):
                todo += [(one, label), (other, label)]
            case ast.List(elts=some) | ast.Tuple(elts=some) | ast.Dict(values=some):
                todo += [(n, label) for n in some]
            case _ if node not in labels:
                labels[node] = label
                todo += [(source, name_of(n)) for n in parts(node) for source in package.sources(n)]
    kept = {n for n, label in labels.items() if name_of(n) in SENTENCES or (" " in words(n) if label else words(n))}
    lines: dict[str, dict[str, None]] = defaultdict(dict)
    for n in sorted(kept, key=lambda n: (n.path, n.lineno, n.col_offset)):
        if not kept.intersection(outside(n)):
            lines[n.path][f"    {labels[n]} = {written(n)}" if labels[n] else written(n)] = None
    return "\n".join("\n".join([path, *(f"    {line}" for line in found), ""]) for path, found in lines.items())


def test_the_list_contains_all_messages():
    assert collect() == LIST.read_text(encoding="utf-8"), "messages have changed: run python -m tests.test_messages"


if __name__ == "__main__":
    LIST.write_text(collect(), encoding="utf-8")
