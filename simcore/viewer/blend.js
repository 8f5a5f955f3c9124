// Linear-blend skinning (Eq. 3 of docs/physics.md) on the processor: a vertex is blended once a frame, not once for each
// triangle and each pass, which a software renderer would do with its slow look-ups of bones.
(() => {
  "use strict";
  const replay = (window.simcoreReplay = window.simcoreReplay || {});
  const INFLUENCES = 4;

  /** Poses a geometry by bones that now stand in its rest pose. */
  class Blend {
    constructor(body, geometry, bones) {
      this.bones = bones;
      this.binds = bones.map((bone) => bone.matrixWorld.clone().invert());
      this.moves = new Float32Array(12 * bones.length); // rows of each bone's way from the rest pose
      this.segments = body.segments;
      this.weights = Float32Array.from(body.weights, (share) => share / 65535);
      this.rest = geometry.attributes.position.array.slice();
      this.restNormal = geometry.attributes.normal.array.slice();
      this.position = geometry.attributes.position;
      this.normal = geometry.attributes.normal;
    }

    pose() {
      const { moves, segments, weights, rest, restNormal } = this;
      const position = this.position.array, normal = this.normal.array;
      const matrix = new THREE.Matrix4();
      this.bones.forEach((bone, i) => {
        const e = matrix.multiplyMatrices(bone.matrixWorld, this.binds[i]).elements;
        for (let row = 0; row < 3; row++)
          for (let column = 0; column < 4; column++) moves[12 * i + 4 * row + column] = e[4 * column + row];
      });
      for (let i = 0, k = 0; k < rest.length; i += INFLUENCES, k += 3) {
        const x = rest[k], y = rest[k + 1], z = rest[k + 2];
        const u = restNormal[k], v = restNormal[k + 1], w = restNormal[k + 2];
        let px = 0, py = 0, pz = 0, nx = 0, ny = 0, nz = 0;
        for (let j = i; j < i + INFLUENCES && weights[j] > 0; j++) { // the heaviest comes first
          const a = weights[j], m = 12 * segments[j];
          px += a * (moves[m] * x + moves[m + 1] * y + moves[m + 2] * z + moves[m + 3]);
          py += a * (moves[m + 4] * x + moves[m + 5] * y + moves[m + 6] * z + moves[m + 7]);
          pz += a * (moves[m + 8] * x + moves[m + 9] * y + moves[m + 10] * z + moves[m + 11]);
          nx += a * (moves[m] * u + moves[m + 1] * v + moves[m + 2] * w);
          ny += a * (moves[m + 4] * u + moves[m + 5] * v + moves[m + 6] * w);
          nz += a * (moves[m + 8] * u + moves[m + 9] * v + moves[m + 10] * w);
        }
        position[k] = px, position[k + 1] = py, position[k + 2] = pz;
        normal[k] = nx, normal[k + 1] = ny, normal[k + 2] = nz; // the shader makes it a unit vector
      }
      this.position.needsUpdate = this.normal.needsUpdate = true;
    }
  }

  replay.Blend = Blend;
})();
