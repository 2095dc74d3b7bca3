// An orbit camera: it looks at a target from an azimuth, an elevation and a distance. The elevation is clamped, so
// that the view cannot flip over. Angles in radians, lengths in metres, the world's z axis points up.
const MotionCamera = (() => {
  "use strict";
  const ELEVATION = [-0.17, 1.5], DISTANCE = [0.4, 30], FIELD_OF_VIEW = 0.62, NEAR = 0.05, FAR = 120;
  const clamp = (value, [low, high]) => Math.min(high, Math.max(low, value));
  const dot = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2];

  class Camera {
    constructor() {
      this.target = [0, 0, 0.9];
      this.reset(0);
    }

    // Look from the front and the side of a body that faces `heading`.
    reset(heading) {
      this.azimuth = heading + 0.6;
      this.elevation = 0.2;
      this.distance = 3.6;
      this.offset = [0, 0, 0];
    }

    turn(azimuth, elevation) {
      this.azimuth = Math.atan2(Math.sin(this.azimuth + azimuth), Math.cos(this.azimuth + azimuth));
      this.elevation = clamp(this.elevation + elevation, ELEVATION);
    }

    zoom(factor) {
      this.distance = clamp(this.distance * factor, DISTANCE);
    }

    // Move the target by parts of the picture's height, to the right and up in the picture.
    pan(right, up) {
      const size = 2 * this.distance * Math.tan(FIELD_OF_VIEW / 2), axes = this.axes();
      this.offset = this.offset.map((o, i) => clamp(o + size * (right * axes.right[i] + up * axes.up[i]), [-50, 50]));
    }

    axes() {
      const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
      return { back: [ce * ca, ce * sa, se], right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce] };
    }

    eye() {
      const { back } = this.axes();
      return this.target.map((c, i) => c + this.offset[i] + this.distance * back[i]);
    }

    // World to clip coordinates as a column-major matrix, for a picture of this width over height.
    matrix(aspect) {
      const { back, right, up } = this.axes(), eye = this.eye();
      const f = 1 / Math.tan(FIELD_OF_VIEW / 2) * Math.min(1, aspect * 1.25), a = (FAR + NEAR) / (NEAR - FAR), b = 2 * FAR * NEAR / (NEAR - FAR);
      const x = -dot(right, eye), y = -dot(up, eye), z = -dot(back, eye), g = f / aspect;
      return new Float32Array([
        g * right[0], f * up[0], a * back[0], -back[0],
        g * right[1], f * up[1], a * back[1], -back[1],
        g * right[2], f * up[2], a * back[2], -back[2],
        g * x, f * y, a * z + b, -z,
      ]);
    }

    // Six numbers that `restore` takes back, or nothing for a text that is no camera.
    text() {
      return [this.azimuth, this.elevation, this.distance, ...this.offset].map((n) => Number(n.toFixed(3))).join(",");
    }

    restore(text) {
      const numbers = String(text).split(",").map(Number);
      if (numbers.length !== 6 || !numbers.every(Number.isFinite)) return;
      [this.azimuth, this.elevation, this.distance] = numbers;
      this.offset = numbers.slice(3).map((n) => clamp(n, [-50, 50]));
      this.turn(0, 0);
      this.zoom(1);
    }
  }

  // Let mouse and touch on an element move a camera; `changed` is called afterwards, `reset` after a double click.
  Camera.control = (stage, camera, changed, reset) => {
    const held = new Map();
    let scrolled = -1e9;
    addEventListener("scroll", () => { scrolled = performance.now(); }, { passive: true });
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    stage.addEventListener("dblclick", reset);
    // A page that is being scrolled over the view goes on scrolling.
    stage.addEventListener("wheel", (event) => {
      if (performance.now() - scrolled < 250 && !event.ctrlKey) return;
      event.preventDefault();
      const steps = event.deltaY * (event.deltaMode ? 0.05 : 0.0015) * (event.ctrlKey ? 4 : 1);
      camera.zoom(Math.exp(clamp(steps, [-0.5, 0.5])));
      changed();
    }, { passive: false });
    stage.addEventListener("pointerdown", (event) => {
      stage.setPointerCapture(event.pointerId);
      held.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
      stage.addEventListener(name, (event) => held.delete(event.pointerId));
    }
    stage.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId), at = [event.clientX, event.clientY], high = stage.clientHeight;
      if (!before) return;
      const [dx, dy] = [at[0] - before[0], at[1] - before[1]];
      const other = [...held].find(([id]) => id !== event.pointerId);
      held.set(event.pointerId, at);
      if (other) {
        const apart = (p) => Math.hypot(p[0] - other[1][0], p[1] - other[1][1]) || 1;
        camera.zoom(apart(before) / apart(at));
        camera.pan((-0.5 * dx) / high, (0.5 * dy) / high);
      } else if (event.buttons & 2 || event.buttons & 4 || event.shiftKey) camera.pan(-dx / high, dy / high);
      else camera.turn((-5 * dx) / high, (4 * dy) / high);
      changed();
    });
  };
  return Camera;
})();
