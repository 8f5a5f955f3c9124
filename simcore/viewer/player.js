// The controls around one or two stages: time, camera, choice of runs. Every `.replay` of the page becomes a player.
(() => {
  "use strict";
  const replay = (window.simcoreReplay = window.simcoreReplay || {});
  const FIELD_OF_VIEW = 30; // degrees
  const EDGE = 20; // free around what the camera frames [pixel]
  const RATE_WINDOW = 1000; // ms over which frames are counted
  // Levels of fineness: pixels drawn for one of the screen, along each side, and after how many frames the shadow is cast
  // anew, which costs a software renderer half of its time; multisampling would cost it three times as much. What is at rest
  // is drawn at the finest level, what moves at the finest that the machine keeps up with.
  const LEVELS = [[0.7, 4], [1, 4], [1, 1], [1.4, 1], [2, 1]], FIRST = 2, FINEST = LEVELS.length - 1;
  const RATIO_MAX = 2; // pixels drawn for one of CSS, along each side: more is not seen
  const SLOW = 28, FAST = 55; // frames/s below or above which the next is taken
  const REST = 120; // ms without a change
  const VIEWS = {
    front: [1, 0, 0.12], back: [-1, 0, 0.12], side: [0, 1, 0.12], above: [0.001, 0, 1], below: [-0.55, 0.25, -0.75],
  };

  class Player {
    constructor(root) {
      this.root = root;
      this.find = (name) => root.querySelector(`.replay-${name}`);
      this.canvas = this.find("canvas");
      this.stages = [];
      this.time = 0;
      this.playing = false;
      this.drawn = []; // when the last frames were drawn [ms]
      this.level = FIRST;
      this.ceiling = FINEST;
      this.count = 0;
      this.choosers = [...root.querySelectorAll(".replay-run")];
      this.shown = JSON.parse(root.dataset.shown);
      // In a page of other things, a player that nobody has come to costs nothing.
      this.ready = "alone" in root.dataset ? this._start() : this._comesIntoSight().then(() => this._start());
    }

    async _start() {
      if (!this.canvas.getContext("webgl2", { antialias: false, alpha: true }))
        return this._tell("The replay needs WebGL 2, which this browser does not offer.");
      if (!window.DecompressionStream)
        return this._tell("The replay needs a newer browser: from Chrome 80, Firefox 113 or Safari 16.4 on.");
      const style = JSON.parse(document.getElementById("replay-colours").textContent);
      this.table = replay.colourTable(Uint8Array.from(atob(style), (c) => c.charCodeAt(0)));
      this.renderer = new THREE.WebGLRenderer({ canvas: this.canvas, antialias: false, alpha: true });
      this.renderer.shadowMap.enabled = true;
      this.renderer.shadowMap.autoUpdate = false;
      this.renderer.shadowMap.type = THREE.PCFShadowMap;
      this.renderer.setClearAlpha(0);
      this.renderer.autoClear = false;
      this.camera = new THREE.PerspectiveCamera(FIELD_OF_VIEW, 1, 0.05, 60);
      this.camera.up.set(0, 0, 1);
      this.orbit = new THREE.OrbitControls(this.camera, this.canvas);
      this.orbit.addEventListener("change", () => this.draw());
      this._listen();
      this.started = true;
      await this.choose(this.shown);
    }

    _comesIntoSight() {
      return new Promise((seen) => {
        const watch = new IntersectionObserver((entries) => {
          if (!entries.some((entry) => entry.isIntersecting)) return;
          watch.disconnect();
          seen();
        }, { rootMargin: "200px" });
        watch.observe(this.root);
      });
    }

    _tell(message) {
      this.find("message").textContent = message;
      this.find("message").hidden = !message;
    }

    /** Show another run in the first place; if it is beside it already, the two change places. */
    put(id) {
      const [first, second] = this.shown;
      return this.choose(second ? [id, id === second ? first : second] : [id]);
    }

    /** Show one or two runs by their ids, in step. */
    async choose(ids) {
      this.shown = ids.filter(Boolean);
      this.choosers.forEach((each, i) => (each.value = this.shown[i] ?? ""));
      if (!this.started) return;
      this._tell("Loading …");
      const wanted = this.shown;
      const stages = await Promise.all(wanted.map(async (id) => {
        const run = await replay.unpack(id);
        const device = run.device && (await replay.unpack(run.device));
        return new replay.Stage(run, await replay.unpack(run.body), device, this.table);
      }));
      if (wanted !== this.shown) return stages.forEach((stage) => stage.dispose()); // chosen anew meanwhile
      this.stages.forEach((stage) => stage.dispose());
      this.stages = stages;
      const runs = stages.map((stage) => stage.run);
      this.first = Math.min(...runs.map((run) => run.time[0]));
      this.last = Math.max(...runs.map((run) => run.time[run.time.length - 1]));
      this.step = Math.min(...runs.map((run) => (run.time[run.time.length - 1] - run.time[0]) / Math.max(run.time.length - 1, 1))) || 0.04;
      this.outermost = runs.flatMap((run) => run.outermost.map((point) => new THREE.Vector3(...point)));
      Object.assign(this.find("time"), { min: this.first, max: this.last, step: "any" });
      this.find("panes").replaceChildren(...runs.map((run) => this._label(run)));
      for (const button of this.root.querySelectorAll("[data-view]")) button.textContent = runs[0].views[button.dataset.view];
      this._tell("");
      this._theme();
      this.seeThrough(this.find("through").checked);
      this._size();
      const soonest = Math.min(...runs.map((run) => run.time[run.time.length - 1]));
      this.seek(soonest < 0 ? this.first : Math.max(0, this.first)); // a fall amid the settling is seen from its start
      this.view("overview"); // which makes room for the titles that are there by now
    }

    _label(run) {
      const label = document.createElement("div");
      const title = document.createElement("b");
      title.textContent = run.title;
      const verdict = document.createElement("span");
      verdict.className = `replay-verdict ${run.verdict}`;
      verdict.textContent = run.outcome;
      label.append(title, verdict, document.createElement("small"));
      return label;
    }

    /** Show a time [s], 0 when the device starts to move. */
    seek(time) {
      this.time = Math.min(Math.max(time, this.first), this.last);
      this.find("time").value = this.time;
      const text = `${this.time.toFixed(2).replace("-", "−")} s`;
      this.find("clock").textContent = text;
      this.find("phase").textContent = this._phase();
      this.find("time").setAttribute("aria-valuetext", text);
      this.stages.forEach((stage, i) => {
        stage.show(this.time);
        const { run, at } = stage, end = run.time[run.time.length - 1];
        const place = run.places[run.peak_place[at.frame]];
        const pressed = run.peak[at.frame] > 0 ? `highest now ${(run.peak[at.frame] / 1000).toFixed(1)} kPa, ${place}` : "nothing pressed";
        this.find("panes").children[i].lastChild.textContent =
          this.time > end + 1e-6 ? `ended at ${end.toFixed(2).replace("-", "−")} s` : pressed;
      });
      this.draw();
    }

    _phase() {
      const until = Math.max(...this.stages.map((stage) => stage.run.moves_until));
      return this.time < 0 ? "settling" : this.time < until ? "device moves" : "device stands still";
    }

    play(on = true) {
      if (on === this.playing) return;
      if (on && this.time >= this.last - 1e-6) this.seek(this.first);
      this.playing = on;
      this.before = null;
      this.drawn = [];
      this.find("play").setAttribute("aria-pressed", on);
      this.find("play").setAttribute("aria-label", on ? "Pause" : "Play");
      this.draw();
    }

    seeThrough(on) {
      this.find("through").checked = on;
      this.stages.forEach((stage) => stage.seeThrough(on));
      this.draw();
    }

    /** Turn the camera to a view and frame all that the runs ever show. */
    view(name) {
      const { azimuth } = this.stages[0].run;
      const from = name === "overview" ? [Math.cos(azimuth), Math.sin(azimuth), 0.42] : VIEWS[name];
      this.viewed = name;
      const back = new THREE.Vector3(...from).normalize();
      // Below the titles, and above what lies over the picture on a wide screen.
      const [width, height] = this.pane;
      const labels = [...this.find("panes").children];
      const top = Math.max(...labels.map((label) => label.lastChild.offsetTop + label.lastChild.offsetHeight - label.offsetTop));
      const tall = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * (1 - (top + EDGE) / height);
      const wide = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * this.camera.aspect * (1 - (2 * EDGE) / width);
      this.camera.setViewOffset(width, height, 0, (EDGE - top) / 2, width, height);
      const right = new THREE.Vector3().crossVectors(this.camera.up, back).normalize();
      const up = new THREE.Vector3().crossVectors(back, right);
      // |a − x| ≤ slope · (z − d) for every point at (a, d) across and towards the camera, which stands at (x, z): its two
      // sides bound x + slope · z and slope · z − x from below.
      const fit = (axis, slope) => {
        const [more, less] = [1, -1].map((sign) => Math.max(...this.outermost.map((point) => sign * point.dot(axis) + slope * point.dot(back))));
        return { place: (more - less) / 2, distance: (more + less) / (2 * slope) };
      };
      const across = fit(right, wide), along = fit(up, tall);
      const depth = this.outermost.map((point) => point.dot(back));
      const middle = (Math.min(...depth) + Math.max(...depth)) / 2;
      const target = new THREE.Vector3().addScaledVector(right, across.place).addScaledVector(up, along.place).addScaledVector(back, middle);
      const distance = Math.max(across.distance, along.distance) - middle;
      this.camera.position.copy(target).addScaledVector(back, distance);
      this.orbit.target.copy(target);
      this.orbit.update();
      this.draw();
    }

    draw() {
      if (this.waiting || !this.renderer) return;
      this.waiting = true;
      requestAnimationFrame((now) => this._frame(now));
    }

    _frame(now) {
      this.waiting = false;
      if (this.playing) {
        const speed = Number(this.find("speed").value);
        const time = this.time + (this.before === null ? 0 : ((now - this.before) / 1000) * speed);
        this.before = now;
        this.seek(time);
        if (time >= this.last) this.play(false);
        this._rate(now);
      }
      this._render(this.level);
      clearTimeout(this.rest);
      if (this.playing) this.draw();
      else this.rest = setTimeout(() => this._render(FINEST), REST);
    }

    _render(level) {
      if (this.hidden || !this.pane) return;
      const { renderer, stages } = this;
      const [pixels, every] = LEVELS[level];
      const ratio = Math.min(pixels * window.devicePixelRatio, RATIO_MAX);
      if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
      const cast = this.count++ % every === 0;
      renderer.setScissorTest(false);
      renderer.clear();
      renderer.setScissorTest(stages.length > 1);
      const [width, height] = this.pane;
      stages.forEach((stage, i) => {
        const [x, y] = this.stacked ? [0, (stages.length - 1 - i) * height] : [i * width, 0];
        renderer.setViewport(x, y, width, height);
        renderer.setScissor(x, y, width, height);
        renderer.shadowMap.needsUpdate = cast;
        renderer.render(stage.scene, this.camera);
      });
      this._axes();
    }

    /** Draw the world's axes as the camera sees them. */
    _axes() {
      const turn = this.camera.quaternion.clone().invert();
      const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
      this.find("axes").querySelectorAll("g").forEach((group, i) => {
        const { x, y } = new THREE.Vector3(...axes[i]).applyQuaternion(turn);
        const [line, text] = group.children;
        line.setAttribute("x2", 22 * x);
        line.setAttribute("y2", -22 * y);
        text.setAttribute("x", 30 * x);
        text.setAttribute("y", -30 * y);
      });
    }

    _rate(now) {
      this.drawn.push(now);
      while (this.drawn[0] < now - RATE_WINDOW) this.drawn.shift();
      const span = now - this.drawn[0];
      if (span > RATE_WINDOW / 3) {
        this.frameRate = (1000 * (this.drawn.length - 1)) / span;
        this.find("rate").textContent = `${Math.round(this.frameRate)} frames/s`;
        if (span > RATE_WINDOW / 2) this._adapt();
      }
    }

    _adapt() {
      const change = this.frameRate < SLOW ? -1 : this.frameRate > FAST ? 1 : 0;
      const level = Math.min(Math.max(this.level + change, 0), this.ceiling);
      if (change < 0) this.ceiling = level; // never up again to what was too slow
      if (level !== this.level) this.drawn = [];
      this.level = level;
    }

    _size() {
      const { clientWidth: width, clientHeight: height } = this.find("stage");
      if (!width || !height || !this.stages.length) return;
      this.stacked = width < height;
      const count = this.stages.length;
      this.pane = this.stacked ? [width, height / count] : [width / count, height];
      this.find("panes").classList.toggle("stacked", this.stacked);
      this.renderer.setSize(width, height, false);
      this.camera.aspect = this.pane[0] / this.pane[1];
      this.camera.updateProjectionMatrix();
      if (this.viewed) this.view(this.viewed);
    }

    _theme() {
      const style = getComputedStyle(this.root);
      const [grid, edge] = ["grid", "edge"].map((name) => style.getPropertyValue(`--replay-${name}`).trim());
      this.stages.forEach((stage) => stage.colourLines(grid, edge));
      this.draw();
    }

    _listen() {
      const { root } = this, alone = "alone" in root.dataset;
      this.find("play").addEventListener("click", () => this.play(!this.playing));
      this.find("time").addEventListener("input", (event) => this.seek(Number(event.target.value)));
      this.find("through").addEventListener("change", (event) => this.seeThrough(event.target.checked));
      root.querySelectorAll("[data-view]").forEach((each) => each.addEventListener("click", () => this.view(each.dataset.view)));
      this.choosers.forEach((each) => each.addEventListener("change", () => this.choose(this.choosers.map((one) => one.value))));
      (alone ? document : root).addEventListener("keydown", (event) => this._key(event));
      this.orbit.addEventListener("start", () => (this.viewed = null)); // a camera set by hand stays
      if (!alone) {
        this.orbit.enableZoom = false; // scrolling a report past a replay must not zoom it
        this.canvas.style.touchAction = "pan-y";
        this.canvas.addEventListener("pointerdown", () => (this.orbit.enableZoom = true));
        this.canvas.addEventListener("pointerleave", () => (this.orbit.enableZoom = false));
      }
      new ResizeObserver(() => this._size()).observe(this.find("stage"));
      new IntersectionObserver(([entry]) => {
        this.hidden = !entry.isIntersecting;
        this.draw();
      }).observe(this.canvas);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this._theme());
    }

    _key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select")) return;
      const steps = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (steps) {
        this.play(false);
        this.seek(this.time + steps * this.step * (event.shiftKey ? 10 : 1));
      } else if (event.key === "Home" || event.key === "End") this.seek(event.key === "Home" ? this.first : this.last);
      else if (event.key === " " && !event.target.closest("button, input[type=checkbox], a, summary")) this.play(!this.playing);
      else return;
      event.preventDefault();
    }
  }

  document.querySelectorAll(".replay").forEach((root) => {
    root.player = new Player(root);
    root.player.ready.catch((error) => root.player._tell(`The replay failed: ${error.message}`));
  });
})();
