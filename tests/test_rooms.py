"""The package as a whole: rooms from the ground up, no circles, names that are there, one job a room."""

import ast
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

from places import page

import exo_pin

FOLDER = Path(exo_pin.__file__).parent
#: From the ground up: a room imports only what stands before it.
ORDER = (
    "core", "numerics", "design", "muscle", "load_case", "chain", "wrist", "wrist_chain", "device", "reaction",
    "uncertainty", "person", "consistency", "thesis", "study", "workspace", "calibration", "control", "view", "report",
    "exo", "service", "app", "testing", "cli",
)  # fmt: skip
#: Rooms that stand before another one and are still none of its business.
APART = {"chain": {"design", "muscle", "load_case"}, "wrist": {"chain"}}


def name_of(path):
    parts = (FOLDER.name, *path.relative_to(FOLDER).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {name_of(path): path for path in sorted(FOLDER.rglob("*.py"))}


@cache
def trees():
    """Every file as parsed, once for the tests of this file."""
    return {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in FILES.items()}


@cache
def calls():
    """Every call in each file."""
    return {name: [node for node in ast.walk(tree) if isinstance(node, ast.Call)] for name, tree in trees().items()}


def asked(node, package):
    """What a statement of a package's module imports: (module, name, as what), no name where it is a module itself."""
    if isinstance(node, ast.Import):
        return [(alias.name, None, alias.name) for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    parts = package.split(".")
    above = parts[: len(parts) - node.level + 1] if node.level else []
    base = ".".join([*above, *([node.module] if node.module else [])])
    inner = {alias: f"{base}.{alias.name}" for alias in node.names}
    return [
        (path, None, alias.asname or alias.name) if path in FILES else (base, alias.name, alias.asname or alias.name)
        for alias, path in inner.items()
    ]


def lazy_names():
    """What each name of a package's lazy list stands for: {package: {public name: (module, name)}}."""
    found = {}
    for path in FOLDER.rglob("__init__.pyi"):
        package = name_of(path)
        nodes = ast.parse(path.read_text(encoding="utf-8")).body
        found[package] = {public: (module, name) for node in nodes for module, name, public in asked(node, package)}
    return found


LAZY = lazy_names()


def behind(module, name):
    """Modules behind a name of a module, through lazy lists; behind a package as a whole is all that it lists."""
    names = LAZY.get(module, {})
    if name is None:
        return {module}.union(*(behind(*listed) for listed in names.values()))
    return behind(*names[name]) if name in names else {module}


#: Where statements hold other statements.
PARTS = ("body", "orelse", "handlers", "finalbody", "cases")


def imports(name, tree, late=False):
    """Modules of the package that a module imports when it is itself imported; those for types only are left out.

    With ``late`` those that its functions import count too.
    """
    package = name if FILES[name].name == "__init__.py" else name.rpartition(".")[0]
    found, left = set(), list(tree.body)
    while left:
        node = left.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        found |= {target for module, word, _ in asked(node, package) for target in behind(module, word)}
        # An import is a statement; what stands in expressions need not be looked at.
        inner = [child for part in PARTS for child in getattr(node, part, ())]
        left += inner if late or not isinstance(node, ast.FunctionDef) else []
    return found & set(FILES) - {name}


@cache
def graph():
    return {name: imports(name, tree) for name, tree in trees().items()}


def room(name):
    return name.split(".")[1] if "." in name else ""


def test_every_room_has_its_place():
    assert {room(name) for name in FILES} - {""} == set(ORDER)


def test_rooms_import_only_lower_rooms():
    place = {name: k for k, name in enumerate(ORDER)}
    wrong = [
        (name, target)
        for name, targets in graph().items()
        for target in targets
        if room(name) and room(target)
        if place[room(target)] > place[room(name)] or room(target) in APART.get(room(name), ())
    ]
    assert not wrong


def circle(graph):
    """Names that a circle leads to and that lead to one; empty where there is none."""
    left = set(graph)
    while (on := {name for name in left if graph[name] & left} & set().union(*(graph[name] for name in left))) != left:
        left = on
    return sorted(left)


def test_circles_are_found():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": set()}) == ["b", "c"]
    assert circle({"a": {"b"}, "b": set()}) == []


def test_modules_do_not_import_each_other_in_circles():
    assert not circle(graph())


def folders():
    """Folders, and those each imports, also late; one that holds the other does not count."""
    apart = {}
    for name, tree in trees().items():
        own = name if FILES[name].name == "__init__.py" else name.rpartition(".")[0]
        apart.setdefault(own, set())
        for target in imports(name, tree, late=True):
            other = target if FILES[target].name == "__init__.py" else target.rpartition(".")[0]
            if not f"{own}.".startswith(f"{other}.") and not f"{other}.".startswith(f"{own}."):
                apart[own].add(other)
    return apart


def test_folders_do_not_import_each_other_in_circles():
    assert not circle(folders())


def test_no_room_is_full():
    for folder in {path.parent for path in FILES.values()}:
        count = sum(path.parent == folder and path.name != "__init__.py" for path in FILES.values())
        assert count <= 12, f"{folder} has {count} files"


def test_public_names_are_there_and_described():
    for info in walk_packages(exo_pin.__path__, "exo_pin."):
        module = import_module(info.name)
        assert module.__doc__, info.name
        listed = getattr(module, "__all__", [])
        assert len(set(listed)) == len(listed), info.name
        for public in listed:
            assert getattr(module, public) is not None, (info.name, public)


def test_printing_is_left_to_the_command_line():
    for name, nodes in calls().items():
        prints = [node for node in nodes if isinstance(node.func, ast.Name) and node.func.id in ("print", "input")]
        assert not prints or room(name) == "cli", name


#: Calls that run code which they read.
RUNNING = {"eval", "exec", "pickle.load", "pickle.loads", "pickle.Unpickler", "marshal.loads", "shelve.open"}


def test_nothing_that_is_read_runs_as_code():
    for name, nodes in calls().items():
        found = {ast.unparse(node.func) for node in nodes} & RUNNING
        assert not found, name
        words = [keyword for node in nodes for keyword in node.keywords if keyword.arg == "allow_pickle"]
        assert all(isinstance(word.value, ast.Constant) and word.value.value is False for word in words), name


def test_matplotlib_is_imported_only_where_something_is_drawn():
    for name, tree in trees().items():
        top = tree.body
        names = {node.module.split(".")[0] for node in top if isinstance(node, ast.ImportFrom) and not node.level}
        assert "matplotlib" not in names, name


def test_the_page_for_contributors_lists_the_rooms_from_the_ground_up():
    assert ", ".join(f"`{name}`" for name in ORDER) in " ".join(page("contributing").split())


#: Programs and kernels that choose or bound forces; only the room that answers questions knows them.
FORCE_PROGRAMS = (
    "exo_pin.numerics.bounded.box_program",
    "exo_pin.numerics.bounded.polytope_program",
    "exo_pin.reaction.splits.limb_and_side_forces",
    "exo_pin.wrist.forces.force_kernels",
    "exo_pin.reaction.batch.limit_kernels",
    "exo_pin.reaction.holding.least_force_kernels",
    "exo_pin.reaction.batch.map_kernels",
)


def test_one_room_knows_the_programs_that_choose_forces():
    users = {program: {name for name, found in graph().items() if program in found} for program in FORCE_PROGRAMS}
    assert all(users.values()), "a program that nobody imports has another name now"
    for program, names in users.items():
        strangers = {name for name in names if room(name) not in ("reaction", "numerics")}
        assert not strangers, f"{program} is imported by {sorted(strangers)}"
