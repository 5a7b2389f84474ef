"""Meshes of several surfaces, against volumes and moments that are known in closed form."""

import numpy as np
import pytest

from sweeps.systems.bodies import inertia, mesh_shells

trimesh = pytest.importorskip("trimesh")


def box(edges, at=(0.0, 0.0, 0.0), inwards=False):
    mesh = trimesh.creation.box(edges)
    mesh.apply_translation(at)
    if inwards:
        mesh.invert()
    return mesh


def solid(folder, *parts):
    trimesh.util.concatenate(parts).export(folder / "parts.off")
    return inertia.solid(folder / "parts.off", density=1.0)


TWO_BRICKS = [box((1, 1, 1)), box((1, 1, 1), (3, 0, 0))]
OVERLAPPING = {
    "a corner in the other": [box((1, 1, 1)), box((1, 1, 1), (0.5, 0.5, 0.5))],
    "a cross, no corner in the other": [box((4, 1, 1)), box((1, 4, 0.5), (0.1, 0, 0.05))],
    "end in end, faces in one plane": [box((2, 1, 1)), box((2, 1, 1), (1, 0, 0))],
    "one in the other, both outwards": [box((3, 3, 3)), box((1, 1, 1), (0.1, 0, 0))],
    "all but the same": [box((1, 2, 3)), box((1, 2, 3), (1e-3, 0, 0))],
    "balls": [trimesh.creation.icosphere(2), trimesh.creation.icosphere(2).apply_translation((1.9, 0, 0))],
}


@pytest.mark.parametrize("name", OVERLAPPING)
def test_what_overlaps_is_refused(tmp_path, name):
    with pytest.raises(inertia.MeshError, match=r"overlap .*count twice; allowed: "):
        solid(tmp_path, *OVERLAPPING[name])


def test_two_bricks_apart_have_the_moments_of_both(tmp_path):
    body = solid(tmp_path, *TWO_BRICKS)
    assert body.volume == pytest.approx(2.0, rel=1e-12)
    # each M a2/6 about its own middle, and M d2 with d = 1.5 (Steiner)
    np.testing.assert_allclose(body.principal.moments, [2 / 6, 2 / 6 + 2 * 1.5**2, 2 / 6 + 2 * 1.5**2], rtol=1e-12)


def test_a_brick_inside_out_beside_another_is_turned_and_said(tmp_path):
    body = solid(tmp_path, TWO_BRICKS[0], box((1, 1, 1), (3, 0, 0), inwards=True))
    assert body.volume == pytest.approx(2.0, rel=1e-12)
    assert "1 of its 2 surfaces looked inwards" in body.principal.notes[0]


def test_a_hollow_and_what_lies_in_it_count_once(tmp_path):
    body = solid(tmp_path, box((4, 4, 4)), box((3, 3, 3), inwards=True), box((1, 1, 1), (0.5, 0, 0)))
    assert body.volume == pytest.approx(64 - 27 + 1, rel=1e-12)
    assert not any("surfaces" in note for note in body.principal.notes)


def test_bricks_that_touch_are_apart(tmp_path):
    body = solid(tmp_path, box((1, 1, 1)), box((0.5, 0.5, 1), (0, 0, 1)))
    assert body.volume == pytest.approx(1.25, rel=1e-12)


def test_surfaces_too_fine_to_be_compared_are_said(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_shells, "MAX_PAIRS", 100)
    body = solid(tmp_path, box((1, 1, 1)), box((1, 1, 1), (0.5, 0.5, 0.5)))
    assert "1 pairs of its surfaces are too fine to be compared" in body.principal.notes[0]


def test_one_flipped_triangle_is_turned_and_said(tmp_path):
    mesh = box((3, 2, 1))
    mesh.faces[4] = mesh.faces[4][::-1]
    mesh.export(tmp_path / "flipped.off")
    body = inertia.solid(tmp_path / "flipped.off", mass=1.0)
    np.testing.assert_allclose(body.principal.moments, [5 / 12, 10 / 12, 13 / 12], rtol=1e-12)
    assert "looked both ways" in body.principal.notes[0]
