// Says below each box that is wider than the page that it scrolls, for as long as there is more to the right.
(() => {
  "use strict";
  const sizes = new ResizeObserver((entries) => entries.forEach(({ target }) => update(target.closest(".wide"))));

  function update(box) {
    const more = box.scrollWidth - box.clientWidth - box.scrollLeft > 2;
    box.nextElementSibling.hidden = !more;
  }

  document.querySelectorAll(".wide").forEach((box) => {
    const hint = document.createElement("p");
    hint.className = "scroll-hint";
    hint.textContent = "Scroll sideways for more \u2192";
    box.after(hint);
    box.addEventListener("scroll", () => update(box), { passive: true });
    sizes.observe(box);
    if (box.firstElementChild) sizes.observe(box.firstElementChild);
  });
})();
