"""The animation of the flip: its body, the rotation and the content of the file."""

from itertools import combinations, pairwise

import euler
import numpy as np
import pytest
from PIL import Image, ImageSequence

import sweeps
from sweeps.__main__ import main
from sweeps.figure import sheets
from sweeps.schema.refusals import RefusedError
from sweeps.systems.bodies import outline, solid
from sweeps.systems.presentation import animation as animations
from sweeps.systems.rigid_body.presentation import figure_flip
from sweeps.views import figures, films

GRID = {"grid": {"I1": {"start": 0.4, "stop": 1.6, "num": 5}, "I2": [0.7, 1.1, 2.5], "I3": [1.0, 1.3], "omega0": -5.0}}


ds = pytest.fixture(lambda: sweeps.survey(GRID), scope="module")


def test_it_is_the_most_unstable_body_that_can_exist(ds, monkeypatch):
    monkeypatch.setattr(figure_flip, "BLOCK_POINTS", 7)
    point = figure_flip.most_unstable(ds)
    rates = np.where(ds.triangle_margin.values >= 0, ds.growth_rate.values, -1.0)
    row = ds.sel({name: point[name] for name in ds.dims})
    assert float(row.growth_rate) == rates.max()
    assert ds.growth_rate.values.max() > rates.max()  # else the triangle would decide nothing


def test_a_map_where_nothing_flips_has_no_animation():
    assert list(figure_flip.frames(sweeps.survey(axes=[3], I1=1.0, I2=2.0, I3=2.5, omega0=1.0))) == []


def test_a_racket_on_the_grid_is_shown_about_its_own_axis_2():
    I1, I2, I3 = 0.00121, 0.01638, 0.01748
    grid = {"I1": [I1, 0.02], "I2": [0.01, I2], "I3": [I3, 0.03], "omega0": [2.0, 11.0]}
    point = figure_flip.racket(sweeps.survey({"grid": grid}))
    assert [point[name] for name in ("I1", "I2", "I3", "axis", "omega0")] == [I1, I2, I3, 2, 11.0]


@pytest.mark.parametrize(
    "motion", [{"axis": 1, "epsilon": 0.3}, pytest.param({"axis": 2, "epsilon": 0.1}, marks=pytest.mark.slow)]
)
def test_no_letter_lies_on_another_in_any_frame(motion, monkeypatch):
    """L, ω and the number of the axis, by their boxes of pixels, over two flips or wobbles."""
    frames, set_attitude = [], figure_flip.FilmStage.set_attitude

    def look(stage, *arguments):
        artists = set_attitude(stage, *arguments)
        frames.append([text.get_window_extent() for text in (stage.vertical, *stage.letters)])
        return artists

    monkeypatch.setattr(figure_flip.FilmStage, "set_attitude", look)
    with sheets.use_sheet(sheets.OWN_SIZE), films.use_film_of("racket.gif"):
        count = len(list(figure_flip.film(sweeps.motion("racket", motion | {"omega0": 10.0}))))
    assert len(frames) == count > 80
    assert not [k for k, boxes in enumerate(frames) for one, other in combinations(boxes, 2) if one.overlaps(other)]


@pytest.mark.parametrize("moments", [(1.0, 2.0, 2.6), (0.00121, 0.01638, 0.01748), (16.38, 1.21, 17.48)])
def test_the_solid_has_the_moments_of_the_body(moments):
    """Triangles of its faces; strings, which are transparent, weigh nothing."""
    trimesh = pytest.importorskip("trimesh")
    faces = solid.solid(np.array(moments))
    triangles = [face.corners[[0, i, i + 1]] for face in faces if face.opacity == 1.0 for i in (1, 2)]
    body = trimesh.triangles.mass_properties(np.array(triangles))
    inertia = np.diag(body.inertia)
    np.testing.assert_allclose(inertia / inertia[0], np.array(moments) / moments[0], rtol=1e-12)  # rounding
    np.testing.assert_allclose(body.center_mass, 0.0, atol=1e-14)
    assert len(faces) == (6 if moments[0] == 1.0 else 136)


def test_the_body_turns_as_its_angular_velocity_says():
    """Against DOP853 from the first attitude, whose L is upright."""
    moments, omega, times = np.array([1.0, 2.0, 2.6]), np.array([0.3, 5.0, -0.2]), np.linspace(0.0, 3.0, 4)
    attitudes = figure_flip.attitudes(moments, omega, times)
    L = moments * omega
    np.testing.assert_allclose(attitudes[0] @ L / np.linalg.norm(L), [0, 0, 1], atol=1e-14)
    states = euler.rotate(moments, omega, 3.0, attitudes[0], t_eval=times).y
    np.testing.assert_allclose(attitudes, euler.in_space(states, np.eye(3)), atol=1e-9)  # DOP853 at 1e-12


def test_the_file_is_an_animation_that_moves(ds, tmp_path, monkeypatch):
    monkeypatch.setattr(figure_flip, "FRAMES", 6)
    monkeypatch.setattr(figures, "pictures", lambda ds: {})
    monkeypatch.setenv("PATH", "")  # no encoder
    assert list(figures.draw_all(ds, tmp_path)) == [tmp_path / "flip.gif"]
    with Image.open(tmp_path / "flip.gif") as animation:
        assert animation.info["loop"] == 0
        pictures = [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(animation)]
    assert len(pictures) == 6
    assert all((before != after).any() for before, after in pairwise(pictures))
    list(figures.draw_all(ds, tmp_path, theme="dark"))
    with Image.open(tmp_path / "flip.gif") as animation:
        # the paper of a dark figure, #15181c, to the nearest of the 256 shades of a palette
        assert animation.convert("RGB").getpixel((0, 0)) == pytest.approx((0x15, 0x18, 0x1C), abs=1)


@pytest.fixture
def encode(tmp_path, monkeypatch):
    """Put a fake ffmpeg into the path: it stores its arguments and the length of its input, and ends with a status."""

    def install_encoder(status=0):
        encoder = tmp_path / "bin" / "ffmpeg"
        encoder.parent.mkdir()
        last = 'for last in "$@"; do :; done'
        encoder.write_text(f'#!/bin/sh\n{last}\necho "$@" > "$last"\nwc -c >> "$last"\nexit {status}\n')
        encoder.chmod(0o755)
        monkeypatch.setenv("PATH", str(encoder.parent), prepend=":")

    return install_encoder


@pytest.mark.parametrize("status", [0, 1])
def test_a_film_is_written_by_the_encoder_or_refused(ds, tmp_path, monkeypatch, encode, status):
    """Frames of 1920 pixels, 30 a second, in the requested number."""
    encode(status)
    monkeypatch.setattr(figure_flip, "FRAMES", 2)
    if status:
        with pytest.raises(RefusedError, match="mp4: cannot be written by the installed ffmpeg; allowed: gif"):
            list(figures.draw_all(ds, tmp_path / "films", "mp4"))
        assert not (tmp_path / "films").exists()
        return
    assert list(figures.draw_all(ds, tmp_path / "films", "mp4")) == [tmp_path / "films" / "flip.mp4"]
    arguments = (tmp_path / "films" / "flip.mp4").read_text()
    assert "-s 1920x1080 -r 30 " in arguments
    assert int(arguments.split()[-1]) == 4 * 1920 * 1080 * 4  # twice the frames of a GIF, of four bytes a pixel


@pytest.mark.parametrize("inches", [(7.2, 5.0), (9.6, 5.4), (6.4, 3.5)])
def test_a_film_of_any_shape_fits_a_screen_and_its_sheet_is_even(tmp_path, encode, inches):
    encode()
    dots = sheets.HD.dpi(inches, 90)
    films.write_frames([np.zeros((int(inches[1] * dots), int(inches[0] * dots), 4), np.uint8)], tmp_path / "film.mp4")
    assert "pad=1920:1080:" in (tmp_path / "film.mp4").read_text()


def test_a_motion_is_a_film_with_the_body_s_mesh(tmp_path, monkeypatch, capsys):
    trimesh = pytest.importorskip("trimesh")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(animations, "FILM_SECONDS", (0.3, 0.3))
    trimesh.creation.icosphere(2).apply_scale([1.0, 2.0, 4.0]).export("ball.stl")
    call = ["motion", "--mesh", "ball.stl", "--density", "1000", "--unit", "cm", "-o", "ball.gif", "--omega0"]
    assert main([*call, "30 rpm"]) == 0
    assert capsys.readouterr().out == "ball.gif\n"
    with Image.open("ball.gif") as animation:
        assert animation.n_frames == 6
    trajectory = sweeps.motion({"mesh": {"file": "ball.stl", "density": 1000.0, "unit": "cm"}})
    assert len(next(iter(outline.read(trajectory.attrs).values()))["faces"]) == 3 * 320


def test_a_film_has_its_words_in_lines_and_no_unit_of_ratios(tmp_path, monkeypatch):
    stages, stage = [], animations.empty_stage
    monkeypatch.setattr(animations, "empty_stage", lambda *words: stages.append(stage(*words)) or stages[-1])
    monkeypatch.setattr(animations, "draw_frames", lambda figure, frames: iter([np.zeros((8, 8, 4), np.uint8)]))
    spin = ["--axis", "2", "--omega0", "10", "--duration", "1", "--output", str(tmp_path / "a.gif")]
    for body, words in ((["--ratios", "1", "3", "3.5"], "I₁ : I₂ : I₃ = 1 : 3 : 3.5"), (["racket"], "kg m²")):
        assert main(["motion", *body, *spin]) == 0
        _title, subtitle = stages[-1].texts
        assert words in subtitle.get_text().replace("\u00a0", " ")
        assert ("kg" in subtitle.get_text()) == (words == "kg m²")
        width = stages[-1].bbox.width
        assert subtitle.get_window_extent().x1 < width
