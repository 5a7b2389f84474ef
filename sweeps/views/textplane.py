"""What is drawn in characters: planes beside one another."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Panel:
    """One plane of characters."""

    title: str  #: what is special to this plane, "axis 2" or ""
    rows: list[tuple[str, str]]  #: (label, characters) from the top
    ends: tuple[str, str]  #: first and last value along the bottom


@dataclass(frozen=True)
class TextMap:
    """Planes beside one another, with what is the same in all."""

    flag: str  #: the variable that is drawn
    x: str  #: dimension along the bottom, "" for none
    y: str  #: dimension upwards
    fixed: dict[str, float | int | str]  #: dimension → value of what is not shown
    panels: list[Panel]  #: the planes
    legend: dict[str, str]  #: character → meaning, of what occurs
    colors: dict[str, str]  #: character → colour, "" where it has none
