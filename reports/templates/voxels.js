'use strict';
// The tooth of a session at any moment.
//
// Takes the packed voxels of the page: the density at the start in 32 steps, tissues, verdicts, and for the part that
// changed the density at the end and the tick at which each voxel was removed. Gives the density at a given moment.
// Coordinates are voxels of the page, [i, j, k] with i fastest.

/** Steps of density from which a voxel is solid, of 32. */
const SOLID = 16;
/** Each step as 0 to 255. */
const FULL = Uint8Array.from({ length: 32 }, (_, step) => Math.round(step * 255 / 31));
/** A tick (ms) later than any tick of a session. */
const NEVER = 0xffffffff;
/** Numbers of the verdicts, as in performance.seg.nrrd. */
const VERDICT = { outside: 0, keptSound: 1, rightlyRemoved: 2, withinLeeway: 3, overcut: 4, left: 5, vulnerableTouched: 6, kept: 7, restored: 8, overfilled: 9 };

/** The bytes behind a packed text: base64 of a zlib stream. */
async function unpacked(text) {
  const packed = atob(text.trim());
  const bytes = new Uint8Array(packed.length);
  for (let i = 0; i < packed.length; i++) bytes[i] = packed.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Voxels {
  constructor(about, bytes) {
    this.about = about;
    this.dims = about.dims;
    this.spacing = about.spacing_mm;
    /** True where y runs toward mesial. */
    this.mirrored = about.is_mirrored;
    /** The jaw of which all teeth are shown, if it is one. */
    this.jaw = about.jaw;
    const part = {};
    let from = 0;
    for (const [name, length] of about.parts) {
      part[name] = bytes.subarray(from, from + length);
      from += length;
    }
    this.start = part.start;
    this.label = part.label;
    this.verdict = part.verdict;
    this.low = about.changed_low;
    this.size = about.changed_dims;
    this.end = part.end;
    this.readFalls(part.fell, part.pressed);
    /** Density now, 0 to 255. */
    this.density = new Uint8Array(part.start.length);
    for (let i = 0; i < part.start.length; i++) this.density[i] = FULL[part.start[i]];
    /** The changed part of it, ready to be sent to a graphics adapter. */
    this.changed = new Uint8Array(this.end.length);
    this.moment = -1;
    /** Number of the ticks in which voxels fell until now; -1 before the first moment. */
    this.fallen = -1;
  }

  index(cell) {
    return (cell[2] * this.dims[1] + cell[1]) * this.dims[0] + cell[0];
  }

  holds(cell) {
    return cell.every((v, axis) => v >= 0 && v < this.dims[axis]);
  }

  /** Visits the part that changed: its own index, and that in the whole. */
  eachChanged(visit) {
    const [nx, ny, nz] = this.size, [lx, ly, lz] = this.low;
    let own = 0;
    for (let z = 0; z < nz; z++)
      for (let y = 0; y < ny; y++) {
        let whole = this.index([lx, ly + y, lz + z]);
        for (let x = 0; x < nx; x++) visit(own++, whole++);
      }
  }

  readFalls(fell, pressed) {
    this.fell = new Uint32Array(this.end.length).fill(NEVER);
    const count = fell.length / 4;
    let next = 0;
    this.eachChanged((own, whole) => {
      if (this.start[whole] < SOLID || this.end[own] >= SOLID) return;
      const byte = plane => fell[plane * count + next];
      this.fell[own] = byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24 >>> 0;
      next++;
    });
    // How hard was pressed is told once for each tick in which anything fell.
    this.ticks = Uint32Array.from(new Set(this.fell)).sort();
    if (this.ticks[this.ticks.length - 1] === NEVER) this.ticks = this.ticks.subarray(0, -1);
    const ticks = this.ticks.length;
    this.pressed = Float32Array.from(this.ticks, (_, i) => (pressed[i] | pressed[ticks + i] << 8) / 100);
    this.thinned = this.timesOfThinned();
  }

  /** Time at which voxels changed that were not removed: that of the first of their neighbours. */
  timesOfThinned() {
    const times = this.fell.slice();
    for (let round = 0; round < 2; round++) {
      const before = times.slice();
      this.eachChanged((own, whole) => {
        if (before[own] !== NEVER || this.end[own] === this.start[whole]) return;
        this.around(own, near => { times[own] = Math.min(times[own], before[near]); });
      });
    }
    this.eachChanged((own, whole) => {
      if (times[own] === NEVER && this.end[own] !== this.start[whole]) times[own] = 0;
    });
    return times;
  }

  /** Visits the voxels of the changed part that touch one of it, itself among them. */
  around(own, visit) {
    const [nx, ny, nz] = this.size;
    const x = own % nx, y = Math.floor(own / nx) % ny, z = Math.floor(own / (nx * ny));
    for (let k = Math.max(z - 1, 0); k <= Math.min(z + 1, nz - 1); k++)
      for (let j = Math.max(y - 1, 0); j <= Math.min(y + 1, ny - 1); j++)
        for (let i = Math.max(x - 1, 0); i <= Math.min(x + 1, nx - 1); i++) visit((k * ny + j) * nx + i, i - x, j - y, k - z);
  }

  /** Sets the tooth to its state at a moment, s. False where it has this state already. */
  standAt(seconds) {
    const tick = Math.round(seconds * 1000), fallen = this.fallenUntil(tick);
    this.moment = tick;
    if (fallen === this.fallen) return false;
    this.fallen = fallen;
    const steps = this.changed;
    this.eachChanged((own, whole) => {
      steps[own] = this.thinned[own] <= tick ? this.end[own] : this.start[whole];
    });
    this.smoothFront(tick);
    this.eachChanged((own, whole) => {
      steps[own] = this.density[whole] = FULL[steps[own]];
    });
    return true;
  }

  /** Number of the ticks up to one in which voxels fell. */
  fallenUntil(tick) {
    let low = 0, high = this.ticks.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.ticks[middle] <= tick) low = middle + 1; else high = middle;
    }
    return low;
  }

  /** Smooths the density along the cut at intermediate moments, for which no density ramp is stored. */
  smoothFront(tick) {
    const GONE = 1, TO_FALL = 2;
    const state = new Uint8Array(this.fell.length);
    for (let own = 0; own < state.length; own++) {
      const at = this.fell[own];
      state[own] = at === NEVER ? 0 : at <= tick ? GONE : TO_FALL;
    }
    const [nx, ny] = this.size;
    let near = state;
    for (const stride of [1, nx, nx * ny]) {
      const spread = near.slice();
      for (let i = stride; i < near.length; i++) {
        spread[i] |= near[i - stride];
        spread[i - stride] |= near[i];
      }
      near = spread;
    }
    const sharp = this.changed.slice();
    for (let own = 0; own < near.length; own++) {
      if (near[own] !== (GONE | TO_FALL)) continue;
      let sum = 0, weights = 0;
      this.around(own, (n, i, j, k) => {
        const weight = (2 - Math.abs(i)) * (2 - Math.abs(j)) * (2 - Math.abs(k));
        sum += weight * sharp[n];
        weights += weight;
      });
      // Rounded, but on the side of the surface where it belongs.
      const rounded = Math.round(sum / weights);
      this.changed[own] = sharp[own] >= SOLID ? Math.max(rounded, SOLID) : Math.min(rounded, SOLID - 1);
    }
  }

  /** The index of a voxel within the part that changed; -1 outside. */
  own(cell) {
    const at = cell.map((v, axis) => v - this.low[axis]);
    if (!at.every((v, axis) => v >= 0 && v < this.size[axis])) return -1;
    return (at[2] * this.size[1] + at[1]) * this.size[0] + at[0];
  }

  /** Tick at which a voxel was removed; NEVER if it was not. */
  fellAt(cell) {
    const own = this.own(cell);
    return own < 0 ? NEVER : this.fell[own];
  }

  isGone(cell) {
    return this.isGoneAt(...cell);
  }

  isGoneAt(i, j, k) {
    const [nx, ny, nz] = this.size, x = i - this.low[0], y = j - this.low[1], z = k - this.low[2];
    if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) return false;
    return this.fell[(z * ny + y) * nx + x] <= this.moment;
  }

  /** Tissue at the start as in initial.seg.nrrd: what is solid. */
  tissue(cell) {
    const index = this.index(cell);
    return this.start[index] >= SOLID ? this.label[index] : 0;
  }

  /** Removal of a voxel: force in N, and the index of the instrument in the tray. */
  fallOf(cell) {
    const tick = this.fellAt(cell);
    if (tick === NEVER) return null;
    let low = 0, high = this.ticks.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.ticks[middle] < tick) low = middle + 1; else high = middle;
    }
    const held = this.about.held.filter(([from]) => from <= tick).pop() || [0, 0];
    return { tick, force: this.pressed[low], tool: held[1] };
  }

  /** A point of tooth space, mm, in voxels of the page; and back. */
  cellOf(point) {
    return point.map((v, axis) => (v - this.about.origin_mm[axis]) / this.spacing[axis]);
  }

  pointOf(cell) {
    return cell.map((v, axis) => this.about.origin_mm[axis] + v * this.spacing[axis]);
  }

  /** The voxel as the bundle's label maps count it. */
  inBundle(cell) {
    return cell.map((v, axis) => this.about.first[axis] + v * this.about.stride);
  }

  /**
   * How much lies between a place (mm of tooth space) and an eye in a direction, in steps of half a voxel; what lies within a
   * third of a millimetre of the place belongs to it.
   */
  coverOf(place, way) {
    const step = 0.5 * Math.min(...this.spacing), from = this.cellOf(place);
    const reach = Math.hypot(...this.dims.map((n, axis) => n * this.spacing[axis]));
    let count = 0;
    for (let mm = 0.33; mm < reach; mm += step) {
      const [x, y, z] = from.map((v, axis) => v + mm * way[axis] / this.spacing[axis]);
      if (this.sample(x, y, z) > 0.5) count++;
    }
    return count;
  }

  /** Density between voxels, 0 to 1; outside there is none. */
  sample(x, y, z) {
    const [nx, ny, nz] = this.dims;
    if (!(x >= 0 && y >= 0 && z >= 0 && x <= nx - 1 && y <= ny - 1 && z <= nz - 1)) return 0;
    const i = Math.min(Math.floor(x), nx - 2), j = Math.min(Math.floor(y), ny - 2), k = Math.min(Math.floor(z), nz - 2);
    const u = x - i, v = y - j, w = z - k;
    const at = (k * ny + j) * nx + i, d = this.density, plane = nx * ny;
    const along = n => d[n] + (d[n + 1] - d[n]) * u;
    const low = along(at) + (along(at + nx) - along(at)) * v;
    const high = along(at + plane) + (along(at + plane + nx) - along(at + plane)) * v;
    return (low + (high - low) * w) / 255;
  }
}

// Colours, the same in space and in sections.

/** Colour of unchanged matter: its verdict's colour with a little of its tissue's, so that the work stands out. */
const TOUCH = 0.35;

class Palette {
  constructor(tissues, verdicts) {
    this.tissues = new Map(tissues.map(t => [t.id, t]));
    this.verdicts = new Map(verdicts.map(v => [v.id, v]));
  }

  tissue(label) {
    return (this.tissues.get(label) || { color: [0.5, 0.5, 0.5] }).color;
  }

  verdict(number) {
    return (this.verdicts.get(number) || { color: [0.5, 0.5, 0.5] }).color;
  }

  isDecay(label) {
    return (this.tissues.get(label) || { decay: false }).decay;
  }

  /**
   * Matter that is still there, by verdict: what is to go shows as left until it is gone. The thin outer half of a surface
   * has a tissue and no verdict.
   */
  standing(label, verdict) {
    const isOpen = verdict === VERDICT.rightlyRemoved || verdict === VERDICT.outside;
    if (verdict === VERDICT.left || (isOpen && this.isDecay(label))) return this.verdict(VERDICT.left);
    if (verdict === VERDICT.restored || verdict === VERDICT.overfilled) return this.verdict(verdict);
    const kept = this.verdict(verdict === VERDICT.kept ? VERDICT.kept : VERDICT.keptSound);
    return kept.map((c, i) => c + (this.tissue(label)[i] - c) * TOUCH);
  }
}
