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

from kernels.blocks import LANES, W, rows_of, scratch
from kernels.dense import product_in_lanes, put
from kernels.jit import OPTIONS, PASSED, float64, int64, njit, types, void, whole_vectors
from kernels.straight import lines

EPSILON = float(np.finfo(np.float64).eps)
NOISE = 6.0 * EPSILON  # rounding of a segment, relative to its terms
ROUNDED = 16.0 * EPSILON  # of terms: by what a sum of motions may be off by rounding alone
LARGE = 1e3  # entry from which on the lesser pair is found from the product of both
ELSEWHERE = 0.381966  # of a period: where the product begins again
ROWS = void(float64[::1], float64[:, ::1], int64)
COMPOSE = void(float64[::1], LANES, LANES, int64)
FUNCTION, COMPOSING = types.FunctionType(ROWS), types.FunctionType(COMPOSE)


class Record:
    """The rows that are kept of each segment of n states, W lanes each, and the lines that work on them.

    S its matrix, row by row, and later E, the sum of the squares of what its errors and those after become; o by what
    it is off beside rounding, in roundings, and a what counts as alike in all segments, relative to the largest entry;
    P the product of the matrices before, and later of it and those after. Where entries are large, longer records have
    C, D, Q, too: the second compound, the sizes of its errors, its products. Entries of states that are not `joined`
    vanish, and no line works on them.
    """

    def __init__(self, n: int, joined):
        self.n, self.pairs = n, [*combinations(range(n), 2)] if n in (2, 4) else []
        d = len(self.pairs)
        sizes = [n, 1, 1, n, d, d, d]
        self.of, starts = dict(zip("SoaPCDQ", sizes, strict=True)), np.cumsum([0, *np.square(sizes)]).tolist()
        self.first, self.height, self.tall = dict(zip("SoaPCDQ", starts, strict=False)), starts[4], starts[7]
        self.entries = {d: [*product(range(d), repeat=2)], n: [*zip(*np.nonzero(joined), strict=True)]}

    def at(self, name: str, i: int = 0, j: int = 0) -> str:
        """Return the place of an entry, of the next segment where the name is doubled."""
        height = self.tall if name[0] in "CDQ" else self.height
        row = self.first[name[0]] + i * self.of[name[0]] + j + (len(name) - 1) * height
        return f"S[{row * W} + lane]"

    def _products(self, a, b):
        """Return (i, j) → the terms of an entry of a product of matrices."""
        entries = self.entries[self.of[a[0]]]
        return {(i, j): [f"{self.at(a, i, k)} * {self.at(b, k, j)}" for r, k in entries if r == i] for i, j in entries}

    def errors(self) -> list[str]:
        """Return lines that find the sizes of the errors: of terms' roundings, |S||S| or the largest entry, and o."""
        text = ["most = 0.0", *(f"most = max(most, abs({self.at('S', *entry)}))" for entry in self.entries[self.n])]
        text += [f"off = {self.at('o')} + {self.at('a')} * most"]
        for (i, j), terms in self._products("S", "S").items():  # states apart stay apart
            text += [f"G_{i}_{j} = min({' + '.join(f'abs({term})' for term in terms)}, most) + off"]
        return text

    def minors(self) -> list[str]:
        """Return lines that write the second compound and the sizes of its errors."""
        text = self.errors()
        for (r, (i, j)), (s, (k, m)) in product(enumerate(self.pairs), repeat=2):
            one, other = (f"{self.at('S', i, a)} * {self.at('S', j, b)}" for a, b in ((k, m), (m, k)))
            text += [f"one = {one}", f"other = {other}", f"{self.at('C', r, s)} = one - other"]
            text += [f"{self.at('D', r, s)} = abs(one) + abs(other) + 2.0 * {self.at('o')} * most"]
        return text

    def before(self, matrix: str, others: str) -> list[str]:
        """Return lines that multiply the product of those before by a segment's matrix."""
        products = self._products(matrix, others)
        return [f"{self.at(2 * others, *entry)} = {' + '.join(terms)}" for entry, terms in products.items()]

    def after(self, matrix: str, others: str) -> list[str]:
        """Return lines that multiply the product of those after by a segment's matrix, and add errors' squares."""
        entries, two = self.entries[self.of[matrix]], 2 * others
        text = [f"G_{i}_{j} = {self.at('D', i, j)}" for i, j in entries] if matrix == "C" else self.errors()
        for i, j in entries:
            text += [f"h_{i}_{j} = G_{i}_{j} * G_{i}_{j} + {self.at(matrix, i, j)} * {self.at(matrix, i, j)}"]
            text += [f"p_{i}_{j} = {self.at(others, i, j)} * {self.at(others, i, j)}"]
        for b, j in entries:
            text += [f"t_{b}_{j} = " + " + ".join(f"h_{b}_{c} * p_{c}_{j}" for r, c in entries if r == b)]
        text += [f"z_{i}_{b} = {self.at(two, i, b)} * {self.at(two, i, b)}" for i, b in entries]
        text += [f"y_{i}_{j} = {' + '.join(terms)}" for (i, j), terms in self._products(two, matrix).items()]
        for i, j in entries:
            squares = " + ".join([self.at(2 * matrix, i, j), *(f"z_{i}_{b} * t_{b}_{j}" for r, b in entries if r == i)])
            text += [f"{self.at(matrix, i, j)} = {squares}"]
        return text + [f"{self.at(others, i, j)} = y_{i}_{j}" for i, j in entries]


def joined(n, groups):
    """Return whether states act on each other, by row a tuple, from groups of those that do."""
    block = np.arange(n)
    for group in [*groups] * n:
        block[[*group]] = block[[*group]].min()
    return tuple(map(tuple, (block[:, None] == block).tolist()))


@njit(**OPTIONS)
def mirror(source, masses, n, are_squares, target):
    """Write R S⁻¹ R of a matrix, or what errors' squares become; masses in the states' sizes, then their inverse."""
    whole_vectors()
    m = n // 2
    for i in range(n):
        for j in range(n):
            row = target[i * n + j]
            for a in range(m):
                for b in range(m):
                    here = source[(a + m if j < m else a) * n + (b + m if i < m else b)]
                    mass = masses[a * m + j if j < m else (j - m) * m + a]
                    inverse = masses[m * m + (i * m + b if i < m else b * m + i - m)]
                    for lane in range(W):
                        factor = inverse[lane] * mass[lane]
                        term = (factor * factor if are_squares else factor) * here[lane]
                        row[lane] = term if a == b == 0 else row[lane] + term


@njit(**OPTIONS)
def _turns(R, height, followed, steps, count):
    """Count how often the first of two states' columns turns through whole half turns; R holds the followed steps."""
    whole_vectors()
    x, y = scratch(1), scratch(1)
    for lane in range(W):
        x[lane] = 1.0
    for s in range(steps):
        S = R[(s if s < followed else steps - 1 - s) * height :]
        b, c = S[1], S[2]
        a, d = (S[0], S[3]) if s < followed else (S[3], S[0])
        for lane in range(W):
            u, v = a[lane] * x[lane] + b[lane] * y[lane], c[lane] * x[lane] + d[lane] * y[lane]
            turn = 1.0 if y[lane] * u > x[lane] * v else -1.0
            count[lane] += turn if (y[lane] > 0.0) != (v > 0.0) else 0.0
            x[lane], y[lane] = u, v


@njit(**OPTIONS)
def _identity(rows, n):
    """Write the unit matrix of each lane."""
    for i in range(n * n):
        for lane in range(W):
            rows[i, lane] = 1.0 if i % (n + 1) == 0 else 0.0


@cache
def compose_of(n, joined):
    """Return the compiled function that multiplies matrices of n states: ``compose(S, masses, out, steps)``.

    Of states that are :func:`joined`. S holds a :class:`Record` of each step and one more, flat, of which S and o are
    given: of half of the steps where there are masses, those of :func:`mirror`. Written into out, (3 n n + 3, W): the
    product; the root of the sum of the squares of what G, and one rounding of each product, become; the matrix of the
    period that begins ELSEWHERE; the number of times that the first column turned through whole half turns, of n = 2;
    where an entry is large, the trace of the second compound, and the error of that.
    """
    record, name = Record(n, joined), f"{n}_" + "".join(str(int(x)) for row in joined for x in row)
    height, size, P, d = record.height, n * n, record.first["P"], len(record.pairs)
    before, after = (lines("\n".join(text("S", "P"))) for text in (record.before, record.after))
    tell_minors = _minors_of(record, f"minors_{name}")

    @njit(COMPOSE, name=f"compose_{name}", **PASSED)
    def compose(S, masses, out, steps):
        whole_vectors()
        half, elsewhere, most = len(masses) > 0, round(ELSEWHERE * steps), 0.0
        followed, alike = steps // 2 if half else steps, 0.5 * EPSILON / NOISE * math.sqrt(steps * n)
        R, later, mirrored = S.reshape(S.size // W, W), rows_of(size), rows_of(size)
        last = R[followed * height :]
        end = last[P : P + size]
        _identity(R[P:], n)
        for s in range(followed):
            here = S[s * height * W :]
            for lane in range(W):  # the length of a step is rounded in all alike
                here[(size + 1) * W + lane] = alike
            for lane in range(W):
                before(here, lane)
        put(later, R[elsewhere * height + P : elsewhere * height + P + size])
        if half:
            mirror(end, masses, n, False, mirrored)
            product_in_lanes(mirrored, end, out, n)
            put(end, mirrored)
        else:
            put(out, end)
            _identity(end, n)
        for i in range(size):
            for lane in range(W):
                most, last[i, lane], mirrored[i, lane] = max(most, abs(out[i, lane])), 0.0, 0.0
        for lane in range(W):
            out[3 * size, lane], out[3 * size + 1, lane], out[3 * size + 2, lane] = 0.0, np.nan, np.nan
        if n == 2:
            _turns(R, height, followed, steps, out[3 * size])
        if d > 0 and most > LARGE:
            tell_minors(R, masses, out, (followed, steps))
        for s in range(followed, -1, -1):
            here = S[s * height * W :]
            for lane in range(W if s < followed else 0):
                after(here, lane)
            if s == elsewhere:
                product_in_lanes(later, R[s * height + P :], out[2 * size :], n)
        if half:
            mirror(R, masses, n, True, mirrored)
        for i in range(size):
            for lane in range(W):
                out[size + i, lane] = math.sqrt(R[i, lane]) + math.sqrt(mirrored[i, lane])

    return compose


def _minors_of(record, name):
    """Return the compiled function that writes the trace of the second compound, and its error, of large matrices."""
    n, d, height, tall, size = record.n, len(record.pairs), record.height, record.tall, record.n**2
    C, Q = record.first["C"], record.first["Q"]
    text = [*record.minors(), *record.before("C", "Q")], record.after("C", "Q")
    before, after = (lines("\n".join(some)) for some in text)

    @njit(name=name, **OPTIONS)
    def tell_minors(R, masses, out, numbers):
        whole_vectors()
        (followed, steps), most = numbers, scratch(1)
        alike = math.sqrt(steps / followed)  # a mirrored segment's error is the segment's own
        S = scratch((steps + 1) * tall)
        T = S.reshape(S.size // W, W)
        _identity(T[Q:], d)
        for s in range(steps):
            there, source = T[s * tall :], R[(s if s < followed else steps - 1 - s) * height :]
            put(there, source[: size + 2])
            if s >= followed:
                mirror(source, masses, n, False, there)
                for lane in range(W):
                    most[lane] = 1.0
                for i in range(size):
                    for lane in range(W):
                        most[lane] = max(most[lane], abs(there[i, lane]))
                for lane in range(W):
                    there[size, lane] *= most[lane] ** 2
            for lane in range(W):
                before(S[s * tall * W :], lane)
        last, most[:] = T[steps * tall :], 0.0
        for i in range(size):
            for lane in range(W):
                most[lane] = max(most[lane], abs(out[i, lane]))
        for i in range(d):
            for lane in range(W):
                trace = last[Q + i * d + i, lane] + (out[3 * size + 1, lane] if i > 0 else 0.0)
                out[3 * size + 1, lane] = trace if most[lane] > LARGE else np.nan
        _identity(last[Q:], d)
        for s in range(steps - 1, -1, -1):
            for lane in range(W):
                after(S[s * tall * W :], lane)
        for i in range(d):
            for lane in range(W):
                error = alike * math.sqrt(T[C + i * d + i, lane]) + (out[3 * size + 2, lane] if i > 0 else 0.0)
                out[3 * size + 2, lane] = error if most[lane] > LARGE else np.nan

    return tell_minors


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
    float64[:, ::1](FUNCTION, COMPOSING, float64[:, :, ::1], float64[:, :, :, ::1], LANES, int64[::1]),
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
            of the states in a column, and the row of what the steps leave out; sides; row of what the steps leave out
            of the base motion; and of each entry of a segment's matrix the motion that has it, or -1 where it vanishes.

    Returns:
        numpy.ndarray, shape (3 n n + 5, points): As written by :func:`compose_of`; then the truncation error of the
            steps and the effect of the amplitude, relative to each segment's largest entry.
    """
    whole_vectors()
    n, segments, followed, steps, rows, states, left_out, sides, base_left_out = numbers[:9]
    motions, size, height, out = columns.shape[1], n * n, 2 * (n * n + 1), np.empty((3 * n * n + 5, lengths.shape[1]))
    S, C = scratch(rows), scratch(len(columns) * motions).reshape(len(columns), motions * W)
    length, records = rows_of(len(lengths)), scratch((segments + 1) * height)
    out_rows, work = rows_of(len(out)), rows_of(4)
    R, coherent = records.reshape(records.size // W, W), math.sqrt(segments * n) / NOISE
    lost, wide, half, uneven = out_rows[3 * size + 3], out_rows[3 * size + 4], work[0], work[3]
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
            _differences(C, length, R[s * height :], work, (n, states, sides), numbers[9:])
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
        compose(records, length[n + 1 :], out_rows, segments)
        for i in range(size):
            for lane in range(W):
                lost[lane] += 0.0 * out_rows[i, lane]  # not a number where these are none
        store(out_rows, first, out)
    return out
