// Sections through the tooth, drawn voxel by voxel on a 2D canvas, without WebGL.

/**
 * Right and upward directions of each section in tooth space. Mesial is on the left of both sections that show it: where y
 * runs toward mesial, those are seen from the other side.
 */
const SECTIONS = [SIDES.mesial, SIDES.buccal, [[0, 1, 0], [-1, 0, 0]]];
const MIRRORED_SECTIONS = [SIDES.mesial, SIDES.lingual, SIDES.occlusal];

/** Space around the work, mm. */
const AROUND = 1.8;

/** Least half of a section's side, mm. */
const HALF_LEAST = 3.5;

/** Pixels along a section's side. */
const PIXELS = 260;

/** Letters at the ends of the axes: buccal and lingual, distal and mesial (or, mirrored, mesial and distal), occlusal and apical. */
const LETTERS = [['L', 'B'], ['M', 'D'], ['A', 'O']];

/** Content of a pixel: remaining matter, or removed matter. */
const STANDS = 1, GONE = 2;

/** A colour of 0 to 1 as a pixel, opaque. */
function packed(colour) {
  const [r, g, b] = colour.map(c => Math.round(255 * Math.min(c, 1)));
  return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
}

const PAPER = packed([1, 1, 1]), LINE = packed([0.22, 0.2, 0.18]), IDEAL = packed([0.02, 0.2, 0.62]);

/** Length of the dashes of the ideal outline, pixels. */
const DASH = 5;

class Cut {
  constructor(canvas, number, voxels, palette) {
    this.canvas = canvas;
    [this.right, this.up] = (voxels.mirrored ? MIRRORED_SECTIONS : SECTIONS)[number];
    this.across = this.right.findIndex(v => v !== 0);
    this.along = this.up.findIndex(v => v !== 0);
    this.axis = 3 - this.across - this.along;
    this.voxels = voxels;
    this.palette = palette;
    this.byVerdict = true;
    this.byDeviation = false;
    /** Signed distances from the ideal cavity; null where there is none. */
    this.deviation = null;
    this.patterns = true;
    canvas.width = canvas.height = PIXELS;
    const span = axis => voxels.size[axis] * voxels.spacing[axis];
    const isWorked = voxels.size.some(n => n > 1);
    const whole = axis => voxels.dims[axis] * voxels.spacing[axis];
    const work = Math.max(HALF_LEAST, 0.5 * Math.max(span(this.across), span(this.along)) + AROUND);
    this.half = isWorked ? work : 0.52 * Math.max(whole(this.across), whole(this.along));
    const middle = isWorked ? voxels.low.map((v, axis) => v + 0.5 * (voxels.size[axis] - 1)) : voxels.dims.map(n => 0.5 * (n - 1));
    /** Voxel in the middle of the picture; along the section's axis, where it cuts. */
    this.middle = middle.map(Math.round);
  }

  get at() {
    return this.middle[this.axis];
  }

  moveTo(at) {
    this.middle[this.axis] = Math.min(Math.max(Math.round(at), 0), this.voxels.dims[this.axis] - 1);
  }

  /** Brings a voxel into the picture. */
  show(cell) {
    this.moveTo(cell[this.axis]);
    for (const axis of [this.across, this.along]) {
      if (Math.abs(cell[axis] - this.middle[axis]) * this.voxels.spacing[axis] > 0.9 * this.half) this.middle[axis] = cell[axis];
    }
  }

  /** Voxels, not rounded, under a place of the picture: 0 to 1, down. */
  under(x, y) {
    const point = this.middle.slice();
    point[this.across] += this.right[this.across] * (2 * x - 1) * this.half / this.voxels.spacing[this.across];
    point[this.along] += this.up[this.along] * (1 - 2 * y) * this.half / this.voxels.spacing[this.along];
    return point;
  }

  /** Position of a voxel in the picture, pixels. */
  place(cell) {
    const offset = axis => (cell[axis] - this.middle[axis]) * this.voxels.spacing[axis] / this.half;
    return [0.5 * PIXELS * (1 + this.right[this.across] * offset(this.across)), 0.5 * PIXELS * (1 - this.up[this.along] * offset(this.along))];
  }

  cellAt(x, y) {
    const cell = this.under(x, y).map(Math.round);
    return this.voxels.holds(cell) ? cell : null;
  }

  draw(asked, others) {
    const context = this.canvas.getContext('2d');
    const image = context.createImageData(PIXELS, PIXELS);
    const pixels = new Uint32Array(image.data.buffer);
    const kinds = this.paint(pixels);
    // A line where what stands meets what is gone or never was.
    for (let pixel = PIXELS; pixel < kinds.length; pixel++) {
      if (kinds[pixel] !== kinds[pixel - 1] || kinds[pixel] !== kinds[pixel - PIXELS]) pixels[pixel] = LINE;
    }
    if (this.deviation) this.outline(pixels, kinds);
    context.putImageData(image, 0, 0);
    this.write(context, asked, others);
  }

  /** Draws the outline of the ideal cavity, dashed; and, in colours of the deviation, the border of the cut one. */
  outline(pixels, kinds) {
    const point = this.under(0.5 / PIXELS, 0.5 / PIXELS), begin = point[this.across];
    const step = axis => 2 * this.half / PIXELS / this.voxels.spacing[axis];
    const dx = this.right[this.across] * step(this.across), dy = -this.up[this.along] * step(this.along);
    const mm = new Float32Array(kinds.length).fill(NaN);
    for (let y = 0, pixel = 0; y < PIXELS; y++, point[this.along] += dy) {
      point[this.across] = begin;
      for (let x = 0; x < PIXELS; x++, pixel++, point[this.across] += dx) {
        const at = kinds[pixel] ? this.deviation.at(...point) : null;
        if (at !== null) mm[pixel] = at;
      }
    }
    const isBorder = pixel => kinds[pixel] * kinds[pixel - 1] === 2 || kinds[pixel] * kinds[pixel - PIXELS] === 2;
    for (let pixel = PIXELS; this.byDeviation && pixel < kinds.length; pixel++) {
      if (!isBorder(pixel) || Number.isNaN(mm[pixel])) continue;
      const colour = packed(deviationColour(mm[pixel]));
      for (const beside of [0, 1, -1, PIXELS, -PIXELS, 2, -2, 2 * PIXELS, -2 * PIXELS]) {
        if (kinds[pixel + beside]) pixels[pixel + beside] = colour;
      }
    }
    for (let pixel = PIXELS; pixel < kinds.length; pixel++) {
      const isCrossed = beside => mm[pixel] < 0 !== mm[beside] < 0 && !Number.isNaN(mm[pixel]) && !Number.isNaN(mm[beside]);
      const isDash = Math.floor((pixel % PIXELS + Math.floor(pixel / PIXELS)) / DASH) % 2 === 0;
      if (isDash && (isCrossed(pixel - 1) || isCrossed(pixel - PIXELS))) pixels[pixel] = pixels[pixel - 1] = IDEAL;
    }
  }

  /** Angle between the walls in this section, degrees; null where there are no two walls, or the section is level. */
  taper() {
    return this.along === 2 ? wallTaper(this.voxels, this.across, this.middle) : null;
  }

  /** Colours every pixel and says of each whether nothing is there, something stands, or it is gone. */
  paint(pixels) {
    const { voxels } = this, [nx, ny, nz] = voxels.dims;
    const kinds = new Uint8Array(PIXELS * PIXELS);
    const colours = new Map();
    const point = this.under(0.5 / PIXELS, 0.5 / PIXELS);
    const step = axis => 2 * this.half / PIXELS / voxels.spacing[axis];
    const dx = this.right[this.across] * step(this.across), dy = -this.up[this.along] * step(this.along);
    const begin = point[this.across];
    for (let y = 0, pixel = 0; y < PIXELS; y++, point[this.along] += dy) {
      point[this.across] = begin;
      for (let x = 0; x < PIXELS; x++, pixel++, point[this.across] += dx) {
        const i = Math.round(point[0]), j = Math.round(point[1]), k = Math.round(point[2]);
        pixels[pixel] = PAPER;
        if (i < 0 || j < 0 || k < 0 || i >= nx || j >= ny || k >= nz) continue;
        const index = (k * ny + j) * nx + i;
        if (voxels.start[index] === 0) continue;
        const stands = voxels.sample(point[0], point[1], point[2]) > 0.5;
        if (!stands && !voxels.isGoneAt(i, j, k)) continue;
        kinds[pixel] = stands ? STANDS : GONE;
        const stripe = (stands ? x + y : x - y + PIXELS) % 9 < 2;
        const key = voxels.label[index] | voxels.verdict[index] << 8 | stands << 16 | stripe << 17;
        let colour = colours.get(key);
        if (colour === undefined) colours.set(key, colour = this.colour(voxels.label[index], voxels.verdict[index], stands, stripe));
        pixels[pixel] = colour;
      }
    }
    return kinds;
  }

  colour(label, verdict, stands, stripe) {
    const { palette } = this, hatched = this.byVerdict && this.patterns && stripe;
    if (this.byDeviation) return packed(stands ? palette.tissue(label).map(c => 0.45 + 0.55 * c) : [0.97, 0.97, 0.97]);
    if (stands) {
      const colour = this.byVerdict ? palette.standing(label, verdict) : palette.tissue(label);
      return packed(colour.map(c => (hatched && verdict === VERDICT.left ? c + 0.3 : c)));
    }
    if (!this.byVerdict) return packed(palette.tissue(label).map(c => 1 - 0.16 * (1 - c)));
    const isWrong = verdict === VERDICT.overcut || verdict === VERDICT.vulnerableTouched;
    return packed(palette.verdict(verdict).map(c => (hatched && isWrong ? 0.6 * c : c)));
  }

  write(context, asked, others) {
    context.lineWidth = 1;
    context.strokeStyle = 'rgba(0, 60, 140, 0.45)';
    context.setLineDash([4, 4]);
    for (const other of others) {
      const cell = this.middle.slice();
      cell[other.axis] = other.at;
      const [x, y] = this.place(cell);
      context.beginPath();
      if (other.axis === this.across) { context.moveTo(x, 0); context.lineTo(x, PIXELS); } else { context.moveTo(0, y); context.lineTo(PIXELS, y); }
      context.stroke();
    }
    context.setLineDash([]);
    if (asked && Math.abs(asked[this.axis] - this.at) < 1) {
      const [x, y] = this.place(asked);
      for (const [width, style] of [[4, '#fff'], [2, '#000']]) {
        context.lineWidth = width;
        context.strokeStyle = style;
        context.beginPath();
        context.arc(x, y, 7, 0, 2 * Math.PI);
        context.stroke();
      }
    }
    context.font = 'bold 13px sans-serif';
    context.textAlign = 'center';
    // The teeth of an arch have only the occlusal side in common.
    const letter = (vector, axis, end) => this.voxels.jaw && axis < 2
      ? '' : LETTERS[axis][((vector[axis] > 0) === end) === (axis === 1 && this.voxels.mirrored) ? 0 : 1];
    const text = (t, x, y) => {
      context.lineWidth = 3;
      context.strokeStyle = '#fff';
      context.strokeText(t, x, y);
      context.fillStyle = '#333';
      context.fillText(t, x, y);
    };
    text(letter(this.right, this.across, true), PIXELS - 10, PIXELS / 2);
    text(letter(this.right, this.across, false), 26, PIXELS / 2);
    text(letter(this.up, this.along, true), PIXELS / 2, 15);
    text(letter(this.up, this.along, false), PIXELS / 2, PIXELS - 20);
    this.rule(context);
  }

  /** Rulers along the left and lower edges: a tick for each millimetre, from a corner, with its number where there is room. */
  rule(context) {
    const millimetre = PIXELS / (2 * this.half), every = millimetre < 16 ? 5 : millimetre < 26 ? 2 : 1;
    context.font = '9px sans-serif';
    context.fillStyle = context.strokeStyle = '#333';
    context.lineWidth = 1;
    for (let mm = 0; mm * millimetre < PIXELS - 20; mm++) {
      const at = Math.round(mm * millimetre) + 0.5, length = mm % 5 === 0 ? 7 : 4;
      context.beginPath();
      context.moveTo(at, PIXELS);
      context.lineTo(at, PIXELS - length);
      context.moveTo(0, PIXELS - at);
      context.lineTo(length, PIXELS - at);
      context.stroke();
      if (mm === 0 || mm % every) continue;
      context.textAlign = 'center';
      context.fillText(mm, at, PIXELS - 9);
      context.textAlign = 'left';
      context.fillText(mm, 9, PIXELS - at + 3);
    }
    context.textAlign = 'left';
    context.fillText('mm', 3, PIXELS - 9);
  }
}
