"use strict";
(() => {
  const film = JSON.parse($("#film").textContent);
  const screen = $("#screen");
  if (!screen) return;
  const brush = screen.getContext("2d", { willReadFrequently: true });
  const [play, scrub, strength, told] = ["#play", "#scrub", "#strength", "#told"].map((s) => $(s));
  const last = film.length - 1;
  let at = 0, map = "", timer = 0;

  // Pictures are decoded when they are first needed, and the ones ahead while there is time.
  const decoded = new Map();
  function picture(uri) {
    if (!decoded.has(uri)) {
      const image = new Image();
      image.src = uri;
      decoded.set(uri, image.decode().then(() => image));
      if (decoded.size > 400) decoded.delete(decoded.keys().next().value);
    }
    return decoded.get(uri);
  }

  async function draw() {
    const frame = film[at];
    const over = map && frame.maps[map];
    let images;
    try {
      images = await Promise.all([frame.picture.uri, ...(over ? [over.uri] : [])].map(picture));
    } catch {
      told.textContent = `Frame ${frame.number} cannot be shown.`;
      return;
    }
    if (frame !== film[at] || over !== (map && film[at].maps[map])) return;
    [screen.width, screen.height] = [frame.picture.width, frame.picture.height];
    brush.drawImage(images[0], 0, 0);
    if (over) {
      brush.globalAlpha = strength.value / 100;
      brush.drawImage(images[1], 0, 0, screen.width, screen.height);
      brush.globalAlpha = 1;
    }
    screen.dataset.shown = frame.number;
    screen.dataset.map = over ? map : "";
  }

  function show(index) {
    at = clamp(index, 0, last);
    const frame = film[at];
    scrub.value = at;
    scrub.setAttribute("aria-valuetext", `frame ${frame.number}`);
    told.textContent = frame.text;
    screen.setAttribute("aria-label", frame.text);
    for (const chart of $$(".chart")) {
      const { low, high } = chart.dataset;
      const cursor = $(".cursor", chart);
      cursor.style.left = `${(100 * (frame.number - low)) / (high - low)}%`;
      cursor.style.display = "block";
    }
    draw();
    picture(film[(at + 1) % film.length].picture.uri).catch(() => {});
  }

  function run(on) {
    clearInterval(timer);
    timer = on ? setInterval(() => show((at + 1) % film.length), 1000 / $("#fps").value) : 0;
    play.textContent = on ? "Pause" : "Play";
    play.setAttribute("aria-pressed", on);
  }

  function go(index) {
    run(false);
    show(index);
  }

  function choose(name) {
    map = name;
    for (const b of $$("#maps button")) b.setAttribute("aria-pressed", b.dataset.map === map);
    for (const p of $$(".meaning")) p.hidden = p.dataset.of !== map;
    draw();
  }

  const choices = $$("#maps button").map((b) => b.dataset.map);
  for (const b of $$("#maps button")) b.addEventListener("click", () => choose(b.dataset.map));
  strength.addEventListener("input", draw);
  play.addEventListener("click", () => run(!timer));
  $("#back").addEventListener("click", () => go(at - 1));
  $("#on").addEventListener("click", () => go(at + 1));
  scrub.addEventListener("input", () => go(+scrub.value));
  $("#fps").addEventListener("change", () => timer && run(true));

  for (const chart of $$(".chart")) {
    $(".canvas", chart).addEventListener("click", (event) => {
      const box = event.currentTarget.getBoundingClientRect();
      const { low, high } = chart.dataset;
      const wanted = +low + ((event.clientX - box.left) / box.width) * (high - low);
      const off = film.map((f) => Math.abs(f.number - wanted));
      go(off.indexOf(Math.min(...off)));
    });
  }

  document.addEventListener("keydown", (event) => {
    if (keyIsTaken(event)) return;
    const step = event.shiftKey ? 10 : 1;
    const keys = {
      ArrowLeft: () => go(at - step),
      ArrowRight: () => go(at + step),
      Home: () => go(0),
      End: () => go(last),
      m: () => choose(choices[(choices.indexOf(map) + 1) % choices.length]),
    };
    // On a button the blank presses it.
    if (!event.target.matches("button")) keys[" "] = () => run(!timer);
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
  show(0);
})();
