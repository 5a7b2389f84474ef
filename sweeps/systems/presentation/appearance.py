"""How a system's flags and names look: in words, as a character in a terminal, in colour, as a symbol."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from kernels.statuses import STATUSES
from sweeps.figure import colors


class Mark(NamedTuple):
    """How one meaning of a flag looks."""

    words: str  #: what people read
    glyph: str  #: one character
    color: str  #: a name of `sweeps.figure.colors`, or "#rrggbb", the same in every theme; "" for none
    more: str = ""  #: what a reader of the words alone would miss, in a sentence under a legend


class Symbol(NamedTuple):
    """How one parameter is written."""

    tex: str  #: as mathtext, with its dollars
    text: str  #: in Unicode


class Compared(NamedTuple):
    """A measured quantity that one column of the figure of agreement compares with theory."""

    names: tuple[str, ...]  #: a measured variable; of several, as of a vector's components, the root of squares
    title: str  #: of the column
    per: str = ""  #: variable or coordinate in whose size theory is drawn; "" for theory's own unit
    is_spare: bool = False  #: whether it is compared only in a map that has no other


COMMON = {
    "undetermined": Mark("undetermined", "?", colors.BLACK),
    "stable": Mark("stable", "+", colors.STABLE),
    "unstable": Mark("unstable", "#", colors.UNSTABLE),
    "marginal": Mark("marginal", "=", colors.GREY),
    "ok": Mark("ok", ".", colors.STABLE),
    "short_window": Mark("short window", "w", ""),
    "not_converged": Mark("not converged", "x", ""),
    "non_finite": Mark("non-finite", "n", ""),
}

MISSING = {
    frozenset({"no_equilibrium"}): "no such equilibrium",
    frozenset({"equilibrium_undecided"}): "equilibrium undecided",
    frozenset({"no_equilibrium", "equilibrium_undecided"}): "no such equilibrium, or undecided",
}


def missing_words(codes: Iterable[int]) -> str:
    """Return the legend's words for points without a measured value, by the codes of their statuses."""
    return MISSING.get(frozenset(STATUSES[code] for code in codes), "no measured value")


@dataclass(frozen=True)
class Appearance:
    """How a system's flags and names look; what it does not say looks as its name reads."""

    marks: Mapping[str, Mark] = field(default_factory=dict)  #: meaning of a flag → how it looks, beside `COMMON`
    symbols: Mapping[str, Symbol] = field(default_factory=dict)  #: parameter → how it is written

    def mark(self, meaning: str) -> Mark | None:
        """Return the words, character and colour of a meaning; None where it has none."""
        return self.marks.get(meaning) or COMMON.get(meaning)

    def words(self, meaning: str) -> str:
        """Return a meaning in words."""
        mark = self.mark(meaning)
        return mark.words if mark else meaning.replace("_", " ")

    def color(self, meaning: str) -> str:
        """Return the colour of a meaning, "" where it has none."""
        mark = self.mark(meaning)
        return mark.color if mark else ""

    def symbol(self, name: str) -> str:
        """Return the symbol of a parameter as mathtext; its name where it has none."""
        return self.symbols[name].tex if name in self.symbols else name.replace("_", " ")
