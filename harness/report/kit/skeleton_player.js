// Plays the worst seconds in 3-D. The page holds the data and the charting library compressed. They are unpacked when
// the view is first scrolled to, so that the page opens quickly.
(() => {
  "use strict";
  const find = (id) => document.getElementById(id);
  const stage = find("stage"), choice = find("shot"), slider = find("frame"), where = find("where");
  const play = find("play"), reset = find("reset");
  const TRUTH = "#5b87ad", ESTIMATE = "#e8850c", FLOOR = "#8d98a5", GRID_M = 0.5, REACH_M = 1.5;
  // An icosahedron (its corners are cyclic permutations of (0, +-1, +-golden ratio)).
  const G = (1 + Math.sqrt(5)) / 2, LONG = Math.hypot(1, G);
  const BALL = [[-1, G, 0], [1, G, 0], [-1, -G, 0], [1, -G, 0], [0, -1, G], [0, 1, G], [0, -1, -G], [0, 1, -G],
    [G, 0, -1], [G, 0, 1], [-G, 0, -1], [-G, 0, 1]].map((p) => p.map((c) => c / LONG));
  const BALL_FACES = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
    [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
    [8, 6, 7], [9, 8, 1]];
  let bones, head, shots, frame = 0, timer = 0;

  // The camera looks from the front and the side of the body.
  function camera() {
    const from = shots[Number(choice.value)].heading_rad - 0.7;
    return { eye: { x: 1.2 * Math.cos(from), y: 1.2 * Math.sin(from), z: 0.24 }, center: { x: 0, y: 0, z: -0.1 },
      up: { x: 0, y: 0, z: 1 } };
  }
  const lookAgain = () => Plotly.relayout(stage, { "scene.camera": camera() });

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(find(id).textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  }

  // Differences from frame to frame in millimetres -> joint centres [frame][joint][axis] in metres.
  function unrolled(steps) {
    const now = new Array(steps[0].length).fill(0);
    return steps.map((step) => {
      const joints = [];
      step.forEach((change, i) => { now[i] += change; });
      for (let i = 0; i < now.length; i += 3) joints.push([now[i] / 1000, now[i + 1] / 1000, now[i + 2] / 1000]);
      return joints;
    });
  }

  const minus = (p, q) => [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
  const cross = (p, q) => [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const unit = (p) => { const n = Math.hypot(...p) || 1; return p.map((c) => c / n); };

  // A bone as an octahedron: its joint, four corners a fifth of the way along, its far end.
  function octahedron(from, to, girth) {
    const along = minus(to, from), length = Math.hypot(...along);
    const side = unit(cross(along, Math.abs(along[2]) < 0.9 * length ? [0, 0, 1] : [1, 0, 0]));
    const other = unit(cross(along, side));
    const radius = girth * Math.min(0.06, Math.max(0.028, 0.18 * length));
    const corner = (a, b) => from.map((c, i) => c + 0.2 * along[i] + radius * (a * side[i] + b * other[i]));
    return [from, corner(1, 0), corner(0, 1), corner(-1, 0), corner(0, -1), to];
  }

  // All bones and the head as one mesh relative to the true root, so that the camera follows the root.
  function body(joints, at, girth) {
    const out = { x: [], y: [], z: [] };
    const put = (p) => { out.x.push(p[0] - at[0]); out.y.push(p[1] - at[1]); out.z.push(p[2]); };
    for (const [from, to] of bones) octahedron(joints[from], joints[to], girth).forEach(put);
    const [neck, top] = bones[head].map((n) => joints[n]);
    const middle = neck.map((c, i) => c + 0.75 * (top[i] - c));
    for (const corner of BALL) put(middle.map((c, i) => c + (0.045 + 0.05 * girth) * corner[i]));
    return out;
  }

  // Vertex indices of the triangles of `body`.
  function triangles() {
    const out = { i: [], j: [], k: [] };
    const put = (first, faces) => faces.forEach(([i, j, k]) => {
      out.i.push(first + i); out.j.push(first + j); out.k.push(first + k);
    });
    const bone = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1], [5, 2, 1], [5, 3, 2], [5, 4, 3], [5, 1, 4]];
    bones.forEach((_, n) => put(6 * n, bone));
    put(6 * bones.length, BALL_FACES);
    return out;
  }

  function floor(at) {
    const out = { x: [], y: [], z: [] };
    const shift = [0, 1].map((i) => ((-at[i] % GRID_M) + GRID_M) % GRID_M);
    for (let d = -REACH_M; d < REACH_M; d += GRID_M) {
      const x = d + shift[0], y = d + shift[1];
      out.x.push(x, x, null, -REACH_M, REACH_M, null);
      out.y.push(-REACH_M, REACH_M, null, y, y, null);
      out.z.push(0, 0, null, 0, 0, null);
    }
    return out;
  }

  function parts() {
    const shot = shots[Number(choice.value)], truth = shot.truth[frame], estimate = shot.estimate[frame];
    const at = truth[0];
    return [floor(at), body(truth, at, 1), body(estimate, at, 0.55)];
  }

  function say() {
    const shot = shots[Number(choice.value)], count = shot.time_ms.length;
    where.textContent = `frame ${frame + 1} of ${count} \u00b7 ${(shot.time_ms[frame] / 1000).toFixed(3)} s`;
    slider.max = count - 1;
    slider.value = frame;
  }

  function draw() {
    const now = parts();
    const update = { x: now.map((p) => p.x), y: now.map((p) => p.y), z: now.map((p) => p.z) };
    say();
    return Plotly.restyle(stage, update, [0, 1, 2]);
  }

  function stop() {
    clearTimeout(timer);
    timer = 0;
    play.textContent = "Play";
  }

  // Plays in real time; frames that would be drawn too late are skipped.
  function start() {
    const shot = shots[Number(choice.value)], last = shot.time_ms.length - 1;
    if (frame >= last) frame = 0;
    const began = performance.now() - (shot.time_ms[frame] - shot.time_ms[0]);
    play.textContent = "Pause";
    const tick = async () => {
      const due = performance.now() - began + shot.time_ms[0];
      while (frame < last && shot.time_ms[frame + 1] <= due) frame += 1;
      await draw();
      if (!timer) return;
      if (frame >= last) stop();
      else timer = setTimeout(tick, 20);
    };
    timer = setTimeout(tick, 0);
  }

  async function begin() {
    const data = JSON.parse(await unpacked("shots"));
    ({ bones, head } = data);
    shots = data.shots.map((s) => ({ ...s, truth: unrolled(s.truth), estimate: unrolled(s.estimate) }));
    const library = document.createElement("script");
    library.textContent = await unpacked("plotly");
    document.head.append(library);
    const axis = { visible: false, showspikes: false, autorange: false };
    const scene = {
      xaxis: { ...axis, range: [-1.3, 1.3] }, yaxis: { ...axis, range: [-1.3, 1.3] }, zaxis: { ...axis, range: [-0.05, 2.3] },
      aspectmode: "manual", aspectratio: { x: 1.2, y: 1.2, z: 1.085 }, camera: camera(), dragmode: "turntable",
    };
    const mesh = (color, opacity) => ({ type: "mesh3d", hoverinfo: "skip", flatshading: true, color, opacity, ...triangles(),
      lighting: { ambient: 0.85, diffuse: 0.5, specular: 0.1, roughness: 0.9 }, lightposition: { x: 1e4, y: -1e4, z: 2e4 } });
    const looks = [
      { type: "scatter3d", mode: "lines", hoverinfo: "skip", line: { color: FLOOR, width: 1 } },
      mesh(TRUTH, 0.4), mesh(ESTIMATE, 1),
    ];
    const now = parts();
    await Plotly.newPlot(stage, looks.map((look, i) => ({ ...look, ...now[i] })), {
      scene, uirevision: "kept", showlegend: false, margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)",
    }, { displayModeBar: false, responsive: true, scrollZoom: false });
    say();
    choice.addEventListener("change", () => { stop(); frame = 0; draw().then(lookAgain); });
    slider.addEventListener("input", () => { stop(); frame = Number(slider.value); draw(); });
    play.addEventListener("click", () => (timer ? stop() : start()));
    reset.addEventListener("click", lookAgain);
    stage.dataset.ready = "yes";
  }

  function fits() {
    const canvas = document.createElement("canvas");
    return typeof DecompressionStream === "function" && (canvas.getContext("webgl2") || canvas.getContext("webgl"));
  }

  new IntersectionObserver((seen, observer) => {
    if (!seen.some((entry) => entry.isIntersecting)) return;
    observer.disconnect();
    if (!fits()) {
      where.textContent = "this browser has no WebGL or cannot unpack the view";
      return;
    }
    where.textContent = "loading";
    begin().catch((error) => { where.textContent = `the view failed: ${error.message}`; throw error; });
  }, { rootMargin: "200px" }).observe(stage);
})();
