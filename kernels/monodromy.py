r"""Monodromy matrices from perturbed motions: segment after segment, and the product of all, W points side by side.

From each direction, and from its other side, a perturbed motion is followed through every segment of the period beside
the base motion, whose series all directions share. Half the difference of both sides is a column of the segment's
matrix S, and :math:`M = S_K\cdots S_1`. Where the equations are linear, one motion follows a direction of each block of
states that no others influence. Where they are not, one more motion begins at twice the sum of all directions: from
twice the sum of their ends it differs by more than each column does from a linear motion.

*Half a period.* Where Hamilton's equations are even in the time and have no terms in the velocities, :math:`u(-t)`
solves them where u(t) does: the segments of the second half are :math:`R\,S_k^{-1}R` in reverse order, R with
velocities reversed. Of :math:`S = (A\ B;\ C\ D)` and the masses a the inverse is known without division:
:math:`a^{-1}(D^T B^T;\ C^T A^T)\,a`.

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

from kernels.blocks import W, rows_of, scratch
from kernels.dense import product_in_lanes
from kernels.jit import OPTIONS, PASSED, float64, int64, njit, types, void, whole_vectors
from kernels.straight import lines

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
ROUNDED = 16.0 * EPSILON  # of terms: by what a sum of motions may be off by rounding alone
LARGE = 1e3  # entry from which on the lesser pair is found from the product of both
ELSEWHERE = 0.381966  # of a period: where the product begins again
ROWS = void(float64[::1], float64[:, ::1], int64)
FUNCTION = types.FunctionType(ROWS)


class Record:
    """The rows that are kept of each segment of n states, W lanes each, and the lines that work on them.

    S its matrix, row by row; o by what it is off beside rounding, in roundings, and a what counts as alike in all
    segments, relative to the largest entry; t how often the first of two states' columns turned through whole half
    turns before it; G the sizes of its errors, P the product of the matrices before, Y of it and those after, E the sum
    of the squares of what its errors and those after become; C, D, Q, Z, F likewise of the second compound.
    """

    def __init__(self, n: int):
        self.n, self.pairs = n, [*combinations(range(n), 2)] if n in (2, 4) else []
        sizes = [n, 1, 1, 1, n, n, n, n, *[len(self.pairs)] * 5]
        self.of, starts = dict(zip("SoatGPYECDQZF", sizes, strict=True)), np.cumsum([0, *np.square(sizes)]).tolist()
        self.first, self.height = dict(zip("SoatGPYECDQZF", starts, strict=False)), starts[-1]

    def at(self, name: str, i: int = 0, j: int = 0) -> str:
        """Return the place of an entry, of the next segment where the name is doubled."""
        row = self.first[name[0]] + i * self.of[name[0]] + j + (len(name) - 1) * self.height
        return f"S[{row * W} + lane]"

    def _each(self, name, entry):
        """Return lines that write a matrix."""
        size = range(self.of[name[0]])
        return [f"{self.at(name, i, j)} = {entry(i, j)}" for i in size for j in size]

    def _product(self, a, b, i, j):
        return " + ".join(f"{self.at(a, i, k)} * {self.at(b, k, j)}" for k in range(self.of[a[0]]))

    def errors(self) -> list[str]:
        """Return lines that write the sizes of the errors: of terms' roundings, |S||S| or the largest entry, and o."""
        n, most = range(self.n), "0.0"
        for i, j in product(n, n):
            most = f"max({most}, abs({self.at('S', i, j)}))"

        def size(i, j):
            terms = " + ".join(f"abs({self.at('S', i, k)} * {self.at('S', k, j)})" for k in n)
            return f"min({terms}, most) + off"  # states apart stay apart

        off = f"off = {self.at('o')} + {self.at('a')} * most"
        return [f"most = {most}", off, *self._each("G", size)]

    def minors(self) -> list[str]:
        """Return lines that write the second compound and the sizes of its errors."""
        text = self.errors()[:1]
        for (r, (i, j)), (s, (k, m)) in product(enumerate(self.pairs), repeat=2):
            one, other = (f"{self.at('S', i, a)} * {self.at('S', j, b)}" for a, b in ((k, m), (m, k)))
            text += [f"one = {one}", f"other = {other}", f"{self.at('C', r, s)} = one - other"]
            text += [f"{self.at('D', r, s)} = abs(one) + abs(other) + 2.0 * {self.at('o')} * most"]
        return text

    def before(self, matrix: str, others: str) -> list[str]:
        """Return lines that multiply the product of those before by a segment's matrix."""
        text = self._each(2 * others, lambda i, j: self._product(matrix, others, i, j))
        if self.n == 2 and matrix == "S":
            old, new = (f"({self.at(p, 1, 0)} > 0.0)" for p in ("P", "PP"))
            ahead = f"{self.at('P', 1, 0)} * {self.at('PP', 0, 0)} > {self.at('P', 0, 0)} * {self.at('PP', 1, 0)}"
            turned = f"({old} & ~{new}) | ({new} & ~{old})"
            text += [f"turn = 1.0 if {ahead} else -1.0", f"turn = turn if {turned} else 0.0"]
            text += [f"{self.at('tt')} = {self.at('t')} + turn"]
        return text

    def after(self, names: str) -> list[str]:
        """Return lines that multiply the product of those after by a segment's matrix, and add the squares of errors.

        Args:
            names: of the rows of matrix, errors' sizes, products before and after, and squares.
        """
        matrix, error, before, others, squares = names
        size, text = range(self.of[matrix]), []
        for b in size:
            for j in size:
                text += [f"t_{b}_{j} = {self.at(2 * before, b, j)} * {self.at(2 * before, b, j)}"]
                for c in size:
                    text += [f"u = {self.at(error, b, c)} * {self.at(before, c, j)}", f"t_{b}_{j} = t_{b}_{j} + u * u"]
        text += [f"z_{i}_{b} = {self.at(2 * others, i, b)} * {self.at(2 * others, i, b)}" for i in size for b in size]

        def added(i, j):
            return " + ".join([self.at(2 * squares, i, j), *(f"z_{i}_{b} * t_{b}_{j}" for b in size)])

        text += self._each(squares, added)
        return [*text, *self._each(others, lambda i, j: self._product(2 * others, matrix, i, j))]


@njit(**OPTIONS)
def _tell_minors(compound, squares, d, n, out):
    """Write the trace of the second compound, d x d, and its error where an entry of the lane is large."""
    for lane in range(W):
        most, trace, error = 0.0, 0.0, 0.0
        for i in range(n * n):
            most = max(most, abs(out[i, lane]))
        for i in range(d):
            trace += compound[i * d + i, lane]
            error += math.sqrt(squares[i * d + i, lane])
        if most > LARGE:
            out[2 * n * n + 1, lane], out[2 * n * n + 2, lane] = trace, error


@cache
def compose_of(n):
    """Return the compiled function that multiplies the matrices of n states: ``compose(S, out, steps)``.

    S holds a :class:`Record` of each step and one more, flat, of which S and o are given. Written into out
    (2 n n + 3, W): the product; the root of the sum of the squares of what G, and one rounding of each product, become;
    the number of times that the first column turned through whole half turns, of n = 2; where an entry is large, the
    trace of the second compound, and the error of that.
    """
    record = Record(n)
    d, height, size = len(record.pairs), record.height, n * n
    P, Y, E, Q, Z, F, turns = (record.first[name] for name in "PYEQZFt")
    rate, minors = lines("\n".join(record.errors())), lines("\n".join(record.minors()))
    before, after = lines("\n".join(record.before("S", "P"))), lines("\n".join(record.after("SGPYE")))
    before_minors, after_minors = lines("\n".join(record.before("C", "Q"))), lines("\n".join(record.after("CDQZF")))

    @njit(ROWS, name=f"compose_{n}", **PASSED)
    def compose(S, out, steps):
        whole_vectors()
        R, alike = S.reshape(S.size // W, W), 0.5 * EPSILON / NOISE * math.sqrt(steps * n)
        last = R[steps * height :]
        for i in range(n):
            for lane in range(W):
                R[P + i * n + i, lane], last[Y + i * n + i, lane] = 1.0, 1.0
        for s in range(steps):
            here = S[s * height * W :]
            for lane in range(W):  # the length of a step is rounded in all alike
                here[(size + 1) * W + lane] = alike
            for lane in range(W):
                rate(here, lane)
            for lane in range(W):
                before(here, lane)
        for s in range(steps - 1, -1, -1):
            here = S[s * height * W :]
            for lane in range(W):
                after(here, lane)
        most = 0.0
        for i in range(size):
            for lane in range(W):
                out[i, lane], out[size + i, lane] = last[P + i, lane], math.sqrt(R[E + i, lane])
                most = max(most, abs(last[P + i, lane]))
        for lane in range(W):
            out[2 * size, lane] = last[turns, lane]
            out[2 * size + 1, lane] = out[2 * size + 2, lane] = np.nan
        if d > 0 and most > LARGE:
            for i in range(d):
                for lane in range(W):
                    R[Q + i * d + i, lane], last[Z + i * d + i, lane] = 1.0, 1.0
            for s in range(steps):
                here = S[s * height * W :]
                for lane in range(W):
                    minors(here, lane)
                for lane in range(W):
                    before_minors(here, lane)
            for s in range(steps - 1, -1, -1):
                here = S[s * height * W :]
                for lane in range(W):
                    after_minors(here, lane)
            _tell_minors(last[Q:], R[F:], d, n, out)

    return compose


@njit(**OPTIONS)
def begun_elsewhere(R, steps, height, n, out):
    """Write the matrix of the period that begins ELSEWHERE: R holds the records, multiplied, of so many rows."""
    later, before = R[round(ELSEWHERE * steps) * height :], 2 * n * n + 3
    product_in_lanes(later[before:], later[before + n * n :], out, n)


@njit(**OPTIONS)
def mirror(R, steps, height, n, masses):
    """Write S and o of the second half of steps from those of the first one: R holds records of so many rows.

    masses: the rows of the masses in the states' sizes, and those of their inverse.
    """
    whole_vectors()
    m, most = n // 2, rows_of(1)[0]
    for s in range(steps // 2):
        here, there = R[s * height :], R[(steps - 1 - s) * height :]
        for lane in range(W):
            most[lane] = 1.0
        for i in range(n):
            for j in range(n):
                row = there[i * n + j]
                for a in range(m):
                    for b in range(m):
                        source = here[(a + m if j < m else a) * n + (b + m if i < m else b)]
                        mass = masses[a * m + j if j < m else (j - m) * m + a]
                        inverse = masses[m * m + (i * m + b if i < m else b * m + i - m)]
                        for lane in range(W):
                            term = inverse[lane] * source[lane] * mass[lane]
                            row[lane] = term if a == b == 0 else row[lane] + term
                for lane in range(W):
                    most[lane] = max(most[lane], abs(row[lane]))
        for lane in range(W):
            there[n * n, lane] = here[n * n, lane] * most[lane] ** 2


@njit(**OPTIONS)
def load(source, first, target):
    """Write what W points from the first on have, shape (rows, points), the last one in place of those not there."""
    whole_vectors()
    count = min(W, source.shape[1] - first)
    for row in range(len(source)):
        if count == W:
            for lane in range(W):
                target[row, lane] = source[row, first + lane]
        else:
            for lane in range(W):
                target[row, lane] = source[row, first + min(lane, count - 1)]


@njit(**OPTIONS)
def store(source, first, target):
    """Write rows of W lanes where points from the first on are, as many as there are."""
    for row in range(len(source)):
        for lane in range(min(W, target.shape[1] - first)):
            target[row, first + lane] = source[row, lane]


@njit(**OPTIONS)
def _differences(C, length, matrix, work, numbers, owner):
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
                half[lane] = share * (plus[lane] + sign * minus[lane]) * length[i, lane]
            if j < n:
                row = matrix[i * n + j]
                for lane in range(W):
                    row[lane] = half[lane]
                    linear[lane] += half[lane]
                    terms[lane] += abs(half[lane])
                    uneven[lane] = max(uneven[lane], abs(plus[lane] - sign * minus[lane]) * length[i, lane])
            else:
                for lane in range(W):
                    apart = abs(half[lane] - 2.0 * linear[lane]) - ROUNDED * terms[lane]
                    worst[lane] = max(worst[lane], apart)


@njit(
    float64[:, ::1](FUNCTION, FUNCTION, float64[:, :, ::1], float64[:, :, :, ::1], float64[:, ::1], int64[::1]),
    nogil=True,
    **OPTIONS,
)
def measure(advance, compose, base, columns, lengths, numbers):
    """Follow perturbed motions through the segments of a period, and multiply the segments' matrices.

    Args:
        advance (function): ``advance(S, columns, steps)`` advances the base motion, the first rows of S, and perturbed
            motions of it.
        compose (function): Of :func:`compose_of`.
        base (numpy.ndarray, shape (rows, segments, points)): The base motion where segments begin; or where the first
            one begins, and motions go on from it.
        columns (numpy.ndarray, shape (motions, rows, segments or 1, points)): Perturbed motions where segments begin:
            those of one side, and one of twice their sum where equations are not linear, then those of the other.
        lengths (numpy.ndarray, shape (n + 1, points)): Of the states; what the base motion's error adds to an error, of
            the difference of sides. Where half a period is followed, the rows of :func:`mirror` come after these.
        numbers (numpy.ndarray): n; segments; those that are followed, all or half; steps in each; rows of S; first row
            of the states in a column, and the row of what the steps leave out; sides; rows of a record; row of what the
            steps leave out of the base motion; and of each entry of a segment's matrix the motion that has it, or -1
            where it vanishes.

    Returns:
        numpy.ndarray, shape (2 n n + 5, points): As written by :func:`compose_of`; then the truncation error of the
            steps and the effect of the amplitude, relative to each segment's largest entry.
    """
    whole_vectors()
    n, segments, followed, steps, rows, states, left_out, sides, height, base_left_out = numbers[:10]
    motions, size, out = columns.shape[1], n * n, np.empty((2 * n * n + 5, lengths.shape[1]))
    S, C = scratch(rows), scratch(len(columns) * motions).reshape(len(columns), motions * W)
    length, records = rows_of(len(lengths)), scratch((segments + 1) * height)
    out_rows, work = rows_of(len(out)), rows_of(4)
    R, coherent = records.reshape(records.size // W, W), math.sqrt(segments * n) / NOISE
    lost, wide, half, uneven = out_rows[2 * size + 3], out_rows[2 * size + 4], work[0], work[3]
    for first in range(0, lengths.shape[1], W):
        load(lengths, first, length)
        for lane in range(W):
            lost[lane], wide[lane] = 0.0, 0.0
        for i in range(n):
            for lane in range(W):
                length[i, lane] = 1.0 / length[i, lane]
        for s in range(followed):
            if s < base.shape[1]:
                load(base[:, s], first, S.reshape(rows, W))
            for c in range(len(columns)):
                load(columns[c, :, min(s, columns.shape[2] - 1)], first, C[c].reshape(motions, W))
            advance(S, C, steps)
            worst = R[s * height + size]
            _differences(C, length, R[s * height :], work, (n, states, sides), numbers[10:])
            for lane in range(W):
                wide[lane] += worst[lane]
                half[lane] = S[base_left_out * W + lane]
            for c in range(len(columns)):
                for i in range(n):
                    lacks = C[c, (left_out + i) * W :]
                    for lane in range(W):
                        half[lane] = max(half[lane], lacks[lane] * length[i, lane])
            for lane in range(W):
                lost[lane] += half[lane]
                worst[lane] = (worst[lane] + half[lane] + length[n, lane] * uneven[lane]) * coherent
        if followed < segments:
            mirror(R, segments, height, n, length[n + 1 :])
        compose(records, out_rows, segments)
        for i in range(size):
            for lane in range(W):
                lost[lane] += 0.0 * out_rows[i, lane]  # not a number where these are none
        store(out_rows, first, out)
    return out
