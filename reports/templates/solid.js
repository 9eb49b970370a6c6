// The tooth in 3D: rays through the density, drawn with WebGL 2.

const BRICK = 8;
/** Radius of the ring around a place, mm; as in the shader. */
const RING = 0.35;
/** Depth of the picture before and behind its middle, mm; as in the shader. */
const REACH = 200;

const VERTEX = `#version 300 es
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  place = corner;
  gl_Position = vec4(corner, 0.0, 1.0);
}`;

/** Right and upward directions of a view from each side, in tooth space; as in the program's own pictures. */
const SIDES = {
  occlusal: [[0, -1, 0], [1, 0, 0]],
  buccal: [[0, 1, 0], [0, 0, 1]],
  lingual: [[0, -1, 0], [0, 0, 1]],
  mesial: [[1, 0, 0], [0, 0, 1]],
  distal: [[-1, 0, 0], [0, 0, 1]],
  apical: [[0, 1, 0], [1, 0, 0]],
};

/** Directions that are tried to look at a place, evenly spread (Fibonacci's spiral). */
const VIEWS = Array.from({ length: 400 }, (_, number) => {
  const z = 1 - (2 * number + 1) / 400, angle = number * Math.PI * (3 - Math.sqrt(5)), level = Math.sqrt(1 - z * z);
  return [level * Math.cos(angle), level * Math.sin(angle), z];
});

/** Directions from which a section is looked at: from each side but from the root. */
const SECTION_VIEWS = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]];

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => a.map(v => v * s);
const added = (a, b) => a.map((v, i) => v + b[i]);
const unit = a => scaled(a, 1 / Math.hypot(...a));

/** Eight points of the ring around a place as it is seen from a direction. */
function ringAround(place, way) {
  const right = unit(cross(Math.abs(way[2]) > 0.9 ? [1, 0, 0] : [0, 0, 1], way)), up = cross(way, right);
  return Array.from({ length: 8 }, (_, number) => {
    const angle = number * Math.PI / 4;
    return added(place, added(scaled(right, RING * Math.cos(angle)), scaled(up, RING * Math.sin(angle))));
  });
}

/** An orthographic camera: a millimetre has the same length everywhere in the picture. */
class Eye {
  constructor(middle, half) {
    this.middle = middle;
    this.half = half;
    [this.right, this.up] = SIDES.occlusal;
  }

  /** From the tooth to the eye. */
  get back() {
    return cross(this.right, this.up);
  }

  /** Turns by angles about the picture's upright and level axes. */
  turn(across, along) {
    const back = this.back;
    this.right = unit(added(scaled(this.right, Math.cos(across)), scaled(back, -Math.sin(across))));
    const turned = this.back;
    this.up = unit(added(scaled(this.up, Math.cos(along)), scaled(turned, -Math.sin(along))));
  }

  /** Looks along a direction of tooth space, from its end; the crown is up where that can be. */
  lookFrom(direction) {
    const back = unit(direction);
    const upright = Math.abs(back[2]) > 0.97 ? [1, 0, 0] : [0, 0, 1];
    this.right = unit(cross(upright, back));
    this.up = cross(back, this.right);
  }
}

class Solid {
  /** Asks for the adapter and begins to translate the shader, which takes a while and needs no voxels yet. */
  static begin(canvas, shader) {
    const gl = canvas.getContext('webgl2', { antialias: false, depth: true, stencil: true, preserveDrawingBuffer: true, premultipliedAlpha: true });
    if (!gl) return null;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, shader]]) {
      const part = gl.createShader(kind);
      gl.shaderSource(part, text.trim());
      gl.compileShader(part);
      gl.attachShader(program, part);
    }
    gl.linkProgram(program);
    return { gl, program };
  }

  /** Throws where the browser has no WebGL 2 or not the memory; `begun` is what [begin] gave. */
  constructor(canvas, voxels, palette, begun) {
    if (!begun) throw new Error('WebGL 2 is not available');
    const { gl, program } = begun;
    Object.assign(this, { canvas, voxels, gl, program });
    const most = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
    if (voxels.dims.some(n => n > most)) throw new Error('the volume is too large for this graphics adapter');
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      const logs = gl.getAttachedShaders(program).map(part => gl.getShaderInfoLog(part));
      throw new Error(`shader of the tooth: ${gl.getProgramInfoLog(program)} ${logs.join(' ')}`);
    }
    gl.useProgram(program);
    this.vertices = gl.createVertexArray();
    gl.bindVertexArray(this.vertices);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.textures(palette);
    const size = voxels.dims.map((n, axis) => n * voxels.spacing[axis]);
    this.eye = new Eye(voxels.pointOf(voxels.dims.map(n => 0.5 * (n - 1))), 0.55 * Math.max(...size));
    this.clips = [null, null, null];
    /** The place that is marked by a ring, mm of tooth space. */
    this.ring = null;
    /** The instrument that is drawn, with its pose; null for none. */
    this.held = null;
    this.instruments = null;
    this.byVerdict = true;
    this.byDeviation = false;
    this.patterns = true;
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    const names = Array.from({ length: count }, (_, number) => gl.getActiveUniform(program, number).name);
    this.uniforms = Object.fromEntries(names.map(name => [name, gl.getUniformLocation(program, name)]));
  }

  /** Shows what another one showed: after an adapter was lost and a new one begins with nothing in it. */
  resume({ eye, clips, ring, held, byVerdict, byDeviation, patterns, deviation, instruments }) {
    if (deviation) this.take(deviation);
    if (instruments) this.carry(instruments.shapes);
    return Object.assign(this, { eye, clips, ring, held, byVerdict, byDeviation, patterns });
  }

  /** Takes the shapes of the tray's instruments; without them the tooth is shown alone. */
  carry(shapes) {
    try {
      this.instruments = new InstrumentMeshes(this.gl, shapes);
    } catch (reason) {
      console.warn(reason);
    }
    this.useTooth();
  }

  useTooth() {
    this.gl.useProgram(this.program);
    this.gl.bindVertexArray(this.vertices);
  }

  /** Takes the signed distances from the ideal cavity. */
  take(deviation) {
    const { gl } = this;
    this.deviation = deviation;
    gl.activeTexture(gl.TEXTURE5);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8, ...deviation.size, 0, gl.RED, gl.UNSIGNED_BYTE, deviation.bytes());
    gl.uniform3fv(gl.getUniformLocation(this.program, 'deviationLow'), deviation.low);
    gl.uniform3fv(gl.getUniformLocation(this.program, 'deviationSize'), deviation.size);
    gl.uniform1f(gl.getUniformLocation(this.program, 'deviationMost'), DEVIATION_MOST);
  }

  textures(palette) {
    const { gl, voxels } = this;
    const volume = (unit, name, inner, format, filter, dims, bytes) => {
      const texture = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_3D, texture);
      for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(gl.TEXTURE_3D, side, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MAG_FILTER, filter);
      gl.texImage3D(gl.TEXTURE_3D, 0, inner, ...dims, 0, format, gl.UNSIGNED_BYTE, bytes);
      gl.uniform1i(gl.getUniformLocation(this.program, name), unit);
    };
    volume(0, 'density', gl.R8, gl.RED, gl.LINEAR, voxels.dims, voxels.density);
    volume(1, 'tissues', gl.R8UI, gl.RED_INTEGER, gl.NEAREST, voxels.dims, voxels.label);
    volume(2, 'verdicts', gl.R8UI, gl.RED_INTEGER, gl.NEAREST, voxels.dims, voxels.verdict);
    const bricks = voxels.dims.map(n => Math.ceil(n / BRICK));
    volume(3, 'coarse', gl.R8, gl.RED, gl.NEAREST, bricks, this.coarse(bricks));
    gl.activeTexture(gl.TEXTURE4);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 4, 0, gl.RGBA, gl.UNSIGNED_BYTE, this.colours(palette));
    gl.uniform1i(gl.getUniformLocation(this.program, 'palette'), 4);
    volume(5, 'deviations', gl.R8, gl.RED, gl.LINEAR, [1, 1, 1], new Uint8Array(1));
    for (const [name, colour] of [['shallow', SHALLOW], ['planned', PLANNED], ['deep', DEEP]]) gl.uniform3fv(gl.getUniformLocation(this.program, name), colour);
  }

  /** Bricks that ever held matter that a ray could meet: a sample in one sees a voxel beyond its edge. */
  coarse(bricks) {
    const { start, dims: [nx, ny, nz] } = this.voxels;
    const found = new Uint8Array(bricks[0] * bricks[1] * bricks[2]);
    const row = new Uint8Array(bricks[0]);
    for (let z = 0, at = 0; z < nz; z++)
      for (let y = 0; y < ny; y++, at += nx) {
        row.fill(0);
        let isEmpty = true;
        for (let x = 0; x < nx; x++) {
          if (start[at + x] === 0) continue;
          isEmpty = false;
          row[Math.max((x - 1) >> 3, 0)] = row[x >> 3] = 255;
          // The rest of this brick says no more, but for its last voxel.
          x = Math.max(x, Math.min(x | 7, nx - 1) - 1);
          if (x + 1 < nx && start[x + 1 + at] !== 0) row[Math.min((x + 2) >> 3, bricks[0] - 1)] = 255;
        }
        if (isEmpty) continue;
        for (let k = Math.max((z - 1) >> 3, 0); k <= Math.min((z + 1) >> 3, bricks[2] - 1); k++)
          for (let j = Math.max((y - 1) >> 3, 0); j <= Math.min((y + 1) >> 3, bricks[1] - 1); j++)
            for (let i = 0, to = (k * bricks[1] + j) * bricks[0]; i < bricks[0]; i++) found[to + i] |= row[i];
      }
    return found;
  }

  colours(palette) {
    const bytes = new Uint8Array(4 * 256 * 4);
    const put = (row, number, [r, g, b], alpha) => bytes.set([r * 255, g * 255, b * 255, alpha].map(Math.round), 4 * (row * 256 + number));
    for (let number = 0; number < 256; number++) {
      put(0, number, palette.tissue(number), palette.isDecay(number) ? 0 : 255);
      put(1, number, palette.verdict(number), 255);
      put(2, number, palette.standing(number, VERDICT.kept), 255);
      put(3, number, palette.standing(number, VERDICT.keptSound), 255);
    }
    return bytes;
  }

  /** Sends what the cavity is now to the adapter. */
  refresh() {
    const { gl, voxels } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.texSubImage3D(gl.TEXTURE_3D, 0, ...voxels.low, ...voxels.size, gl.RED, gl.UNSIGNED_BYTE, voxels.changed);
  }

  /** Corners, in voxels, of what the clip planes leave: each takes away what lies before it. */
  remaining() {
    const back = this.eye.back;
    const low = [0, 0, 0], high = this.voxels.dims.map(n => n - 1);
    this.clips.forEach((at, axis) => {
      if (at === null) return;
      if (back[axis] > 0) high[axis] = at; else low[axis] = at;
    });
    return [low, high];
  }

  /** Draws at a share of the canvas's size on the screen. */
  draw(share) {
    const { gl, voxels, eye, canvas } = this;
    const ratio = Math.min(window.devicePixelRatio || 1, 1.5) * share;
    const width = Math.max(Math.round(canvas.clientWidth * ratio), 1), height = Math.max(Math.round(canvas.clientHeight * ratio), 1);
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.viewport(0, 0, width, height);
    const set = (name, values) => gl.uniform3fv(this.uniforms[name], values);
    const inVoxels = vector => vector.map((v, axis) => v / voxels.spacing[axis]);
    const [low, high] = this.remaining();
    set('dims', voxels.dims);
    set('spacing', voxels.spacing);
    set('low', low);
    set('high', high);
    set('middle', voxels.cellOf(eye.middle));
    set('right', inVoxels(scaled(eye.right, eye.half * width / height)));
    set('up', inVoxels(scaled(eye.up, eye.half)));
    set('away', inVoxels(scaled(eye.back, -1)));
    gl.uniform1i(this.uniforms.hasRing, this.ring !== null);
    set('ring', this.ring ? voxels.cellOf(this.ring) : [0, 0, 0]);
    // The same for whoever reads the page by program.
    const { middle, right, up, half } = eye;
    const clips = this.clips.map((at, axis) => (at === null ? null : voxels.pointOf([at, at, at])[axis]));
    canvas.dataset.view = JSON.stringify({ middle, right, up, half, clips, ring: this.ring, ratio: width / height });
    gl.uniform1i(this.uniforms.byVerdict, this.byVerdict);
    gl.uniform1i(this.uniforms.byDeviation, this.byDeviation);
    gl.uniform1i(this.uniforms.patterns, this.patterns);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.ALWAYS);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (!this.held || !this.instruments) return;
    this.instruments.draw(this.held, eye, this.ring, width / height, REACH);
    this.useTooth();
  }

  /** The place of the picture, in pixels of the page from its upper left corner, of a point of tooth space. */
  placeOf(point) {
    const { eye, canvas: { clientWidth, clientHeight } } = this;
    const from = added(point, scaled(eye.middle, -1)), pixels = 0.5 * clientHeight / eye.half;
    return [0.5 * clientWidth + pixels * dot(from, eye.right), 0.5 * clientHeight - pixels * dot(from, eye.up)];
  }

  /**
   * The voxel that a place of the picture (-1 to 1, up) shows: what was taken away there, else what stands; null beside the
   * tooth. The same way as the shader's.
   */
  voxelAt(x, y) {
    const { voxels, eye } = this;
    const ratio = this.canvas.clientWidth / this.canvas.clientHeight;
    const from = added(eye.middle, added(scaled(eye.right, x * eye.half * ratio), scaled(eye.up, y * eye.half)));
    const origin = voxels.cellOf(from), away = eye.back.map((v, axis) => -v / voxels.spacing[axis]);
    const [low, high] = this.remaining();
    let t = -Infinity, end = Infinity;
    for (let axis = 0; axis < 3; axis++) {
      if (Math.abs(away[axis]) < 1e-9) {
        if (origin[axis] < low[axis] || origin[axis] > high[axis]) return null;
        continue;
      }
      const sides = [(low[axis] - origin[axis]) / away[axis], (high[axis] - origin[axis]) / away[axis]];
      t = Math.max(t, Math.min(...sides));
      end = Math.min(end, Math.max(...sides));
    }
    const pace = 0.3 / Math.hypot(...away);
    for (let first = true; t < end; t += pace, first = false) {
      const p = added(origin, scaled(away, t + 1e-4));
      if (voxels.sample(...p) <= 0.5) continue;
      const within = p.map((v, axis) => Math.min(Math.max(Math.round(v), 0), voxels.dims[axis] - 1));
      if (first) return within;
      const e = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
      const slope = e.map((d, axis) => (voxels.sample(...added(p, d)) - voxels.sample(...added(p, scaled(d, -1)))) / voxels.spacing[axis]);
      const least = Math.min(...voxels.spacing), size = Math.hypot(...slope) || 1;
      const along = mm => added(p, slope.map((v, axis) => -v / size / voxels.spacing[axis] * mm * least)).map(Math.round);
      const beside = along(1.2), inside = along(-0.6);
      if (voxels.holds(beside) && voxels.isGone(beside)) return beside;
      return voxels.holds(inside) ? inside : within;
    }
    return null;
  }
}
