{
  const figure = document.currentScript.closest("figure");
  const scene = JSON.parse(figure.querySelector("script").textContent);
  const [button, slider] = figure.querySelectorAll("button, input");
  const all = (chosen) => [...figure.querySelectorAll(chosen)];
  const lines = all("[data-points]").map((line) =>
    ({line, of: line.dataset.of, points: line.dataset.points.split(" ").map(Number)}));
  const dots = all("[data-point]");
  const bars = {points: all(".bar[data-of=points]"), nominal: all(".bar[data-of=nominal]")};
  const numbers = all(".number");
  const label = figure.querySelector(".label");
  const last = scene.points.length - 1;
  let frame = scene.start;
  let playing = false;
  let since = 0;

  function show(number) {
    frame = number;
    for (const {line, of, points} of lines) {
      const places = scene[of][frame];
      line.setAttribute("points",
        points.map((i) => places[2 * i] + "," + places[2 * i + 1]).join(" "));
    }
    for (const dot of dots) {
      const i = 2 * dot.dataset.point;
      dot.setAttribute("cx", scene.points[frame][i]);
      dot.setAttribute("cy", scene.points[frame][i + 1]);
    }
    for (const of of ["points", "nominal"])
      bars[of].forEach((bar, i) => bar.setAttribute("x2",
        scene.middle + scene.half * scene.bars[i][of][frame] / 1000));
    numbers.forEach((number, i) => { number.textContent = scene.bars[i].words[frame]; });
    label.textContent = scene.labels[frame];
    slider.value = frame;
    slider.setAttribute("aria-valuetext", scene.labels[frame]);
  }

  function step(now) {
    if (!playing) return;
    const passed = Math.floor((now - since) / scene.frame);
    if (passed > 0) {
      since += passed * scene.frame;
      show((frame + passed) % (last + 1));
    }
    requestAnimationFrame(step);
  }

  function play(starts) {
    playing = starts;
    button.textContent = starts ? "Pause" : "Play";
    since = performance.now();
    if (starts) requestAnimationFrame(step);
  }

  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); show(Number(slider.value)); });
  addEventListener("beforeprint", () => { play(false); show(scene.start); });
  figure.querySelector(".controls").hidden = false;
  show(frame);
  play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
}
