// The polhode on the energy ellipsoid, among its neighbours of the same energy, with the angular velocity on it.

/** A few polhodes of the same energy: circles round the least and the greatest axis, and the separatrix. */
function neighbours(moments, energy) {
  const [least, middle, greatest] = orderOfMoments(moments);
  const angles = [0.15, 0.35, 0.6, 0.85, 1.1, 1.3, 1.45];
  const curves = [];
  for (const angle of angles) {
    for (const [sl, sg] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
      const w = [0, 0, 0];
      w[least] = sl * Math.sqrt(energy / moments[least]) * Math.cos(angle);
      w[greatest] = sg * Math.sqrt(energy / moments[greatest]) * Math.sin(angle);
      const neighbour = new Trajectory(moments, w);
      if (!neighbour.isStationary) curves.push(neighbour.polhode(120));
    }
  }
  return [...curves, ...separatrices(moments, energy, least, middle, greatest)];
}

/** The two ellipses through the middle axis, L² = 2E·I_mid. */
function separatrices(moments, energy, least, middle, greatest) {
  const [Il, Im, Ig] = [least, middle, greatest].map((i) => moments[i]);
  if (Il === Im || Im === Ig) return [];
  const slope = Math.sqrt((Il * (Im - Il)) / (Ig * (Ig - Im))); // w_greatest over w_least
  const long = Math.sqrt(energy / (Il + Ig * slope * slope));
  return [1, -1].map((sign) => Array.from({ length: 121 }, (_, i) => {
    const phi = (2 * Math.PI * i) / 120;
    const w = [];
    w[middle] = Math.sqrt(energy / Im) * Math.cos(phi);
    w[least] = long * Math.sin(phi);
    w[greatest] = sign * slope * long * Math.sin(phi);
    return w;
  }));
}

class PolhodePicture {
  constructor(canvas) {
    this.scene = new Scene(canvas, 1.2, (view) => this.draw(view));
    this.scene.fit = (width, height, right, up) => this.fit(width, height, right, up);
  }

  show(trajectory, spinAxis) {
    const { semi, largest, family } = trajectory.surface?.() ?? this.ellipsoid(trajectory);
    Object.assign(this, { semi, unit: largest * trajectory.unit });
    const lift = (curve, by) => curve.map((w) => w.map((x) => (x / by) * 1.003));
    this.family = family.map((curve) => lift(curve, largest));
    this.curve = lift(trajectory.polhode(), this.unit);
    this.spinAxis = spinAxis;
    this.looked = null;
    this.tiny = Math.max(...[0, 1, 2].map((i) => Math.max(...this.curve.map((w) => w[i])) - Math.min(...this.curve.map((w) => w[i])))) < 0.03;
    this.tick(trajectory.tip(0));
  }

  /** The ellipsoid of the trajectory's energy: its semi-axes, the largest before they are divided by it, curves on it. */
  ellipsoid(trajectory) {
    const { moments, start } = trajectory;
    const energy = moments.reduce((sum, I, i) => sum + I * start[i] ** 2, 0);
    const axes = moments.map((I) => Math.sqrt(energy / I));
    const largest = Math.max(...axes);
    return { semi: axes.map((a) => a / largest), largest, family: neighbours(moments, energy) };
  }

  /** A scale at which the ellipsoid fills the picture, with room for the names of its axes. */
  fit(width, height, right, up) {
    const reach = (direction) => Math.hypot(...direction.map((x, i) => x * (this.semi?.[i] ?? 1)));
    return Math.min((width / 2 - 34) / reach(right), (height / 2 - 30) / reach(up));
  }

  tick(omega) {
    this.omega = omega.map((w) => w / this.unit);
    this.scene.render();
  }

  draw(view) {
    if (!this.semi) return;
    const { canvas } = view.pen;
    const looked = [camera.yaw, camera.pitch, canvas.width, canvas.height, pageColor("paper")].join();
    if (this.looked !== looked) this.drawStill(view, looked);
    view.pen.drawImage(this.still, 0, 0, view.width, view.height);
    this.drawTip(view);
  }

  /** All but the tip, which alone moves while a motion plays: drawn once for each look at it. */
  drawStill(view, looked) {
    const { canvas } = view.pen;
    this.still ??= document.createElement("canvas");
    Object.assign(this.still, { width: canvas.width, height: canvas.height });
    const pen = this.still.getContext("2d");
    pen.setTransform(canvas.width / view.width, 0, 0, canvas.height / view.height, 0, 0);
    const on = { ...view, pen };
    this.drawEllipsoid(on);
    for (const curve of this.family) this.drawCurve(on, curve, pageColor("polhode"), 1, 0.12);
    this.drawCurve(on, this.curve, pageColor("accent"), 2.8, 0.3);
    this.drawAxes(on);
    this.looked = looked;
  }

  /** Whether a point of the ellipsoid looks at the viewer. */
  faces(point, toward) {
    return point.reduce((sum, x, i) => sum + (x / this.semi[i] ** 2) * toward[i], 0) > 0;
  }

  drawEllipsoid(view) {
    const { pen, project, width, height } = view;
    const [right, up] = viewAxes();
    const stretch = (direction) => Math.hypot(...direction.map((x, i) => x * this.semi[i]));
    const [a, b] = [stretch(right), stretch(up)];
    const mixed = right.reduce((sum, x, i) => sum + x * up[i] * this.semi[i] ** 2, 0);
    const [angle, scale] = [0.5 * Math.atan2(-2 * mixed, a * a - b * b), project(right)[0] - width / 2];
    const half = Math.hypot((a * a - b * b) / 2, mixed);
    const [long, short] = [1, -1].map((sign) => Math.sqrt(Math.max(1e-12, (a * a + b * b) / 2 + sign * half)));
    pen.beginPath();
    pen.ellipse(width / 2, height / 2, scale * long, scale * short, angle, 0, 2 * Math.PI);
    const shade = pen.createRadialGradient(width / 2 - 0.3 * scale, height / 2 - 0.4 * scale, 0.1 * scale, width / 2, height / 2, 1.1 * scale);
    shade.addColorStop(0, pageColor("ball-light"));
    shade.addColorStop(1, pageColor("ball-dark"));
    pen.fillStyle = shade;
    pen.fill();
    pen.strokeStyle = pageColor("quiet");
    pen.lineWidth = 1;
    pen.stroke();
  }

  drawCurve(view, points, color, width, behind) {
    const { pen, toward } = view;
    for (const front of [false, true]) {
      pen.globalAlpha = front ? 1 : behind;
      let run = [];
      const end = () => {
        if (run.length > 1) strokeLine(view, run, color, width);
        run = [];
      };
      for (const point of points) {
        if (this.faces(point, toward) === front) run.push(point);
        else end();
      }
      end();
    }
    pen.globalAlpha = 1;
  }

  drawAxes(view) {
    const stub = 20 / view.scale;
    for (let k = 0; k < 3; k++) {
      for (const sign of [1, -1]) {
        const at = (s) => [0, 1, 2].map((i) => (i === k ? sign * s : 0));
        if (!this.faces(at(this.semi[k]), view.toward)) continue;
        const color = k + 1 === this.spinAxis ? pageColor("accent") : pageColor("ink");
        strokeLine(view, [at(this.semi[k]), at(this.semi[k] + stub)], color, 1.5);
        writeAt(view, at(this.semi[k] + stub), `${sign > 0 ? "" : "−"}${k + 1}`, color);
      }
    }
  }

  drawTip(view) {
    const { pen, project, toward } = view;
    pen.globalAlpha = this.faces(this.omega, toward) ? 1 : 0.4;
    drawDisc(pen, project(this.omega), 6, pageColor("accent"));
    pen.lineWidth = 2;
    pen.strokeStyle = pageColor("paper");
    pen.stroke();
    pen.globalAlpha = 1;
  }
}
