// Shows a live session: its status, the newest frame, the last minute of the line; and sends commands with a token.
(() => {
  "use strict";
  const { header } = document.getElementById("viewer").dataset, find = (id) => document.getElementById(id);
  const SECONDS = 60, TOKEN = "harness-token", APART_M = 0.65;
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const root = find("player"), stage = document.createElement("div"), canvas = document.createElement("canvas"), names = document.createElement("div");
  stage.className = "stage";
  stage.tabIndex = 0;
  names.className = "names";
  stage.append(canvas, names);
  root.append(stage);
  const camera = new MotionCamera();
  let renderer, body, frame, guided, stations, pending = 0, recording = "", said = "", token = takeToken();

  // The token stands behind # in the address that the terminal shows; a tab keeps it, the address bar does not.
  function takeToken() {
    const given = location.hash.slice(1);
    if (given) {
      sessionStorage.setItem(TOKEN, given);
      history.replaceState(null, "", location.pathname);
    }
    return sessionStorage.getItem(TOKEN) || "";
  }

  function redraw() {
    if (!pending && renderer) pending = requestAnimationFrame(() => { pending = 0; draw(); });
  }

  const pointOf = (joints_mm, shift) => (joint) => [0, 1, 2].map((i) => joints_mm[3 * joint + i] / 1000 + shift[i]);

  function draw() {
    const parts = [], labels = [], posing = guided && guided.stage === "posing";
    const add = (point, colour) => {
      const capsules = new MotionRenderer.Capsules();
      MotionRenderer.addBody(capsules, body, point, () => MotionRenderer.rgb(colour));
      parts.push({ capsules, opacity: 1, girth: 1 });
    };
    if (posing) {
      for (const [joints, text, y] of [[guided.wanted_mm, `pose ${guided.number}`, -APART_M], [guided.performer_mm, "you", APART_M]]) {
        if (!joints) continue;
        const point = pointOf(joints, [0, y, 0]), [x, , z] = point(0);
        add(point, css(text === "you" ? "--ink" : "--faint"));
        labels.push([text, [x, y, z + 1.0], "--ink"]);
      }
      camera.target = [0, 0, 0.9];
    } else if (frame) {
      const worn = new MotionRenderer.Capsules();
      const point = pointOf(frame.joints_mm, [0, 0, 0]), at = point(0);
      camera.target = [at[0], at[1], 0.9];
      add(point, css(`--${find("session").dataset.word.toLowerCase()}`));
      frame.stations.forEach((pose, n) => {
        if (!pose) return;
        const [x, y, z, ...turn] = pose.map((c) => c / 1000);
        MotionRenderer.addStation(worn, [x, y, z], turn, MotionRenderer.rgb(css(stations[n].colour)));
        labels.push([body.stations[n], [x, y, z], stations[n].colour]);
      });
      parts.push({ capsules: worn, opacity: 1, girth: 1 });
      const region = new MotionRenderer.Capsules(), reach = frame.reach_mm || [], moved = (values) => values.filter((_, n) => reach[n]);
      const radii_mm = moved(body.radii_mm.map(([start, end], n) => [start, end + reach[n]]));
      MotionRenderer.addBody(region, { bones: moved(body.bones), radii_mm }, point, () => MotionRenderer.rgb(css("--faint")));
      parts.push({ capsules: region, opacity: 0.3, girth: 1, shadowless: true });
      find("uncertainty").querySelector("i").hidden = !frame.reach_mm;
    } else return;
    const ratio = Math.min(2, devicePixelRatio || 1), look = MotionRenderer.look();
    canvas.width = Math.round(stage.clientWidth * ratio);
    canvas.height = Math.round(stage.clientHeight * ratio);
    renderer.begin(look);
    renderer.draw([0, 0, canvas.width, canvas.height], camera, look, parts);
    write(labels);
    root.dataset.drawn = posing ? `pose ${guided.number}` : frame.number;
  }

  // Names beside the stations, where the camera sees them.
  function write(labels) {
    const m = camera.matrix(stage.clientWidth / stage.clientHeight);
    while (names.children.length > labels.length) names.lastChild.remove();
    labels.forEach(([text, p, colour], n) => {
      const label = names.children[n] || names.appendChild(document.createElement("span"));
      const clip = [0, 1, 3].map((row) => m[row] * p[0] + m[4 + row] * p[1] + m[8 + row] * p[2] + m[12 + row]);
      label.textContent = text;
      label.style.borderLeft = `4px solid var(${colour})`;
      label.style.left = `${(clip[0] / clip[2] * 0.5 + 0.5) * 100}%`;
      label.style.top = `${(0.5 - 0.5 * clip[1] / clip[2]) * 100}%`;
      label.style.transform = "translate(0.9rem, -50%)";
    });
  }

  // The least round number that is not below a value.
  function roundUp(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 3, 4, 5, 6, 8, 10].map((n) => n * power).find((n) => n >= value * 0.999);
  }

  // Lines over the last minute with the newest value at the right, from 0 to a round number; null leaves a gap.
  function chart(plot, lines, least, unit, colour, most = 0) {
    const top = most || roundUp(Math.max(least, ...lines.flat().filter((v) => v !== null)));
    const grid = [0, 25, 50, 75].map((x) => `<path d="M${3 * x} 0V100" stroke="var(--rule)" vector-effect="non-scaling-stroke"/>`).join("");
    const half = '<path d="M0 50H300" stroke="var(--rule)" vector-effect="non-scaling-stroke"/>';
    const paths = lines.map((values, n) => {
      let path = "", gap = true;
      values.forEach((v, k) => {
        const x = ((SECONDS - values.length + k + 1) * 300) / SECONDS;
        if (v !== null) path += `${gap ? "M" : "L"}${x.toFixed(1)} ${(98 - (96 * Math.min(v, top)) / top).toFixed(1)}`;
        gap = v === null;
      });
      return `<path class="line" d="${path}" fill="none" stroke="var(${colour})" stroke-width="2" ${n ? 'stroke-dasharray="3 3"' : ""} vector-effect="non-scaling-stroke"/>`;
    });
    plot.querySelector("svg").innerHTML = grid + half + paths.join("");
    plot.querySelector(".top").textContent = `${top} ${unit}`;
  }

  function setWord(element, word, text) {
    element.dataset.word = word;
    (element.querySelector("b") || element).textContent = word;
    if (text !== undefined) element.querySelector("span").textContent = text;
  }

  function showStatus(status) {
    const seconds = status.seconds, last = seconds[seconds.length - 1];
    setWord(find("session"), status.session, status.why);
    redraw();
    stations.forEach(({ row }, n) => setWord(row.querySelector(".word"), status.stations[n]));
    find("uncertainty").querySelector("output").textContent = status.uncertainty;
    recording = status.recording || "";
    find("record").textContent = recording ? "Stop recording" : "Record";
    if (status.failure) say(`the recording has ended: ${status.failure}`);
    else if (recording) say(`recording into ${recording}`);
    if (!last) return;
    stations.forEach(({ row, colour }, n) => {
      row.querySelector("output").textContent = `${Math.round(100 * last.quality[n])} %`;
      chart(row, [seconds.map((s) => 100 * s.quality[n])], 100, "%", colour, 100);
    });
    const one = (value) => (value === null ? "–" : value.toFixed(1));
    for (const [id, lines, least, unit, now] of [
      ["rate", [seconds.map((s) => s.rate_hz)], 10, "Hz", `${one(last.rate_hz)} Hz`],
      ["loss", [seconds.map((s) => 100 * s.loss)], 10, "%", `${one(100 * last.loss)} %`],
      ["latency", [seconds.map((s) => s.p50_ms), seconds.map((s) => s.p99_ms)], 2, "ms", `${one(last.p50_ms)} and ${one(last.p99_ms)} ms`],
    ]) {
      chart(find(id), lines, least, unit, "--ink");
      find(id).querySelector("output").textContent = now;
    }
    root.dataset.status = seconds.length;
  }

  function showCalibration(state) {
    guided = state;
    const panel = find("calibration"), posing = state.stage === "posing", title = { posing: `Pose ${state.number} of ${state.poses}: ${state.name}`, solving: "Solving", done: "Calibrated", failed: "Not calibrated" };
    panel.hidden = false;
    panel.dataset.stage = state.stage;
    panel.querySelector("h2").textContent = title[state.stage];
    panel.querySelector(".instruction").textContent = posing ? state.instruction : "";
    panel.querySelector("progress").hidden = !posing;
    panel.querySelector("progress").value = state.still_share || 0;
    panel.querySelector("ul").replaceChildren(...state.lines.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
    panel.querySelector("details").hidden = !state.report;
    panel.querySelector("pre").textContent = state.report || "";
    for (const button of document.querySelectorAll("[data-kind]")) {
      button.dataset.text = button.dataset.text || button.textContent;
      button.textContent = posing && button.dataset.kind === state.kind ? "Stop calibration" : button.dataset.text;
      button.disabled = state.stage === "solving" || (posing && button.dataset.kind !== state.kind);
    }
    redraw();
  }

  function say(text) {
    if (text !== said) find("said").textContent = said = text;
  }

  function setReader(reader) {
    find("reader").hidden = !reader;
    for (const button of document.querySelectorAll(".controls button")) button.hidden = reader;
  }

  // Sends a command and says what came of it; `describe` makes a text of the answer.
  async function command(button, name, content, describe) {
    if (!token || button.disabled) return;
    button.disabled = true;
    try {
      const answer = await fetch(`/command/${name}`, { method: "POST", headers: { "Content-Type": "application/json", [header]: token }, body: JSON.stringify(content) });
      if (answer.status === 403) setReader(true);
      if (!answer.ok) throw new Error((await answer.text()).trim());
      say(describe(await answer.json()));
    } catch (error) {
      say(error.message);
    }
    button.disabled = false;
  }

  function prepareCommands() {
    const actions = {
      heading: (button) => command(button, "heading", {}, (done) => `heading reset by ${done.turn_deg.toFixed(0)}°`),
      record: (button) => command(button, "record", { on: !recording }, (done) => {
        recording = done.recording;
        button.textContent = recording ? "Stop recording" : "Record";
        return recording ? `recording into ${recording}` : `saved ${done.saved}`;
      }),
    };
    for (const [id, action] of Object.entries(actions)) find(id).addEventListener("click", () => action(find(id)));
    for (const button of document.querySelectorAll("[data-kind]")) {
      button.addEventListener("click", () => command(button, "calibrate", { kind: guided && guided.stage === "posing" ? "" : button.dataset.kind }, () => ""));
    }
    addEventListener("keydown", (event) => {
      const id = { h: "heading", r: "record" }[event.key.toLowerCase()];
      if (id && !event.ctrlKey && !event.metaKey && !event.altKey && !event.repeat) actions[id](find(id));
    });
    setReader(!token);
    addEventListener("hashchange", () => setReader(!(token = takeToken())));
  }

  async function begin() {
    body = await (await fetch("/body.json")).json();
    stations = [...find("stations").children].map((row) => ({ row, colour: row.dataset.colour }));
    try {
      renderer = new MotionRenderer.Renderer(canvas);
      MotionCamera.control(stage, camera, redraw, () => { camera.reset(0); redraw(); });
      new ResizeObserver(redraw).observe(stage);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    } catch (error) {
      names.textContent = `No picture: ${error.message}.`;
    }
    prepareCommands();
    follow();
    root.dataset.ready = "yes";
  }

  // Asks for news again and again. A browser has six connections for all tabs of a host: no tab keeps one, and a hidden tab asks for nothing.
  async function follow() {
    const show = { frame: showFrame, status: showStatus, calibration: showCalibration };
    for (let last = 0; ; ) {
      if (document.hidden) await new Promise((resolve) => document.addEventListener("visibilitychange", resolve, { once: true }));
      try {
        const answer = await fetch(`/events?after=${last}`);
        if (!answer.ok) throw new Error(await answer.text());
        const news = await answer.json();
        last = news.last;
        for (const [kind, content] of news.messages) show[kind](content);
      } catch {
        setWord(find("session"), "LOST", "the session has ended");
        for (const { row } of stations) setWord(row.querySelector(".word"), "LOST");
        await new Promise((resolve) => setTimeout(resolve, 1000));
      }
    }
  }

  function showFrame(newest) {
    frame = newest;
    redraw();
  }
  begin();
})();
