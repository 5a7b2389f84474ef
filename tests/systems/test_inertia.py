import pickle

import numpy as np
import pytest

from sweeps.points.loading import read_definition
from sweeps.schema.refusals import DefinitionError
from sweeps.systems.bodies import inertia

trimesh = pytest.importorskip("trimesh")

EDGES = (3.0, 2.0, 1.0)
BRICK = (5 / 12, 10 / 12, 13 / 12)  # M (b2 + c2)/12 and cyclic, M = 1 kg: Landau and Lifshitz, section 32


def rotate(mesh, seed=3):
    matrix = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    mesh.apply_transform(matrix)
    return matrix[:3, :3]


def tensor_of(moments, rotation):
    return rotation @ np.diag(moments) @ rotation.T


def brick(path, *, shift=(0.0, 0.0, 0.0), is_rotated=True, scale=1.0):
    mesh = trimesh.creation.box(EDGES)
    rotation = rotate(mesh) if is_rotated else np.eye(3)
    mesh.apply_scale(scale)
    mesh.apply_translation(shift)
    mesh.export(path, **({"digits": 17} if path.suffix == ".obj" else {}))
    return rotation


def refusal(call):
    with pytest.raises((inertia.InertiaError, inertia.MeshError)) as error:
        call()
    assert "allowed: " in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("scale", [1e-200, 1e-47, 1.0, 8e37, 1e200])
def test_a_turned_tensor_gives_back_moments_and_axes(scale):
    moments = np.array([1.0, 2.5, 3.25])
    rotation = rotate(trimesh.creation.box(EDGES))
    principal = inertia.principal(tensor_of(moments, rotation) * scale)
    # a 3 by 3 eigenproblem is right to some roundings of the largest eigenvalue
    np.testing.assert_allclose(principal.moments, moments * scale, rtol=0, atol=1e-14 * 3.25 * scale)
    axes = np.array(principal.axes)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(np.abs(axes @ rotation), np.eye(3), atol=1e-13)
    tensor = axes.T @ np.diag(principal.moments) @ axes
    np.testing.assert_allclose(tensor, tensor_of(moments, rotation) * scale, rtol=1e-12)


def test_moments_equal_but_for_rounding_are_made_equal_and_said():
    rotation = rotate(trimesh.creation.box(EDGES))
    sphere = inertia.principal(tensor_of([2.0, 2.0, 2.0], rotation))
    assert len(set(sphere.moments)) == 1
    top = inertia.principal(np.diag([1.0, 2.0, 2.0 + 4e-16]))
    assert top.moments[0] != top.moments[1] == top.moments[2]
    assert "I2 and I3 differ by rounding only" in top.notes[0]
    near = inertia.principal(np.diag([1.0, 2.0, 2.0 + 1e-12]))
    assert near.moments[1] != near.moments[2]
    assert near.notes == ()
    assert inertia.principal(np.diag([1.0, 1.0, 2.0])).moments == (1.0, 1.0, 2.0)  # a flat plate is a body


SIZES = [(suffix, size) for suffix in ("stl", "obj", "ply", "off") for size in (1e-9, 1.0, 1e12)]


@pytest.mark.parametrize(("suffix", "size"), [pair for pair in SIZES if pair[0] in ("stl", "obj") or pair[1] == 1.0])
def test_a_brick_of_any_format_and_size_has_the_moments_of_the_textbook(tmp_path, suffix, size):
    rotation = brick(tmp_path / f"brick.{suffix}", scale=size)
    body = inertia.solid(tmp_path / f"brick.{suffix}", mass=1.0)
    # STL stores coordinates in single precision, the further formats eight decimals or more: 1e-7 of the edges
    np.testing.assert_allclose(np.array(body.principal.moments) / size**2, BRICK, rtol=2e-6)
    np.testing.assert_allclose(np.abs(np.array(body.principal.axes) @ rotation), np.eye(3), atol=2e-6)
    assert body.volume == pytest.approx(6.0 * size**3, rel=1e-6)
    assert body.mass == pytest.approx(1.0, rel=1e-15)


def test_a_thin_plate_keeps_its_thickness(tmp_path):
    plate = trimesh.creation.box()
    plate.apply_scale((1.0, 1.0, 1e-9))
    plate.export(tmp_path / "plate.stl")
    assert inertia.solid(tmp_path / "plate.stl", mass=1.0).volume == pytest.approx(1e-9, rel=1e-6)  # single precision


def test_density_unit_and_place_count_as_they_should(tmp_path):
    brick(tmp_path / "near.obj", is_rotated=False)
    brick(tmp_path / "far.obj", shift=(4000.0, -3000.0, 2000.0), is_rotated=False)
    near, far = (inertia.solid(tmp_path / f"{name}.obj", density=600.0, unit="cm") for name in ("near", "far"))
    # 3 by 2 by 1 cm at 600 kg m-3: 3.6 g
    np.testing.assert_allclose(near.principal.moments, np.array(BRICK) * 3.6e-3 * 1e-4, rtol=1e-12)
    # the coordinates themselves are rounded at 5e-13 of the edges
    np.testing.assert_allclose(far.principal.moments, near.principal.moments, rtol=1e-11)
    np.testing.assert_allclose(far.centre, [40.0, -30.0, 20.0], rtol=1e-12)
    assert near.mass == pytest.approx(3.6e-3, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("words.stl", b"hello", "holds no body"),
        ("empty.obj", b"", "holds no body"),
        ("words.obj", b"v 1 2\nf 1 2 3 4 5\n", "mesh"),
        ("nan.off", b"OFF\n4 4 0\nnan 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n", "holds no body"),
        ("brick.step", b"ISO-10303-21;", ".step; allowed: .stl, .obj, .ply, .off, .glb, .dae, .tab, .txt (export the"),
    ],
)
def test_a_file_that_is_no_mesh_is_refused_in_words(tmp_path, name, content, words):
    (tmp_path / name).write_bytes(content)
    assert words in refusal(lambda: inertia.solid(tmp_path / name, mass=1.0))


@pytest.mark.parametrize(
    ("edges", "settings", "unit", "note"),
    [
        ((71.5, 146.7, 7.4), {"mass": 0.172}, "m", "its density is 2.22e-06 kg/m³: is it in mm (--unit mm)?"),
        ((7.15, 14.67, 0.74), {"mass": 0.172}, "m", "its density is 0.00222 kg/m³: is it in cm (--unit cm)?"),
        ((0.0715, 0.1467, 0.0074), {"mass": 0.172}, "mm", "its density is 2.22e+12 kg/m³: is it in m (--unit m)?"),
        ((699.0, 100.0, 100.0), {"density": 1000.0}, "m", "it is 699 m long: is it in mm (--unit mm)?"),
        ((71.5, 146.7, 7.4), {"mass": 0.172}, "mm", ""),
        ((2.0, 2.0, 3.0), {"mass": 30.0}, "m", ""),
        ((3.0, 2.0, 1.0), {"density": 600.0}, "m", ""),
    ],
)
def test_lengths_in_another_unit_are_doubted(tmp_path, edges, settings, unit, note):
    trimesh.creation.box(edges).export(tmp_path / "box.obj")
    notes = inertia.solid(tmp_path / "box.obj", unit=unit, **settings).principal.notes
    assert notes == ((note,) if note else ())


def test_corners_that_differ_in_their_normals_are_one(tmp_path):
    """As programs write the flat sides of a box in OBJ: each corner thrice, with the normal of each side."""
    box = trimesh.creation.box(EDGES)
    places = [f"v {x} {y} {z}" for x, y, z in box.vertices[box.faces].reshape(-1, 3)]
    normals = [f"vn {x} {y} {z}" for x, y, z in box.face_normals]
    faces = [f"f {3 * k + 1}//{k + 1} {3 * k + 2}//{k + 1} {3 * k + 3}//{k + 1}" for k in range(len(box.faces))]
    (tmp_path / "box.obj").write_text("\n".join([*places, *normals, *faces]))
    np.testing.assert_allclose(inertia.solid(tmp_path / "box.obj", mass=1.0).principal.moments, BRICK, rtol=1e-12)


def test_a_missing_and_a_truncated_mesh_are_refused(tmp_path):
    brick(tmp_path / "brick.stl")
    (tmp_path / "cut.stl").write_bytes((tmp_path / "brick.stl").read_bytes()[:300])
    (tmp_path / "folder.stl").mkdir()
    for name, words in (("cut", ""), ("none", "is not there"), ("folder", "is not there, or is no file")):
        assert words in refusal(lambda name=name: inertia.solid(tmp_path / f"{name}.stl", mass=1.0))


# ---------------------------------------------------------------------------------------------------------
# In a definition


def definition(folder, body):
    (folder / "mine").mkdir(exist_ok=True)
    (folder / "mine" / "mine.yaml").write_text(f"bodies: [{{name: b, omega0: 1.0, {body}}}]\n")
    return folder / "mine" / "mine.yaml"


def test_a_mesh_is_found_beside_its_definition_and_its_content_is_an_input(tmp_path, monkeypatch):
    path = definition(tmp_path, "mesh: {file: brick.obj, mass: 1.0}")
    brick(tmp_path / "mine" / "brick.obj", is_rotated=False)
    monkeypatch.chdir("/")
    first = read_definition(path)
    np.testing.assert_allclose(first.bodies[0].moments, BRICK, rtol=1e-12)
    copy = pickle.loads(pickle.dumps(first))  # as it travels between processes
    assert copy.bodies[0].moments == first.bodies[0].moments
    assert first.text == path.read_text()
    assert first.inputs.startswith("brick.obj ")
    brick(tmp_path / "mine" / "brick.obj")
    assert read_definition(path).inputs != first.inputs
    assert read_definition({"grid": {"I1": 1.0, "I2": 1.0, "I3": 1.0, "omega0": 1.0}}).inputs == ""


def test_moments_of_a_tensor_land_ascending_in_the_map(tmp_path):
    import sweeps

    ds = sweeps.survey(definition(tmp_path, "tensor: [[3.25, 0, 0], [0, 1.0, 0], [0, 0, 2.5]]"))
    assert [float(ds[name][0]) for name in ("I1", "I2", "I3")] == [1.0, 2.5, 3.25]
    assert "tensor" in ds.attrs["definition"]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("tensor: [[1, 0, 0], [0, 1, 0]]", "bodies[0].tensor: [[1, 0, 0], [0, 1, 0]] is not a tensor of inertia"),
        ("tensor: [[1, 0, 0], [0, yes, 0], [0, 0, 1]]", "is text, not a number"),
        ("tensor: [[1, 0, 0], [0, .nan, 0], [0, 0, 3]]", "is not finite as a double"),
        ("tensor: [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]", "is not symmetric: 0.1 against 0.0"),
        ("tensor: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]", "has the principal moments -1, 1, 3"),
        ("tensor: [[0, 0, 0], [0, 0, 0], [0, 0, 0]]", "principal moments > 0"),
        ("tensor: [[1, 0, 0], [0, 1, 0], [0, 0, 3]]", "principal moments of no rigid body: I3 = 3 > I1 + I2 = 2"),
        ("tensor: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], I1: 2.0", "bodies[0].I1: 2.0 is given beside tensor"),
        ("ratios: {I1: 1, I2: 1, I3: 1}, mesh: {file: a.stl, mass: 1}", "is given beside ratios"),
        ("mesh: {file: none.stl, mass: 1.0}", "bodies[0].mesh.file: 'none.stl' is not there"),
        ("mesh: {file: none.stl}", "bodies[0].mesh.density: is missing"),
        ("mesh: {file: none.stl, mass: 1.0, density: 1.0}", "is given beside mass"),
        ("mesh: {file: none.stl, mass: 1.0, unit: yard}", "bodies[0].mesh.unit: 'yard' is not available"),
        ("mesh: {file: none.stl, mass: -1.0}", "bodies[0].mesh.mass: -1.0 is out of range"),
    ],
)
def test_a_definition_refuses_in_the_words_of_the_others(tmp_path, body, words):
    with pytest.raises(DefinitionError) as error:
        read_definition(definition(tmp_path, body))
    assert words in str(error.value)
    assert "allowed: " in str(error.value)
