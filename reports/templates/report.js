// Script of the page: connects the timeline, the tooth, the sections, the curves and the texts.

/** Factor by which the tooth is drawn finer along each side at rest; with a fast adapter, at full resolution. */
const FINER = 3;

/** Direction from which the working area is looked at: from above and a little from the side. */
const WORK_VIEW = [0.25, -0.35, 1];

const byId = id => document.getElementById(id);

/** A duration as the page writes it: 9.5 s, 1:10.3. */
function duration(seconds) {
  const tenths = Math.round(Math.max(seconds, 0) * 10);
  if (tenths < 600) return `${Math.floor(tenths / 10)}.${tenths % 10} s`;
  return `${Math.floor(tenths / 600)}:${String(Math.floor(tenths / 10) % 60).padStart(2, '0')}.${tenths % 10}`;
}

/** Languages are chosen by a button, by the address (#tr) or by the browser; all of them are in the page. */
const language = {
  codes: [...document.querySelectorAll('[data-language]')].map(b => b.dataset.language),
  get now() { return document.documentElement.lang; },
  choose(code) {
    document.documentElement.lang = code;
    for (const button of document.querySelectorAll('[data-language]')) button.setAttribute('aria-pressed', button.dataset.language === code);
    document.dispatchEvent(new Event('language'));
  },
  begin() {
    const wanted = [location.hash.slice(1), ...(navigator.languages || [])].map(code => code.toLowerCase());
    const fits = code => this.codes.find(own => own.toLowerCase() === code) || this.codes.find(own => own.toLowerCase() === code.split('-')[0]);
    const found = wanted.map(fits).find(Boolean) || this.codes[0];
    if (this.codes.length > 1) document.querySelector('.languages').hidden = false;
    for (const button of document.querySelectorAll('[data-language]')) button.onclick = () => this.choose(button.dataset.language);
    if (found) this.choose(found);
  },
};

class Page {
  constructor(session, voxels, motion, begun) {
    this.session = session;
    this.voxels = voxels;
    this.palette = new Palette(session.tissues, session.verdicts);
    this.moment = session.seconds;
    this.asked = null;
    /** The place that is marked by a ring, mm of tooth space. */
    this.ring = null;
    this.mark = null;
    this.cuts = [0, 1, 2].map(number => new Cut(byId(`cut-${number}`), number, voxels, this.palette));
    this.deviation = Deviation.of(voxels);
    for (const cut of this.cuts) cut.deviation = this.deviation;
    byId('explore').hidden = false;
    this.solid = this.inSpace(begun);
    if (this.solid && this.deviation) this.solid.take(this.deviation);
    for (const part of document.querySelectorAll('.of-deviation')) part.hidden = !this.deviation;
    if (this.solid && motion) this.solid.carry(motion.about.shapes);
    this.player = new Player(this, motion);
    /** Part of the canvas's pixels along each side while things move. */
    this.share = 0.22;
    this.wire();
    this.look('work');
    this.setMoment(this.moment);
  }

  inSpace(begun) {
    try {
      return new Solid(byId('solid'), this.voxels, this.palette, begun);
    } catch (reason) {
      document.querySelector('.stage').hidden = true;
      byId('told').textContent = `${this.say('script.no_solid')} (${reason.message})`;
      return null;
    }
  }

  say(key, values = {}) {
    const words = this.session.words[language.now] || this.session.words.en;
    return (words[key] || key).replace(/\{(\w+)\}/g, (whole, name) => (name in values ? values[name] : whole));
  }

  named(thing) {
    return thing ? thing.title[language.now] || thing.title.en : '–';
  }

  // Time.

  setMoment(seconds) {
    this.moment = Math.min(Math.max(seconds, 0), this.session.seconds);
    const isOther = this.voxels.standAt(this.moment);
    if (this.solid && isOther) this.solid.refresh();
    const slider = byId('moment');
    slider.value = this.moment;
    slider.setAttribute('aria-valuetext', duration(this.moment));
    byId('moment-text').textContent = `${duration(this.moment)} / ${duration(this.session.seconds)}`;
    const now = byId('now');
    if (now) {
      const x = this.left + (this.right - this.left) * this.moment / Math.max(this.session.seconds, 1e-9);
      now.setAttribute('x1', x);
      now.setAttribute('x2', x);
    }
    this.player.show();
    this.drawSoon(isOther);
  }

  // Places.

  /** Says of a voxel what it was and what became of it; the ring is drawn around it, or around a place beside it. */
  ask(cell, ring = this.voxels.pointOf(cell)) {
    this.asked = cell;
    this.ring = ring;
    for (const cut of this.cuts) cut.show(cell);
    this.showCuts();
    this.tell();
    this.drawSoon();
  }

  /** The directions and distances of a place from the middle of the tooth, in words. */
  wayTo(place) {
    const way = (axis, high, low) => this.say(`script.${place[axis] >= 0 ? high : low}`, { mm: Math.abs(place[axis]).toFixed(1) });
    const z = way(2, 'up', 'down');
    // The teeth of an arch have no common directions; left and right are the patient's.
    const { jaw } = this.voxels;
    if (jaw) return { x: way(0, 'front', 'back'), y: jaw === 'lower' ? way(1, 'left', 'right') : way(1, 'right', 'left'), z };
    const y = this.voxels.mirrored ? way(1, 'mesial', 'distal') : way(1, 'distal', 'mesial');
    return { x: way(0, 'buccal', 'lingual'), y, z };
  }

  tell() {
    const told = byId('told');
    if (!this.asked) {
      // A place beside the tooth: on an adjacent tooth, or on the gingiva.
      if (this.mark !== null && this.ring) told.textContent = `${this.say('script.mark', { number: this.mark })} ${Object.values(this.wayTo(this.ring)).join(', ')}.`;
      return;
    }
    const cell = this.asked, { voxels, palette } = this;
    const tissue = voxels.tissue(cell), verdict = voxels.verdict[voxels.index(cell)], fall = voxels.fallOf(cell);
    const values = {
      tissue: this.named(palette.tissues.get(tissue)), verdict: this.named(palette.verdicts.get(verdict)),
      voxel: voxels.inBundle(cell).join(', '), ...this.wayTo(voxels.pointOf(cell)),
    };
    if (fall) Object.assign(values, { time: duration(fall.tick / 1000), seconds: (fall.tick / 1000).toFixed(3), force: fall.force.toFixed(2), tool: this.named(this.session.tools[fall.tool]) });
    const parts = [tissue === 0 ? this.say('script.air') : this.say(fall ? 'script.fell' : 'script.kept', values)];
    if (fall && fall.tick > voxels.moment) parts.push(this.say('script.falls_later'));
    if (this.mark !== null) parts.unshift(this.say('script.mark', { number: this.mark }));
    const mm = this.deviation && tissue !== 0 ? this.deviation.at(...cell) : null;
    const isSeen = fall || verdict === VERDICT.left;
    if (mm !== null && isSeen) parts.push(this.say(mm > 0 ? 'script.deep' : 'script.shallow', { mm: Math.abs(mm).toFixed(1) }));
    told.textContent = `${parts.join(' ')} ${this.say('script.place', values)}`;
    // The same for whoever reads the page by program.
    Object.assign(told.dataset, { voxel: voxels.inBundle(cell).join(' '), tissue, verdict, seconds: fall ? fall.tick / 1000 : '', deviation: mm === null || !isSeen ? '' : mm.toFixed(3) });
  }

  /** Shows a place of tooth space, mm, as it was at a moment, from where it is seen. */
  visit(place, seconds, mark) {
    this.player.pause();
    this.setMoment(seconds ?? this.session.seconds);
    if (this.solid) this.turnTo(place);
    this.point(place, seconds, mark);
    const view = byId('explore'), { top, bottom } = byId('solid').getBoundingClientRect();
    if (top < 0 || bottom > window.innerHeight) view.scrollIntoView({ block: 'start' });
  }

  /** Marks a place of tooth space, mm, at a moment, in the view that the reader has. */
  point(place, seconds, mark) {
    this.mark = mark;
    this.setMoment(seconds ?? this.session.seconds);
    const cell = this.matterNear(this.voxels.cellOf(place));
    if (cell) this.ask(cell, place);
    else {
      this.asked = null;
      this.ring = place;
      this.tell();
      this.drawSoon();
    }
  }

  /**
   * Turns the tooth so that a place is seen as it is now: along the middle of the directions in which nothing covers it and
   * the ring around it. Where there are none, the tooth is cut open at the place, from the side on which least lies before it.
   */
  turnTo(place) {
    const { solid, voxels } = this, { eye, clips } = solid;
    eye.middle = place.slice();
    eye.half = 3.5;
    clips.fill(null);
    const isOpen = (point, way) => voxels.coverOf(point, way) === 0;
    const open = VIEWS.filter(way => isOpen(place, way) && ringAround(place, way).filter(point => isOpen(point, way)).length >= 7);
    if (open.length) {
      const middle = open.reduce(added);
      eye.lookFrom(open.reduce((best, way) => (dot(way, middle) > dot(best, middle) ? way : best)));
    } else {
      const cover = SECTION_VIEWS.map(way => voxels.coverOf(place, way));
      const way = SECTION_VIEWS[cover.indexOf(Math.min(...cover))], axis = way.findIndex(Boolean);
      eye.lookFrom(way);
      clips[axis] = Math.round(voxels.cellOf(place)[axis]);
    }
    for (const box of document.querySelectorAll('.clip')) box.checked = clips[this.cuts[box.dataset.clip].axis] !== null;
  }

  /** The nearest voxel of the tooth around a place. */
  matterNear(at) {
    const { voxels } = this;
    let best = null, least = Infinity;
    const middle = at.map(Math.round), reach = 4;
    for (let k = -reach; k <= reach; k++) for (let j = -reach; j <= reach; j++) for (let i = -reach; i <= reach; i++) {
      const cell = [middle[0] + i, middle[1] + j, middle[2] + k];
      const far = Math.hypot(...cell.map((v, axis) => v - at[axis]));
      if (far < least && voxels.holds(cell) && voxels.tissue(cell) !== 0) [best, least] = [cell, far];
    }
    return best;
  }

  look(side) {
    const { solid, voxels } = this;
    if (!solid) return;
    const { eye } = solid, isWorked = voxels.size.some(n => n > 1);
    if (side === 'work' && isWorked) {
      eye.lookFrom(WORK_VIEW);
      eye.middle = voxels.pointOf(voxels.low.map((v, axis) => v + 0.5 * (voxels.size[axis] - 1)));
      eye.half = 0.75 * Math.max(...voxels.size.map((n, axis) => n * voxels.spacing[axis]), 2);
    } else {
      // Where nothing was removed, the crowns are the working area.
      if (side === 'work') eye.lookFrom(WORK_VIEW);
      else [eye.right, eye.up] = SIDES[voxels.mirrored ? { mesial: 'distal', distal: 'mesial' }[side] || side : side];
      eye.middle = voxels.pointOf(voxels.dims.map(n => 0.5 * (n - 1)));
      const size = voxels.dims.map((n, axis) => n * voxels.spacing[axis]);
      eye.half = 0.52 * Math.max(...[eye.right, eye.up].map(way => Math.abs(dot(way.map(Math.abs), size))));
      this.makeRoom();
    }
    this.drawSoon(false);
  }

  /** Makes room for the instrument above the crown, in views in which the crown is up. */
  makeRoom() {
    const { eye } = this.solid;
    if (!this.player.motion || eye.up[2] < 0.9) return;
    eye.middle = added(eye.middle, scaled(eye.up, 0.15 * eye.half));
    eye.half *= 1.17;
  }

  // Drawing: coarse while something moves, fine when it rests.

  /** Draws the tooth in the next frame, and the sections where what they show has changed. */
  drawSoon(areCutsOld = true) {
    this.areCutsOld ||= areCutsOld;
    delete document.documentElement.dataset.drawn;
    this.isDirty = true;
    if (this.awaited) return;
    this.awaited = requestAnimationFrame(() => {
      this.awaited = 0;
      this.isDirty = false;
      this.draw(this.share);
      document.documentElement.dataset.shown = this.moment.toFixed(3);
      clearTimeout(this.fine);
      this.fine = setTimeout(() => this.drawFine(), 150);
    });
  }

  drawFine() {
    if (this.isDirty) return;
    this.drawSolid(Math.min(1, FINER * this.share));
    this.showTaper();
    document.documentElement.dataset.drawn = this.moment.toFixed(3);
  }

  draw(share) {
    this.drawSolid(share);
    if (!this.areCutsOld) return;
    this.areCutsOld = false;
    for (const cut of this.cuts) cut.draw(this.asked, this.cuts.filter(other => other !== cut));
  }

  /** Says below each upright section how the walls stand to each other. */
  showTaper() {
    this.cuts.forEach((cut, number) => {
      const degrees = cut.taper(), line = byId(`taper-${number}`);
      if (!line) return;
      const shown = degrees === null ? 0 : Math.round(degrees);
      line.textContent = degrees === null ? '' : this.say(shown < 0 ? 'script.undercut' : 'script.taper', { degrees: Math.abs(shown) });
      line.dataset.degrees = degrees === null ? '' : degrees.toFixed(1);
    });
  }

  /**
   * Pictures for paper, where no browser prints what a graphics adapter drew: the tooth by assessment and by deviation, at
   * full resolution, from the same side.
   */
  drawForPaper() {
    const { solid } = this;
    if (!solid) return;
    const { byVerdict, byDeviation, held } = solid;
    solid.held = null;
    for (const [id, deviates] of [['solid-print', false], ['deviation-print', true]]) {
      if (deviates && !this.deviation) continue;
      solid.byVerdict = true;
      solid.byDeviation = deviates;
      solid.draw(1);
      const paper = byId(id);
      [paper.width, paper.height] = [solid.canvas.width, solid.canvas.height];
      paper.getContext('2d').drawImage(solid.canvas, 0, 0);
    }
    Object.assign(solid, { byVerdict, byDeviation, held });
    this.drawSoon(false);
  }

  drawSolid(share) {
    if (!this.solid) return;
    const began = performance.now();
    this.solid.ring = this.ring;
    this.solid.draw(share);
    this.player.drawForce();
    if (share > this.share) return;
    // A slow adapter gets fewer pixels while things move: the next frame comes when this one is done.
    requestAnimationFrame(() => {
      const took = performance.now() - began;
      this.share = Math.min(Math.max(share * Math.sqrt(50 / Math.max(took, 1)), 0.2), 0.7);
    });
  }

  showCuts() {
    this.cuts.forEach((cut, number) => {
      const slider = document.querySelector(`[data-cut="${number}"]`);
      slider.value = cut.at;
      slider.setAttribute('aria-valuetext', `${this.voxels.pointOf(cut.middle)[cut.axis].toFixed(1)} mm`);
      if (this.solid && this.solid.clips[cut.axis] !== null) this.solid.clips[cut.axis] = cut.at;
    });
  }

  // Hands.

  wire() {
    const slider = byId('moment');
    slider.max = this.session.seconds;
    // The last step of the slider may lie short of the end.
    slider.oninput = () => {
      const [value, step] = [Number(slider.value), Number(slider.step)];
      this.setMoment(this.session.seconds - value < step ? this.session.seconds : value);
    };
    this.wireCuts();
    if (this.solid) this.wireSolid();
    this.wireCurves();
    for (const button of document.querySelectorAll('[data-side]')) button.onclick = () => this.look(button.dataset.side);
    for (const choice of document.querySelectorAll('[name="colours"]')) {
      choice.onchange = () => this.colourBy(view => {
        view.byVerdict = choice.value === 'verdict';
        view.byDeviation = choice.value === 'deviation';
        document.querySelector('.scale').classList.toggle('unused', !view.byDeviation);
      });
    }
    byId('patterns').onchange = event => this.colourBy(view => { view.patterns = event.target.checked; });
    for (const button of document.querySelectorAll('.show')) {
      button.hidden = false;
      button.onclick = () => {
        const { mark, at, x, y, z } = button.dataset;
        if (mark) this.visitMark(Number(mark));
        else this.visit([x, y, z].map(Number), at === undefined ? null : Number(at), null);
      };
    }
    document.addEventListener('language', () => { this.tell(); this.showTaper(); });
    window.addEventListener('beforeprint', () => this.drawForPaper());
    window.addEventListener('resize', () => this.drawSoon(false));
  }

  visitMark(number) {
    const moment = this.session.moments.find(m => m.number === number);
    if (moment) this.visit(moment.place, moment.at, number);
  }

  colourBy(change) {
    for (const view of [this.solid, ...this.cuts]) if (view) change(view);
    this.drawSoon();
  }

  wireCuts() {
    this.cuts.forEach((cut, number) => {
      const slider = document.querySelector(`[data-cut="${number}"]`);
      slider.max = this.voxels.dims[cut.axis] - 1;
      slider.oninput = () => { cut.moveTo(Number(slider.value)); this.showCuts(); this.drawSoon(); };
      document.querySelector(`[data-clip="${number}"]`).onchange = event => {
        if (this.solid) this.solid.clips[cut.axis] = event.target.checked ? cut.at : null;
        this.drawSoon();
      };
      cut.canvas.onclick = event => {
        const box = cut.canvas.getBoundingClientRect();
        const cell = cut.cellAt((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
        this.mark = null;
        if (cell) this.ask(cell);
      };
      cut.canvas.onkeydown = event => {
        const ways = { ArrowRight: [cut.right, 1], ArrowLeft: [cut.right, -1], ArrowUp: [cut.up, 1], ArrowDown: [cut.up, -1] };
        const way = ways[event.key];
        if (!way && event.key !== 'Enter') return;
        event.preventDefault();
        const from = this.asked && Math.abs(this.asked[cut.axis] - cut.at) < 1 ? this.asked : cut.middle;
        const cell = way ? added(from, scaled(way[0], way[1] * (event.shiftKey ? 10 : 1))) : from.slice();
        this.mark = null;
        if (this.voxels.holds(cell)) this.ask(cell);
      };
    });
    this.showCuts();
  }

  wireSolid() {
    const { solid } = this, { canvas, eye } = solid;
    let from = null, moved = 0;
    canvas.onpointerdown = event => {
      from = [event.clientX, event.clientY];
      moved = 0;
      canvas.setPointerCapture(event.pointerId);
    };
    canvas.onpointermove = event => {
      if (!from) return;
      const [x, y] = [event.clientX - from[0], event.clientY - from[1]];
      moved += Math.abs(x) + Math.abs(y);
      if (event.shiftKey) {
        const mm = 2 * eye.half / canvas.clientHeight;
        eye.middle = added(eye.middle, added(scaled(eye.right, -x * mm), scaled(eye.up, y * mm)));
      } else eye.turn(x * 0.008, -y * 0.008);
      from = [event.clientX, event.clientY];
      this.drawSoon(false);
    };
    canvas.onpointerup = event => {
      const isClick = from && moved < 5;
      from = null;
      if (!isClick) return;
      const box = canvas.getBoundingClientRect();
      this.mark = null;
      this.askSolid(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
    };
    canvas.onpointercancel = () => { from = null; };
    const zoom = factor => { eye.half = Math.min(Math.max(eye.half * factor, 0.5), 60); this.drawSoon(false); };
    canvas.addEventListener('wheel', event => { event.preventDefault(); zoom(Math.exp(0.0012 * event.deltaY)); }, { passive: false });
    canvas.onkeydown = event => {
      const turns = { ArrowLeft: [0.12, 0], ArrowRight: [-0.12, 0], ArrowUp: [0, -0.12], ArrowDown: [0, 0.12] };
      if (turns[event.key]) eye.turn(...turns[event.key]);
      else if (event.key === '+' || event.key === '=') zoom(0.85);
      else if (event.key === '-') zoom(1 / 0.85);
      else if (event.key === 'Home') this.look('occlusal');
      else if (event.key === 'Enter' || event.key === ' ') { this.mark = null; this.askSolid(0, 0); } else return;
      event.preventDefault();
      this.drawSoon(false);
    };
    // An adapter that was lost comes back with nothing in it.
    canvas.addEventListener('webglcontextlost', event => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => {
      const old = this.solid;
      const begun = Solid.begin(canvas, byId('solid-shader').textContent);
      this.solid = new Solid(canvas, this.voxels, this.palette, begun).resume(old);
      this.drawSoon();
    });
  }

  askSolid(x, y) {
    const cell = this.solid.voxelAt(x, y);
    if (cell) this.ask(cell);
  }

  wireCurves() {
    const curves = byId('curves');
    if (!curves) return;
    [this.left, this.right] = [Number(curves.dataset.left), Number(curves.dataset.right)];
    const box = curves.viewBox.baseVal;
    const now = document.createElementNS('http://www.w3.org/2000/svg', 'line');
    now.id = 'now';
    now.setAttribute('y1', 60);
    now.setAttribute('y2', box.height - 28);
    curves.append(now);
    const markOf = target => target.closest && target.closest('.mark');
    const toMoment = event => {
      const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(curves.getScreenCTM().inverse());
      const share = (place.x - this.left) / (this.right - this.left);
      if (share >= -0.02 && share <= 1.02) this.setMoment(share * this.session.seconds);
    };
    curves.onclick = event => {
      const mark = markOf(event.target);
      if (mark) this.visitMark(Number(mark.dataset.mark)); else toMoment(event);
    };
    curves.onpointermove = event => { if (event.buttons === 1 && !markOf(event.target)) toMoment(event); };
    curves.onkeydown = event => {
      const mark = markOf(event.target);
      if (!mark || (event.key !== 'Enter' && event.key !== ' ')) return;
      event.preventDefault();
      this.visitMark(Number(mark.dataset.mark));
    };
  }
}

(async () => {
  language.begin();
  const packed = byId('voxels');
  if (!packed || typeof DecompressionStream === 'undefined') {
    if (packed) {
      const session = JSON.parse(byId('session').textContent);
      const note = document.createElement('p');
      note.textContent = (session.words[language.now] || session.words.en)['script.no_voxels'];
      byId('explore').before(note);
    }
    return;
  }
  const session = JSON.parse(byId('session').textContent);
  const begun = Solid.begin(byId('solid'), byId('solid-shader').textContent);
  const voxels = new Voxels(session.voxels, await unpacked(packed.textContent));
  const moved = byId('motion');
  const motion = session.motion ? new Motion(session.motion, await unpacked(moved.textContent)) : null;
  packed.remove();
  moved.remove();
  new Page(session, voxels, motion, begun);
})();
