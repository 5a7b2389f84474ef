import numpy as np
import pytest
import xarray as xr

from sweeps.maps import selection


@pytest.fixture
def ds():
    coords = {
        "body": ["Tennis racket", "Earth", "Earth's Moon"],
        "axis": ("axis", np.array([1, 3], np.int8), {"units": "1"}),
        "epsilon": ("epsilon", [1e-8, 1e-4, 1e-2], {"units": "1"}),
        "phase": ("phase", [0.6], {"units": "rad"}),
        "I1": ("body", [1.0, 2.0, 3.0]),
    }
    return xr.Dataset({"status": (("body", "axis", "epsilon", "phase"), np.zeros((3, 2, 3, 1), np.int8))}, coords)


def selected_place(ds, **values):
    return {dim: place.value for dim, place in selection.nearest_places(ds, values).items()}


def test_the_nearest_value_is_that_of_xarray(ds):
    for value in (1e-9, 3e-5, 6e-5, 4.9e-3, 5.1e-3, 1.0):
        expected = ds.epsilon.sel(epsilon=value, method="nearest").item()
        assert selected_place(ds, epsilon=str(value)) == {"epsilon": expected, "phase": 0.6}


def test_places_say_what_was_asked(ds):
    places = selection.nearest_places(ds, {"epsilon": "5", "phase": "0.6"})
    assert str(places["epsilon"]) == "epsilon = 0.01 (nearest to 5, which is outside the grid)"
    assert str(places["phase"]) == "phase = 0.6 rad"
    inside = selection.nearest_places(ds, {"epsilon": "9e-5"})
    assert str(inside["epsilon"]) == "epsilon = 0.0001 (nearest to 9e-05)"
    assert selection.select_places(ds, places).status.dims == ("body", "axis")


def test_names_may_be_parts_that_only_one_has(ds):
    names = {"Earth": "Earth", "earth": "Earth", "RACKET": "Tennis racket", "moon": "Earth's Moon"}
    assert {text: selected_place(ds, body=text)["body"] for text in names} == names


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"body": "rackett"}, "did you mean Tennis racket?"),
        ({"body": "e"}, "may be several"),
        ({"body": ""}, "is not among the names; allowed: Tennis racket, Earth"),
        ({"axis": "2"}, "--axis: 2 is not in this map; allowed: 1, 3"),
        ({"epsilon": "small"}, "--epsilon: 'small' is no number; allowed: 1e-08, 0.0001, 0.01"),
        ({"epsilon": "nan"}, "is no number"),
        ({"epsilon": "1e999"}, "is no number"),
        ({"epsilom": "1"}, "--epsilom: is no dimension of this map (did you mean epsilon?)"),
        ({"I1": "1"}, "--I1: is a coordinate along body, not a dimension"),
    ],
)
def test_what_is_no_place_is_refused(ds, values, words):
    with pytest.raises(selection.SelectionError) as error:
        selection.nearest_places(ds, values, "--")
    assert words in str(error.value)
    assert "allowed: " in str(error.value)


@pytest.mark.parametrize("text", ["I3=", "=1", "I3", ""])
def test_an_assignment_without_name_or_value_is_refused(text):
    with pytest.raises(selection.SelectionError, match=r"names no place; allowed: DIMENSION=VALUE"):
        selection.parse_assignment(text)
    assert selection.parse_assignment(" I3 = 0.5") == ("I3", "0.5")


def test_a_choice_is_written_as_the_caller_writes_it(ds):
    assert selection.how_to_choose(ds, ["axis", "epsilon"]) == "axis=1, 3, epsilon=1e-08, 0.0001, 0.01"
    assert selection.how_to_choose(ds, ["axis"], "--") == "--axis 1, 3"
