"""Appearance of a system's flags and names: words, characters in a terminal, colours, symbols."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from kernels.estimator.statuses import STATUSES
from sweeps.figure import colors


class Mark(NamedTuple):
    """Words, character and colour of one meaning of a flag."""

    words: str  #: text in legends and tables
    glyph: str  #: one character
    color: str  #: a name of `sweeps.figure.colors`, or "#rrggbb", the same in every theme; "" for none
    more: str = ""  #: explanation of the words, a sentence below a legend


class Symbol(NamedTuple):
    """Symbol of one parameter."""

    tex: str  #: as mathtext, including the dollar signs
    text: str  #: in Unicode


class Compared(NamedTuple):
    """A measured quantity that one column of the figure of agreement compares with theory."""

    names: tuple[str, ...]  #: a measured variable; of several, a vector's components, the root of the sum of squares
    title: str  #: title of the column
    per: str = ""  #: variable or coordinate by which theory is divided; "" for its own unit
    is_spare: bool = False  #: True if it is compared only in a map without another compared quantity


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
    """Appearance of a system's flags and names. A name without an entry is shown as it is."""

    marks: Mapping[str, Mark] = field(default_factory=dict)  #: meaning of a flag → its mark, in addition to `COMMON`
    symbols: Mapping[str, Symbol] = field(default_factory=dict)  #: parameter → its symbol

    def mark(self, meaning: str) -> Mark | None:
        """Return the words, character and colour of a meaning; None if it has no mark."""
        return self.marks.get(meaning) or COMMON.get(meaning)

    def words(self, meaning: str) -> str:
        """Return a meaning in words."""
        mark = self.mark(meaning)
        return mark.words if mark else meaning.replace("_", " ")

    def color(self, meaning: str) -> str:
        """Return the colour of a meaning, "" if it has none."""
        mark = self.mark(meaning)
        return mark.color if mark else ""

    def symbol(self, name: str) -> str:
        """Return the symbol of a parameter as mathtext; its name if it has no symbol."""
        return self.symbols[name].tex if name in self.symbols else name.replace("_", " ")
