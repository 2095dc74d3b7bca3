// Shows a live session: the newest frame as the server sends it, and the last minute of the line.
(() => {
  "use strict";
  const { token, header } = document.getElementById("viewer").dataset, find = (id) => document.getElementById(id);
  const BODY = { 0: "#e8850c", 1: "#a98a63", 2: "#9aa3ab" }, STATION = ["#20a4a8", "#e0b000", "#d43c3c"];
  const LINES = ["#e8850c", "#0f9d76", "#c05f9c", "#5b87ad", "#8a6d3b", "#7a68b8"], SECONDS = 60;
  const root = find("player"), stage = document.createElement("div"), canvas = document.createElement("canvas");
  stage.className = "stage";
  stage.tabIndex = 0;
  stage.append(canvas);
  root.append(stage);
  const camera = new MotionCamera(), renderer = new MotionRenderer.Renderer(canvas);
  let body, frame, pending = 0, heading = null, recording = "";

  function redraw() {
    if (!pending) pending = requestAnimationFrame(() => { pending = 0; draw(); });
  }

  function draw() {
    if (!frame) return;
    const ratio = Math.min(2, devicePixelRatio || 1), look = MotionRenderer.look();
    canvas.width = Math.round(stage.clientWidth * ratio);
    canvas.height = Math.round(stage.clientHeight * ratio);
    const point = (joint) => [0, 1, 2].map((i) => frame.joints_mm[3 * joint + i] / 1000), at = point(0);
    camera.target = [at[0], at[1], 0.9];
    const colour = MotionRenderer.rgb(BODY[frame.status]), capsules = new MotionRenderer.Capsules(), worn = new MotionRenderer.Capsules();
    MotionRenderer.addBody(capsules, body, point, () => colour);
    for (const { pose, state } of frame.stations) {
      if (pose) MotionRenderer.addStation(worn, pose.slice(0, 3).map((c) => c / 1000), pose.slice(3).map((c) => c / 1000), MotionRenderer.rgb(STATION[state]));
    }
    renderer.begin(look);
    renderer.draw([0, 0, canvas.width, canvas.height], camera, look, [{ capsules, opacity: 1, girth: 1 }, { capsules: worn, opacity: 1, girth: 1 }]);
    root.dataset.drawn = frame.number;
  }

  // Lines over the last minute, the newest value at the right; each line is a list with null where there is no value.
  function chart(id, lines, most, last) {
    const high = Math.max(most, ...lines.flat().filter((v) => v !== null)) * 1.05 || 1, figure = find(id);
    const paths = lines.map((values, n) => {
      const points = values.map((v, k) => (v === null ? null : `${((SECONDS - values.length + k + 1) * 300) / SECONDS},${70 - (66 * v) / high}`));
      return `<polyline points="${points.filter((p) => p).join(" ")}" fill="none" stroke="${LINES[n % LINES.length]}" stroke-width="1.5" vector-effect="non-scaling-stroke"/>`;
    });
    let svg = figure.querySelector("svg");
    if (!svg) {
      svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      svg.setAttribute("viewBox", "0 0 300 72");
      svg.setAttribute("preserveAspectRatio", "none");
      figure.prepend(svg);
      figure.dataset.text = figure.querySelector("figcaption").textContent;
    }
    svg.innerHTML = paths.join("");
    figure.querySelector("figcaption").textContent = `${figure.dataset.text}: ${last}`;
  }

  function showStatus(status) {
    const seconds = status.seconds, last = seconds[seconds.length - 1];
    const gone = body.stations.filter((_, n) => status.lost[n]);
    find("alarm").textContent = status.silent ? `no data for ${status.silent_s.toFixed(1)} s` : gone.length ? `lost: ${gone.join(", ")}` : "";
    find("stations").replaceChildren(...body.stations.map((name, n) => {
      const item = document.createElement("li"), dot = document.createElement("i");
      dot.style.background = status.lost[n] ? STATION[2] : LINES[n % LINES.length];
      item.append(dot, `${name} ${status.lost[n] ? "lost" : last ? `${Math.round(100 * last.quality[n])} %` : ""}`);
      return item;
    }));
    recording = status.recording;
    find("record").textContent = recording ? "Stop recording" : "Record";
    if (recording) find("said").textContent = `recording into ${recording}`;
    if (!last) return;
    chart("rate", [seconds.map((s) => s.rate_hz)], 1, last.rate_hz.toFixed(1));
    chart("loss", [seconds.map((s) => 100 * s.loss)], 5, (100 * last.loss).toFixed(1));
    chart("latency", ["p50_ms", "p99_ms"].map((name) => seconds.map((s) => s[name])), 1, last.p50_ms === null ? "–" : `${last.p50_ms.toFixed(1)}, ${last.p99_ms.toFixed(1)}`);
    chart("quality", body.stations.map((_, n) => seconds.map((s) => s.quality[n])), 1, last.quality.map((q) => q.toFixed(2)).join(" "));
    root.dataset.status = seconds.length;
  }

  async function record() {
    const button = find("record");
    button.disabled = true;
    try {
      const answer = await fetch("/command/record", { method: "POST", headers: { "Content-Type": "application/json", [header]: token }, body: JSON.stringify({ on: !recording }) });
      if (!answer.ok) throw new Error((await answer.text()).trim());
      const done = await answer.json();
      recording = done.recording;
      button.textContent = recording ? "Stop recording" : "Record";
      find("said").textContent = recording ? `recording into ${recording}` : `saved ${done.saved}`;
    } catch (error) {
      find("said").textContent = error.message;
    }
    button.disabled = false;
  }

  async function begin() {
    body = await (await fetch("/body.json")).json();
    MotionCamera.control(stage, camera, redraw, () => camera.reset(heading || 0));
    new ResizeObserver(redraw).observe(stage);
    find("record").addEventListener("click", record);
    follow();
    root.dataset.ready = "yes";
  }

  // Asks for news again and again. A browser has six connections for all tabs of a host: no tab keeps one, and a hidden tab asks for nothing.
  async function follow() {
    for (let last = 0; ; ) {
      if (document.hidden) await new Promise((resolve) => document.addEventListener("visibilitychange", resolve, { once: true }));
      try {
        const answer = await fetch(`/events?after=${last}`);
        if (!answer.ok) throw new Error(await answer.text());
        const news = await answer.json();
        last = news.last;
        for (const [kind, content] of news.messages) (kind === "frame" ? showFrame : showStatus)(content);
      } catch {
        find("alarm").textContent = "the session has ended";
        await new Promise((resolve) => setTimeout(resolve, 1000));
      }
    }
  }

  function showFrame(newest) {
    frame = newest;
    if (heading === null) camera.reset(heading = 0);
    redraw();
  }
  begin();
})();
