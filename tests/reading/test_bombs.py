"""Definitions, meshes and tables that are small and would become large, and text that would become code."""

import ast
import json

import h5py
import numpy as np
import pytest

from sweeps.mechanics import taylor
from sweeps.points import tables
from sweeps.points.loading import read_sweep
from sweeps.process import process_identity
from sweeps.reading import definitions, hdf5
from sweeps.reading import tables as formats
from sweeps.reading.files import FileBytes
from sweeps.schema.refusals import DefinitionError, UnreadableError
from sweeps.systems.bodies import inertia

LONG = "x" * 90_000
ALIASES = {
    "a text": f"a: &a {LONG}\nb: [{', '.join(['*a'] * 90)}]",
    "a key": f"b: [{{? &a {LONG} : 1}}, {', '.join(['{? *a : 1}'] * 90)}]",
    "a list": f"a: &a [{LONG}]\nb: [{', '.join(['*a'] * 90)}]",
    "a mapping": f"a: &a {{c: {LONG}}}\nb: [{', '.join(['*a'] * 90)}]",
    "lists of lists": f"a: &a [{LONG}, {LONG}]\nb: &b [{', '.join(['*a'] * 9)}]\nc: [{', '.join(['*b'] * 9)}]",
}


@pytest.mark.parametrize("what", ALIASES)
def test_aliases_are_counted_in_characters(what):
    with pytest.raises(UnreadableError) as error:
        definitions.plain(definitions.read_text(ALIASES[what]))
    assert "4,194,304 characters in all, aliases expanded" in error.value.problem.allowed
    assert definitions.definition_of({"definition": ALIASES[what]}) == {}  # in a map
    assert definitions.plain(definitions.read_text(ALIASES[what].replace(LONG, LONG[:20_000])))  # 3.7 million at most


def test_numbers_of_an_attribute_are_read_where_they_are_few(tmp_path):
    with h5py.File(tmp_path / "map.nc", "w") as file:
        file.attrs.update(contract_version="1.0", few=np.ones(10_000, "i1"), many=np.ones(10_001, "i1"))
    attributes = hdf5.read_structure(FileBytes(tmp_path / "map.nc")).attributes
    assert (attributes["few"], attributes["many"]) == ([1] * 10_000, "")


TITLES = ['"""', 'a"', "\\", "a\nimport os", '"""\nopen("owned", "w")\n"""', "{0}", "\udcff", "\0", "\\N{x}", "é '"]


@pytest.mark.parametrize("title", TITLES)
def test_a_title_is_text_in_generated_code(title):
    for quote in ('"""', '"'):
        (node,) = ast.parse(f"{quote}{taylor.in_quotes(title)}: a step.{quote}").body
        assert node.value.value == title.encode("utf-8", "replace").decode() + ": a step."


SQUARE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def off_text(vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0", *(" ".join(map(str, v)) for v in vertices)]
    return "\n".join([*lines, *(f"3 {a} {b} {c}" for a, b, c in faces)]) + "\n"


def write_textured(name):
    head = f"ply\nformat ascii 1.0\ncomment TextureFile {name}\nelement vertex 4\n"
    head += "".join(f"property float {k}\n" for k in ("x", "y", "z", "s", "t"))
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [f"{x} {y} {z} 0 0" for x, y, z in SQUARE] + [f"3 {a} {b} {c}" for a, b, c in FACES]
    return head + "\n".join(rows) + "\n"


def shells(number):
    """Return many small bodies that all intersect."""
    vertices = [(x + 1e-3 * k, y, z) for k in range(number) for x, y, z in SQUARE]
    return off_text(vertices, [(a + 4 * k, b + 4 * k, c + 4 * k) for k in range(number) for a, b, c in FACES])


def scaled(by):
    return off_text([tuple(by * x for x in v) for v in SQUARE], FACES)


MESHES = {
    "a texture that is a file": ("a.ply", write_textured("/etc/passwd"), None),
    "a texture that is a FIFO": ("a.ply", write_textured("fifo.png"), None),
    "coordinates of 1e308": ("a.off", scaled(1e308), r"beyond 1e\+30"),
    "coordinates of 1e200": ("a.off", scaled(1e200), r"beyond 1e\+30"),
    "no number": ("a.off", scaled(float("nan")), "no numbers|cannot be read as a mesh"),
    "overlapping shells": ("a.off", shells(6), r"surfaces .* overlap"),
    "shells beyond number": ("a.off", shells(10_001), "too many surfaces one above the other"),
}


@pytest.mark.parametrize("what", MESHES)
def test_a_mesh_is_its_points_and_triangles(tmp_path, what, recwarn):
    pytest.importorskip("trimesh")
    name, content, words = MESHES[what]
    (tmp_path / name).write_text(content)
    if words is None:
        assert inertia.solid(tmp_path / name, 1.0).volume == pytest.approx(1 / 6)
    else:
        with pytest.raises(inertia.MeshError, match=words):
            inertia.solid(tmp_path / name, 1.0)
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]


def of_parquet(path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"I1": np.ones(20_000_000)}), path)


def of_netcdf(path, **options):
    with h5py.File(path, "w") as file:
        file.create_dataset("I1", (20_000_000,), "f8", **options)


def reverse_chunks(path):
    of_parquet(path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content[:-9] + b"\xff" + content[-8:])


TABLES = {
    "Parquet that swells": ("a.parquet", of_parquet, "times what it holds"),
    "Parquet with flipped bytes": ("a.parquet", reverse_chunks, "is no Parquet file|is damaged|times what"),
    "netCDF that swells": (
        "a.nc",
        lambda p: of_netcdf(p, chunks=(10**6,), compression="gzip", fillvalue=1.0),
        "netCDF|times",
    ),
    "netCDF of texts": (
        "a.nc",
        lambda p: h5py.File(p, "w").create_dataset("I1", data=["a"], dtype=h5py.string_dtype()),
        "is no type of numbers",
    ),
    "netCDF of lists": (
        "a.nc",
        lambda p: h5py.File(p, "w").create_dataset("I1", (3,), h5py.vlen_dtype("f8")),
        "is no type of numbers",
    ),
    "netCDF of bytes": (
        "a.nc",
        lambda p: h5py.File(p, "w").create_dataset("I1", data=[b"\xff\xfe"]),
        "is no type of numbers",
    ),
    "CSV of many columns": ("a.csv", lambda p: p.write_text("I1," * 1001 + "\n1"), "has 1,002 columns; allowed"),
    "CSV of one long line": ("a.csv", lambda p: p.write_bytes(b"I1\n" + b"1" * 5_000_000), "has a line of more than"),
    "CSV of a long heading": ("a.csv", lambda p: p.write_bytes(b"I" * 100_000), "has a line of more than"),
    "CSV of an open quote": ("a.csv", lambda p: p.write_bytes(b'I1\n"' + b"1\n" * 9_000_000), "I1|a.csv"),
}


@pytest.mark.parametrize("what", TABLES)
def test_a_table_is_of_the_size_of_its_file(tmp_path, monkeypatch, what):
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")
    monkeypatch.setattr(formats, "SMALL_TABLE", 2**20)
    name, make, words = TABLES[what]
    dataset = make(tmp_path / name)
    if isinstance(dataset, h5py.Dataset):
        dataset.file.close()
    (tmp_path / "my.json").write_text(json.dumps({"table": name, "grid": {"I2": 1.0, "I3": 1.0, "omega0": 1.0}}))
    with pytest.raises(DefinitionError, match=words):
        read_sweep(tmp_path / "my.json")
    assert not [file for file in (tmp_path / "cache").rglob("*") if file.is_file()]


def test_what_a_killed_conversion_left_is_removed_by_the_next_reading(tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "cache_folder", lambda: tmp_path / "cache")
    (tmp_path / "a.csv").write_text("I1\n1.0\n1.1\n")
    (tmp_path / "my.json").write_text(json.dumps({"table": "a.csv", "grid": {"I2": 1.0, "I3": 1.0, "omega0": 1.0}}))
    folder = tmp_path / "cache" / "tables"
    folder.mkdir(parents=True)
    mark = process_identity.process_mark().rsplit("-", 2)[0]
    for number, name in enumerate(("another", "seen-another", "third", "seen-third", "a" * 40)):
        (folder / f".{name}.{mark}-{2**22 + 1 + number}-1.0123456789abcdef.part").write_bytes(b"x")
    read_sweep(tmp_path / "my.json")
    assert not list(folder.glob(".*.part"))
