"""The house rules that neither the linter nor the import contracts can state."""

import ast
import re
import tokenize
import tomllib
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from grimp import build_graph

ROOT = Path(__file__).parents[1]
PACKAGES = (
    *("anatomy", "app", "benchmarks", "devices", "system", "paravol"),
    *("renderers", "scenarios", "surgery"),
)
SOURCES = sorted(p for name in PACKAGES for p in (ROOT / name).rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))
FACES = [p for p in SOURCES if p.name == "__init__.py"]
KERNELS = [p for p in SOURCES if p.parent.name == "kernels" and p.name != "__init__.py"]
SIMD = [p for p in SOURCES if p.is_relative_to(ROOT / "renderers" / "simd")]
POOL = ROOT / "renderers" / "scene" / "thread_pool.py"


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def at(path: Path, line: int | ast.AST) -> str:
    number = line if isinstance(line, int) else getattr(line, "lineno", 1)
    return f"{path.relative_to(ROOT)}:{number}"


@cache
def nodes(path: Path) -> list[ast.AST]:
    return list(ast.walk(parsed(path)))


@cache
def imported(path: Path) -> list[tuple[ast.stmt, str]]:
    """Give every import, wherever it stands, with the full name of its module."""
    found: list[tuple[ast.stmt, str]] = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            found += [(node, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found.append((node, "." * node.level + (node.module or "")))
    return found


def names_of_face(path: Path) -> tuple[list[str], list[str], list[str]]:
    """Give what a face imports, what it lists, and statements not to be there.

    A name whose module loads a large library may be imported when it is asked for: by
    `__getattr__`, and beside it for type checkers.
    """
    names: list[str] = []
    listed: list[str] = []
    others: list[str] = []
    for node in parsed(path).body:
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                pass
            case ast.ImportFrom(module="typing", names=[ast.alias("TYPE_CHECKING")]):
                pass
            case ast.ImportFrom():
                names += [alias.asname or alias.name for alias in node.names]
            case ast.If(
                test=ast.Name(id="TYPE_CHECKING"),
                body=[ast.ImportFrom() as late],
                orelse=[ast.FunctionDef(name="__getattr__")],
            ):
                names += [alias.asname or alias.name for alias in late.names]
            case ast.Assign(targets=[ast.Name(id="__all__")]):
                listed = ast.literal_eval(node.value)
            case _:
                others.append(at(path, node))
    return names, listed, others


def test_there_is_something_to_check() -> None:
    assert len(FACES) >= len(PACKAGES)
    assert len(SOURCES) > 2 * len(FACES)
    assert KERNELS


def test_a_face_is_a_docstring_imports_and_the_full_sorted_list() -> None:
    wrong = []
    for path in FACES:
        names, listed, others = names_of_face(path)
        wrong += others
        if set(names) != set(listed) or len(set(listed)) != len(listed):
            wrong.append(f"{at(path, 1)} imports {names} and lists {listed}")
        # The linter's order: constants, then classes, then the rest.
        order = [(n.upper() != n, n[0].islower(), n) for n in listed]
        if order != sorted(order) or any(n.startswith("_") for n in listed):
            wrong.append(f"{at(path, 1)} lists {listed}")
        if ast.get_docstring(parsed(path)) is None:
            wrong.append(f"{at(path, 1)} does not say what the package is for")
    assert not wrong


def test_a_face_imports_from_its_own_package_only() -> None:
    wrong = []
    for path in FACES:
        package = ".".join(path.parent.relative_to(ROOT).parts)
        wrong += [
            f"{at(path, node)} {name}"
            for node, name in imported(path)
            if not name.startswith(package + ".") and name != "typing"
        ]
    assert not wrong


def test_only_kernels_are_compiled_and_only_lanes_extend_the_compiler() -> None:
    assert not [
        at(path, node)
        for path in SOURCES
        if path not in KERNELS + SIMD
        for node, name in imported(path)
        if name.partition(".")[0] in ("numba", "llvmlite")
    ]
    assert not [
        at(path, node)
        for path in SOURCES
        if path not in SIMD
        for node, name in imported(path)
        if name.partition(".")[0] == "llvmlite" or name.startswith("numba.")
    ]


def test_only_kernels_take_vectors() -> None:
    """Others ask the self-check whether this numba is one that vectors know."""
    assert not [
        at(path, node)
        for path in SOURCES
        # A pool's threads wait for one another by atomic counters.
        if path not in (*KERNELS, *SIMD, POOL)
        for node, name in imported(path)
        if name == "renderers.simd" or name.startswith("renderers.simd.")
        if name != "renderers.simd.self_check"
    ]


def test_kernels_import_no_policy() -> None:
    """Arrays in, arrays out: no files, no logging, none of our own objects.

    From us a kernel takes vectors, other kernels and modules that only lay out its
    arguments, by their full names: the compiled code's cache is named by exactly
    these files.
    """
    plain = {"numba", "llvmlite", "numpy", "math", "typing", "collections", "enum"}
    wrong = []
    for path in KERNELS:
        for node, name in imported(path):
            if name.partition(".")[0] in plain or ".kernels." in f"{name}.":
                continue
            if name == "renderers.simd" or name.startswith("renderers.simd."):
                continue
            layout = ROOT / f"{name.replace('.', '/')}.py"
            if not layout.is_file() or not plain >= {
                inner.partition(".")[0] for _, inner in imported(layout)
            }:
                wrong.append(f"{at(path, node)} {name}")
    assert not wrong


def test_kernels_have_no_default_values() -> None:
    assert not [
        f"{at(path, node)} {node.name}"
        for path in KERNELS
        for node in nodes(path)
        if isinstance(node, ast.FunctionDef)
        and (node.args.defaults or any(node.args.kw_defaults))
    ]


def test_compiled_code_keeps_the_bits_and_the_threads_to_itself() -> None:
    """No full fast-math and no thread pool of numba's own."""
    safe = {"contract", "reassoc", "arcp", "nsz"}
    wrong = []
    for path in KERNELS:
        for node in nodes(path):
            if not isinstance(node, ast.keyword):
                continue
            if node.arg == "parallel":
                wrong.append(at(path, node))
            if node.arg == "fastmath" and not (
                isinstance(node.value, ast.Set) and ast.literal_eval(node.value) <= safe
            ):
                wrong.append(at(path, node))
    assert not wrong


def test_nothing_read_can_become_code() -> None:
    wrong = []
    for path in SOURCES:
        wrong += [
            at(path, node)
            for node, name in imported(path)
            if name.partition(".")[0] in ("pickle", "marshal", "shelve", "dill")
        ]
        for node in nodes(path):
            match node:
                case ast.Call(func=ast.Name(id="eval" | "exec")):
                    wrong.append(at(path, node))
                case ast.keyword(arg="allow_pickle", value=ast.Constant(value=True)):
                    wrong.append(at(path, node))
                case ast.keyword(arg="shell", value=ast.Constant(value=True)):
                    wrong.append(at(path, node))
    assert not wrong


def test_nothing_waits_by_a_clock_that_somebody_may_set() -> None:
    """It jumps by hours where a zone or a server says so; OpenIGTLink sends it."""
    wrong = []
    for path in SOURCES:
        for node in nodes(path):
            match node:
                case ast.Attribute(value=ast.Name(id="time"), attr="time" | "time_ns"):
                    wrong.append(path.relative_to(ROOT).as_posix())
    assert wrong == ["devices/openigtlink/streamer.py"]


def test_checks_are_silenced_one_by_one_and_by_name() -> None:
    silenced = re.compile(r"#\s*(type:\s*ignore|noqa)(?P<code>[\[:]\s*\w)?")
    wrong = []
    for path in SOURCES + TESTS:
        if not silenced.search(path.read_text(encoding="utf-8")):
            continue
        with tokenize.open(path) as file:
            for token in tokenize.generate_tokens(file.readline):
                if token.type == tokenize.COMMENT:
                    found = silenced.search(token.string)
                    if found and not found["code"]:
                        wrong.append(at(path, token.start[0]))
    assert not wrong


def test_imports_are_absolute_and_of_today() -> None:
    assert not [
        at(path, node)
        for path in SOURCES + TESTS
        for node, name in imported(path)
        if name.startswith(".") or name == "__future__"
    ]


def test_files_are_named_after_what_they_hold() -> None:
    vague = {"utils", "util", "helpers", "helper", "common", "misc", "manager"}
    assert not [
        at(path, 1)
        for path in SOURCES + TESTS
        if vague & {path.stem.removeprefix("test_"), *path.parts[len(ROOT.parts) : -1]}
    ]


def test_every_source_says_what_it_is() -> None:
    assert not [at(p, 1) for p in SOURCES if ast.get_docstring(parsed(p)) is None]


BUDGET = {
    "anatomy": 16115,
    "app": 19183,
    "benchmarks": 10998,
    "devices": 13348,
    "examples": 1722,
    "paravol": 28588,
    "renderers": 38044,
    "scenarios": 12399,
    "surgery": 7384,
    "system": 1201,
    "tests": 95494,
}
"""Lines of Python by package. A figure only falls; one that has to rise is changed in
a commit of its own that says what the new lines are for."""

SLACK = 0.01
"""Lines that were gained and are not taken off the budget, at most, by all lines."""


def test_each_package_keeps_its_budget_of_lines() -> None:
    files = Counter[str]()
    for path in (*SOURCES, *EXAMPLES, *TESTS):
        room = path.relative_to(ROOT).parts[0]
        files[room] += len(path.read_text(encoding="utf-8").splitlines())
    assert files.keys() == BUDGET.keys()
    assert not {
        n: f"{files[n]} of {most}" for n, most in BUDGET.items() if files[n] > most
    }
    # what was gained is taken off, so that it stays gained
    kept = {
        n: most for n, most in BUDGET.items() if files[n] < most - SLACK * most - 50
    }
    assert not kept, "lower the budget of these"


def test_tests_are_no_packages() -> None:
    """A tests/renderers/__init__.py would hide the real `renderers`."""
    assert not [at(path, 1) for path in TESTS if path.name == "__init__.py"]


MOST_PARAMETERS = 12
MOST_LINES = 100
MOST_LINES_OF_A_KERNEL = 150
LONGER = {("march_packets", "march_packets"), ("march_packets", "march")}
"""The one march of rays: a part of its loop would take and return thirty vectors."""


def functions(path: Path) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    kinds = ast.FunctionDef | ast.AsyncFunctionDef
    return [node for node in nodes(path) if isinstance(node, kinds)]


def test_a_function_has_few_parameters() -> None:
    """Arrays that belong together travel as a NamedTuple with typed fields."""
    wrong = []
    for path in SOURCES:
        for node in functions(path):
            given = node.args
            count = len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs)
            if count > MOST_PARAMETERS:
                wrong.append(f"{at(path, node)} {node.name} has {count} parameters")
    assert not wrong


def test_a_function_fits_two_screens() -> None:
    wrong = []
    for path in SOURCES:
        most = MOST_LINES_OF_A_KERNEL if path in KERNELS else MOST_LINES
        for node in functions(path):
            count = (node.end_lineno or node.lineno) - node.lineno + 1
            if count > most and (path.stem, node.name) not in LONGER:
                wrong.append(f"{at(path, node)} {node.name} has {count} lines")
    assert not wrong


def test_a_folder_holds_more_than_one_module() -> None:
    wrong = []
    for folder in {path.parent for path in SOURCES}:
        modules = [p for p in folder.glob("*.py") if p.name != "__init__.py"]
        below = [p for p in folder.iterdir() if (p / "__init__.py").is_file()]
        if len(modules) + len(below) < 2:
            wrong.append(at(folder, 1))
    assert not wrong


def test_renderers_are_three_folders_deep_at_most() -> None:
    top = ROOT / "renderers"
    assert not [
        at(path, 1)
        for path in SOURCES
        if path.is_relative_to(top) and len(path.relative_to(top).parts) > 3 + 1
    ]


@cache
def words(path: Path) -> list[str]:
    """Give every identifier that a file mentions, as name, attribute or text."""
    found = []
    for node in nodes(path):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name):
                found.append(name)
            case ast.keyword(arg=str(name)):
                found.append(name)
            case ast.Constant(value=str(name)) if name.isidentifier():
                found.append(name)
    return found


def own_words(node: ast.AST) -> list[str]:
    names = [n.id for n in ast.walk(node) if isinstance(n, ast.Name)]
    return names + [n.attr for n in ast.walk(node) if isinstance(n, ast.Attribute)]


def defined(path: Path) -> list[tuple[ast.stmt, str]]:
    """Give what a module defines, and the methods of classes that inherit nothing.

    What a decorator or a base class may call by itself is left out.
    """
    found: list[tuple[ast.stmt, str]] = []
    for node in parsed(path).body:
        match node:
            case ast.FunctionDef(name=name, decorator_list=[]):
                found.append((node, name))
            case ast.Assign(targets=[ast.Name(id=name)]):
                found.append((node, name))
            case ast.AnnAssign(target=ast.Name(id=name)):
                found.append((node, name))
            case ast.ClassDef(name=name, bases=bases, body=body, decorator_list=[]):
                found.append((node, name))
                found += [
                    (inner, inner.name)
                    for inner in body
                    if isinstance(inner, ast.FunctionDef) and not bases
                ]
    return [(node, name) for node, name in found if not name.startswith("__")]


FAULT_PORT = {"send_foreign"}
"""What the emulated arm's rare faults act through; they stand with the tests."""


def entry_points() -> set[str]:
    """Give what other programs call, as `pyproject.toml` tells them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    groups = [project["scripts"], *project["entry-points"].values()]
    return {target.partition(":")[2] for group in groups for target in group.values()}


def test_what_only_tests_reach_is_no_source() -> None:
    """Product is named again in the product, benchmarks there or in examples."""
    called_from_outside = FAULT_PORT | entry_points()
    product = [p for p in SOURCES if p.relative_to(ROOT).parts[0] != "benchmarks"]
    measuring = [p for p in SOURCES if p not in product]
    wrong = []
    for sources, readers in (
        (product, product),
        (measuring, SOURCES + EXAMPLES),
    ):
        mentioned = Counter(word for path in readers for word in words(path))
        wrong += [
            f"{at(path, node)} {name}"
            for path in sources
            for node, name in defined(path)
            if mentioned[name] <= own_words(node).count(name)
            if name not in called_from_outside
        ]
    assert not wrong


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Late imports count, too; those for types alone do not."""
    rooms = (name for name in PACKAGES if name != "app")
    graph = build_graph(*rooms, exclude_type_checking_imports=True)
    around = {
        each: graph.find_modules_directly_imported_by(each) for each in graph.modules
    }
    TopologicalSorter(around).prepare()


def test_files_that_the_documents_name_are_there() -> None:
    wrong = []
    for path in sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]):
        text = path.read_text(encoding="utf-8")
        named = re.findall(r"`((?:[a-z_]+/)+[\w.]*)`", text)
        linked = re.findall(r"\]\(([\w./-]+)\)", text)
        wrong += [
            f"{at(path, 1)} {name}"
            for name in named
            if name.split("/")[0] in (*PACKAGES, "tests", "docs", "examples")
            and not (ROOT / name).exists()
        ]
        wrong += [
            f"{at(path, 1)} {link}"
            for link in linked
            if not (path.parent / link).exists()
        ]
    assert not wrong


def test_the_architecture_is_told_in_250_lines() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 250
