"""The verdict on a spin: its word against the spectrum of the linearised equations, its margin against a search."""

import numpy as np
import pytest

import sweeps
from sweeps.systems.rigid_body.presets import PRESETS
from sweeps.systems.uncertain_bodies import verdict


def bodies(count, seed):
    """Return possible bodies, axes in any order: sums of two of three second moments."""
    second = np.random.default_rng(seed).exponential(size=(count, 3))
    return second.sum(axis=1, keepdims=True) - second


def spectrum(moments, axis, loss):
    """Return the largest real part of the eigenvalues of ω' about a spin, with L' = L × ω + α L × (L × ω)."""
    start = np.eye(3)[axis - 1] * moments[axis - 1]

    def rates(L):
        omega = L / moments
        return np.cross(L, omega) + loss * np.cross(L, np.cross(L, omega))

    step = 1e-6  # central differences of a cubic: right to 1e-9
    columns = [(rates(start + step * e) - rates(start - step * e)) / (2 * step) for e in np.eye(3)]
    return np.linalg.eigvals(np.transpose(columns)).real.max()


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_the_word_is_that_of_the_spectrum_with_and_without_dissipation(axis):
    for moments in bodies(60, axis):
        grows_without_loss, grows = (spectrum(moments, axis, loss) > 1e-7 for loss in (0.0, 0.1))
        expected = "unstable" if grows_without_loss else "stable_without_loss" if grows else "stable"
        assert verdict.judge_moments(moments.tolist(), axis) == expected


def test_equal_moments_are_marginal_across_and_judged_along():
    words = [verdict.judge_moments((1.0, 2.0, 2.0), axis) for axis in (1, 2, 3)]
    assert words == ["stable_without_loss", "marginal", "marginal"]
    assert verdict.judge_moments((1.0, 1.0, 2.0), 3) == "stable"
    assert verdict.judge_moments((1.0, 1.0, 1.0), 3) == "marginal"
    assert verdict.find_margin((1.0, 2.0, 2.0), 2)["change"] == 0.0


@pytest.mark.parametrize("axis", [1, 2, 3])
def test_the_margin_is_the_smallest_change_of_one_moment_that_keeps_a_possible_body(axis):
    changes = np.concatenate([-np.linspace(0, 1, 4001)[1:-1], np.geomspace(1e-4, 1e4, 8000)])
    changes = changes[np.abs(changes).argsort()]
    for moments in bodies(50, 10 + axis):
        words, smallest = verdict.WORDS_BY_REGIME, np.inf
        for k in range(3):
            changed = np.repeat(moments[None], len(changes), axis=0)
            changed[:, k] *= 1 + changes
            is_body = 2 * changed.max(axis=1) <= changed.sum(axis=1)
            word = words.index(verdict.judge_moments(moments.tolist(), axis))
            is_changed = is_body & (verdict.judge_draws(changed, axis, 0.0) != word)
            smallest = min(smallest, abs(changes[is_changed.argmax()]) if is_changed.any() else np.inf)
        margin = abs(verdict.find_margin(moments.tolist(), axis)["change"])
        assert smallest == pytest.approx(margin, rel=4e-3, abs=3e-4)  # the spacing of the changes that are tried


@pytest.mark.parametrize(
    ("body", "setting", "axis", "chosen_by"),
    [
        ([3.0, 1.0, 2.5], {}, 1, "greatest_inertia"),
        ([1.0, 2.0, 2.5], {"axis": 2}, 2, "axis"),
        ("racket", {}, 2, "usual_spin"),
        ([[3.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 2.5]], {"omega": [0.0, "-5 rpm", 0.0]}, 1, "omega"),
    ],
)
def test_the_judged_axis_is_requested_or_stated(body, setting, axis, chosen_by):
    answer = sweeps.body(body, **setting)
    facts = answer.facts["verdict"]
    assert (facts["axis"], facts["chosen_by"]) == (axis, chosen_by)
    assert " ".join(str(answer).split()).startswith(f"{answer.name} {facts['sentence']}")
    assert verdict.CHOICES[chosen_by] in facts["sentence"]
    if chosen_by == "omega":
        assert facts["direction"][1] < 0  # the sense of the spin


def test_the_bodies_to_choose_on_a_page_have_names_for_the_command():
    answers = {preset["name"]: sweeps.body(preset["name"]).facts for preset in PRESETS}
    assert answers["Explorer 1"]["verdict"]["word"] == "stable_without_loss"
    assert answers["book"]["verdict"]["word"] == "unstable"
    for preset in PRESETS[3:]:  # the racket and the phone are those of the definition `bodies`, to its digits
        assert answers[preset["name"]]["moments"] == pytest.approx(preset["moments"], rel=1e-12)
