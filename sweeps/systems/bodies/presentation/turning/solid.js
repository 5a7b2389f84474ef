// The body that turns: a box or a racket with exactly the body's ratios of moments.
//
// With unit mass, the mean square of coordinate i over the body is S_i = (I_j + I_k − I_i)/2: any shape, stretched
// along the axes until its own mean squares are S_i, has the moments I_i.

const SURFACE = [213, 94, 0];

/** Return true if a rigid body may have these moments: none is above the sum of the others, to rounding. */
function isPossible(moments) {
  return 2 * Math.max(...moments) <= moments.reduce((sum, I) => sum + I) * (1 + 1e-9);
}

/** Mean squares S_i of a body, at least a thousandth of the largest, in units of the largest. */
function meanSquares([I1, I2, I3]) {
  const squares = [(I2 + I3 - I1) / 2, (I3 + I1 - I2) / 2, (I1 + I2 - I3) / 2];
  const largest = Math.max(...squares);
  return squares.map((S) => Math.max(S / largest, 1e-3));
}

/** The faces of a shape that has mean squares of one along its longest, middle and shortest direction, with those of a body. */
function stretched(faces, squares) {
  const order = [0, 1, 2].sort((i, j) => squares[j] - squares[i]);
  const even = (order[1] - order[0] + 3) % 3 === 1; // an odd order of the axes mirrors the shape
  return faces.map(([color, veil, corners]) => {
    const placed = corners.map((corner) => [0, 1, 2].map((axis) => Math.sqrt(squares[axis]) * corner[order.indexOf(axis)]));
    return { color, veil, corners: even ? placed : placed.reverse() };
  });
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
  return Array.from({ length: faces.length / 3 }, (_, k) => ({ color: SURFACE, corners: faces.slice(3 * k, 3 * k + 3).map(corner), smooth: true }));
}

function bodyFaces(squares, shape) {
  const faces = shape === "own" ? surfaceFaces(ownSurface()) : stretched(theMap.solids[shape], squares);
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
