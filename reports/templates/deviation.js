// Signed distance between the cavity that was cut and the ideal one, mm, and the taper of its walls.
//
// The ideal cavity is the tissue that should be removed: what was rightly removed, and what was left of it. Positive is too
// deep: the distance of a place in other tissue from the ideal cavity. Negative is too shallow: the distance of a place in
// the ideal cavity from the tissue that should stay.

/** Ends of the colour scale, mm. */
const DEVIATION_MOST = 1;

/** Tissue around the ideal cavity and the cut one for which the distance is computed, mm: more than the colour scale shows. */
const DEVIATION_MARGIN = 1.2;

/** Colours of the scale: too shallow, as planned, too deep. Blue and orange are told apart by colour-blind readers. */
const SHALLOW = [0.09, 0.33, 0.72], PLANNED = [0.94, 0.94, 0.92], DEEP = [0.82, 0.3, 0.02];

/** Colour of a deviation, mm. */
function deviationColour(mm) {
  const share = Math.min(Math.abs(mm) / DEVIATION_MOST, 1), end = mm < 0 ? SHALLOW : DEEP;
  return PLANNED.map((c, i) => c + (end[i] - c) * Math.sqrt(share));
}

/**
 * Distances in mm from each voxel of a box to the nearest one of a set; Infinity where the set is empty. Exact: squared
 * distances as the lower envelope of parabolas, one axis after the other (Felzenszwalb & Huttenlocher 2012).
 */
function distancesTo(isInside, size, spacing) {
  const squared = Float64Array.from(isInside, inside => (inside ? 0 : Infinity));
  const longest = Math.max(...size);
  const line = new Float64Array(longest), apex = new Int32Array(longest), from = new Float64Array(longest + 1);
  const strides = [1, size[0], size[0] * size[1]];
  for (let axis = 0; axis < 3; axis++) {
    const length = size[axis], stride = strides[axis], step = spacing[axis] * spacing[axis];
    const [a, b] = [0, 1, 2].filter(other => other !== axis);
    for (let j = 0; j < size[b]; j++) for (let i = 0; i < size[a]; i++) {
      const start = i * strides[a] + j * strides[b];
      let last = -1;
      for (let q = 0; q < length; q++) {
        line[q] = squared[start + q * stride];
        if (line[q] === Infinity) continue;
        let cut = -Infinity;
        while (last >= 0) {
          const p = apex[last];
          cut = (line[q] - line[p] + step * (q * q - p * p)) / (2 * step * (q - p));
          if (cut > from[last]) break;
          last--;
        }
        last++;
        apex[last] = q;
        from[last] = last ? cut : -Infinity;
      }
      if (last < 0) continue;
      for (let q = 0, k = 0; q < length; q++) {
        while (k < last && from[k + 1] < q) k++;
        squared[start + q * stride] = line[apex[k]] + step * (q - apex[k]) * (q - apex[k]);
      }
    }
  }
  return Float32Array.from(squared, Math.sqrt);
}

/** Deviations around the ideal cavity and the cut one. */
class Deviation {
  /** Null where nothing should be removed, or the work is a restoration. */
  static of(voxels) {
    const [nx, ny, nz] = voxels.dims, low = [nx, ny, nz], high = [-1, -1, -1];
    let isRestored = false;
    const widen = cell => cell.forEach((v, axis) => { low[axis] = Math.min(low[axis], v); high[axis] = Math.max(high[axis], v); });
    for (let k = 0, index = 0; k < nz; k++) for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++, index++) {
      const verdict = voxels.verdict[index];
      if (verdict === VERDICT.restored || verdict === VERDICT.overfilled) isRestored = true;
      if (isIdeal(verdict)) widen([i, j, k]);
    }
    if (high[0] < 0 || isRestored) return null;
    if (voxels.size.some(n => n > 1)) for (const end of [voxels.low, voxels.low.map((v, axis) => v + voxels.size[axis] - 1)]) widen(end);
    return new Deviation(voxels, low, high);
  }

  constructor(voxels, low, high) {
    this.voxels = voxels;
    const margin = axis => Math.ceil(DEVIATION_MARGIN / voxels.spacing[axis]);
    this.low = low.map((v, axis) => Math.max(v - margin(axis), 0));
    this.size = high.map((v, axis) => Math.min(v + margin(axis), voxels.dims[axis] - 1) - this.low[axis] + 1);
    const [nx, ny, nz] = this.size, count = nx * ny * nz;
    const ideal = new Uint8Array(count), sound = new Uint8Array(count);
    for (let k = 0, own = 0; k < nz; k++) for (let j = 0; j < ny; j++) for (let i = 0; i < nx; i++, own++) {
      const index = voxels.index([this.low[0] + i, this.low[1] + j, this.low[2] + k]);
      if (isIdeal(voxels.verdict[index])) ideal[own] = 1;
      else if (voxels.start[index] >= SOLID) sound[own] = 1;
    }
    const toIdeal = distancesTo(ideal, this.size, voxels.spacing), toSound = distancesTo(sound, this.size, voxels.spacing);
    // The border is halfway between the centres of two voxels.
    const half = 0.5 * Math.min(...voxels.spacing), most = Math.hypot(...this.size.map((n, axis) => n * voxels.spacing[axis]));
    this.mm = toIdeal.map((far, own) => (ideal[own] ? half - Math.min(toSound[own], most) : Math.min(far, most) - half));
  }

  /** Deviation between voxels, mm; null outside the part that is known. */
  at(x, y, z) {
    const p = [x - this.low[0], y - this.low[1], z - this.low[2]], [nx, ny] = this.size;
    if (!p.every((v, axis) => v >= 0 && v <= this.size[axis] - 1)) return null;
    const base = p.map((v, axis) => Math.min(Math.floor(v), Math.max(this.size[axis] - 2, 0)));
    let sum = 0;
    for (let corner = 0; corner < 8; corner++) {
      const offset = [corner & 1, corner >> 1 & 1, corner >> 2];
      const weight = offset.reduce((product, o, axis) => product * (o ? p[axis] - base[axis] : 1 - (p[axis] - base[axis])), 1);
      if (weight > 0) sum += weight * this.mm[((base[2] + offset[2]) * ny + base[1] + offset[1]) * nx + base[0] + offset[0]];
    }
    return sum;
  }

  /** For a graphics adapter: -DEVIATION_MOST to DEVIATION_MOST as 0 to 255. */
  bytes() {
    return Uint8Array.from(this.mm, mm => Math.round(127.5 + 127.5 * Math.min(Math.max(mm / DEVIATION_MOST, -1), 1)));
  }
}

function isIdeal(verdict) {
  return verdict === VERDICT.rightlyRemoved || verdict === VERDICT.left;
}

/** Least height of a wall whose direction is told, mm. */
const WALL_LEAST = 0.5;

/** Most by which a wall's border may differ from its straight line, root mean square, mm: a rounded wall has no direction. */
const CURVED = 0.05;

/** Part of a cavity's depth at its floor, where walls are rounded by the bur, and at its rim, that does not count. */
const ROUNDED = 0.25, RIM = 0.1;

/**
 * Angle between the two walls of a cavity in an upright section, degrees: positive where they diverge towards the opening,
 * negative where they converge (undercut). `across` is the axis of the section (0 or 1), `middle` a voxel between the walls.
 * Null where there are no two straight walls. Each wall is a straight line fitted to its border by least squares.
 */
function wallTaper(voxels, across, middle) {
  const rows = [];
  const sample = (place, z) => {
    const cell = middle.slice();
    cell[across] = place;
    cell[2] = z;
    return voxels.sample(...cell);
  };
  // The border between air and matter in a direction from the middle; null where none follows.
  const border = (z, way) => {
    for (let place = middle[across]; place >= 0 && place < voxels.dims[across]; place += way) {
      const density = sample(place, z);
      if (density <= 0.5) continue;
      const before = sample(place - way, z);
      return place - way * (density - 0.5) / Math.max(density - before, 1e-6);
    }
    return null;
  };
  for (let z = voxels.dims[2] - 1; z >= 0; z--) {
    if (sample(middle[across], z) > 0.5) { if (rows.length) break; continue; }
    const left = border(z, -1), right = border(z, 1);
    if (left === null || right === null) continue;
    rows.push([z * voxels.spacing[2], left * voxels.spacing[across], right * voxels.spacing[across]]);
  }
  const counted = rows.slice(Math.round(RIM * rows.length), rows.length - Math.round(ROUNDED * rows.length));
  if (counted.length < 4 || counted[0][0] - counted[counted.length - 1][0] < WALL_LEAST) return null;
  const mean = column => counted.reduce((sum, row) => sum + row[column], 0) / counted.length;
  const height = mean(0), spread = counted.reduce((sum, row) => sum + (row[0] - height) ** 2, 0);
  const slope = column => counted.reduce((sum, row) => sum + (row[0] - height) * (row[column] - mean(column)), 0) / spread;
  const isStraight = column => {
    const off = counted.reduce((sum, row) => sum + (row[column] - mean(column) - slope(column) * (row[0] - height)) ** 2, 0);
    return Math.sqrt(off / counted.length) <= CURVED;
  };
  return isStraight(1) && isStraight(2) ? (Math.atan(slope(2)) - Math.atan(slope(1))) * 180 / Math.PI : null;
}
