// The instrument in 3D: meshes from the parts of the page, drawn with WebGL 2 into the picture of the tooth.

/** Surfaces of parts, as the shader counts them. */
const SURFACES = ['steel', 'end', 'edge', 'flutes', 'grit', 'mark', 'glass'];

/** Cosine of the angle from which two stretches of an outline meet in an edge. */
const EDGE_COSINE = 0.8;

/** Corners of a wire's cross-section. */
const WIRE_SIDES = 12;

/** Numbers of a vertex: position, normal, surface. */
const VERTEX_NUMBERS = 7;

/** Length over which the shaft fades out at its end, mm. */
const FADE = 6;

/** Height at which a shape ends that does not fade out, mm: above every instrument. */
const ENDLESS = 1e6;

/** Opacity of what the tooth hides. */
const HIDDEN = 0.3;

const INSTRUMENT_VERTEX = `#version 300 es
uniform vec3 position;       // of the instrument, mm of tooth space
uniform vec4 orientation;
uniform vec3 middle;         // of the picture, mm of tooth space
uniform vec3 right;          // unit vectors of the picture
uniform vec3 up;
uniform vec3 back;
uniform vec2 half_size;      // of the picture, mm
uniform float reach;         // depth of the picture before and behind its middle, mm
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 outward;
layout(location = 2) in float surface;
out vec3 in_handle;
out vec3 normal;
out vec2 seen;               // from the middle of the picture, mm
flat out float kind;
vec3 turned(vec3 v) { return v + 2.0 * cross(orientation.xyz, cross(orientation.xyz, v) + orientation.w * v); }
void main() {
  vec3 from = turned(corner) + position - middle;
  in_handle = corner;
  normal = turned(outward);
  kind = surface;
  seen = vec2(dot(from, right), dot(from, up));
  gl_Position = vec4(seen / half_size, -dot(from, back) / reach, 1.0);
}`;

const INSTRUMENT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 right;
uniform vec3 up;
uniform vec3 back;
uniform float ends;          // height at which the shaft has faded out, mm
uniform float fade;
uniform float opacity;
uniform bool spares_ring;    // true where the ring around a place is not to be drawn over
uniform vec2 ring;           // its middle from the middle of the picture, mm
uniform float ring_radius;
in vec3 in_handle;
in vec3 normal;
in vec2 seen;
flat in float kind;
out vec4 colour;
const float FLUTES = 3.0, GRIT = 4.0;
vec3 base() {
  if (kind < 0.5) return vec3(0.74, 0.77, 0.81);
  if (kind < 1.5) return vec3(0.47, 0.51, 0.57);
  if (kind < 4.5) return kind < 3.5 ? vec3(0.36, 0.40, 0.47) : vec3(0.47, 0.45, 0.43);
  return kind < 5.5 ? vec3(0.10) : vec3(0.80, 0.88, 0.94);
}
// Eight helical blades of a carbide bur, or the grains of a diamond bur.
float relief() {
  float radius = length(in_handle.xy);
  if (kind == FLUTES) return 0.72 + 0.28 * smoothstep(-0.5, 0.3, sin(8.0 * atan(in_handle.y, in_handle.x) + 3.2 * in_handle.z / max(radius, 0.25)));
  if (kind != GRIT) return 1.0;
  vec3 grain = floor(in_handle * 11.0);
  return 0.78 + 0.44 * fract(sin(dot(grain, vec3(12.9898, 78.233, 37.719))) * 43758.5453);
}
void main() {
  if (spares_ring && abs(length(seen - ring) - ring_radius) < 0.11) discard;
  vec3 n = normalize(normal);
  // The tooth's lamp.
  vec3 lamp = normalize(back + 0.45 * up - 0.35 * right);
  // A bright room on one side, which polished steel shows wherever it does not face the lamp.
  float facing = max(dot(n, back), 0.0), room = 0.5 + 0.5 * dot(n, normalize(0.5 * up - right));
  vec3 c = base() * relief() * (0.40 + 0.26 * max(dot(n, lamp), 0.0) + 0.46 * room);
  float shine = kind == GRIT ? 0.05 : 0.4;
  c += shine * pow(max(dot(n, normalize(lamp + back)), 0.0), 30.0);
  // A dark rim keeps steel apart from enamel.
  c *= mix(1.0, 0.45, pow(1.0 - facing, 5.0));
  float a = opacity * (1.0 - smoothstep(ends - fade, ends, in_handle.z));
  colour = vec4(c * a, a);
}`;

/** Normals of an outline's stretches, [out, up]; where stretches meet at a blunt angle, their ends share one. */
function outlineNormals(outline) {
  const stretches = outline.slice(1).map(([r, z], i) => {
    const [dr, dz] = [r - outline[i][0], z - outline[i][1]], length = Math.hypot(dr, dz);
    return length > 1e-6 ? [dz / length, -dr / length] : null;
  });
  const shared = (own, other) => {
    if (!other || own[0] * other[0] + own[1] * other[1] < EDGE_COSINE) return own;
    const sum = [own[0] + other[0], own[1] + other[1]], length = Math.hypot(...sum);
    return sum.map(v => v / length);
  };
  return stretches.map((own, i) => own && [shared(own, stretches[i - 1]), shared(own, stretches[i + 1])]);
}

/** A vector turned by a unit quaternion. */
function turned([x, y, z, w], v) {
  const way = [x, y, z];
  return added(v, scaled(cross(way, added(cross(way, v), scaled(v, w))), 2));
}

/** Triangles of an outline that is turned about its axis, as numbers of vertices. */
function latheMesh({ surface, outline, sides, scale, at, turn }) {
  const numbers = [], kind = SURFACES.indexOf(surface), isRound = sides > 8, begin = isRound ? 0 : Math.PI / sides;
  const normals = outlineNormals(outline);
  const put = ([r, z], [out, rise], angle, facing) => {
    const place = [r * Math.cos(angle), r * Math.sin(angle), z].map((v, axis) => v * scale[axis]);
    const normal = [out * Math.cos(facing), out * Math.sin(facing), rise].map((v, axis) => v / scale[axis]);
    numbers.push(...added(turned(turn, place), at), ...unit(turned(turn, normal)), kind);
  };
  normals.forEach((ends, i) => {
    if (!ends) return;
    for (let side = 0; side < sides; side++) {
      const [a, b] = [side, side + 1].map(n => begin + 2 * Math.PI * n / sides), flat = 0.5 * (a + b);
      const corner = (end, angle) => put(outline[i + end], ends[end], angle, isRound ? angle : flat);
      corner(0, a); corner(0, b); corner(1, a);
      corner(1, a); corner(0, b); corner(1, b);
    }
  });
  return numbers;
}

/** Triangles of a tube along rings [x, y, z, radius]. */
function wireMesh({ surface, rings }) {
  const numbers = [], kind = SURFACES.indexOf(surface), last = rings.length - 1;
  const circles = rings.map(([x, y, z, radius], i) => {
    const way = unit(added(rings[Math.min(i + 1, last)].slice(0, 3), scaled(rings[Math.max(i - 1, 0)].slice(0, 3), -1)));
    const side = unit(cross(way, Math.abs(way[1]) > 0.95 ? [1, 0, 0] : [0, 1, 0])), up = cross(way, side);
    return Array.from({ length: WIRE_SIDES + 1 }, (_, n) => {
      const angle = 2 * Math.PI * n / WIRE_SIDES, out = added(scaled(side, Math.cos(angle)), scaled(up, Math.sin(angle)));
      return [...added([x, y, z], scaled(out, radius)), ...out, kind];
    });
  });
  for (let i = 0; i < last; i++) for (let n = 0; n < WIRE_SIDES; n++) {
    const [a, b, c, d] = [circles[i][n], circles[i][n + 1], circles[i + 1][n], circles[i + 1][n + 1]];
    numbers.push(...a, ...b, ...c, ...c, ...b, ...d);
  }
  return numbers;
}

/** Triangles of a surface; a corner's normal is the mean of its triangles' by their areas. */
function surfaceMesh({ surface, corners, triangles }) {
  const numbers = [], kind = SURFACES.indexOf(surface), normals = corners.map(() => [0, 0, 0]);
  for (const triangle of triangles) {
    const [a, b, c] = triangle.map(n => corners[n]);
    const normal = cross(added(b, scaled(a, -1)), added(c, scaled(a, -1)));
    for (const n of triangle) normals[n] = added(normals[n], normal);
  }
  const outward = normals.map(normal => (normal.some(v => v !== 0) ? unit(normal) : normal));
  for (const n of triangles.flat()) numbers.push(...corners[n], ...outward[n], kind);
  return numbers;
}

/** Triangles of a part. */
function partMesh(part) {
  if (part.outline) return latheMesh(part);
  return part.rings ? wireMesh(part) : surfaceMesh(part);
}

/** The instruments of a tray, ready to be drawn. */
class InstrumentMeshes {
  /** `shapes` are the parts of each instrument; those that were never held have none. */
  constructor(gl, shapes) {
    Object.assign(this, { gl, shapes });
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, INSTRUMENT_VERTEX], [gl.FRAGMENT_SHADER, INSTRUMENT_FRAGMENT]]) {
      const part = gl.createShader(kind);
      gl.shaderSource(part, text);
      gl.compileShader(part);
      gl.attachShader(this.program, part);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) throw new Error(`shader of the instrument: ${gl.getProgramInfoLog(this.program)}`);
    this.meshes = shapes.map(parts => (parts.length ? this.mesh(parts) : null));
  }

  mesh(parts) {
    const { gl } = this;
    const numbers = new Float32Array(parts.flatMap(partMesh));
    const vertices = gl.createVertexArray();
    gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
    [[0, 3, 0], [1, 3, 3], [2, 1, 6]].forEach(([place, size, from]) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * VERTEX_NUMBERS, 4 * from);
    });
    // A shape from a file is drawn to its end; only the shafts that the page adds fade out.
    let ends = parts.some(part => part.triangles) ? ENDLESS : -Infinity;
    for (let i = 2; i < numbers.length; i += VERTEX_NUMBERS) ends = Math.max(ends, numbers[i]);
    return { vertices, count: numbers.length / VERTEX_NUMBERS, ends };
  }

  /** Draws the instrument that is held into the picture of the tooth: what the tooth hides, only faintly. */
  draw({ tool, position, orientation }, eye, ring, ratio, reach) {
    const { gl, program } = this, mesh = this.meshes[tool];
    if (!mesh) return;
    gl.useProgram(program);
    gl.bindVertexArray(mesh.vertices);
    const place = name => gl.getUniformLocation(program, name);
    const { middle, right, up, back, half } = eye;
    for (const [name, vector] of Object.entries({ position, middle, right, up, back })) gl.uniform3fv(place(name), vector);
    gl.uniform4fv(place('orientation'), orientation);
    gl.uniform2f(place('half_size'), half * ratio, half);
    gl.uniform1f(place('reach'), reach);
    gl.uniform1f(place('ends'), mesh.ends);
    gl.uniform1f(place('fade'), FADE);
    const from = ring ? added(ring, scaled(middle, -1)) : [0, 0, 0];
    gl.uniform2f(place('ring'), dot(from, right), dot(from, up));
    gl.uniform1f(place('ring_radius'), RING);
    gl.enable(gl.CULL_FACE);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const pass = (opacity, sparesRing, depth) => {
      gl.uniform1f(place('opacity'), opacity);
      gl.uniform1i(place('spares_ring'), sparesRing);
      gl.depthFunc(depth);
      gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
    };
    // What is hidden comes first, as long as only the tooth has a depth; the stencil draws each pixel once.
    gl.depthMask(false);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 0, 0xff);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    pass(HIDDEN, ring !== null, gl.GREATER);
    gl.disable(gl.STENCIL_TEST);
    gl.depthMask(true);
    pass(1, false, gl.LEQUAL);
    gl.disable(gl.CULL_FACE);
    gl.disable(gl.BLEND);
  }
}
