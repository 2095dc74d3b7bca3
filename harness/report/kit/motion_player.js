// Plays the motions of a run or a clip in 3-D: truth, up to three methods next to each other or in one view, stations.
// The data is unpacked when the view is first scrolled to, so that the page opens quickly.
const MotionPlayer = (() => {
  "use strict";
  const TRUTH = "#5b87ad", METHODS = ["#e8850c", "#0f9d76", "#c05f9c"], LOST = "#8d98a5";
  const STATION = ["#20a4a8", "#e0b000", "#d43c3c"];
  const STATES = ["", " · held", " · lost", " · no estimate"], NO_ESTIMATE = 3;
  const { rgb } = MotionRenderer, FLAGS = ["truth", "stations", "names", "errors", "follow"], MOST_POINTS = 800;
  const SPEEDS = [0.1, 0.25, 0.5, 1, 1.5, 2], WORST_MM = 100, LINK = "view?";
  const RAMP = ["#2c7bb6", "#7fc7c9", "#f2e394", "#f3913c", "#c2182b"].map(rgb);

  function errorColour(mm) {
    const at = Math.min(1, mm / WORST_MM) * (RAMP.length - 1), k = Math.min(RAMP.length - 2, Math.floor(at));
    return RAMP[k].map((c, i) => c + (at - k) * (RAMP[k + 1][i] - c));
  }

  // An element with attributes, properties (`onclick`, `value`, ...) and children.
  function make(name, attributes = {}, ...children) {
    const element = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
      if (key in element && key !== "list") element[key] = value;
      else element.setAttribute(key, value);
    }
    element.append(...children);
    return element;
  }

  function options(list, entries) {
    list.replaceChildren(...entries.map(([value, text]) => make("option", { value, textContent: text })));
  }

  class Player {
    constructor(root, load) {
      this.root = root;
      this.load = load;
      this.camera = new MotionCamera();
      this.frame = 0;
      this.shown = [];
      this.playing = false;
      this.visible = false;
      this.#build();
      new IntersectionObserver((seen) => {
        this.visible = seen.some((entry) => entry.isIntersecting);
        if (this.visible && !this.started) this.#start();
        this.redraw();
      }, { rootMargin: "100px" }).observe(this.stage);
      if (location.hash.startsWith(`#${LINK}`)) root.scrollIntoView();
    }

    #build() {
      const box = (name, text) => {
        const input = make("input", { type: "checkbox", name, onchange: () => this.redraw() });
        this[name] = input;
        return make("label", {}, input, text);
      };
      const button = (name, text, onclick, title = "") => (this[name] = make("button", { type: "button", textContent: text, onclick, title, name }));
      const list = (name, text, onchange) => {
        this[name] = make("select", { name, onchange, "aria-label": text });
        return make("label", { className: `choose ${name}` }, `${text} `, this[name]);
      };
      this.canvas = make("canvas", {});
      this.labels = make("div", { className: "labels" });
      this.stage = make("div", { className: "stage", tabIndex: 0, role: "img", "aria-label": this.root.dataset.label,
        "aria-keyshortcuts": "Space ArrowLeft ArrowRight Plus Minus" }, this.canvas, this.labels, ...this.root.querySelectorAll(".waiting"));
      this.slider = make("input", { type: "range", min: 0, max: 0, value: 0, step: 1, "aria-label": "frame",
        oninput: () => { this.stop(); this.seek(Number(this.slider.value)); } });
      this.where = make("output", { textContent: "loads when scrolled to" });
      this.said = make("output", { className: "said" });
      this.key = make("div", { className: "key" });
      this.signals = make("div", { className: "signals" });
      const methods = [0, 1, 2].map((n) => list(`method${n}`, ["Method", "and", "and"][n], () => this.#try(() => this.#choose())));
      const speed = list("speed", "Speed", () => { if (this.playing) this.play(); });
      options(this.speed, SPEEDS.map((s) => [s, `${s}×`]));
      this.speed.value = 1;
      const layout = list("layout", "View", () => this.redraw());
      options(this.layout, [["side", "side by side"], ["over", "overlaid"]]);
      this.root.replaceChildren(
        make("div", { className: "controls chooser" }, list("clip", "Clip", () => this.#try(() => this.#open(Number(this.clip.value)))), ...methods, layout,
          list("moment", "Go to", () => this.#try(() => this.#goTo()))),
        this.stage,
        make("div", { className: "controls" }, button("run", "Play", () => this.toggle(), "space"),
          button("back", "◀", () => this.step(-1), "one frame back (left arrow)"),
          button("next", "▶", () => this.step(1), "one frame on (right arrow)"), this.slider, this.where),
        this.signals,
        make("div", { className: "controls" }, speed, box("truth", "truth"), box("stations", "stations"), box("names", "names"), box("errors", "colour by error"),
          box("follow", "follow"), button("reset", "Reset view", () => this.resetCamera(), "R"),
          button("link", "Copy link to this moment", () => this.copyLink()), this.said),
        this.key,
      );
      for (const name of FLAGS) this[name].checked = name !== "errors";
    }

    async #start() {
      this.started = true;
      this.where.textContent = "loading";
      try {
        if (typeof DecompressionStream !== "function") throw new Error("this browser cannot unpack the data");
        this.renderer = new MotionRenderer.Renderer(this.canvas);
        this.data = await this.load();
        options(this.clip, this.data.clips.map((clip, n) => [n, clip.title]));
        const moments = this.data.moments || [];
        options(this.moment, [["", "worst seconds"], ...moments.map((m, n) => [n, m.title])]);
        this.moment.parentElement.hidden = !moments.length;
        this.clip.parentElement.hidden = this.data.clips.length < 2;
        this.#listen();
        if (!(await this.#restore())) await this.#open(0);
        this.root.dataset.ready = "yes";
      } catch (error) {
        this.where.textContent = `the view failed: ${error.message}`;
        this.root.dataset.failed = error.message;
      }
    }

    #listen() {
      const { stage } = this;
      new ResizeObserver(() => this.redraw()).observe(stage);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
      addEventListener("hashchange", () => this.#try(() => this.#restore()));
      MotionCamera.control(stage, this.camera, () => this.redraw(), () => this.resetCamera());
      stage.addEventListener("keydown", (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const turns = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
        const acts = {
          " ": () => this.toggle(), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1), Home: () => this.seek(0),
          End: () => this.seek(1e9), "+": () => this.camera.zoom(0.9), "=": () => this.camera.zoom(0.9), "-": () => this.camera.zoom(1 / 0.9),
          r: () => this.resetCamera(), ArrowUp: () => this.camera.turn(0, 0.1), ArrowDown: () => this.camera.turn(0, -0.1),
        };
        const act = event.shiftKey && turns[event.key] ? () => this.camera.turn(...turns[event.key]) : acts[event.key];
        if (!act) return;
        event.preventDefault();
        act();
        this.redraw();
      });
    }

    async #try(act) {
      try {
        await act();
      } catch (error) {
        this.where.textContent = `the view failed: ${error.message}`;
      }
    }

    // Open a clip with the methods of these names; the ones that are chosen already, without names.
    async #open(n, names = null, time = null) {
      this.stop();
      this.where.textContent = "loading";
      this.now = await this.data.clip(n);
      this.clip.value = n;
      const estimates = this.now.tracks.filter((track) => track.role === "estimate").map((track) => track.name);
      const before = names || (this.shown.length ? this.shown.map((track) => track.name) : this.data.shown || []);
      [0, 1, 2].forEach((k) => {
        const list = this[`method${k}`];
        options(list, [...(k ? [["", "–"]] : []), ...estimates.map((name) => [name, name])]);
        list.value = estimates.includes(before[k]) ? before[k] : k ? "" : estimates[0] || "";
        list.parentElement.hidden = estimates.length <= k;
      });
      const reference = this.now.tracks.find((track) => track.role === "truth");
      for (const name of ["truth", "errors"]) this[name].parentElement.hidden = !(reference && estimates.length);
      for (const name of ["stations", "names"]) this[name].parentElement.hidden = !this.now.stations;
      const progress = (share) => { this.where.textContent = `loading ${Math.round(100 * share)} %`; };
      const clip = this.now;
      this.time = (await this.data.array(clip.time, 1e-4)).values;
      this.reference = reference ? await this.#track(reference, progress) : null;
      if (clip.stations) {
        const [poses, states, quality] = await Promise.all(["poses", "states", "quality"].map((name) => this.data.array(clip.stations[name], 1)));
        this.worn = { names: clip.stations.names, poses: poses.values, states: states.values, quality: quality.values };
      } else this.worn = null;
      if (!names) this.camera.reset(clip.heading);
      this.slider.max = this.time.length - 1;
      this.frame = 0;
      await this.#choose();
      this.seek(time === null ? 0 : this.#frameAt(time));
    }

    async #track(track, progress) {
      const [joints, states, region] = await Promise.all([this.data.joints(track.joints, progress), this.data.array(track.states, 1),
        track.region && this.data.array(track.region, 0.1)]);
      return { name: track.name, joints: joints.values, columns: joints.columns, states: states.values, region: region && region.values };
    }

    // Load the chosen methods, each once.
    async #choose() {
      const names = [...new Set([0, 1, 2].map((k) => this[`method${k}`].value).filter(Boolean))];
      const tracks = names.map((name) => this.now.tracks.find((track) => track.name === name));
      this.shown = await Promise.all(tracks.map((track) => this.#track(track, () => {})));
      this.layout.parentElement.hidden = this.shown.length < 2;
      this.#showSignals();
      this.seek(this.frame);
    }

    async #goTo() {
      const moment = this.data.moments[Number(this.moment.value)];
      if (!moment || this.moment.value === "") return;
      const kept = [0, 1, 2].map((k) => this[`method${k}`].value).filter((name) => name && name !== moment.method);
      await this.#open(moment.clip, [moment.method, ...kept], moment.time_s);
      this.play(moment.end_s);
    }

    // ---- time

    #frameAt(time) {
      let low = 0, high = this.time.length - 1;
      while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (this.time[middle] <= time + 1e-6) low = middle;
        else high = middle - 1;
      }
      return low;
    }

    seek(frame) {
      this.frame = Math.max(0, Math.min(this.time.length - 1, frame));
      this.slider.value = this.frame;
      this.where.textContent = `frame ${this.frame + 1} of ${this.time.length} · ${this.time[this.frame].toFixed(3)} s`;
      for (const mark of this.signals.querySelectorAll("i")) mark.style.left = `${(100 * this.frame) / Math.max(1, this.time.length - 1)}%`;
      this.redraw();
    }

    // Under the time line: the mean error of each method, its stated region, the lowest quality of a station, the share of stations with readings.
    #showSignals() {
      const last = this.time.length - 1, every = Math.max(1, Math.ceil(last / MOST_POINTS)), frames = [], signals = [];
      for (let frame = 0; frame <= last; frame += every) frames.push(frame);
      const errors = this.reference ? this.shown.map((track, n) => [METHODS[n], frames.map((frame) => this.#meanErrorMm(track, frame))]) : [];
      if (errors.length) signals.push(["error [mm]", Math.max(1, ...errors.flatMap(([, values]) => values)), errors]);
      const regions = this.shown.flatMap((track, n) => (track.region ? [[METHODS[n], frames.map((frame) => this.#region(track, frame))]] : []));
      if (regions.length) signals.push(["stated 95 % region [±°]", Math.max(1, ...regions.flatMap(([, values]) => values)), regions]);
      if (this.worn) {
        const count = this.worn.names.length, row = (values, frame) => values.subarray(count * frame, count * (frame + 1));
        const present = frames.map((frame) => (100 * row(this.worn.states, frame).filter((state) => state < 2).length) / count);
        signals.push(["lowest quality [%]", 100, [[STATION[1], frames.map((frame) => Math.min(...row(this.worn.quality, frame)))]]]);
        signals.push(["stations read [%]", 100, [[STATION[0], present]]]);
      }
      this.signals.replaceChildren(...signals.map(([text, most, lines]) => {
        const box = make("div", { className: "signal", onclick: (event) => this.seek(Math.round((last * event.offsetX) / box.clientWidth)) });
        const path = ([colour, values]) => `<path d="${values.map((value, n) => (value === null ? "" : `${n && values[n - 1] !== null ? "L" : "M"}${frames[n]} ${(30 - (28 * value) / most).toFixed(1)}`)).join("")}" stroke="${colour}"/>`;
        box.innerHTML = `<svg viewBox="0 0 ${Math.max(1, last)} 32" preserveAspectRatio="none">${lines.map(path).join("")}</svg>`;
        box.append(make("i", {}));
        return make("div", {}, make("span", { textContent: `${text}, 0 to ${most.toFixed(0)}` }), box);
      }));
    }

    // Mean half width of the stated 95 % region [deg]; null without an estimate or where none is stated.
    #region(track, frame) {
      return track.region && track.states[frame] !== NO_ESTIMATE ? track.region[frame] : null;
    }

    // Mean over joints; null without an estimate or without the truth.
    #meanErrorMm(track, frame) {
      if (!this.reference || [track, this.reference].some((each) => each.states[frame] === NO_ESTIMATE)) return null;
      const joints = this.data.bones.map(([, to]) => to);
      return joints.reduce((sum, joint) => sum + this.errorMm(track, joint, frame), 0) / joints.length;
    }

    step(frames) {
      this.stop();
      this.seek(this.frame + frames);
    }

    toggle() {
      if (this.playing) this.stop();
      else this.play();
    }

    stop() {
      this.playing = false;
      this.run.textContent = "Play";
    }

    // Play in real time, times the speed, to `end` seconds; frames that would be drawn too late are skipped.
    play(end = null) {
      if (this.frame >= this.time.length - 1) this.seek(0);
      const speed = Number(this.speed.value), began = performance.now(), from = this.time[this.frame];
      const until = end === null ? this.time[this.time.length - 1] : end, token = {};
      this.playing = token;
      this.run.textContent = "Pause";
      const tick = () => {
        if (this.playing !== token) return;
        const time = from + (speed * (performance.now() - began)) / 1000;
        const frame = this.#frameAt(Math.min(time, until));
        if (frame !== this.frame) this.seek(frame);
        if (time >= until) this.stop();
        else requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    // ---- the moment as a link

    state() {
      const fields = new URLSearchParams({ clip: this.now.name });
      for (const track of this.shown) fields.append("method", track.name);
      fields.set("t", this.time[this.frame].toFixed(4));
      fields.set("camera", this.camera.text());
      fields.set("layout", this.layout.value);
      fields.set("show", FLAGS.filter((name) => this[name].checked).join(","));
      return fields.toString();
    }

    async copyLink() {
      history.replaceState(null, "", `#${LINK}${this.state()}`);
      try {
        await navigator.clipboard.writeText(location.href);
        this.said.textContent = "copied";
      } catch {
        this.said.textContent = "the link is in the address bar";
      }
      setTimeout(() => { this.said.textContent = ""; }, 4000);
    }

    // Open the moment of the address, if it names one; false if it does not.
    async #restore() {
      if (!location.hash.startsWith(`#${LINK}`)) return false;
      const fields = new URLSearchParams(location.hash.slice(1 + LINK.length));
      const n = this.data.clips.findIndex((clip) => clip.name === fields.get("clip"));
      if (n < 0) return false;
      if (["side", "over"].includes(fields.get("layout"))) this.layout.value = fields.get("layout");
      if (fields.has("show")) {
        const shown = fields.get("show").split(",");
        for (const name of FLAGS) this[name].checked = shown.includes(name);
      }
      this.camera.reset((await this.data.clip(n)).heading);
      this.camera.restore(fields.get("camera"));
      const time = Number(fields.get("t"));
      await this.#open(n, fields.getAll("method"), Number.isFinite(time) ? time : 0);
      return true;
    }

    // ---- drawing

    resetCamera() {
      this.camera.reset(this.now ? this.now.heading : 0);
      this.redraw();
    }

    redraw() {
      if (this.pending || !this.visible || !this.time) return;
      this.pending = requestAnimationFrame(() => {
        this.pending = 0;
        this.#draw();
      });
    }

    #draw() {
      const ratio = Math.min(2, devicePixelRatio || 1), wide = this.stage.clientWidth, high = this.stage.clientHeight;
      if (!wide || !high) return;
      const { canvas, renderer } = this;
      if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
        canvas.width = Math.round(wide * ratio);
        canvas.height = Math.round(high * ratio);
      }
      const look = MotionRenderer.look(), root = this.reference || this.shown[0];
      if (root) {
        const row = this.follow.checked ? this.frame * root.columns : 0;
        this.camera.target = [root.joints[row], root.joints[row + 1], 0.9 * this.now.height_m / 1.75];
      } else if (this.worn) {
        const count = this.worn.names.length, row = this.follow.checked ? this.frame * count : 0, mean = [0, 0, 0];
        for (let n = 0; n < count; n += 1) for (let i = 0; i < 3; i += 1) mean[i] += this.worn.poses[7 * (row + n) + i] / 1000 / count;
        this.camera.target = mean;
      }
      renderer.begin(look);
      const views = this.shown.length > 1 && this.layout.value === "side" ? this.shown.map((track) => [track]) : [this.shown];
      const stacked = wide < 520 && views.length > 1, across = stacked ? 1 : views.length, down = stacked ? views.length : 1;
      views.forEach((tracks, n) => {
        const w = canvas.width / across, h = canvas.height / down;
        const box = [stacked ? 0 : n * w, stacked ? canvas.height - (n + 1) * h : 0, w, h].map(Math.round);
        renderer.draw(box, this.camera, look, this.#bodies(tracks));
      });
      this.#label(views, across, down);
      this.root.dataset.drawn = this.frame;
    }

    #bodies(tracks) {
      const bodies = [], known = this.reference && this.reference.states[this.frame] !== NO_ESTIMATE;
      const ghost = known && tracks.length > 0, byError = this.errors.checked && known;
      if (known && (!ghost || this.truth.checked)) {
        bodies.push({ capsules: this.#body(this.reference, rgb(TRUTH)), opacity: ghost ? 0.28 : 1, girth: 1 });
      }
      for (const track of tracks) {
        if (track.states[this.frame] === NO_ESTIMATE) continue;
        const lost = track.states[this.frame] === 2, colour = rgb(lost ? LOST : METHODS[this.shown.indexOf(track)]);
        bodies.push({ capsules: this.#body(track, colour, byError), opacity: 1, girth: ghost && this.truth.checked ? 0.6 : 1 });
      }
      if (this.worn && this.stations.checked) bodies.push({ capsules: this.#stations(), opacity: 1, girth: 1 });
      return bodies;
    }

    #point(track, joint, frame = this.frame) {
      const at = frame * track.columns + 3 * joint;
      return [track.joints[at], track.joints[at + 1], track.joints[at + 2]];
    }

    errorMm(track, joint, frame = this.frame) {
      const [p, q] = [this.#point(track, joint, frame), this.#point(this.reference, joint, frame)];
      return 1000 * Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    }

    #body(track, colour, byError = false) {
      const capsules = new MotionRenderer.Capsules();
      const paint = (joint) => (byError ? errorColour(this.errorMm(track, joint)) : colour);
      MotionRenderer.addBody(capsules, this.data, (joint) => this.#point(track, joint), paint);
      return capsules;
    }

    #stations() {
      const capsules = new MotionRenderer.Capsules(), { poses, states, names } = this.worn;
      names.forEach((_, n) => {
        const row = this.frame * names.length + n, [x, y, z, ...turn] = poses.subarray(7 * row, 7 * row + 7);
        const pose = [[x, y, z], turn].map((part) => part.map((v) => v / 1000));
        MotionRenderer.addStation(capsules, ...pose, rgb(STATION[states[row]]));
      });
      return capsules;
    }

    // The names of the stations, each where its station is in a view.
    #stationNames(across, down) {
      if (!this.worn || !this.names.checked || !this.stations.checked) return [];
      const { poses, names } = this.worn, m = this.camera.matrix((this.stage.clientWidth / across) / (this.stage.clientHeight / down));
      return names.map((name, n) => {
        const at = 7 * (this.frame * names.length + n), [x, y, , w] = [0, 1, 2, 3].map((i) => m[12 + i] + [0, 1, 2].reduce((sum, k) => sum + (m[4 * k + i] * poses[at + k]) / 1000, 0));
        const text = make("span", { className: "station", textContent: name.replaceAll("_", " "), hidden: w <= 0 });
        text.style.left = `${50 + (50 * x) / w}%`;
        text.style.top = `${50 - (50 * y) / w}%`;
        return text;
      });
    }

    #label(views, across, down) {
      const text = (track) => {
        const state = track.states[this.frame], name = make("b", { textContent: track.name });
        name.style.color = METHODS[this.shown.indexOf(track)];
        const mean = this.#meanErrorMm(track, this.frame), region = this.#region(track, this.frame);
        const stated = region === null ? "" : ` · stated ±${region.toFixed(0)}°`;
        return make("span", {}, name, `${mean === null ? "" : ` ${mean.toFixed(0)} mm`}${stated}${STATES[state] || ""}`);
      };
      this.labels.style.gridTemplate = `repeat(${down}, 1fr) / repeat(${across}, 1fr)`;
      this.labels.replaceChildren(...views.map((tracks) => make("div", {}, ...tracks.map(text), ...this.#stationNames(across, down))));
      const chip = (colour, name) => {
        const dot = make("i", {});
        dot.style.background = colour;
        return make("span", {}, dot, name);
      };
      const key = [];
      if (this.reference) key.push(chip(TRUTH, this.reference.name));
      if (this.errors.checked && this.reference && this.shown.length) {
        const bar = make("i", { className: "ramp" });
        bar.style.background = `linear-gradient(90deg, ${RAMP.map((c) => `rgb(${c.map((v) => Math.round(255 * v))})`)})`;
        key.push(make("span", {}, "error 0 ", bar, ` ${WORST_MM} mm and more`));
      } else key.push(...this.shown.map((track, n) => chip(METHODS[n], track.name)));
      if (this.worn && this.stations.checked) {
        key.push(chip(STATION[0], "station"), chip(STATION[1], "position or orientation held"), chip(STATION[2], "lost"));
      }
      this.key.replaceChildren(...key);
    }
  }

  // Put a player into an element; `load` gives its data when the element is first seen.
  function mount(root, load) {
    root.player = new Player(root, load);
    return root.player;
  }
  return { mount };
})();
