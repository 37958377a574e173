"use strict";
(() => {
  // ---- the plots ----------------------------------------------------------------------------
  const details = JSON.parse($("#details").textContent);
  const pictures = JSON.parse($("#pictures").textContent);
  const byId = new Map(details.map((d) => [d.id, d]));
  const points = $$(".point");
  let left = null;

  function element(name, text) {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  function tell(id) {
    const detail = byId.get(id);
    if (!detail) return;
    for (const p of points) p.classList.toggle("chosen", +p.dataset.id === id);
    const list = element("dl");
    for (const [name, value] of detail.figures) {
      const pair = element("div");
      pair.append(element("dt", name), element("dd", value));
      list.append(pair);
    }
    $("#detail").replaceChildren(element("strong", detail.name), list, element("code", detail.command));
    $("#detail").dataset.id = id;
  }

  for (const point of points) {
    const id = +point.dataset.id;
    point.addEventListener("pointerenter", () => tell(id));
    point.addEventListener("focus", () => tell(id));
    point.addEventListener("click", () => {
      tell(id);
      const at = pictures.findIndex((p) => p.id === id);
      if (at >= 0 && left) {
        left.value = at;
        left.dispatchEvent(new Event("change"));
      }
    });
    point.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      // Neighbours in time, in the same plot.
      const all = $$(".point", point.closest(".plot"));
      all.sort((a, b) => parseFloat(a.style.left) - parseFloat(b.style.left));
      all[clamp(all.indexOf(point) + step, 0, all.length - 1)].focus();
    });
  }

  for (const button of $$("button[data-show]")) {
    button.addEventListener("click", () => {
      for (const b of $$("button[data-show]")) b.setAttribute("aria-pressed", b === button);
      for (const p of $$("#plots > div")) p.hidden = p.dataset.of !== button.dataset.show;
    });
  }
  if (details.length) tell(details[0].id);

  // ---- two pictures ---------------------------------------------------------------------------
  const screen = $("#screen");
  if (!screen) return;
  const brush = screen.getContext("2d", { willReadFrequently: true });
  const [right, how, gain, slider, told] = ["#right", "#how", "#gain", "#slider", "#told"].map((s) => $(s));
  left = $("#left");
  for (const select of [left, right]) {
    pictures.forEach((p, i) => select.append(new Option(p.name, i)));
  }
  [left.value, right.value] = [0, 1];

  const decoded = new Map();
  function picture(index) {
    if (!decoded.has(index)) {
      const image = new Image();
      image.src = pictures[index].picture.uri;
      decoded.set(index, image.decode().then(() => image));
    }
    return decoded.get(index);
  }

  // The values of a picture, as 8-bit red, green, blue, alpha.
  function values(image) {
    brush.drawImage(image, 0, 0);
    return brush.getImageData(0, 0, screen.width, screen.height);
  }

  const stops = [[0, 0, 0], [89, 13, 153], [217, 51, 102], [255, 166, 26], [255, 255, 204]];
  function heat(share, out, at) {
    const place = clamp(share, 0, 1) * 4;
    const low = Math.min(Math.floor(place), 3);
    for (let c = 0; c < 3; c++) {
      out[at + c] = stops[low][c] + (place - low) * (stops[low + 1][c] - stops[low][c]);
    }
    out[at + 3] = 255;
  }

  function drawHeat(images) {
    const [a, b] = images.map(values);
    let most = 0, over = 0;
    for (let i = 0; i < a.data.length; i += 4) {
      let off = 0;
      for (let c = 0; c < 3; c++) off = Math.max(off, Math.abs(a.data[i + c] - b.data[i + c]));
      most = Math.max(most, off);
      over += off > 2;
      heat(off / gain.value, a.data, i);
    }
    brush.putImageData(a, 0, 0);
    const share = ((100 * over) / (a.data.length / 4)).toFixed(2);
    told.textContent = `${share} % of the pixels differ by more than 2/255, the furthest by ${most}.`;
  }

  function drawPair(images) {
    const edge = Math.round((screen.width * slider.value) / 100);
    brush.drawImage(images[1], 0, 0);
    if (edge > 0) brush.drawImage(images[0], 0, 0, edge, screen.height, 0, 0, edge, screen.height);
    $("#edge").style.left = `${slider.value}%`;
    told.textContent = `Left: ${pictures[left.value].name}. Right: ${pictures[right.value].name}.`;
  }

  let latest = 0;
  async function draw() {
    const mine = ++latest;
    const images = await Promise.all([+left.value, +right.value].map(picture));
    if (mine !== latest) return;
    const { width, height } = pictures[left.value].picture;
    [screen.width, screen.height] = [width, height];
    const isHeat = how.value === "heat";
    $("#edge").hidden = isHeat;
    $("#gain-label").hidden = !isHeat;
    slider.disabled = isHeat;
    isHeat ? drawHeat(images) : drawPair(images);
    screen.dataset.shown = `${how.value} ${left.value} ${right.value} ${slider.value}`;
  }

  for (const input of [left, right, how, gain]) input.addEventListener("change", draw);
  slider.addEventListener("input", draw);
  function drag(event) {
    if (!event.buttons || how.value === "heat") return;
    const box = screen.getBoundingClientRect();
    slider.value = (100 * (event.clientX - box.left)) / box.width;
    draw();
  }
  $("#stage").addEventListener("pointerdown", drag);
  $("#stage").addEventListener("pointermove", drag);
  document.addEventListener("keydown", (event) => {
    if (keyIsTaken(event) || event.key.toLowerCase() !== "h") return;
    how.value = how.value === "heat" ? "slide" : "heat";
    draw();
  });
  draw();
})();
