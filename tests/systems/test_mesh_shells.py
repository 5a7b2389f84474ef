"""Meshes as they come, against volumes and moments in closed form, and against trimesh.

Each kind of fault has files of its own, generated with a fixed seed: 2 of each, POLHODE_ALL_CASES=1 makes 20.
"""

import os

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sweeps.systems.bodies import inertia, mesh_overlaps

trimesh = pytest.importorskip("trimesh")

NUM_FILES = 20 if os.environ.get("POLHODE_ALL_CASES") else 2  # number of generated files per kind


def placed(mesh, at, inwards):
    """Return the mesh at a place, and if it is so, with inward normals."""
    mesh.apply_translation(at)
    if inwards:
        mesh.invert()
    return mesh


def box(edges, at=(0.0, 0.0, 0.0), inwards=False):
    return placed(trimesh.creation.box(edges), at, inwards)


def ball(subdivisions, radius=1.0, at=(0.0, 0.0, 0.0), inwards=False):
    return placed(trimesh.creation.icosphere(subdivisions, radius), at, inwards)


def turned(mesh, rng):
    """Return the mesh in a random attitude at a random place."""
    mesh = mesh.copy()
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
    mesh.apply_translation(rng.normal(size=3))
    return mesh


def solid(folder, *parts):
    trimesh.util.concatenate(list(parts)).export(folder / "parts.off", digits=17)
    return inertia.solid(folder / "parts.off", density=1.0)


def refusal(folder, *parts):
    with pytest.raises(inertia.MeshError) as refused:
        solid(folder, *parts)
    return str(refused.value)


def of_trimesh(mesh):
    """Return volume and principal moments of unit density, by trimesh."""
    return mesh.volume, np.sort(np.linalg.eigvalsh(mesh.moment_inertia))


TWO_BRICKS = [box((1, 1, 1)), box((1, 1, 1), (3, 0, 0))]
OVERLAPPING = {
    "a corner in the other": ([box((1, 1, 1)), box((1, 1, 1), (0.5, 0.5, 0.5))], 0.125),
    "a cross, no corner in the other": ([box((4, 1, 1)), box((1, 4, 0.5), (0.1, 0, 0.05))], 0.5),
    "end in end, faces in one plane": ([box((2, 1, 1)), box((2, 1, 1), (1, 0, 0))], 1.0),
    "one in the other, both outwards": ([box((3, 3, 3)), box((1, 1, 1), (0.1, 0, 0))], 1.0),
    "all but the same": ([box((1, 2, 3)), box((1, 2, 3), (1e-3, 0, 0))], 5.994),
    "balls": ([ball(4), ball(4, at=(1.8, 0, 0))], np.pi * (4 + 1.8) * 0.2**2 / 12),  # a lens
    "a hollow that reaches out": ([box((2, 2, 2)), box((1, 1, 1), (1, 0, 0), inwards=True)], 0.5),
}


def amount(message):
    """Return the volume that a refusal names."""
    return float(message.split(": ")[1].split(" m³")[0])


@pytest.mark.parametrize("name", OVERLAPPING)
def test_overlaps_are_refused_with_pair_and_volume(tmp_path, name):
    parts, volume = OVERLAPPING[name]
    number = list(OVERLAPPING).index(name)
    scale, rotation = (1.0, 1e-3)[number % 2], Rotation.random(random_state=number).as_matrix()
    moved = [trimesh.Trimesh(scale * part.vertices @ rotation.T, part.faces, process=False) for part in parts]
    message = refusal(tmp_path, *moved)
    assert message.startswith("surfaces 1 and 2 overlap: ")
    assert amount(message) == pytest.approx(volume * scale**3, rel=0.1)  # the bar; three printed digits


@pytest.mark.parametrize("subdivisions", [1, 3, pytest.param(5, marks=pytest.mark.slow)])
def test_no_answer_depends_on_the_fineness_of_the_mesh(tmp_path, subdivisions):
    """A cavity stays a cavity, and an inner solid is refused, with up to 20,480 triangles in each surface."""
    outer, inner = ball(subdivisions), ball(subdivisions, 0.5)
    cavity = ball(subdivisions, 0.5, inwards=True)
    body = solid(tmp_path, outer, cavity)
    assert body.volume == pytest.approx(outer.volume - inner.volume, rel=1e-12)  # roundings of sums
    assert "surfaces 1 and 2 overlap" in refusal(tmp_path, outer, inner)


LATTICE = (np.stack(np.meshgrid(*[np.arange(8)] * 3), -1).reshape(-1, 3) - 3.5) / 8.5  # places in the unit cube
# places of voids between the lines of a lattice
ANYWHERE = np.random.default_rng(5417).uniform(-0.45, 0.45, (30, 3))
HOLLOW = [box((4, 4, 4)), box((3, 3, 3), inwards=True), box((1, 1, 1), (0.5, 0, 0))]
LARGE_VOIDS = [box((1, 1, 1)), *(box((0.02,) * 3, at, inwards=True) for at in LATTICE)]
SMALL_VOIDS = [box((1, 1, 1)), *(box((1e-3,) * 3, at, inwards=True) for at in ANYWHERE)]
INVERTED = "1 of its 2 surfaces looked inwards and were turned"
CUBE = "I1, I2 and I3 differ by rounding only and count as equal"
NESTED = {  # surfaces, their volume, and the note
    "apart": (TWO_BRICKS, 2.0, ""),
    "inside out beside another": ([TWO_BRICKS[0], box((1, 1, 1), (3, 0, 0), inwards=True)], 2.0, INVERTED),
    "a hollow and what lies in it": (HOLLOW, 64 - 27 + 1, ""),
    "touching": ([box((1, 1, 1)), box((0.5, 0.5, 1), (0, 0, 1))], 1.25, ""),
    "hundreds of voids": (LARGE_VOIDS, 1 - 512 * 0.02**3, CUBE),
    "voids of 1e-9 of the body": (SMALL_VOIDS, 1 - 30 * 1e-9, CUBE),
}


@pytest.mark.parametrize("name", NESTED)
def test_surfaces_count_once_each_by_their_nesting(tmp_path, name):
    parts, volume, note = NESTED[name]
    body = solid(tmp_path, *parts)
    assert body.volume == pytest.approx(volume, rel=1e-12)  # roundings of sums
    assert body.principal.notes == ((note,) if note else ())
    if name == "apart":  # each M a2/6 about its own middle, and M d2 with d = 1.5 (Steiner)
        np.testing.assert_allclose(body.principal.moments, [2 / 6, 2 / 6 + 2 * 1.5**2, 2 / 6 + 2 * 1.5**2], rtol=1e-12)


def hollow_inside_out(rng):
    radius = rng.uniform(0.3, 1.0)
    parts = [ball(2, radius, inwards=True), ball(2, rng.uniform(0.2, 0.8) * radius, rng.normal(size=3) * 1e-2)]
    mesh = turned(trimesh.util.concatenate(parts), rng)
    reference = mesh.copy()
    reference.invert()
    return mesh, reference, "its faces looked inwards and were turned"


def stacked(rng):
    """Boxes with common corners, sides, or edges of four triangles, two each way."""
    edges = rng.uniform(0.5, 2.0, 3)
    shifts = [[0, 0, 0], [1, 1, 0], [1, 0, 0], [1, 1, 1]][: rng.integers(2, 5)]
    mesh = turned(trimesh.util.concatenate([box(edges, edges * shift) for shift in shifts]), rng)
    return mesh, mesh, ""


def loose_corners(rng):
    """Corners a unit of single precision apart, 1.2e-7 of the largest coordinate, of some 3 radii at most."""
    mesh = turned(ball(2), rng)
    triangles = mesh.triangles.astype(np.float32)
    triangles += rng.integers(-1, 2, triangles.shape) * np.spacing(np.float32(np.abs(triangles).max())) * 0.5
    loose = trimesh.Trimesh(**trimesh.triangles.to_kwargs(triangles), process=False)
    return loose, mesh, "corners closer than 2.4e-07 of the largest coordinate were joined"


def without_area(rng):
    mesh = turned(box(rng.uniform(0.5, 2.0, 3)), rng)
    spoilt, corners = mesh.copy(), rng.integers(0, 8, (5, 2))
    spoilt.faces = np.concatenate([mesh.faces, np.column_stack([corners, corners[:, 1]])])
    return spoilt, mesh, ""


def sound(rng):
    mesh = ball(2)
    mesh.vertices *= rng.uniform(0.7, 1.3, (len(mesh.vertices), 1))
    mesh = turned(mesh, rng)
    return mesh, mesh, ""


def flipped(rng):
    mesh = turned(box(rng.uniform(0.5, 2.0, 3)), rng)
    spoilt, faces = mesh.copy(), rng.permutation(12)[: rng.integers(1, 6)]
    spoilt.faces[faces] = spoilt.faces[faces][:, ::-1]
    return spoilt, mesh, "its faces looked both ways and were turned"


@pytest.mark.parametrize("make", [sound, hollow_inside_out, stacked, loose_corners, without_area, flipped])
def test_a_mesh_with_a_fault_has_volume_and_moments_of_the_sound_one(make, tmp_path):
    rng, is_loose = np.random.default_rng(5411), make is loose_corners
    for _ in range(NUM_FILES):
        mesh, reference, note = make(rng)
        body = solid(tmp_path, mesh)
        volume, moments = of_trimesh(reference)
        assert body.volume == pytest.approx(volume, rel=3e-6 if is_loose else 1e-12)  # else roundings of sums
        # equal within 1e-7 count as equal
        np.testing.assert_allclose(body.principal.moments, moments, rtol=3e-6 if is_loose else 2e-7)
        assert body.faces == len(reference.faces)
        assert note in body.principal.notes or not (note or body.principal.notes)


def test_a_core_that_fills_a_tube(tmp_path):
    """Their common circles have edges of four triangles, and no piece between these is closed alone."""
    tube = trimesh.creation.annulus(0.5, 1.0, 2.0, sections=24)
    core = trimesh.creation.cylinder(0.5, 2.0, sections=24)
    circles = [np.unique(np.round(m.vertices[np.hypot(*m.vertices[:, :2].T) < 0.75], 9), axis=0) for m in (tube, core)]
    assert {*map(tuple, circles[0])} <= {*map(tuple, circles[1])}
    tube.vertices, core.vertices = np.round(tube.vertices, 12), np.round(core.vertices, 12)
    body = solid(tmp_path, tube, core)
    assert body.volume == pytest.approx(tube.volume + core.volume, rel=1e-11)  # corners were rounded at 1e-12


def test_a_surface_that_crosses_itself_is_refused_with_its_volume(tmp_path):
    rng = np.random.default_rng(5415)
    for _ in range(NUM_FILES):
        width = rng.uniform(0.1, 0.25)
        message = refusal(tmp_path, turned(crossing_bar(width), rng))
        assert message.startswith("surface 1 intersects itself: ")
        assert amount(message) == pytest.approx(width**3, rel=0.1)  # a bar crosses itself in a cube of its width


def crossing_bar(width):
    """Return a square bar along an arc of the curve (sin s, sin(2 s)/2), which crosses itself at right angles in 0."""
    bar = trimesh.creation.box((np.pi + 1.0, width, width)).apply_translation((np.pi / 2, 0, 0))
    for _ in range(5):
        bar = bar.subdivide()
    s, across, up = bar.vertices.T
    along = np.array([np.cos(s), np.cos(2 * s)]) / np.hypot(np.cos(s), np.cos(2 * s))
    x, y = [np.sin(s), np.sin(2 * s) / 2] + across * np.array([-along[1], along[0]])
    bar.vertices = np.column_stack([x, y, up])
    return bar


def test_overlaps_of_parts_in_contact_are_noted_below_a_thousandth(tmp_path):
    rng = np.random.default_rng(5416)
    for _ in range(NUM_FILES):
        depth = 10 ** rng.uniform(-4.5, -3.2)
        whole = trimesh.util.concatenate([box((1, 1, 1)), box((1, 1, 1), (1 - depth, 0, 0))])
        body = solid(tmp_path, turned(whole, rng))
        note = next(note for note in body.principal.notes if "overlap" in note)
        assert note.startswith("surfaces 1 and 2 overlap: ")
        assert amount(note) == pytest.approx(depth, rel=0.1)
        assert body.volume == pytest.approx(2.0, rel=1e-12)  # as the file has it


def test_a_mesh_of_too_many_layers_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_overlaps, "MAX_CROSSINGS", 1e5)
    layers = [box((1, 1, 0.001), (0, 0, 0.002 * k)) for k in range(20)]
    assert "too many surfaces one above the other" in refusal(tmp_path, *layers)


def test_open_surfaces_and_sheets_are_refused(tmp_path):
    rng = np.random.default_rng(5420)
    mesh = turned(ball(2), rng)
    missing = rng.permutation(len(mesh.faces))[: rng.integers(1, 20)]
    opened = mesh.copy()
    opened.update_faces(~np.isin(np.arange(len(mesh.faces)), missing))
    edges = {tuple(edge) for edge in np.sort(opened.edges, axis=1).tolist()}
    assert "is not watertight: " in (words := refusal(tmp_path, opened))
    assert f" of its {len(edges)} edges" in words
    doubled = mesh.copy()
    doubled.faces = np.concatenate([mesh.faces, mesh.faces[missing]])
    assert "is not watertight" in refusal(tmp_path, doubled)
    sheet = opened.copy()
    sheet.faces = np.concatenate([opened.faces, opened.faces[:, ::-1]])
    assert "encloses no volume" in refusal(tmp_path, sheet)


TABLES = {
    "damit.txt": "4 4\n0 0 0\n3 0 0\n0 2 0\n0 0 1\n1 3 2\n1 2 4\n2 3 4\n1 4 3\n",
    "numbered.tab": "4\n1 0 0 0\n2 3 0 0\n3 0 2 0\n4 0 0 1\n4\n1 1 3 2\n2 1 2 4\n3 2 3 4\n4 1 4 3\n",
    "from_zero.tab": "4 4\n0 0 0\n3 0 0\n0 2 0\n0 0 1\n0 2 1\n0 1 3\n1 2 3\n0 3 2\n",
    "obj.tab": "v 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_points_and_triangles(tmp_path, name):
    (tmp_path / name).write_text(TABLES[name])
    body = inertia.solid(tmp_path / name, density=1.0, unit="km")
    assert body.volume == pytest.approx(1e9, rel=1e-12)  # 3·2·1/6 km³


@pytest.mark.parametrize(
    "text",
    ["", "4\n", "4 4\n0 0 0\n", "1 2 3\n", "4 4\n" + "0 0\n" * 8, TABLES["damit.txt"].replace("1 4 3", "1 4 9"), "x\n"],
)
def test_tables_that_are_none_are_refused(tmp_path, text):
    (tmp_path / "shape.tab").write_text(text)
    with pytest.raises(inertia.MeshError, match=r"cannot be read as a mesh|holds no body"):
        inertia.solid(tmp_path / "shape.tab", density=1.0)


@pytest.mark.parametrize("metres", [None, 0.001])
def test_dae_in_the_unit_that_it_states(metres, tmp_path):
    pytest.importorskip("collada", reason="pycollada is not installed")
    text = trimesh.exchange.dae.export_collada(trimesh.creation.box((1.0, 2.0, 3.0))).decode()
    unit = "" if metres is None else f'<unit name="millimeter" meter="{metres}"/>'
    (tmp_path / "box.dae").write_text(text.replace("<up_axis>", f"{unit}<up_axis>"))
    volume = inertia.solid(tmp_path / "box.dae", density=1.0).volume
    assert volume == pytest.approx(6.0 * (metres or 1.0) ** 3, rel=1e-6)  # the file is written in single precision
    with pytest.raises(ValueError, match="states its unit of length itself"):
        inertia.solid(tmp_path / "box.dae", density=1.0, unit="mm")


def test_glb(tmp_path):
    scene = trimesh.Scene([box((1, 2, 3)), box((1, 2, 3), (2, 0, 0))])
    (tmp_path / "scene.glb").write_bytes(scene.export(file_type="glb"))
    body = inertia.solid(tmp_path / "scene.glb", density=1.0)
    assert body.volume == pytest.approx(12.0, rel=1e-6)  # single precision


def test_notes_on_a_mesh_reach_map_and_report(tmp_path, monkeypatch):
    import sweeps
    from sweeps.views import report

    monkeypatch.chdir(tmp_path)
    box((3, 2, 1), inwards=True).export("inside.off")
    bodies = [{"name": "Brick", "mesh": {"file": "inside.off", "density": 1000.0}}]
    ds = sweeps.survey({"bodies": bodies, "grid": {"omega0": 1.0}})
    assert ds.attrs["input_notes"] == "Brick: its faces looked inwards and were turned"
    report.write_report(ds, "report.html")
    assert "its faces looked inwards and were turned" in (tmp_path / "report.html").read_text()
