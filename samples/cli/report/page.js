"use strict";
// Viewers of images: values are half floats in planes (see images.rs), unpacked here and shown on a canvas.
(() => {
  const HALF = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const exponent = bits >> 10 & 31, fraction = bits & 1023, sign = bits & 32768 ? -1 : 1;
    HALF[bits] = sign * (exponent === 31 ? (fraction ? NaN : Infinity)
      : exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -14 * fraction / 1024);
  }
  const srgb = x => x <= 0 || x !== x ? 0 : x >= 1 ? 255
    : Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  const tables = new Map();
  const table = factor => {
    if (!tables.has(factor)) tables.set(factor, Uint8Array.from(HALF, value => srgb(value * factor)));
    return tables.get(factor);
  };

  async function unpack(text, width, height) {
    const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const count = width * height * 3, row = width * 3, values = new Uint16Array(count);
    for (let plane = 0; plane < 2; plane++) {
      for (let i = 0, at = plane * count; i < count; i++, at++) {
        if (i % row >= 3) bytes[at] = bytes[at] + bytes[at - 3];
        values[i] |= plane ? bytes[at] : bytes[at] << 8;
      }
    }
    return values;
  }

  const element = (tag, attributes, ...children) => {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes || {})) {
      if (name === "class") node.className = value; else if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
      else node.setAttribute(name, value);
    }
    node.append(...children);
    return node;
  };
  const shown = x => {
    const size = Math.abs(x);
    if (!Number.isFinite(x) || x === 0) return String(x);
    return size >= 1e5 || size < 1e-3 ? x.toExponential(2) : size >= 999.5 ? String(+x.toPrecision(3)) : x.toPrecision(3);
  };
  const GAINS = [1, 4, 16, 64];

  class Viewer {
    constructor(root) {
      this.root = root;
      this.width = +root.dataset.width;
      this.height = +root.dataset.height;
      this.scripts = [...root.querySelectorAll("script[data-name]")];
      this.names = this.scripts.map(script => script.dataset.name);
      this.base = +root.dataset.exposure;
      this.state = { mode: this.names.length > 1 ? "split" : "flip", a: 0, b: Math.min(1, this.names.length - 1), second: false, ev: 0, gain: 1, split: 0.5, zoom: 0, x: 0, y: 0, pixel: null };
      this.cache = new Map();
      this.build();
    }

    async load() {
      const values = [];
      for (const script of this.scripts) values.push(await unpack(script.textContent, this.width, this.height));
      this.values = values;
      this.root.dataset.ready = "true";
      this.draw();
    }

    build() {
      const several = this.names.length > 1;
      const button = (label, text, action, attributes) => element("button", { type: "button", title: text, "aria-label": text, onclick: () => { action(); this.draw(); }, ...attributes }, label);
      const choice = (label, key, chosen) => {
        const select = element("select", { "aria-label": label, onchange: () => { this.state[key] = +select.value; this.draw(); } },
          ...this.names.map((name, i) => element("option", { value: i }, name)));
        select.value = chosen;
        this[`${key}Select`] = select;
        return select;
      };
      this.modes = {};
      const mode = (key, text, help) => this.modes[key] = button(text, help, () => this.setMode(key), { "data-mode": key });
      const first = element("div", { class: "bar" });
      if (several) {
        first.append(
          element("span", { class: "seg", role: "group", "aria-label": "How images are compared" },
            mode("flip", "Flip", "Flip between A and B (F)"), mode("split", "Split", "Split: A to the left, B to the right (S)"),
            mode("difference", "Difference", "Absolute difference of A and B (D)")),
          element("span", { class: "group" }, "A", choice("Image A", "a", this.state.a)),
          element("span", { class: "group" }, "B", choice("Image B", "b", this.state.b)),
          this.swapButton = button("A ⇄ B", "Show the other image (space)", () => this.flip(), { "data-do": "flip" }));
      }
      this.evText = element("output", { class: "state" });
      this.zoomText = element("output", { class: "state" });
      this.gainGroup = element("span", { class: "group" }, "difference", this.gainButton = button("×1", "Amplify the difference (G)", () => this.gain(), { "data-do": "gain" }));
      const second = element("div", { class: "bar" },
        element("span", { class: "group" }, "exposure", button("−", "Darker by a stop ([)", () => this.expose(-1)), this.evText, button("+", "Brighter by a stop (])", () => this.expose(1))),
        element("span", { class: "group" }, "zoom", button("−", "Zoom out (-)", () => this.zoomBy(-1)), this.zoomText, button("+", "Zoom in (+)", () => this.zoomBy(1), { "data-do": "zoom-in" }), button("Fit", "Show all (0)", () => this.fit(), { "data-do": "fit" })),
        ...(several ? [this.gainGroup] : []),
        this.largeButton = button("Enlarge", "Fill the window (E)", () => this.enlarge(), { "aria-pressed": "false" }));
      this.canvas = element("canvas", { "aria-hidden": "true" });
      this.tagA = element("span", { class: "tag a" });
      this.tagB = element("span", { class: "tag b" });
      const help = "Arrow keys move the divider in split mode, else the pixel cursor; shift and arrow keys pan.";
      this.stage = element("div", { class: "stage", tabindex: "0", role: "application", "aria-roledescription": "image viewer", "aria-label": `${this.names.join(", ")}. ${help}`, style: `aspect-ratio: ${this.width} / ${this.height}` }, this.canvas, this.tagA, this.tagB);
      this.readout = element("div", { class: "bar values" });
      this.said = element("span", { role: "status", "aria-live": "polite", style: "position:absolute;clip-path:inset(50%);width:1px;height:1px;overflow:hidden" });
      const key = (...names) => element("span", {}, ...names.flatMap((name, i) => i ? [" ", element("kbd", {}, name)] : [element("kbd", {}, name)]));
      const keys = element("details", {}, element("summary", {}, "Mouse and keys"),
        "Drag the divider, or drag to pan; the wheel zooms. ", key("F", "S", "D"), " mode, ", key("space"), " flip, ", key("1", "…", "9"), " choose A, with ", key("shift"), " B, ",
        key("+", "−", "0"), " zoom, ", key("[", "]"), " exposure, ", key("G"), " amplify the difference, ", key("E"), " enlarge, ", key("←", "→", "↑", "↓"), " move divider or pixel cursor, with ", key("shift"), " pan.");
      this.root.append(first, this.stage, this.readout, second, keys, this.said);
      if (!several) first.remove();
      this.listen();
      new ResizeObserver(() => this.draw()).observe(this.stage);
    }

    listen() {
      let drag = null;
      const place = event => { const box = this.stage.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
      const nearSplit = x => this.state.mode === "split" && Math.abs(x - this.state.split * this.stage.clientWidth) < 14;
      this.stage.addEventListener("pointerdown", event => {
        if (event.button) return;
        const [x, y] = place(event);
        drag = { split: nearSplit(x) || (this.state.mode === "split" && !this.state.zoom), x, y };
        this.stage.setPointerCapture(event.pointerId);
        if (drag.split) { this.setSplit(x); this.draw(); }
      });
      this.stage.addEventListener("pointermove", event => {
        const [x, y] = place(event);
        if (drag?.split) this.setSplit(x);
        else if (drag) { this.pan(drag.x - x, drag.y - y); [drag.x, drag.y] = [x, y]; }
        this.stage.style.cursor = nearSplit(x) || drag?.split ? "ew-resize" : drag ? "grabbing" : "crosshair";
        this.state.pixel = this.pixelAt(x, y);
        this.draw();
      });
      const end = () => { drag = null; };
      this.stage.addEventListener("pointerup", end);
      this.stage.addEventListener("pointercancel", end);
      this.stage.addEventListener("pointerleave", () => { if (!drag) { this.state.pixel = null; this.draw(); } });
      this.stage.addEventListener("wheel", event => {
        event.preventDefault();
        const [x, y] = place(event);
        this.zoomBy(event.deltaY < 0 ? 1 : -1, x, y);
        this.draw();
      }, { passive: false });
      this.stage.addEventListener("keydown", event => { if (this.key(event)) { event.preventDefault(); this.draw(); } });
      this.root.addEventListener("keydown", event => { if (event.key === "Escape" && this.root.classList.contains("large")) { this.enlarge(); this.draw(); } });
    }

    key(event) {
      if (event.ctrlKey || event.altKey || event.metaKey) return false;
      const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
      const arrow = arrows[event.key];
      const digit = /^Digit([1-9])$/.exec(event.code);
      if (arrow && event.shiftKey) this.pan(arrow[0] * 40, arrow[1] * 40);
      else if (arrow && this.state.mode === "split" && arrow[0]) this.setSplit((this.state.split + arrow[0] * 0.02) * this.stage.clientWidth);
      else if (arrow) this.cursor(arrow);
      else if (digit && +digit[1] <= this.names.length) this.state[event.shiftKey ? "b" : "a"] = digit[1] - 1;
      else switch (event.key.toLowerCase()) {
        case "f": this.setMode("flip"); break;
        case "s": this.setMode("split"); break;
        case "d": this.setMode("difference"); break;
        case "g": this.gain(); break;
        case "e": this.enlarge(); break;
        case " ": this.flip(); break;
        case "+": case "=": this.zoomBy(1); break;
        case "-": this.zoomBy(-1); break;
        case "0": this.fit(); break;
        case "[": this.expose(-1); break;
        case "]": this.expose(1); break;
        default: return false;
      }
      return true;
    }

    setMode(mode) { if (this.names.length > 1) { this.state.mode = mode; this.state.second = false; } }
    flip() { if (this.names.length < 2) return; if (this.state.mode !== "flip") this.setMode("flip"); else this.state.second = !this.state.second; }
    gain() { this.state.gain = GAINS[(GAINS.indexOf(this.state.gain) + 1) % GAINS.length]; }
    expose(stops) { this.state.ev = Math.max(-12, Math.min(12, this.state.ev + stops)); }
    enlarge() { const on = this.root.classList.toggle("large"); this.largeButton.setAttribute("aria-pressed", on); this.largeButton.textContent = on ? "Shrink" : "Enlarge"; }
    setSplit(x) { this.state.split = Math.max(0, Math.min(1, x / this.stage.clientWidth)); }

    // Screen pixels of an image pixel when everything is shown.
    fitScale() { return Math.min(this.stage.clientWidth / this.width, this.stage.clientHeight / this.height) || 1; }
    scale() { return this.state.zoom || this.fitScale(); }
    // Screen position of the image's corner.
    corner() {
      const scale = this.scale(), { clientWidth: w, clientHeight: h } = this.stage;
      return [(w - this.width * scale) / 2 - this.state.x * scale, (h - this.height * scale) / 2 - this.state.y * scale];
    }
    pixelAt(x, y) {
      const scale = this.scale(), [left, top] = this.corner(), px = Math.floor((x - left) / scale), py = Math.floor((y - top) / scale);
      return px >= 0 && py >= 0 && px < this.width && py < this.height ? [px, py] : null;
    }
    pan(dx, dy) {
      if (!this.state.zoom) return;
      const limit = (value, size) => Math.max(-size / 2, Math.min(size / 2, value));
      this.state.x = limit(this.state.x + dx / this.scale(), this.width);
      this.state.y = limit(this.state.y + dy / this.scale(), this.height);
    }
    fit() { Object.assign(this.state, { zoom: 0, x: 0, y: 0 }); }
    zoomBy(step, x = this.stage.clientWidth / 2, y = this.stage.clientHeight / 2) {
      const before = this.scale(), fit = this.fitScale(), levels = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32].filter(level => level > fit * 1.05);
      const next = step > 0 ? levels.find(level => level > before * 1.01) : levels.filter(level => level < before * 0.99).pop();
      if (!next) { if (step < 0) this.fit(); return; }
      const [left, top] = this.corner(), u = (x - left) / before, v = (y - top) / before;
      this.state.zoom = next;
      // The point under the mouse stays.
      this.state.x = this.width === 0 ? 0 : u - this.width / 2 - (x - this.stage.clientWidth / 2) / next;
      this.state.y = v - this.height / 2 - (y - this.stage.clientHeight / 2) / next;
      this.pan(0, 0);
    }
    cursor([dx, dy]) {
      const [x, y] = this.state.pixel || [this.width >> 1, this.height >> 1];
      this.state.pixel = [Math.max(0, Math.min(this.width - 1, x + dx)), Math.max(0, Math.min(this.height - 1, y + dy))];
      this.said.textContent = this.lines().join("; ");
    }

    // One image as a bitmap on a canvas of its own; `b` is subtracted if given.
    bitmap(a, b) {
      const factor = 2 ** (this.base + this.state.ev) * (b === undefined ? 1 : this.state.gain), key = `${a},${b},${factor}`;
      if (this.cache.has(key)) return this.cache.get(key);
      const canvas = element("canvas", { width: this.width, height: this.height });
      const context = canvas.getContext("2d"), image = context.createImageData(this.width, this.height);
      const lut = table(factor), one = this.values[a], other = this.values[b];
      for (let i = 0, to = 0; i < one.length; i += 3, to += 4) {
        for (let c = 0; c < 3; c++) image.data[to + c] = b === undefined ? lut[one[i + c]] : srgb(Math.abs(HALF[one[i + c]] - HALF[other[i + c]]) * factor);
        image.data[to + 3] = 255;
      }
      context.putImageData(image, 0, 0);
      if (this.cache.size > 12) this.cache.clear();
      this.cache.set(key, canvas);
      return canvas;
    }

    draw() {
      const { mode, a, b, second, split } = this.state;
      for (const [key, button] of Object.entries(this.modes)) button.setAttribute("aria-pressed", key === mode);
      if (this.aSelect) { this.aSelect.value = a; this.bSelect.value = b; }
      this.gainGroup.style.display = mode === "difference" ? "" : "none";
      this.gainButton.textContent = `×${this.state.gain}`;
      const ev = this.base + this.state.ev;
      this.evText.textContent = `${ev > 0 ? "+" : ev < 0 ? "−" : ""}${+Math.abs(ev).toFixed(1)} EV`;
      this.zoomText.textContent = this.state.zoom ? `${this.state.zoom}:1` : "fit";
      Object.assign(this.stage.dataset, { mode, shown: second ? b : a, split: split.toFixed(3), zoom: this.state.zoom || "fit" });
      if (!this.values) return;
      const ratio = window.devicePixelRatio || 1, w = Math.round(this.stage.clientWidth * ratio), h = Math.round(this.stage.clientHeight * ratio);
      if (this.canvas.width !== w || this.canvas.height !== h) [this.canvas.width, this.canvas.height] = [w, h];
      const context = this.canvas.getContext("2d"), scale = this.scale(), [left, top] = this.corner();
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, w, h);
      context.setTransform(ratio, 0, 0, ratio, 0, 0);
      context.imageSmoothingEnabled = scale * ratio < 1;
      context.imageSmoothingQuality = "high";
      const put = bitmap => context.drawImage(bitmap, left, top, this.width * scale, this.height * scale);
      const at = split * this.stage.clientWidth;
      if (mode === "difference") put(this.bitmap(a, b));
      else put(this.bitmap(mode === "flip" && second ? b : a));
      if (mode === "split") {
        context.save();
        context.beginPath();
        context.rect(at, 0, this.stage.clientWidth - at, this.stage.clientHeight);
        context.clip();
        put(this.bitmap(b));
        context.restore();
        context.fillStyle = "rgba(0,0,0,.55)"; context.fillRect(at - 2, 0, 4, this.stage.clientHeight);
        context.fillStyle = "#fff"; context.fillRect(at - 1, 0, 2, this.stage.clientHeight);
        const middle = this.stage.clientHeight / 2;
        context.beginPath(); context.arc(at, middle, 11, 0, 7); context.fill();
        context.strokeStyle = "#333"; context.lineWidth = 2; context.stroke();
        context.fillStyle = "#333"; context.beginPath();
        for (const side of [-1, 1]) { context.moveTo(at + side * 8, middle); context.lineTo(at + side * 3, middle - 4); context.lineTo(at + side * 3, middle + 4); }
        context.fill();
      }
      const pixel = this.state.pixel;
      if (pixel && scale >= 3) {
        context.strokeStyle = "#000"; context.lineWidth = 3; context.strokeRect(left + pixel[0] * scale, top + pixel[1] * scale, scale, scale);
        context.strokeStyle = "#fff"; context.lineWidth = 1; context.strokeRect(left + pixel[0] * scale, top + pixel[1] * scale, scale, scale);
      } else if (pixel && document.activeElement === this.stage) {
        const x = left + (pixel[0] + 0.5) * scale, y = top + (pixel[1] + 0.5) * scale;
        for (const [colour, width] of [["#000", 3], ["#fff", 1]]) {
          context.strokeStyle = colour; context.lineWidth = width; context.beginPath();
          for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) { context.moveTo(x + dx * 3, y + dy * 3); context.lineTo(x + dx * 9, y + dy * 9); }
          context.stroke();
        }
      }
      const name = index => `${this.names.length > 1 ? (index === a && !(mode === "flip" && second) ? "A: " : "B: ") : ""}${this.names[index]}`;
      this.tagA.textContent = mode === "difference" ? `|A − B| × ${this.state.gain}` : name(mode === "flip" && second ? b : a);
      this.tagB.textContent = mode === "split" ? `B: ${this.names[b]}` : "";
      this.tagB.style.display = mode === "split" ? "" : "none";
      this.read();
    }

    // What is known of the pixel under the cursor, as text.
    lines() {
      const [x, y] = this.state.pixel, at = (y * this.width + x) * 3;
      return [`pixel ${x}, ${y}`, ...this.names.map((name, i) => `${name}: ${[0, 1, 2].map(c => shown(HALF[this.values[i][at + c]])).join(" ")}`)];
    }

    read() {
      if (!this.state.pixel) { this.readout.replaceChildren(element("span", {}, "Values of the pixel under the cursor stand here: linear R G B.")); return; }
      const [x, y] = this.state.pixel, at = (y * this.width + x) * 3, lut = table(2 ** (this.base + this.state.ev));
      this.readout.replaceChildren(...this.lines().map((line, i) => {
        if (!i) return element("span", {}, line);
        const rgb = [0, 1, 2].map(c => lut[this.values[i - 1][at + c]]);
        return element("span", {}, element("span", { class: "swatch", style: `background: rgb(${rgb.join(" ")})` }), line);
      }));
    }
  }

  const viewers = [...document.querySelectorAll(".viewer")].map(root => new Viewer(root));
  (async () => { for (const viewer of viewers) await viewer.load(); document.documentElement.dataset.ready = "true"; })();
})();
