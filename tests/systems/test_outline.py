"""Meshes with few faces, for pictures: within a cell of the body, with its orientation; and refused surfaces."""

import base64
import json

import numpy as np
import pytest

from sweeps.schema.refusals import MapError
from sweeps.systems.bodies import inertia, outline

trimesh = pytest.importorskip("trimesh")


def test_a_simplified_ring_keeps_its_shape_and_sense():
    ring = trimesh.creation.torus(2.0, 0.5, major_sections=96, minor_sections=48)
    vertices, faces = outline.simplify(np.asarray(ring.vertices), np.asarray(ring.faces))
    assert 500 < len(faces) <= outline.MAX_FACES < len(ring.faces)
    cell = 5.0 / 16  # of a lattice coarser than any that is needed
    distance = np.hypot(np.hypot(vertices[:, 0], vertices[:, 1]) - 2.0, vertices[:, 2]) - 0.5
    assert np.abs(distance).max() < cell
    solid = trimesh.Trimesh(vertices, faces, process=False)
    assert solid.volume == pytest.approx(ring.volume, rel=0.1)  # and above 0: normals point outwards


def test_few_faces_stay_as_they_are_and_come_back_from_text():
    box = trimesh.creation.box((3.0, 2.0, 1.0))
    vertices, faces = outline.simplify(np.asarray(box.vertices), np.asarray(box.faces))
    surface = outline.decode_surface(outline.encode_surface(vertices, faces))
    np.testing.assert_array_equal(np.reshape(surface["faces"], (-1, 3)), box.faces)
    far = np.linalg.norm([1.5, 1.0, 0.5])
    coordinates = np.reshape(surface["vertices"], (-1, 3)) / outline.COORDINATE_SCALE * far
    unit = far / outline.COORDINATE_SCALE
    np.testing.assert_allclose(coordinates, box.vertices, atol=unit)  # half of it, and a rounding


def test_a_solid_lies_along_its_principal_axes(tmp_path):
    box = trimesh.creation.box((3.0, 2.0, 1.0))
    box.apply_transform(trimesh.transformations.random_rotation_matrix(np.random.default_rng(1).random(3)))
    box.apply_translation((5.0, -3.0, 2.0))
    box.export(tmp_path / "box.stl")
    vertices, _ = inertia.solid(tmp_path / "box.stl", mass=1.0).surface
    np.testing.assert_allclose(
        np.abs(vertices), np.tile([1.5, 1.0, 0.5], (8, 1)), atol=1e-5
    )  # the file has single precision


def test_bodies_share_the_faces():
    ring = trimesh.creation.torus(2.0, 0.5, major_sections=96, minor_sections=48)
    box = trimesh.creation.box((3.0, 2.0, 1.0))
    text = outline.format_outlines({"ring": (ring.vertices, ring.faces), "box": (box.vertices, box.faces)})
    outlines = outline.read({"outlines": text})
    faces = {name: len(surface["faces"]) // 3 for name, surface in outlines.items()}
    assert faces["box"] == 12
    assert 500 < faces["ring"] <= outline.MAX_FACES - 12
    assert outline.format_outlines({}) == ""


INVALID_OUTLINES = ([1, 0, 0, 0], [2, 0, 0, 0], [1, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0], [60000, 1, 2, 3])
INVALID_OUTLINES += ([1, 0, 0, 0] + [0] * 3 * (outline.MAX_FACES + 1),)


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", "3", json.dumps({"a": 3}), json.dumps({"a": "no base64!"}), json.dumps({"a": ""})),
        *(json.dumps({"a": base64.b64encode(np.array(raw, "<u2").tobytes()).decode()}) for raw in INVALID_OUTLINES),
    ],
)
def test_what_is_no_surface_is_left_out(text):
    assert outline.read({"outlines": text}) == {}


@pytest.mark.parametrize("opening", ["[", '{"a": ', '[{"a": ', "[[", '{"body": ['])
def test_a_surface_that_is_nested_too_deeply_is_refused_in_one_line(opening):
    with pytest.raises(MapError, match=r"^outlines: is nested too deeply; allowed: .*$"):
        outline.read({"outlines": opening * 200_000})
