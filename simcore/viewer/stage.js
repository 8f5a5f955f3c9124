// One run as a three.js scene: body on its bones, device, sheet, ground. World axes: x forward, y left, z up [m].
(() => {
  "use strict";
  const replay = (window.simcoreReplay = window.simcoreReplay || {});
  const UP = new THREE.Vector3(0, 0, 1);
  const COLOURS = { device: 0x668da3, bed: 0xa8b0b8, bar: 0x668da3, strap: 0xdb9438, sheet: 0x338c80 };
  const SEEN_THROUGH = 0.38; // opacity
  const SHARP = 35; // degrees between faces, from which an edge is drawn
  const TUBE_SIDES = 12;
  const GRID_STEP = 0.5;
  const SHADOW_PIXELS = 1024;

  /** Where a time lies between two frames. */
  function between(times, time) {
    let low = 0, high = times.length - 1;
    if (time <= times[0]) return { frame: 0, next: 0, share: 0 };
    if (time >= times[high]) return { frame: high, next: high, share: 0 };
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    return { frame: low, next: high, share: (time - times[low]) / (times[high] - times[low]) };
  }

  /** Both corners of the box around points. */
  replay.boundsOf = (points) => [Math.min, Math.max].map((end) => [0, 1, 2].map((axis) => end(...points.map((point) => point[axis]))));

  /** A texture of 256 colours, sRGB, for shares of the scale. */
  replay.colourTable = (rgba) => {
    const table = new THREE.DataTexture(rgba, 256, 1, THREE.RGBAFormat);
    table.colorSpace = THREE.SRGBColorSpace;
    table.minFilter = table.magFilter = THREE.LinearFilter;
    table.needsUpdate = true;
    return table;
  };

  function skinMaterial(table) {
    const material = new THREE.MeshLambertMaterial({ color: 0xffffff });
    material.onBeforeCompile = (shader) => {
      shader.uniforms.table = { value: table };
      shader.vertexShader = "attribute float pressure;\nvarying float vPressure;\n" + shader.vertexShader
        .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPressure = pressure;");
      shader.fragmentShader = "uniform sampler2D table;\nvarying float vPressure;\n" + shader.fragmentShader
        .replace("#include <color_fragment>", "diffuseColor.rgb = texture2D(table, vec2((vPressure * 255.0 + 0.5) / 256.0, 0.5)).rgb;");
    };
    return material;
  }

  /** Cloth whose outer side is drawn nearer by the depth to which it is pressed into flesh, so that no bare skin shows through. */
  function sheetMaterial(depth) {
    const material = new THREE.MeshLambertMaterial({ color: COLOURS.sheet, side: THREE.DoubleSide });
    material.onBeforeCompile = (shader) => {
      shader.uniforms.pressedIn = { value: depth };
      shader.vertexShader = "uniform float pressedIn;\n" + shader.vertexShader.replace("#include <project_vertex>", `#include <project_vertex>
        if (dot(transformedNormal, mvPosition.xyz) > 0.0) {
          vec4 nearer = projectionMatrix * (mvPosition + vec4(0.0, 0.0, pressedIn, 0.0));
          gl_Position.z = nearer.z / nearer.w * gl_Position.w;
        }`);
    };
    return material;
  }

  function geometryOf(mesh) {
    const geometry = new THREE.BufferGeometry();
    const position = Float32Array.from(mesh.position, (steps) => steps * mesh.quantum);
    geometry.setAttribute("position", new THREE.BufferAttribute(position, 3));
    geometry.setIndex(new THREE.BufferAttribute(mesh.faces, 1));
    geometry.computeVertexNormals();
    return geometry;
  }

  function tube(radius, colour) {
    const geometry = new THREE.CylinderGeometry(radius, radius, 1, TUBE_SIDES);
    geometry.translate(0, 0.5, 0).rotateX(Math.PI / 2); // from the origin along +z
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: colour }));
    mesh.castShadow = true;
    return mesh;
  }

  function lay(mesh, start, end) {
    const along = new THREE.Vector3().subVectors(end, start);
    const length = Math.max(along.length(), 1e-6);
    mesh.position.copy(start);
    mesh.quaternion.setFromUnitVectors(UP, along.divideScalar(length));
    mesh.scale.set(1, 1, length);
  }

  /** A run made ready to be drawn; `show` poses it at a time. */
  class Stage {
    constructor(run, body, device, table) {
      this.run = run;
      this.bounds = replay.boundsOf(run.outermost);
      this.scene = new THREE.Scene();
      this.seenThrough = [];
      this._body(body, table);
      this.carrier = new THREE.Group(); // device or spreader bar
      this.scene.add(this.carrier);
      if (device) this._device(device);
      if (run.bed) this._bed(run.bed);
      for (const [start, end] of run.bar) {
        const each = tube(0.018, COLOURS.bar);
        lay(each, new THREE.Vector3(...start), new THREE.Vector3(...end));
        this.carrier.add(each);
      }
      this.strapCount = run.straps.length / (6 * run.time.length);
      this.straps = Array.from({ length: this.strapCount }, () => tube(0.007, COLOURS.strap));
      for (const strap of this.straps) this.scene.add(strap);
      if (run.sheet) this._sheet();
      this._ground();
      this._light();
    }

    _body(body, table) {
      const geometry = geometryOf(body);
      this.pressure = new THREE.BufferAttribute(new Uint8Array(body.position.length / 3), 1, true);
      geometry.setAttribute("pressure", this.pressure);
      this.bones = body.parents.map((above, i) => {
        const bone = new THREE.Group();
        bone.position.fromArray(body.offset, 3 * i);
        bone.quaternion.fromArray(body.rest, 4 * i);
        return bone;
      });
      body.parents.forEach((above, i) => above >= 0 && this.bones[above].add(this.bones[i]));
      this.skin = new THREE.Mesh(geometry, skinMaterial(table));
      this.skin.castShadow = this.skin.receiveShadow = true;
      this.skin.frustumCulled = false;
      this.scene.add(this.bones[0], this.skin);
      this.bones[0].updateMatrixWorld(true);
      this.blend = new replay.Blend(body, geometry, this.bones);
    }

    _device(device) {
      const material = new THREE.MeshLambertMaterial({ color: COLOURS.device });
      const mesh = new THREE.Mesh(geometryOf(device), material);
      this.edges = new THREE.LineSegments(new THREE.EdgesGeometry(mesh.geometry, SHARP), new THREE.LineBasicMaterial());
      mesh.castShadow = true;
      this.carrier.add(mesh, this.edges);
      this.seenThrough.push(material);
    }

    _bed([low, high]) {
      const size = new THREE.Vector3(...high).sub(new THREE.Vector3(...low));
      const geometry = new THREE.BoxGeometry(size.x, size.y, size.z);
      const bed = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: COLOURS.bed }));
      bed.position.set(...low).addScaledVector(size, 0.5);
      bed.receiveShadow = bed.castShadow = true;
      this.scene.add(bed);
      this.seenThrough.push(bed.material);
    }

    _sheet() {
      const { vertices, pressed_in } = this.run.sheet;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(3 * vertices), 3));
      geometry.setIndex(new THREE.BufferAttribute(this.run.sheet_faces, 1));
      this.sheet = new THREE.Mesh(geometry, sheetMaterial(pressed_in));
      this.sheet.castShadow = true;
      this.sheet.frustumCulled = false;
      this.scene.add(this.sheet);
      this.seenThrough.push(this.sheet.material);
    }

    /** A floor that only takes shadows, seen from above alone, and a grid that fades out. */
    _ground() {
      const [low, high] = this.bounds;
      const x = Math.round((low[0] + high[0]) / 2 / GRID_STEP) * GRID_STEP;
      const y = Math.round((low[1] + high[1]) / 2 / GRID_STEP) * GRID_STEP;
      const reach = Math.ceil(Math.max(high[0] - low[0], high[1] - low[1]) / GRID_STEP + 1) * GRID_STEP;
      const shadow = new THREE.Mesh(new THREE.PlaneGeometry(2 * reach, 2 * reach), new THREE.ShadowMaterial({ opacity: 0.22 }));
      shadow.position.set(x, y, low[2] - 0.003);
      shadow.receiveShadow = true;
      shadow.renderOrder = -2;
      const points = [], alpha = [];
      const add = (u, v) => {
        points.push(x + u, y + v, low[2] - 0.002);
        alpha.push(1, 1, 1, Math.max(0, 1 - Math.hypot(u, v) / reach) ** 1.5);
      };
      for (let line = -reach; line <= reach + 1e-9; line += GRID_STEP)
        for (let at = -reach; at < reach - 1e-9; at += GRID_STEP / 2) {
          add(line, at), add(line, at + GRID_STEP / 2);
          add(at, line), add(at + GRID_STEP / 2, line);
        }
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
      geometry.setAttribute("color", new THREE.BufferAttribute(new Float32Array(alpha), 4));
      this.grid = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, depthWrite: false }));
      this.grid.renderOrder = -1;
      this.scene.add(shadow, this.grid);
    }

    _light() {
      const [low, high] = this.bounds.map((corner) => new THREE.Vector3(...corner));
      const centre = new THREE.Vector3().addVectors(low, high).divideScalar(2);
      const reach = low.distanceTo(high) / 2;
      const key = new THREE.DirectionalLight(0xffffff, 1.5);
      key.position.copy(centre).add(new THREE.Vector3(0.35, 0.45, 1).normalize().multiplyScalar(3 * reach));
      key.target.position.copy(centre);
      key.castShadow = true;
      key.shadow.mapSize.set(SHADOW_PIXELS, SHADOW_PIXELS);
      key.shadow.bias = -0.002;
      key.shadow.normalBias = 0.012;
      Object.assign(key.shadow.camera, { left: -reach, right: reach, bottom: -reach, top: reach, near: reach, far: 5 * reach });
      const sky = new THREE.HemisphereLight(0xffffff, 0xc9c4bd, 2.1);
      sky.position.set(0, 0, 1); // its up is y by default
      this.scene.add(sky, key, key.target);
    }

    colourLines(grid, edge) {
      this.grid.material.color.set(grid);
      this.edges?.material.color.set(edge);
    }

    seeThrough(on) {
      for (const material of this.seenThrough) {
        Object.assign(material, { transparent: on, opacity: on ? SEEN_THROUGH : 1, depthWrite: !on });
        material.needsUpdate = true;
      }
    }

    /** Pose everything at a time [s], straight between the two frames around it. */
    show(time) {
      const { run } = this;
      const { frame, next, share } = (this.at = between(run.time, time));
      const mix = (values, i, size) => values[frame * size + i] * (1 - share) + values[next * size + i] * share;
      this.bones[0].position.set(mix(run.root, 0, 3), mix(run.root, 1, 3), mix(run.root, 2, 3));
      const turn = (object, values, i, size) =>
        object.quaternion.set(mix(values, i, size), mix(values, i + 1, size), mix(values, i + 2, size), mix(values, i + 3, size)).normalize();
      this.bones.forEach((bone, i) => turn(bone, run.joints, 4 * i, 4 * this.bones.length));
      this.bones[0].updateMatrixWorld(true);
      this.blend.pose();
      this.carrier.position.set(mix(run.device_position, 0, 3), mix(run.device_position, 1, 3), mix(run.device_position, 2, 3));
      turn(this.carrier, run.device_turn, 0, 4);
      const count = run.touched.length;
      for (let i = 0; i < count; i++) this.pressure.array[run.touched[i]] = mix(run.pressure, i, count) + 0.5;
      this.pressure.needsUpdate = true;
      const size = 6 * this.strapCount;
      this.straps.forEach((strap, s) => {
        const [a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5].map((i) => mix(run.straps, 6 * s + i, size));
        lay(strap, new THREE.Vector3(a, b, c), new THREE.Vector3(d, e, f));
      });
      if (this.sheet) {
        const { array } = this.sheet.geometry.attributes.position;
        for (let i = 0; i < array.length; i++) array[i] = mix(run.shapes, i, array.length) * run.sheet.quantum;
        this.sheet.geometry.attributes.position.needsUpdate = true;
        this.sheet.geometry.computeVertexNormals();
      }
    }

    /** Where each segment's joint is, world frame [m]. */
    jointPositions() {
      return this.bones.map((bone) => new THREE.Vector3().setFromMatrixPosition(bone.matrixWorld).toArray());
    }

    dispose() {
      this.scene.traverse((object) => {
        object.geometry?.dispose();
        object.material?.dispose();
        object.shadow?.dispose();
      });
    }
  }

  replay.Stage = Stage;
})();
