"""Parts of pages that are made from the code's own tables when the site is built."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path

from cyclopts import App
from public_names import HIDDEN, ROOMS, Public, callables, public_names

from exo_pin.chain.formats.leaving_out import LEAVE_OUT
from exo_pin.chain.structure.closures import TYPES
from exo_pin.cli import GROUPS
from exo_pin.cli.command import command, examples, notes, shown_default
from exo_pin.cli.documents.registry import DOCUMENTS, kind_of
from exo_pin.core import errors
from exo_pin.core.files.toml_tables import UNITS
from exo_pin.core.schema import identifier, members, reachable
from exo_pin.design.io.mechanism_reading import _KEYS
from exo_pin.thesis import condensed, ledger

#: The table of a design file that holds a record; records within others have the table of the key.
_TABLES = {
    "CircleDimensions": "[geometry.circles]",
    "WristGeometry": "[geometry.points]",
    "Shoulder": "[shoulder]",
    "Limb": "[[limbs]]",
    "Stroke": "stroke, of a limb",
    "LimbBody": "base_body and platform_body, of a limb",
    "LimbGuide": "guide, of a limb",
    "Actuator": "actuator, of a limb",
    "Tackle": "tackle, of an actuator",
    "Wearer": "[arm.wearer]",
}
#: Names that notebooks and pages use most, as a script writes them.
MOST_USED = {
    "exo_pin.load": "ep.load",
    "exo_pin.ShoulderExo.pose": "exo.pose",
    "exo_pin.shoulder_rotation": "ep.shoulder_rotation",
    "exo_pin.ShoulderExo.reaction": "exo.reaction",
    "exo_pin.Person": "ep.Person",
    "exo_pin.ShoulderExo.worn_by": "exo.worn_by",
    "exo_pin.ShoulderExo.joint_contact": "exo.joint_contact",
    "exo_pin.ShoulderExo.replace": "exo.replace",
    "exo_pin.ShoulderExo.workspace": "exo.workspace",
    "exo_pin.ShoulderExo.view": "exo.view",
}
#: Modules by what a reader wants to do.
TASKS = {
    "Compute forces": ("exo", "load_case", "reaction"),
    "Describe a device": ("design", "device"),
    "Count the wearer's muscles": ("person",),
    "Judge and improve a design": ("workspace", "study"),
    "Know how sure a number is": ("uncertainty", "calibration", "consistency"),
    "Move it": ("control", "muscle"),
    "Draw, report, serve": ("view", "report", "service"),
    "Use any robot with closed loops": ("chain",),
    "Use the wrist's closed forms": ("wrist", "wrist_chain"),
    "Look up errors and the thesis": ("core", "thesis"),
}
#: Classes whose own methods are not listed under their children.
_BUILT_IN = "tuple, dict, list, str, int, float"
_ITEM = re.compile(r"^(\w[\w, ]*) : (.*)\n((?:    .*\n|\n)*)", re.MULTILINE)


def write_api(folder: Path) -> None:
    """Write one page a module, and their list by task."""
    folder.mkdir(parents=True, exist_ok=True)
    found = public_names()
    listed = {id(item) for names in found.values() for _, item in names}
    kinds = ((f"{errors.__name__}.{name}", getattr(errors, name)) for name in errors.__all__)
    found["core"] += [Public(path, item) for path, item in kinds if id(item) not in listed]
    for module, names in found.items():
        blocks = "\n".join(_entry(path, item) for path, item in names)
        (folder / f"{module}.md").write_text(
            f"# {module}\n\n{ROOMS[module]}.\n\n```{{eval-rst}}\n{blocks}```\n", encoding="utf-8"
        )
    lines = [
        "# API by task",
        "",
        "`ep` is `import exo_pin as ep`, `exo` what `ep.load` returns. Tests run the examples.",
    ]
    lines += ["", "## The ten names used most", "", "| name | what it does |", "| --- | --- |"]
    lines += [f"| {_link(path, said)} | {_cell(_first_line(path))} |" for path, said in MOST_USED.items()]
    for task, modules in TASKS.items():
        lines += ["", f"## {task}", "", "| module | names |", "| --- | --- |"]
        for module in (each for each in modules if each in found):
            names = ", ".join(_link(path, path.rpartition(".")[2]) for path, _ in found[module])
            lines.append(f"| [{module}]({module}.md): {_cell(ROOMS[module])} | {names} |")
    shown = [module for modules in TASKS.values() for module in modules if module in found]
    lines += ["", "```{toctree}", ":hidden:", "", *shown, "```"]
    (folder / "index.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def _link(path: str, said: str) -> str:
    return f"{{py:obj}}`{said} <{path}>`"


def _first_line(path: str) -> str:
    """First sentence of a docstring, without roles."""
    text = " ".join((inspect.getdoc(callables()[path]) or "").split("\n\n")[0].split())
    return re.sub(r":\w+:`~?[\w.]*?(\w+)`", r"`\1`", text).replace("``", "`")


def _entry(path: str, item: object) -> str:
    if inspect.isclass(item):
        inherited = "" if issubclass(item, BaseException) else f"   :inherited-members: {_BUILT_IN}\n"
        return f".. autoclass:: {path}\n   :members:\n   :exclude-members: {', '.join(HIDDEN)}\n{inherited}\n"
    return f".. autofunction:: {path}\n\n"


def command_line() -> str:
    """Every command with its examples and options, from the parser of the command line."""
    lines = []
    for title, commands in GROUPS.items():
        lines += [f"## {title}", ""]
        for name in commands:
            app = command(name)
            lines += [f"### exo-pin {name}", "", app.help or "", "", "```bash", *examples(name), "```", ""]
            lines += ["| option | meaning |", "| --- | --- |", *_options(app), ""]
            lines += ["```text", notes(name).strip("\n"), "```", ""] if notes(name) else []
    return "\n".join(lines)


def _options(app: App) -> Iterable[str]:
    for each in app.assemble_argument_collection(parse_docstring=True):
        if each.parse and not each.children:
            choices = "{" + ",".join(each.get_choices()) + "}" if each.get_choices() else None
            value = "" if each.hint is bool else choices or each.parameter.metavar or ""
            called = ", ".join(each.names) if each.name.startswith("--") else each.name
            default, said = shown_default(each.field_info.default), each.parameter.help or ""
            said += f" Default {default}." if default and not each.required and "default" not in said else ""
            yield f"| `{_cell(f'{called} {value}'.strip())}` | {_cell(said)} |"


def _cell(text: str) -> str:
    """A text as a cell of a Markdown table."""
    return " ".join(text.split()).replace("|", "\\|")


def design_keys() -> str:
    """Keys of a design file, by table, with their units; what each means is its record's docstring."""
    lines = []
    for record, keys in _KEYS.items():
        said = _attributes(record)
        defaults = {each.name: each.default for each in fields(record)} if is_dataclass(record) else {}
        lines += [f"### {_TABLES[record.__name__]}", "", "| key | must be given | meaning |", "| --- | --- | --- |"]
        for key in keys:
            units = [""] if isinstance(key.kind, type) or key.kind in ("text", "law") else UNITS[key.kind]
            names = ", ".join(f"`{key.name}{unit}`" for unit in units)
            meaning = said.get(key.field, "")
            if key.choices:
                meaning += " One of " + ", ".join(f'`"{choice}"`' for choice in key.choices) + "."
            needed = key.required and defaults.get(key.field, MISSING) is MISSING
            lines.append(f"| {names} | {'yes' if needed else ''} | {_cell(meaning)} |")
        lines.append("")
    return "\n".join(lines)


def _attributes(record: type) -> dict[str, str]:
    """What the docstring of a record says of its attributes, as Markdown."""
    text = inspect.getdoc(record) or ""
    found = {}
    for names, _, about in _ITEM.findall(text + "\n"):
        plain = re.sub(r":\w+:`~?[\w.]*?(\w+)`", r"`\1`", " ".join(about.split())).replace("``", "`")
        found |= {name.strip(): plain for name in names.split(",")}
    return found


def closures_file() -> str:
    """The closures file as its reader describes it, and the closure types of the registry."""
    from exo_pin.chain.formats import closures_file as module

    text = inspect.getdoc(module) or ""
    example = re.search(r"::\n\n((?:    .*\n|\n)+)", text)
    assert example
    block = "\n".join(line[4:] for line in example[1].strip("\n").split("\n"))
    rows = [f"| `{name}` | {kind.rows} | `{kind.linear}` | `{kind.angular}` |" for name, kind in TYPES.items()]
    table = "\n".join(["| type | rows | held in translation | held in rotation |", "| --- | --- | --- | --- |", *rows])
    return f"```toml\n{block}\n```\n\n{table}\n"


def documents() -> str:
    """Every document that ``--json`` writes, with its members and units, from the records that make its schema."""
    lines, seen = [], {}
    for name in DOCUMENTS:
        kind = kind_of(name)
        lines += [f"### {identifier(name)}", "", *_members(kind)]
        seen |= dict.fromkeys(each for each in reachable(kind) if kind_of(name) is not each)
    lines += ["## Records within documents", ""]
    for kind in sorted((each for each in seen if members(each)), key=lambda each: each.__name__):
        lines += [f"### {kind.__name__}", "", *_members(kind)]
    return "\n".join(lines)


def _members(kind: type) -> Iterable[str]:
    yield from [" ".join((inspect.getdoc(kind) or "").split("\n\n")[0].split()), ""]
    yield from ["| member | unit | what it is |", "| --- | --- | --- |"]
    for name, member in members(kind).items():
        text = re.sub(r":\w+:`~?[\w.]*?(\w+)`", r"`\1`", member.text).replace("``", "`")
        yield f"| `{name}` | {member.unit} | {_cell(text)} |"
    yield ""


def formulas() -> str:
    """Every label of the thesis with the code that computes it."""
    from formulas import page

    return page(ledger())


def leave_out() -> str:
    """Names of what a reader can leave out of a robot."""
    rows = [f"| `{name}` | {what} |" for name, what in sorted(LEAVE_OUT.items())]
    return "\n".join(["| name | what is left out |", "| --- | --- |", *rows]) + "\n"


def differing_rows() -> str:
    """Rows of the ledger that are not simply reproduced."""
    return condensed(row for row in ledger() if row.verdict != "reproduced")


#: What a page has in place of ``<!-- made: NAME -->``.
MADE = {
    "command line": command_line,
    "design keys": design_keys,
    "closures file": closures_file,
    "documents": documents,
    "formulas": formulas,
    "leave out": leave_out,
    "ledger": differing_rows,
}
