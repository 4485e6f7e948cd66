"""Every kind of file that the package reads, as text that is wrong and as a path that is no file."""

import os
import socket
import subprocess
import sys

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin import FileFormatError, muscle
from exo_pin.chain import read_closures, write_closures
from exo_pin.load_case import read_movement

EXO = ep.load("prototype")
LOOPS = read_closures(URDF / "prototype.closures.toml")
POSES = "".join(f"{t},{10 + t},0,0\n" for t in range(6))
RESPONSE = "".join(f"{t},{t},1\n" for t in range(6))


def write_design(path):
    EXO.save(path)


def write_loops(path):
    write_closures(LOOPS, path)


def write_static(path):
    muscle.save_parameters(muscle.muscle_model("best"), path)


def write_dynamic(path):
    muscle.save_dynamic(muscle.dynamic_model("tang-3-31"), path)


def write_movement(path):
    path.write_text("time_s,flexion_deg,abduction_deg,internal_rotation_deg\n" + POSES)


def write_rest(path):
    rows = (f"{5 * t},{3 + t % 2},{60 - 9 * t + 20 * (t % 2)}\n" for t in range(6))
    path.write_text("contraction_mm,pressure_bar,force_N\n" + "".join(rows))


def write_response(path):
    path.write_text("time_s,contraction_mm,pressure_bar\n" + RESPONSE)


def rest(path):
    return muscle.read_measurements(path, 0.3).force


def response(path):
    return muscle.read_response(path, 1.0, 0.3).contraction


TOML = {
    "design": (ep.load, write_design, ("mass_kg", "base_radius_m", "platform_angles_rad")),
    "closures": (read_closures, write_loops, ("gravity_m_s2",)),
    "static muscle": (muscle.load_parameters, write_static, ("value", "strain", "reference_length_m")),
    "dynamic muscle": (muscle.load_dynamic, write_dynamic, ("D_2_N_s_per_m_bar", "load_bar_per_kg")),
}
CSV = {
    "movement": (read_movement, write_movement),
    "states at rest": (rest, write_rest),
    "response": (response, write_response),
}
READERS = {
    **{name: reader for name, (reader, *_) in (TOML | CSV).items()},
    "robot.yaml": ep.ClosedChain.from_parallel_robot,
    "urdf": lambda path: ep.ClosedChain.from_urdf(path, LOOPS),
    "CASPR": lambda path: ep.ClosedChain.from_caspr(path, "<cables/>"),
}


def good_text(writer, tmp_path):
    path = tmp_path / "good.toml"
    writer(path)
    return path.read_text(encoding="utf-8")


def refused(reader, path, message):
    with pytest.raises(FileFormatError, match=message) as caught:
        reader(path)
    assert caught.value.path == str(path)
    assert len(str(caught.value)) < 2000


@pytest.mark.parametrize("kind", READERS)
def test_paths_that_are_no_file(kind, tmp_path):
    reader = READERS[kind]
    refused(reader, str(tmp_path / "none" / "a.toml"), "No such file|no such file")
    pipe, folder, own = tmp_path / "pipe.toml", tmp_path / "folder.toml", tmp_path / "socket.toml"
    os.mkfifo(pipe)
    folder.mkdir()
    (folder / "robot.yaml").mkdir()
    refused(reader, str(pipe), "this is a pipe; save it as a file")
    if kind != "robot.yaml":
        refused(reader, str(folder), "this is a folder")
    with socket.socket(socket.AF_UNIX) as end:
        end.bind(str(own))
        refused(reader, str(own), "this is a socket|cannot be read")
    zero = tmp_path / "zero.toml"
    zero.symlink_to("/dev/zero")
    refused(reader, str(zero), "this is a device")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00a")
    if kind != "urdf":
        refused(reader, str(binary), "expected UTF-8")


@pytest.mark.parametrize("kind", [kind for kind in READERS if kind != "design"])
@pytest.mark.parametrize("path", [None, 3, b"a.toml", "a\0.toml", object()])
def test_values_that_are_no_path(kind, path):
    with pytest.raises(FileFormatError):
        READERS[kind](path)


@pytest.mark.parametrize("kind", TOML)
def test_toml_texts_that_are_wrong(kind, tmp_path):
    reader, writer, number_keys = TOML[kind]
    good = good_text(writer, tmp_path)
    path = tmp_path / "bad.toml"

    def check(text, message):
        path.write_text(text, encoding="utf-8")
        refused(reader, path, message)

    check("", "missing")
    check("a = [" * 3 + "[" * 5000 + "]" * 5000, "not TOML")
    check(good.replace("\n", "\n" + "x = " + "[" * 400 + "]" * 400 + "\n", 1), f"deeper than {32}|not TOML")
    for parts in (".x", '."x"', " .\t'x'"):
        # tomllib takes the square of their number: minutes and gigabytes.
        for form in ("x{} = 1", "[x{}]", "y = {{x{} = 1}}"):
            check(form.format(parts * 100_000) + "\n" + good, f"a key of more than {32} parts")
    check("x = 0x" + "f" * 6000 + "\n" + good, "x: expected an integer of at most 64 bits")
    check("x = " + "9" * 6000 + "\n" + good, "not TOML")
    check("x = 1\nx = 2\n" + good, "not TOML: Cannot overwrite")
    check("nane = 1\n" + good, r"nane: unknown key \(did you mean 'name'\?\)")
    check(good + "\0", "not TOML")
    lines = good.splitlines()
    for key in number_keys:
        place, *_ = [index for index, line in enumerate(lines) if line.startswith(key + " = ")]
        value = lines[place].split(" = ", 1)[1]
        for wrong in ("true", "nan", "-inf", '"1"', "1979-05-27", "[[1.0], [1.0, 2.0]]", "{a = 1}", "[true, 1.0, 1.0]"):
            # An array goes on in the following lines.
            end = place if value != "[" else place + lines[place:].index("]")
            check("\n".join([*lines[:place], f"{key} = {wrong}", *lines[end + 1 :]]), key)


@pytest.mark.parametrize("kind", TOML)
def test_byte_order_mark_and_line_ends_change_nothing(kind, tmp_path):
    reader, writer, *_ = TOML[kind]
    good = good_text(writer, tmp_path)
    path, other = tmp_path / "good.toml", tmp_path / "marked.toml"
    other.write_bytes(b"\xef\xbb\xbf" + good.replace("\n", "\r\n").encode())
    first, second = reader(path), reader(other)
    again = tmp_path / "again.toml"
    if kind == "closures":
        assert first == second
    elif kind == "design":
        second.save(again)
        assert again.read_text() == good
    else:
        save = muscle.save_parameters if kind == "static muscle" else muscle.save_dynamic
        save(second, again)
        assert again.read_text() == good


@pytest.mark.parametrize("kind", CSV)
def test_csv_texts_that_are_wrong(kind, tmp_path):
    reader, writer = CSV[kind]
    good = good_text(writer, tmp_path)
    head, first, *rest = good.splitlines()
    path = tmp_path / "bad.csv"

    def check(text, message):
        path.write_text(text, encoding="utf-8")
        refused(reader, path, message)

    check("", "is empty")
    check("# only a comment\n\n", "is empty")
    check(head + "," + head.split(",")[0] + "\n", "names '.*' twice")
    if kind != "movement":  # its quaternions and angles are compared in the tests of recordings
        (tmp_path / "good.csv").write_text(good, encoding="utf-8")
        for separator in ";\t":
            path.write_text(good.replace(",", separator), encoding="utf-8")
            np.testing.assert_array_equal(reader(path), reader(tmp_path / "good.csv"))
    check(head + "\n\n# c\n" + first + ",7\n", r"line 4: expected \d cells")
    check(head + "\n" + first.rsplit(",", 1)[0] + "\n", r"line 2: expected \d cells")
    check(head + '\n"' + first + "\n", "line 2: not CSV")
    check(head + '\n"' + "1" * 200_000 + '"\n', "line 2: not CSV")
    column = head.rsplit(",", 1)[1]
    # In a movement these are gaps.
    empty = () if kind == "movement" else ("nan", "")
    for wrong in (*empty, "inf", "1e999", "1_0", "0x1", "true", "١", "1,".strip(",") + " 0", "1\x0c2", "x" * 5000):
        check("\n".join([head, first.rsplit(",", 1)[0] + "," + wrong, *rest]), f"line 2: .* in column {column}")


@pytest.mark.parametrize("kind", CSV)
def test_marks_comments_blanks_and_quotes_change_nothing(kind, tmp_path):
    reader, writer = CSV[kind]
    good = good_text(writer, tmp_path)
    head, *rest = good.splitlines()
    quoted = ['"' + line.replace(",", '","') + '"' for line in rest]
    text = "\r".join(["# made by hand", "", head.replace(",", ", "), "#0,0,0", *rest[:2], "", *quoted[2:]])
    other = tmp_path / "other.csv"
    other.write_bytes(b"\xef\xbb\xbf" + text.encode())
    first, second = reader(tmp_path / "good.toml"), reader(other)
    if kind == "movement":
        assert first.times.tolist() == second.times.tolist()
        assert first.poses.as_quat().tolist() == second.poses.as_quat().tolist()
    else:
        assert first.tolist() == second.tolist()


@pytest.mark.full
def test_standard_input_is_read_only_from_a_file(tmp_path):
    path = tmp_path / "good.csv"
    write_rest(path)
    code = "import sys; from exo_pin.muscle import read_measurements as read; print(len(read(sys.argv[1], 0.3).force))"
    command = [sys.executable, "-c", code, "/dev/stdin"]
    with path.open() as stream:
        assert subprocess.run(command, stdin=stream, capture_output=True, text=True, check=True).stdout == "6\n"
    piped = subprocess.run(command, input=path.read_text(), capture_output=True, text=True, check=False, timeout=100)
    assert "this is a pipe; save it as a file first" in piped.stderr
    refused(rest, "-", "standard input is not read; save it as a file first")
