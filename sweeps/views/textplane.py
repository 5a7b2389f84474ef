"""What is drawn in characters: planes beside one another."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Panel:
    """One plane of characters.

    Attributes:
        title: what is special to this plane, "axis 2" or "".
        rows: (label, characters) from the top.
        ends: first and last value along the bottom.
    """

    title: str
    rows: list[tuple[str, str]]
    ends: tuple[str, str]


@dataclass(frozen=True)
class TextMap:
    """Planes beside one another, with what is the same in all.

    Attributes:
        flag: the variable that is drawn.
        x: dimension along the bottom, "" for none.
        y: dimension upwards.
        fixed: dimension → value of what is not shown.
        panels: the planes.
        legend: character → meaning, of what occurs.
        colors: character → colour, "" where it has none.
    """

    flag: str
    x: str
    y: str
    fixed: dict[str, float | int | str]
    panels: list[Panel]
    legend: dict[str, str]
    colors: dict[str, str]
