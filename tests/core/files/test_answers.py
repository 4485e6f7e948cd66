"""Answers about files, as they are stored: tables in many dialects, TOML with units, what is written and refused."""

import os
import socket
from pathlib import Path

import numpy as np
import pytest
from answers import changes, each_of
from asked_in_turn import in_turn, tried, with_files

from exo_pin import FileFormatError
from exo_pin.core.files import (
    as_file_stem,
    is_stream,
    require_ending,
    require_folder,
    require_writable,
    write_bytes,
    write_columns,
    write_files,
    write_text,
)
from exo_pin.core.files.atomic import read_file, read_text
from exo_pin.core.files.csv_tables import csv_text, parse_csv, read_csv
from exo_pin.core.files.dialects import parse_layout, read_layout
from exo_pin.core.files.toml_tables import UNITS, naming_file, parse_toml, read_toml, toml_text, write_toml
from exo_pin.core.validation import as_positive

TEXTS = {
    "indented": " # no comment\n1\n",
    "plain": '#one\na,b\n1, 2\n\n"3",-4e1 \n#  two words \n5.,.6\n',
    "formulas": "'=a,'-b,''+c\n'@d,+1,'-1\n",
    "quotes": '"a b","c, ""d"""\n1,2\n',
    "empty": "# only\n\n",
    "twice": "a,b,a,b\n1,2,3,4\n",
    "semicolons": "\n# x\na;b\n1;2\n",
    "tabs": "a\tb\n",
    "short": "a,b\n1,2\n\n3\n",
    "open": 'a,b\n"1,2\n',
    "line_ends": "a,b\r\n1,2\r3,4\n\f,5\n",
    "one": "a\n1\n",
}


def parsed(text):
    found = parse_csv(text, "own.csv")
    return found.columns, found.rows, found.lines, found.comments


def asked_of_csv():
    cells = "a,b,c\n{},1,2\n"
    values = ("1_0", "inf", "nan", "", "N/A", "null", "-.5e-3", "5.", ".", "+7", "1e999", "٣", "x" * 90)
    return in_turn(
        {name: lambda text=text: parsed(text) for name, text in TEXTS.items()},
        numbers=lambda: parse_csv("a,b,c\n1,2,3\n4,5,6\n", None).numbers(["c", "a"]),
        missing=lambda: parse_csv("a,b\n1,2\n", "own.csv").numbers(["c", "a", "d"]),
        none=lambda: parse_csv("a,b\n", "own.csv").numbers(["b"]).shape,
        cells=lambda: {value[:9]: answered(cells.format(value)) for value in values},
        text=lambda: csv_text(
            ["=a", "b"],
            [["1", "-x"], ["-2", "@\ty"], ["-inf", "+inf"], ["'=z", "a,b"], ["−", "c\u2028"]],
            ["one\ntwo", ""],
        ),
        raw=lambda: repr(csv_text(["a"], [["1"]], ["b"])),
        read=lambda: with_files(lambda: read_csv("own.csv").rows, own_csv="\ufeffa\n1\n"),
    )


def answered(text):
    table = parse_csv(text, None)
    return in_turn(strict=lambda: table.numbers(["a"]), gaps=lambda: table.numbers(["b", "a"], gaps=True))


KNOWN = {"s": "s", "ms": "ms", "°": "deg", "deg": "deg", "n": "N"}
DIALECTS = {
    "brackets": "Time [ms],Elbow Angle (deg),Note [x]\n1,2,3\n",
    "units": "time,force,quaternion\n(s),[N],-\n1,2,3\n",
    "not_units": "time,force\nm,mm\n1,2\n",
    "german": "sep=;\nZeit;Kraft (N);Kraft (N) 2;\n1,5;2;-3,25e1;\n2,5;3;4;\n",
    "mixed": "a;b\n1,5;2.5\n",
    "tabs": "rig: three\nmass = 3, kg\nname\tb\tc\n1\t2\t3\n4\t5\t6\n",
    "opensim": "lift\nversion=1\nnRows=2\nendheader\ntime  a b\n0.0 1 2\n0.5  3 4\n",
    "opensim_tabs": "lift\ninDegrees=yes\nEndHeader\ntime\ta\n0.0\t1\n",
    "comments": "// made: today\n#by=me\ntime,a\n0,1\n",
    "preamble": "note\n,,\n1,2,3\ntime,a,b\n0,1,2\n1,2,3\n2,3,4\n",
    "twice": "e,d,c,b,a,e,d,c,b,a\n" + 10 * "1," + "\n",
    "distinct": "a (s),a_s,b\n1,2,3\n",
    "short": "a,b\n1,2\n3\n4,5\n6,7\n",
    "long": "a,b\n1,2,\n3,4,\n",
    "sparse": "a,,\nx,y,z\n1,2,3\n2,3,4\n",
    "half": "a,\nx,y\n1,2\n2,3\n",
    "no_header": "1,2\n3,4\n",
    "empty": "# only\n",
    "text": "a,b\nx,y\n",
    "no_separator": "a\n1\n2\n",
    "one_column": "3\nangle\n1\n2\n",
    "half_separated": "a;b\nx\n1;2\n3\n",
    "wide": "a,b,c,d\nx,y\n1,2\n3,4\n",
    "quoted": '"a";"b"\n"1";"2"\n',
}


def laid_out(text):
    found = parse_layout(text, "own.csv", KNOWN)
    return (
        found.table.columns,
        found.labels,
        found.header,
        found.dialect,
        found.table.rows,
        found.table.lines,
        found.table.comments,
    )


def in_bytes(content):
    def question():
        Path("own.csv").write_bytes(content)
        found = read_layout("own.csv", KNOWN)
        return found.labels, found.dialect

    return with_files(question)


def asked_of_dialects():
    text = "Kraft in °,b\n1,2\n" + 6 * "100,2\n"
    few = "aaaaaaaaaaaaa,bbbbbb\n" + 3 * "1,2\n"
    return in_turn({name: lambda text=text: laid_out(text) for name, text in DIALECTS.items()}) | {
        "utf_16": in_bytes(text.encode("utf-16")),
        "utf_16_bare": in_bytes(text.encode("utf-16-le")),
        "big_endian": in_bytes(b"\xfe\xff" + text.encode("utf-16-be")),
        "cp1252": in_bytes(text.encode("cp1252")),
        "utf_8": in_bytes(text.encode("utf-8-sig")),
        "some_foreign": in_bytes(few.replace("a", "°", 1).encode("cp1252")),
        "foreign": in_bytes(few.replace("a", "°", 3).encode("cp1252")),
        "zeros": in_bytes(b"\xb0a\x00b\n1,2\n"),
        "one_line": in_bytes(b"\xb0abc,aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"),
        "late": in_turn(
            header=lambda: laid_out("".join(f"{k}\n" for k in range(199)) + "a,b\n" + 300 * "1,2\n")[1],
            too_late=lambda: laid_out("".join(f"{k}\n" for k in range(200)) + "a,b\n" + 300 * "1,2\n")[1],
        ),
    }


QUANTITIES = {
    f"{kind} {ending}": lambda kind=kind, ending=ending: parse_toml(f"a{ending} = 2.5", None).quantity(kind, "a")
    for kind, endings in UNITS.items()
    for ending in endings
}
TOML = """schema = 3
name = "own"
count = 4
flag = true
size_mm = 250.0
pair_deg = [90.0, 180]
words = ["a", "b"]
more = {a = "b"}
numbers = [1, 2.5]
[part]
mass_kg = 2.0
[[rows]]
x = 1
[[rows]]
x = 2
"""


def table(text=TOML):
    return parse_toml(text, "own.toml")


TABLES = {
    "schema": lambda t: t.require_schema(4),
    "own_schema": lambda t: t.require_schema(3),
    "length": lambda t: (t.quantity("length", "size"), t.quantity("angle", "pair", (2,))),
    "shape": lambda t: t.quantity("angle", "pair", (3,)),
    "twice": lambda t: table("a_m = 1\na_mm = 2").quantity("length", "a"),
    "bare": lambda t: table("size = 1").quantity("length", "size"),
    "none": lambda t: (t.quantity("length", "other", required=False), t.text("other", False), t.table("other")),
    "flags": lambda t: table("a = [1.0, [true]]").quantity("number", "a", (2,)),
    "flag_number": lambda t: table("a = true").coefficient("a"),
    "text_number": lambda t: table('a = "x"').coefficient("a"),
    "ragged": lambda t: table("a = [[1], [1, 2]]").coefficients("a"),
    "not_finite": lambda t: table("a = inf").coefficient("a"),
    "not_finite_list": lambda t: table("a = [nan]").coefficients("a"),
    "list": lambda t: t.coefficient("numbers"),
    "number": lambda t: t.coefficients("count"),
    "numbers": lambda t: (t.coefficients("numbers"), t.coefficient("count")),
    "large": lambda t: table("a_m = 2e12").quantity("length", "a"),
    "name": lambda t: (t.text("name"), t.texts("words"), t.mapping("more"), t.flag("flag"), t.integer("count")),
    "choice": lambda t: t.text("name", choices=("owm", "two")),
    "own_choice": lambda t: t.text("name", choices=("own", "two")),
    "no_text": lambda t: t.text("count"),
    "no_name": lambda t: t.text("nane"),
    "no_length": lambda t: t.quantity("length", "sice"),
    "no_texts": lambda t: t.texts("numbers"),
    "no_mapping": lambda t: t.mapping("part"),
    "no_number": lambda t: t.integer("nothing"),
    "no_coefficient": lambda t: t.coefficient("nothing"),
    "no_flag": lambda t: t.flag("count"),
    "no_integer": lambda t: t.integer("flag"),
    "no_whole": lambda t: t.integer("size_mm"),
    "absent": lambda t: (t.texts("x"), t.mapping("x"), t.flag("x"), t.tables("x"), t.is_text("x"), t.is_true("x")),
    "present": lambda t: (t.is_text("name"), t.is_text("count"), t.is_true("flag"), t.is_true("count"), "name" in t),
    "rows": lambda t: [(row.name, row.integer("x"), row.is_used_up) for row in t.tables("rows")],
    "row": lambda t: t.tables("rows")[1].text("x"),
    "no_rows": lambda t: t.tables("numbers"),
    "part": lambda t: (t.table("part").content, t.table("part")),
    "no_part": lambda t: t.required_table("name"),
    "missing_part": lambda t: t.required_table("parts"),
    "inner": lambda t: t.required_table("part").finish(),
    "finish": lambda t: (t.skip("schema", "nothing"), t.text("name"), t.finish()),
    "nothing_known": lambda t: t.finish(),
    "used": lambda t: (t.is_used_up, table("").is_used_up, table("").finish()),
    "content": lambda t: sorted(t.content),
}


def nested(levels):
    return "a = " + levels * "[" + levels * "]"


def named(error):
    with naming_file("own.toml"):
        raise error


def asked_of_toml():
    return in_turn(
        {name: lambda ask=ask: ask(table()) for name, ask in TABLES.items()},
        quantities=lambda: " ".join(f"{name}: {ask():.6g}" for name, ask in QUANTITIES.items()),
        levels=lambda: [tried(lambda n: parse_toml(nested(n), "own.toml").content["a"] == [[]], 31, 32, 33)],
        deep=lambda: parse_toml(nested(5000), "own.toml"),
        keys=lambda: [
            tried(
                lambda n: len(parse_toml(".".join("abcdefgh"[k % 8] for k in range(n)) + " = 1", None).content), 31, 33
            )
        ],
        quoted=lambda: parse_toml("\"a b\" . 'c'" + 31 * ' . "d"' + " = 1", "own.toml"),
        digits=lambda: [
            tried(lambda n: parse_toml(f"a = {n}", "own.toml").integer("a"), 2**63 - 1, 2**63, -(2**63), -(2**63) - 1)
        ],
        control=lambda: parse_toml('a.b = ["x", "y\\u0007"]', "own.toml"),
        tab=lambda: parse_toml('a = "x\\ty\\n"', "own.toml").text("a"),
        written=lambda: with_files(lambda: (write_toml("own.toml", {"a": {"b": 2.5}}), read_toml("own.toml").content)),
        not_written=lambda: with_files(lambda: write_toml("own.toml", {"a": "\x07"})),
        text=lambda: toml_text({"a": [1, 2], "b": {"c": "d"}}),
        named=lambda: in_turn(
            {str(k): lambda error=error: named(error) for k, error in enumerate((FileFormatError("x"), as_error()))}
        ),
    )


def as_error():
    try:
        as_positive("length", -1.0)
    except Exception as error:
        return error


def asked_of_paths():
    stem = ("a", "a" * 200, "a" * 201, "é" * 100, "é" * 101, "", " a", "a ", ".a", "-a", "a/b", "a\\b", "a\nb", 3)

    def wrote():
        paths = write_files("deep/folder", {"a.txt": "one", "b.txt": "zwei é\n"})
        write_files("deep/folder", {"a.txt": "one"})
        write_bytes("raw", b"\x00\xff")
        return [path.as_posix() for path in paths], [path.read_bytes().hex() for path in (*paths, Path("raw"))]

    def endings():
        with socket.socket(socket.AF_UNIX) as end:
            end.bind("socket")
        (Path("pipe"), os.mkfifo("pipe"), os.symlink("own.txt", "link"), os.symlink("loop", "loop"))
        return tried(
            lambda path: require_ending("it", path, (".csv", ".toml", ".json")), "own.TOML", "own.txt", "pipe", "own"
        ) | {
            "one": tried(lambda path: require_ending("it", path, (".csv",)), "own.csv", "own.txt"),
            "two": tried(lambda path: require_ending("it", path, (".csv", ".toml")), "own.txt"),
            "stream": [is_stream(path) for path in ("pipe", "own.txt", "new", ".", "link", 3, "")],
            "writable": tried(require_writable, "pipe", "own.txt", "new", ".", "no/new", "link", "loop"),
            "files": tried(lambda folder: write_files(folder, {}), "own.txt", "own.txt/x", 3, "a\0"),
            "folder": tried(require_folder, ".", "new/newer", "own.txt", "own.txt/x", 3, "a\0"),
            "read": tried(read_file, "own.txt", "no.txt", ".", "pipe", "-", "a\0b", 3),
            "text": tried(read_text, "own.txt", "latin.txt"),
            "write": tried(lambda path: write_text(path, "x"), ".", "no/new", "loop", "socket", "", "a\0", 3, b"a"),
        }

    def question():
        Path("latin.txt").write_bytes("é\n".encode("latin-1"))
        return endings()

    return {
        "stems": in_turn({str(k): lambda name=name: len(as_file_stem(name)) for k, name in enumerate(stem)}),
        "wrote": with_files(wrote),
        "kinds": with_files(question, own_txt="\ufeffone"),
    }


COLUMNS = {
    "n": [1.5, np.nan, -np.inf],
    "=1+1": ["=2+2", "a\x07b", "-3"],
    "ok": [True, False, True],
    "count": [1, -2, 3],
    "mixed": np.array(["a", 2, None], dtype=object),
}


def asked_of_tables():
    def wrote(name, notes=None):
        paths = write_columns(name, COLUMNS, notes)
        return [path.name for path in paths], [path.read_text(encoding="utf-8") for path in paths]

    def numbers():
        write_columns("own.NPZ", COLUMNS)
        with np.load("own.NPZ") as found:
            return {name: (str(found[name].dtype.kind), found[name]) for name in found.files}

    def again(text):
        Path("own.json").write_text(text, encoding="utf-8")
        return wrote("own.csv", {"verdict": "no"})

    def book():
        openpyxl = pytest.importorskip("openpyxl")
        write_columns("own.xlsx", COLUMNS, {"verdict": "=yes", "list": [1, "é"]})
        found = openpyxl.load_workbook("own.xlsx")
        return (
            found.sheetnames,
            found["table"].freeze_panes,
            [[[(cell.value, cell.data_type) for cell in row] for row in sheet.iter_rows()] for sheet in found],
        )

    others = ('{"schema": "exo_pin.table/2"}', '{"schema": "exo_pin.tables/1"}', '{"schema": 3}', "[]", "{", "\x00")
    return {
        "plain": with_files(lambda: wrote("own.csv")),
        "notes": with_files(lambda: wrote("own.csv", {"verdict": "yes é", "list": [1, None]})),
        "no_ending": with_files(lambda: wrote("own", {"verdict": "yes"})),
        "numbers": with_files(numbers),
        "book": with_files(book),
        "others": with_files(lambda: tried(again, *others)),
        "large": with_files(lambda: write_columns("own.xlsx", {"a": np.zeros(1_048_576), "b": [1.0]})),
        "wide": with_files(lambda: write_columns("own.xlsx", {f"a{k}": [k] for k in range(16_385)})),
    }


ASKED = {
    "csv": asked_of_csv,
    "dialects": asked_of_dialects,
    "toml": asked_of_toml,
    "paths": asked_of_paths,
    "tables": asked_of_tables,
}


@each_of(ASKED)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
