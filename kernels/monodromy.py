r"""Monodromy matrices from perturbed motions: segment after segment, and the product of all, W points side by side.

From each direction, and from its other side, a perturbed motion is followed through every segment of the period beside
the base motion, whose series all directions share. Half the difference of both sides is a column of the segment's
matrix S, and :math:`M = S_K\cdots S_1`. Where the equations are linear, one motion follows a direction of each block of
states that no others influence. Where they are not, one more motion begins at twice the sum of all directions: from
twice the sum of their ends it differs by more than each column does from a linear motion.

*Half a period.* Where Hamilton's equations are even in the time and have no terms in the velocities, :math:`u(-t)`
solves them where u(t) does: the second half's matrix is :math:`R\,P^{-1}R`, P the first half's, R with velocities
reversed. Of :math:`P = (A\ B;\ C\ D)` and the masses a it is known without division:
:math:`a^{-1}(D^T B^T;\ C^T A^T)\,a`; so what P is off, it is off likewise, and both errors are added.

*Errors.* What a segment may be off, :math:`G_k`, grows to :math:`|S_K\cdots S_{k+1}|\,G_k\,|S_{k-1}\cdots S_1|`, and so
does the rounding of each product. Roundings are independent, so their squares are added; what is left out by the steps
is not, and counts :math:`\sqrt{Kn}` times, for :math:`(\sum_{k=1}^K a_k)^2 \le K\sum a_k^2`.

*Second compounds.* The minors of two rows and two columns of a product are the products of the factors' minors. Their
trace is the determinant (two states), or the second invariant (four): from the segments' minors these keep the digits
that beside a large multiplier the entries of M have lost.
"""

import math
from functools import cache
from itertools import combinations, product

import numpy as np

from kernels.blocks import LANES, W, rows_of, scratch
from kernels.dense import put
from kernels.jit import OPTIONS, PASSED, float64, int64, njit, types, void, whole_vectors
from kernels.straight import lines

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
ROUNDED = 16.0 * EPSILON  # of terms: by what a sum of motions may be off by rounding alone
LARGE = 1e3  # entry from which on the lesser pair is found from the product of both
ELSEWHERE = 0.381966  # of a period: where the product begins again
ROWS = void(float64[::1], float64[:, ::1], int64)
COMPOSE = void(float64[::1], int64, int64)
FUNCTION, COMPOSING = types.FunctionType(ROWS), types.FunctionType(COMPOSE)


class Record:
    """The rows that are kept of each segment of n states, W lanes each, and the lines that work on them.

    S its matrix, row by row, and later E, the sum of the squares of what its errors and those after become; o by what
    it is off beside rounding, in roundings, and a what counts as alike in all segments, relative to the largest entry;
    P the product of the matrices before, and later of it and those after; M, R, t, c, e, L the result of
    :func:`compose_of`; v a vector on its way; m and w the masses in the states' sizes, and their inverse. Where entries
    are large, longer records have C, D, Q, too: the second compound, the sizes of its errors, its products. Entries of
    states that are not `joined` vanish, and no line works on them.
    """

    def __init__(self, n: int, joined):
        self.n, self.pairs, names = n, [*combinations(range(n), 2)] if n in (2, 4) else [], "SoaPMRtceLvmwCDQ"
        d, m = len(self.pairs), n // 2
        sizes = [n * n, 1, 1, *[n * n] * 3, 1, 1, 1, n * n, n, *[m * m] * 2, *[d * d] * 3]
        self.first = dict(zip(names, np.cumsum([0, *sizes]).tolist(), strict=False))
        self.of = {name: d if name in "CDQ" else m if name in "mw" else n for name in names}
        self.height, self.tall = self.first["C"], sum(sizes)
        self.entries = {d: [*product(range(d), repeat=2)], n: [*zip(*np.nonzero(joined), strict=True)]}

    def at(self, name: str, i: int = 0, j: int = 0) -> str:
        """Return the place of an entry, of the next segment where the name is doubled; of `q`, its name."""
        if name == "q":
            return f"q_{i}_{j}"
        height = self.tall if name[0] in "CDQ" else self.height
        row = self.first[name[0]] + i * self.of[name[0]] + j + (len(name) - 1) * height
        return f"S[{row * W} + lane]"

    @staticmethod
    def unit(i: int, j: int) -> float:
        """Return an entry of the unit matrix."""
        return float(i == j)

    def each(self, name, source, of=""):
        """Return lines that write the entries of a matrix: those of another one, or what a function returns."""
        entries = self.entries[self.of[of or name[0]]]
        return [
            f"{self.at(name, *e)} = {self.at(source, *e) if isinstance(source, str) else source(*e)}" for e in entries
        ]

    def _terms(self, a, b, i, j):
        """Return the terms of an entry of a product of matrices."""
        row = (k for r, k in self.entries[self.of[b[0]]] if r == i)
        return [f"{self.at(a, i, k)} * {self.at(b, k, j)}" for k in row]

    def multiplied(self, name, a, b):
        """Return lines that write a product of matrices."""
        return self.each(name, lambda i, j: " + ".join(self._terms(a, b, i, j)), b[0])

    def _largest(self, name, least=0.0):
        """Return lines that find the largest entry."""
        return [f"most = {least}", *(f"most = max(most, abs({self.at(name, *e)}))" for e in self.entries[self.n])]

    def mirrored(self, name: str, power: int = 1) -> list[str]:
        """Return lines that find R S⁻¹ R of a matrix, q; with a power of 2, what it makes of the squares of errors."""
        m, entries = self.n // 2, self.entries[self.n]

        def entry(i, j):
            terms = []
            for a, b in product(range(m), repeat=2):
                mass, other = (a, j) if j < m else (j - m, a), (i, b) if i < m else (b, i - m)
                factor = f" * ({self.at('m', *mass)} * {self.at('w', *other)})" if m > 1 else ""
                if mass in entries and other in entries:
                    terms.append(self.at(name, a + m * (j < m), b + m * (i < m)) + power * factor)
            return " + ".join(terms) or "0.0"

        return self.each("q", entry, name)

    def join(self, half: bool) -> list[str]:
        """Return lines that write the product of all, and begin that of those after."""
        text = self.mirrored("P") if half else []
        text += self.multiplied("M", "q", "P") if half else self.each("M", "P")
        text += [f"{self.at('v', 0, i)} = {self.at('P', i)}" for i in range(self.n)]
        text += self.each("P", "q" if half else self.unit)
        return [*text, *self.each("S", lambda *_: 0.0), *self._largest("M"), f"{self.at('c')} = most"]

    def errors(self) -> list[str]:
        """Return lines that find the sizes of the errors: of terms' roundings, |S||S| or the largest entry, and o."""
        text = [*self._largest("S"), f"off = {self.at('o')} + {self.at('a')} * most"]
        for i, j in self.entries[self.n]:  # states apart stay apart
            text += [f"G_{i}_{j} = min({' + '.join(f'abs({x})' for x in self._terms('S', 'S', i, j))}, most) + off"]
        return text

    def flip(self) -> list[str]:
        """Return lines that make R S⁻¹ R of a segment."""
        text = [*self.mirrored("S"), *self.each("S", "q"), *self._largest("q", 1.0)]
        return [*text, f"{self.at('o')} = {self.at('o')} * (most * most)"]

    def minors(self) -> list[str]:
        """Return lines that write the second compound and the sizes of its errors."""
        text = self.errors()
        for (r, (i, j)), (s, (k, m)) in product(enumerate(self.pairs), repeat=2):
            one, other = (f"{self.at('S', i, a)} * {self.at('S', j, b)}" for a, b in ((k, m), (m, k)))
            text += [f"one = {one}", f"other = {other}", f"{self.at('C', r, s)} = one - other"]
            text += [f"{self.at('D', r, s)} = abs(one) + abs(other) + 2.0 * {self.at('o')} * most"]
        return text

    def _turn(self, x, y, u, v, to):
        """Return lines that count the half turns of a vector on its way from (x, y) to (u, v)."""
        up, now = f"({y} > 0.0)", f"({v} > 0.0)"
        turn = f"turn if ({up} & ~{now}) | ({now} & ~{up}) else 0.0"
        old = self.at("t" if to == "tt" else "tt")
        return [f"turn = 1.0 if {y} * {u} > {x} * {v} else -1.0", f"turn = {turn}", f"{self.at(to)} = {old} + turn"]

    def before(self, matrix: str, others: str) -> list[str]:
        """Return lines that multiply the product of those before by a segment's matrix."""
        text = self.multiplied(2 * others, matrix, others)
        if matrix == "S" and self.n == 2:
            text += self._turn(*(self.at(name, i) for name in ("P", "PP") for i in (0, 1)), "tt")
        return text

    def after(self, matrix: str, others: str) -> list[str]:
        """Return lines that multiply the product of those after by a segment's matrix, and add errors' squares."""
        entries, two = self.entries[self.of[matrix]], 2 * others
        text = self.errors() if matrix == "S" else [f"G_{i}_{j} = {self.at('D', i, j)}" for i, j in entries]
        if matrix == "S" and self.n == 2:  # the segment turned over
            x, y, *(a, b, c, d) = (self.at(*e) for e in [("vv", 0, 0), ("vv", 0, 1), *product("S", (0, 1), (0, 1))])
            text += [f"u = {d} * {x} + {b} * {y}", f"v = {c} * {x} + {a} * {y}", *self._turn(x, y, "u", "v", "t")]
            text += [f"{self.at('v', 0, 0)} = u", f"{self.at('v', 0, 1)} = v"]
        for i, j in entries:
            text += [f"h_{i}_{j} = G_{i}_{j} * G_{i}_{j} + {self.at(matrix, i, j)} * {self.at(matrix, i, j)}"]
            text += [f"p_{i}_{j} = {self.at(others, i, j)} * {self.at(others, i, j)}"]
            text += [f"z_{i}_{j} = {self.at(two, i, j)} * {self.at(two, i, j)}"]
        for b, j in entries:
            text += [f"t_{b}_{j} = " + " + ".join(f"h_{b}_{c} * p_{c}_{j}" for r, c in entries if r == b)]
        text += self.multiplied("q", two, matrix)
        for i, j in entries:
            squares = " + ".join([self.at(2 * matrix, i, j), *(f"z_{i}_{b} * t_{b}_{j}" for r, b in entries if r == i)])
            text += [f"{self.at(matrix, i, j)} = {squares}"]
        return text + self.each(others, "q")

    def texts(self) -> list[list[str]]:
        """Return the lines of :func:`compose_of` in order; what a step is off, its mirror image is off, too."""
        return [
            [*self.each("P", self.unit), f"{self.at('t')} = 0.0"],
            self.before("S", "P"),
            self.each("L", "P"),
            self.join(False),
            self.join(True),
            self.after("S", "P"),
            [*self.multiplied("q", "L", "P"), *self.each("L", "q")],
            self.each("R", lambda *e: f"sqrt({self.at('S', *e)})"),
            self.mirrored("S", 2) + self.each("R", lambda *e: f"sqrt(2.0 * ({self.at('S', *e)} + q_{e[0]}_{e[1]}))"),
        ]


@cache
def compose_of(n, joined):
    """Return the compiled function that multiplies matrices of n states, ``compose(S, followed, steps)``, and places.

    Of states that are :func:`kernels.matrices.joined`. S holds a :class:`Record` of each followed step and one more,
    flat, of which S and o are given; where half of the steps are followed, the last has the masses. Into this is
    written: the product; the root of the sum of the squares of what G, and one rounding of each product, become; the
    number of times that the first column turned through whole half turns, of n = 2; where an entry is large, the trace
    of the second compound, and the error of that; the matrix of the period that begins ELSEWHERE. Places: the number of
    rows of a record, of the result's first, of the masses' first.
    """
    record, name = Record(n, joined), f"{n}_" + "".join(str(int(x)) for row in joined for x in row)
    height, size, d, first = record.height, n * n, len(record.pairs), record.first
    L, t, c = (first[key] for key in "Ltc")
    begin, before, keep, join, join_halves, after, later, tell, tell_both = (
        lines("\n".join(text)) for text in record.texts()
    )
    tell_minors = _minors_of(record, f"minors_{name}")

    @njit(COMPOSE, name=f"compose_{name}", **PASSED)
    def compose(S, followed, steps):
        whole_vectors()
        half, elsewhere = followed < steps, round(ELSEWHERE * steps)
        alike = 0.5 * EPSILON / NOISE * math.sqrt(steps * n)
        X, end, aside = S.reshape(S.size // W, W), S[followed * height * W :], S[elsewhere * height * W :]
        last, is_large = X[followed * height :], False
        begin(S)
        for s in range(followed):
            here = S[s * height * W :]
            for lane in range(W):  # the length of a step is rounded in all alike
                here[(size + 1) * W + lane] = alike
            before(here)
        keep(aside)
        if half:
            join_halves(end)
        else:
            join(end)
        for lane in range(W):
            is_large |= last[c, lane] > LARGE
        if d > 0 and is_large:
            tell_minors(X, followed, steps)
        else:
            for lane in range(W):
                last[c, lane], last[c + 1, lane] = np.nan, np.nan
        for s in range(followed, -1, -1):
            here = S[s * height * W :]
            if s < followed:
                after(here)
            if s == elsewhere:
                later(here)
        put(last[:size], X[:size])
        put(last[L : L + size], X[elsewhere * height + L :][:size])
        if half:
            put(last[t : t + 1], X[t : t + 1])
            tell_both(end)
        else:
            tell(end)

    return compose, (height, first["M"], first["m"])


def _minors_of(record, name):
    """Return the compiled function that writes the trace of the second compound, and its error, of large matrices."""
    d, height, tall, size, first = len(record.pairs), record.height, record.tall, record.n**2, record.first
    C, Q, c, m = (first[key] for key in "CQcm")
    texts = record.flip(), [*record.minors(), *record.before("C", "Q")], record.after("C", "Q")
    flip, before, after = (lines("\n".join(text)) for text in texts)

    @njit(name=name, **OPTIONS)
    def tell_minors(X, followed, steps):
        whole_vectors()
        S, last, alike = scratch((steps + 1) * tall), X[followed * height :], math.sqrt(steps / followed)
        T = S.reshape(S.size // W, W)
        end = T[steps * tall :]
        for i in range(d):
            for lane in range(W):
                T[Q + i * (d + 1), lane] = 1.0
        for s in range(steps):
            here, there = S[s * tall * W :], T[s * tall :]
            put(there, X[(s if s < followed else steps - 1 - s) * height :][: size + 2])
            if s >= followed:
                put(there[m:], last[m:height])
                flip(here)
            before(here)
        for lane in range(W):
            last[c, lane], last[c + 1, lane] = 0.0 if last[c, lane] > LARGE else np.nan, 0.0
        for i in range(d * d):
            for lane in range(W):
                last[c, lane] += end[Q + i, lane] if i % (d + 1) == 0 else 0.0
                end[Q + i, lane] = 1.0 if i % (d + 1) == 0 else 0.0
        for s in range(steps - 1, -1, -1):
            after(S[s * tall * W :])
        for i in range(d):  # what a segment is off, its mirror image is, too
            for lane in range(W):
                last[c + 1, lane] += alike * math.sqrt(T[C + i * (d + 1), lane]) + 0.0 * last[c, lane]

    return tell_minors


@njit(**OPTIONS)
def load(source, first, target):
    """Write what W points from the first on have, shape (rows, points), the last one in place of those not there."""
    whole_vectors()
    count = min(W, source.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, lane] = source[row, first + lane]
        for lane in range(count, W):
            target[row, lane] = target[row, count - 1]


@njit(**OPTIONS)
def store(source, first, target):
    """Write rows of W lanes where points from the first on are, as many as there are."""
    whole_vectors()
    count = min(W, target.shape[1] - first)
    for row in range(len(source)):
        for lane in range(count):
            target[row, first + lane] = source[row, lane]


@njit(**OPTIONS)
def _differences(C, inverse, matrix, work, numbers, owner):
    """Write half the differences of both sides, and by what the sum of all columns is off in the row behind these.

    numbers: n; first row of the states in a column; sides. owner: of each entry of the matrix the motion that has it;
    -1 where it vanishes. The last row of work: the largest sum of both sides.
    """
    whole_vectors()
    (n, states, sides), (half, linear, terms, uneven) = numbers, (work[0], work[1], work[2], work[3])
    of_sides, sign, worst = len(C) // sides, 1.0 - 2.0 * (sides - 1), matrix[n * n]
    for lane in range(W):
        worst[lane], uneven[lane] = 0.0, 0.0
    for i in range(n):
        for lane in range(W):
            linear[lane], terms[lane] = 0.0, 0.0
        for j in range(max(n, of_sides)):
            c = owner[i * n + j] if j < n else j
            share, c = (0.5, c) if c >= 0 else (0.0, 0)
            plus, minus = C[c, (states + i) * W :], C[len(C) - of_sides + c, (states + i) * W :]
            for lane in range(W):
                half[lane] = share * (plus[lane] + sign * minus[lane]) * inverse[i, lane]
            if j < n:
                row = matrix[i * n + j]
                for lane in range(W):
                    row[lane] = half[lane]
                    linear[lane] += half[lane]
                    terms[lane] += abs(half[lane])
                    uneven[lane] = max(uneven[lane], abs(plus[lane] - sign * minus[lane]) * inverse[i, lane])
            else:
                for lane in range(W):
                    apart = abs(half[lane] - 2.0 * linear[lane]) - ROUNDED * terms[lane]
                    worst[lane] = max(worst[lane], apart)


@njit(
    float64[:, ::1](FUNCTION, COMPOSING, float64[:, :, ::1], float64[:, :, :, ::1], LANES, int64[::1]),
    nogil=True,
    **OPTIONS,
)
def measure(advance, compose, base, columns, inverses, numbers):
    """Follow perturbed motions through the segments of a period, and multiply the segments' matrices.

    Args:
        advance (function): ``advance(S, columns, steps)`` advances the base motion, the first rows of S, and perturbed
            motions of it.
        compose (function): Of :func:`compose_of`.
        base (numpy.ndarray, shape (segments, rows, points)): The base motion where segments begin; or where the first
            one begins, and motions go on from it.
        columns (numpy.ndarray, shape (motions, segments or 1, rows, points)): Perturbed motions where segments begin:
            those of one side, and one of twice their sum where equations are not linear, then those of the other.
        inverses (numpy.ndarray, shape (n + 1, points)): Inverse of the states' sizes; what the base motion's error adds
            to an error, of the difference of sides. Where half a period is followed, the masses come after these, and
            their inverse.
        numbers (numpy.ndarray): n; segments; steps in each; rows of S; first row of the states in a column, and the row
            of what the steps leave out; sides; row of what the steps leave out of the base motion; places of
            :func:`compose_of`; and of each entry of a matrix the motion that has it, or -1 where it vanishes.

    Returns:
        numpy.ndarray, shape (2 n n + 5, points): As written by :func:`compose_of` without the last; then the truncation
            error of the steps and the effect of the amplitude, relative to each segment's largest entry.
    """
    whole_vectors()
    n, segments, steps, rows, states, left_out, sides, base_left_out, height, result, masses = numbers[:11]
    followed = segments // 2 if len(inverses) > n + 1 else segments
    motions, size, out = columns.shape[2], n * n, np.empty((2 * n * n + 5, inverses.shape[1]))
    S, C = scratch(rows), scratch(len(columns) * motions).reshape(len(columns), motions * W)
    inverse, records = rows_of(len(inverses)), scratch((followed + 1) * height)
    R, both, work, coherent = records.reshape(-1, W), rows_of(2), rows_of(4), math.sqrt(segments * n) / NOISE
    last, lost, wide, half, uneven = R[followed * height :], both[0], both[1], work[0], work[3]
    for first in range(0, inverses.shape[1], W):
        load(inverses, first, inverse)
        for lane in range(W):
            lost[lane], wide[lane] = 0.0, 0.0
        for s in range(followed):
            if s < len(base):
                load(base[s], first, S.reshape(rows, W))
            for c in range(len(columns)):
                load(columns[c, min(s, columns.shape[1] - 1)], first, C[c].reshape(motions, W))
            advance(S, C, steps)
            worst = R[s * height + size]
            _differences(C, inverse, R[s * height :], work, (n, states, sides), numbers[11:])
            for lane in range(W):
                wide[lane] += worst[lane]
                half[lane] = S[base_left_out * W + lane]
            for c in range(len(columns)):
                for i in range(n):
                    lacks = C[c, (left_out + i) * W :]
                    for lane in range(W):
                        half[lane] = max(half[lane], lacks[lane] * inverse[i, lane])
            for lane in range(W):
                lost[lane] += half[lane]
                worst[lane] = (worst[lane] + half[lane] + inverse[n, lane] * uneven[lane]) * coherent
        load(inverses[n + 1 :], first, last[masses:])
        compose(records, followed, segments)
        for i in range(size):
            for lane in range(W):
                lost[lane] += 0.0 * last[result + i, lane]  # not a number where these are none
        store(last[result : result + 2 * size + 3], first, out)
        store(both, first, out[2 * size + 3 :])
    return out
