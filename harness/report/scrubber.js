// Plays the worst seconds in 3-D. Data and the charting library lie in the page, compressed, and are unpacked when
// the view is first scrolled to, so that the page opens at once.
(() => {
  "use strict";
  const find = (id) => document.getElementById(id);
  const stage = find("stage"), choice = find("shot"), slider = find("frame"), where = find("where");
  const play = find("play"), reset = find("reset");
  const TRUTH = "#5b87ad", ESTIMATE = "#e8850c", FLOOR = "#8d98a5", GRID_M = 0.5, REACH_M = 1.5;
  const CAMERA = { eye: { x: 1.35, y: -1.35, z: 0.45 }, center: { x: 0, y: 0, z: -0.08 }, up: { x: 0, y: 0, z: 1 } };
  let bones, head, shots, frame = 0, timer = 0;

  async function unpacked(id) {
    const bytes = Uint8Array.from(atob(find(id).textContent), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).text();
  }

  // Steps from frame to frame, in millimetres -> joint centres [frame][joint][axis] in metres.
  function unrolled(steps) {
    const now = new Array(steps[0].length).fill(0);
    return steps.map((step) => {
      const joints = [];
      step.forEach((change, i) => { now[i] += change; });
      for (let i = 0; i < now.length; i += 3) joints.push([now[i] / 1000, now[i + 1] / 1000, now[i + 2] / 1000]);
      return joints;
    });
  }

  // A figure as one line with a gap after each bone, seen from above the true root: the camera goes along.
  function lines(joints, at) {
    const out = { x: [], y: [], z: [] };
    const put = (p) => { out.x.push(p[0] - at[0]); out.y.push(p[1] - at[1]); out.z.push(p[2]); };
    for (const [from, to] of bones) {
      put(joints[from]);
      put(joints[to]);
      out.x.push(null); out.y.push(null); out.z.push(null);
    }
    return out;
  }

  function point(joints, at) {
    return { x: [joints[head][0] - at[0]], y: [joints[head][1] - at[1]], z: [joints[head][2]] };
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
    return [floor(at), lines(truth, at), point(truth, at), lines(estimate, at), point(estimate, at)];
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
    return Plotly.restyle(stage, update, [0, 1, 2, 3, 4]);
  }

  function stop() {
    clearTimeout(timer);
    timer = 0;
    play.textContent = "Play";
  }

  // In real time: what was too slow to draw is skipped.
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
      aspectmode: "manual", aspectratio: { x: 1.2, y: 1.2, z: 1.085 }, camera: CAMERA, dragmode: "turntable",
    };
    const line = (colour, width, name) => ({ type: "scatter3d", mode: "lines", hoverinfo: "skip", name,
      showlegend: Boolean(name), line: { color: colour, width } });
    const ball = (colour) => ({ type: "scatter3d", mode: "markers", hoverinfo: "skip", showlegend: false,
      marker: { color: colour, size: 12, line: { width: 0 } } });
    const looks = [line(FLOOR, 1, ""), line(TRUTH, 11, "truth"), ball(TRUTH), line(ESTIMATE, 7, "estimate"), ball(ESTIMATE)];
    const now = parts();
    const ink = getComputedStyle(document.body).color;
    await Plotly.newPlot(stage, looks.map((look, i) => ({ ...look, ...now[i] })), {
      scene, uirevision: "kept", margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)",
      legend: { x: 0.01, y: 0.99, bgcolor: "rgba(0,0,0,0)", itemclick: false, itemdoubleclick: false },
      font: { family: "system-ui, sans-serif", size: 14, color: ink },
    }, { displayModeBar: false, responsive: true, scrollZoom: false });
    say();
    choice.addEventListener("change", () => { stop(); frame = 0; draw(); });
    slider.addEventListener("input", () => { stop(); frame = Number(slider.value); draw(); });
    play.addEventListener("click", () => (timer ? stop() : start()));
    reset.addEventListener("click", () => Plotly.relayout(stage, { "scene.camera": CAMERA }));
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
