// The body that turns: a box or a racket with exactly the body's ratios of moments.
//
// With unit mass, the mean square of coordinate i over the body is S_i = (I_j + I_k − I_i)/2: any shape, stretched
// along the axes until its own mean squares are S_i, has the moments I_i.

const FRONT = [213, 94, 0];
const BACK = [0, 114, 178];
const EDGE = [176, 180, 186];

/** Mean squares S_i of a body, at least a thousandth of the largest, in units of the largest. */
function meanSquares([I1, I2, I3]) {
  const squares = [(I2 + I3 - I1) / 2, (I3 + I1 - I2) / 2, (I1 + I2 - I3) / 2];
  const largest = Math.max(...squares);
  return squares.map((S) => Math.max(S / largest, 1e-3));
}

function boxFaces(squares) {
  const [a, b, c] = squares.map((S) => Math.sqrt(3 * S));
  const face = (color, ...corners) => ({ color, corners: corners.map(([x, y, z]) => [a * x, b * y, c * z]) });
  const thin = squares.indexOf(Math.min(...squares));
  const sides = [0, 1, 2].flatMap((k) => [1, -1].map((s) => {
    const corner = (u, v) => [0, 1, 2].map((i) => (i === k ? s : i === (k + 1) % 3 ? u : v));
    const ring = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    return face(k === thin ? (s > 0 ? FRONT : BACK) : EDGE, ...(s > 0 ? ring : ring.reverse()));
  }));
  return sides;
}

/** A racket's outline as quadrilaterals: handle along x, width along y, seen from +z counterclockwise. */
function racketParts() {
  const n = 32;
  const at = (r, i) => [0.55 + 1.05 * r * Math.cos((2 * Math.PI * i) / n), 0.8 * r * Math.sin((2 * Math.PI * i) / n)];
  const ring = Array.from({ length: n }, (_, i) => [at(0.84, i), at(1, i), at(1, i + 1), at(0.84, i + 1)]);
  const handle = [[-2.3, -0.13], [-0.46, -0.1], [-0.46, 0.1], [-2.3, 0.13]];
  return [...ring, handle];
}

/** Area, first and second moments of quadrilaterals: [A, mean x, mean x², mean y²] about the centre. */
function planeMoments(parts) {
  let [A, X, XX, YY] = [0, 0, 0, 0];
  for (const [p, q, r, s] of parts) {
    for (const [u, v, w] of [[p, q, r], [p, r, s]]) {
      const area = 0.5 * ((v[0] - u[0]) * (w[1] - u[1]) - (w[0] - u[0]) * (v[1] - u[1]));
      const square = (k) => (area / 6) * (u[k] ** 2 + v[k] ** 2 + w[k] ** 2 + u[k] * v[k] + v[k] * w[k] + w[k] * u[k]);
      A += area;
      X += (area * (u[0] + v[0] + w[0])) / 3;
      XX += square(0);
      YY += square(1);
    }
  }
  return [A, X / A, XX / A - (X / A) ** 2, YY / A];
}

/** The racket: its handle along the longest direction, its face across the shortest. */
function racketFaces(squares) {
  const parts = racketParts();
  const [, middle, xx, yy] = planeMoments(parts);
  const order = [0, 1, 2].sort((i, j) => squares[j] - squares[i]);
  const [sx, sy, sz] = [Math.sqrt(squares[order[0]] / xx), Math.sqrt(squares[order[1]] / yy), Math.sqrt(3 * squares[order[2]])];
  const even = (order[1] - order[0] + 3) % 3 === 1; // an odd order of the axes mirrors the outline
  const point = ([x, y], side) => {
    const v = [];
    [v[order[0]], v[order[1]], v[order[2]]] = [sx * (x - middle), sy * y, sz * side];
    return v;
  };
  const face = (color, corners, extra = {}) => ({ color, corners: even ? corners : corners.reverse(), ...extra });
  const flat = (part, i) => {
    const handle = i === parts.length - 1;
    const sides = handle ? [[0, 1], [1, 2], [2, 3], [3, 0]] : [[1, 2], [3, 0]];
    return [
      face(handle ? [110, 84, 62] : FRONT, part.map((p) => point(p, 1))),
      face(handle ? [80, 60, 45] : BACK, part.map((p) => point(p, -1)).reverse()),
      ...sides.map(([k, l]) => face(EDGE, [point(part[k], -1), point(part[l], -1), point(part[l], 1), point(part[k], 1)])),
    ];
  };
  return [...parts.flatMap(flat), ...strings(parts, point, face)];
}

/** The bed of strings: one see-through face a side, without mass. */
function strings(parts, point, face) {
  const inner = parts.slice(0, -1).map((part) => part[0]);
  return [
    face(FRONT, inner.map((p) => point(p, 0.02)), { veil: 0.45, bed: true }),
    face(BACK, inner.map((p) => point(p, -0.02)).reverse(), { veil: 0.45, bed: true }),
  ];
}

/** Whether the body is flat enough to be drawn as a racket without being told to. */
function looksLikeRacket(squares) {
  const [thin, wide, long] = [...squares].sort((a, b) => a - b);
  return thin < 0.12 * wide && wide < 0.3 * long;
}

/** The surface of the chosen body's own mesh, where the map carries one. */
function ownSurface() {
  const body = theMap.coordinates.body ? String(coordinateAt("body", state.place)) : "";
  return Object.hasOwn(theMap.outlines ?? {}, body) ? theMap.outlines[body] : null;
}

/** The faces of a surface: triangles, in one colour. */
function surfaceFaces({ vertices, faces }) {
  const corner = (i) => [0, 1, 2].map((k) => vertices[3 * i + k]);
  return Array.from({ length: faces.length / 3 }, (_, k) => ({ color: FRONT, corners: faces.slice(3 * k, 3 * k + 3).map(corner), smooth: true }));
}

function bodyFaces(squares, shape) {
  const faces = shape === "own" ? surfaceFaces(ownSurface()) : shape === "racket" ? racketFaces(squares) : boxFaces(squares);
  const reach = Math.max(...faces.flatMap((face) => face.corners.map((corner) => Math.hypot(...corner))));
  for (const face of faces) {
    face.corners = face.corners.map((corner) => corner.map((x) => x / reach));
    const [p, q, r] = face.corners;
    face.normal = directionOf(cross(q.map((x, i) => x - p[i]), r.map((x, i) => x - p[i])));
  }
  return faces;
}

/** Draws the faces that look at the viewer, the farthest first. */
function drawSolid(view, faces, attitude) {
  const { pen, project, toward } = view;
  const seen = faces.map((face) => [face, rotated(attitude, face.normal)]).filter(([, normal]) => dot(normal, toward) > 0);
  drawPolygons(pen, seen.map(([face, normal]) => {
    const light = 0.5 + 0.5 * dot(normal, [0.35, -0.2, 0.91]);
    const corners = face.corners.map((corner) => project(rotated(attitude, corner)));
    const edge = face.veil < 1 ? "rgba(0,0,0,0)" : shaded(face.color, face.smooth ? light : 0.85 * light);
    return { corners, fill: shaded(face.color, light), edge, veil: face.veil, nearer: face.veil < 1 ? -0.01 : 0 };
  }));
}

/** The principal axes, as far as they stand out of the body. */
function drawBodyAxes(view, attitude, spinAxis) {
  const ink = pageColor("ink");
  for (let k = 0; k < 3; k++) {
    const unit = [0, 1, 2].map((i) => (i === k ? 1.12 : 0));
    const end = rotated(attitude, unit);
    const color = k + 1 === spinAxis ? pageColor("accent") : ink;
    strokeLine(view, [[0, 0, 0], end], color, k + 1 === spinAxis ? 2 : 1, k + 1 === spinAxis ? [] : [2, 4]);
    writeAt(view, end, String(k + 1), color);
  }
}
