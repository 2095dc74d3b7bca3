// Starts the player on the viewer's page, with a button that lets the server make a movie of what is shown.
(() => {
  "use strict";
  const script = document.getElementById("viewer"), { token, header } = script.dataset;

  async function command(name, content) {
    const answer = await fetch(`/command/${name}`, { method: "POST", headers: { "Content-Type": "application/json", [header]: token }, body: JSON.stringify(content) });
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return answer.json();
  }

  function element(name, properties, ...children) {
    const made = Object.assign(document.createElement(name), properties);
    made.append(...children);
    return made;
  }

  const player = MotionPlayer.mount(document.getElementById("player"), () => MotionData.ofServer("/motion.json"));
  const format = element("select", { name: "format", ariaLabel: "format of the movie" }, new Option("mp4"), new Option("gif"));
  const seconds = element("input", { type: "number", name: "seconds", min: 1, max: 60, value: 5, ariaLabel: "seconds of the movie" });
  const said = element("output", { className: "said saved" });
  const save = element("button", { type: "button", name: "save", textContent: "Save movie", onclick: async () => {
    save.disabled = true;
    said.textContent = "the server draws the movie";
    try {
      const from = player.time[player.frame];
      const made = await command("save", { clip: player.data.clips.indexOf(player.now), methods: player.shown.map((track) => track.name),
        start_s: from, end_s: from + Number(seconds.value), format: format.value, errors: player.errors.checked });
      said.textContent = "saved";
      element("a", { href: made.path, download: made.name }).click();
    } catch (error) {
      said.textContent = error.message;
    }
    save.disabled = false;
  } });
  document.getElementById("player").append(element("div", { className: "controls" }, save,
    element("label", {}, "as ", format), element("label", {}, "the next ", seconds, " s"), said));
})();
