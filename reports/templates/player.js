// The hand played back: time, pace, stops, the force on the instrument, and what is said about a moment.

/** Length of the arrow of one newton, pixels; it does not depend on the zoom. As in report.html. */
const NEWTON = 50;

/** Least force that is shown, N. */
const FORCE_LEAST = 0.05;

/** Two times are the same moment within half a tick, s. */
const SAME_MOMENT = 0.0005;

/** Most seconds of the reader's time that one picture may take: a page that was hidden goes on where it was. */
const PICTURE_MOST = 0.5;

/** Seconds between two pictures for readers who prefer reduced motion: still pictures instead of a moving one. */
const STILL = 1;

/** An arrow along x from the origin, or less than its head; half widths of shaft and head, and length of the head, pixels. */
function arrowPath(length) {
  const head = Math.min(15, length), wide = 0.6 * head, neck = length - head;
  return `M0,-3L${neck},-3V${-wide}L${length},0L${neck},${wide}V3H0Z`;
}

/** The sign for an arrow that points at the eye (a dot in a circle) or away from it (a cross in a circle). */
const TOWARD = 'M-8,0a8,8 0 1,0 16,0a8,8 0 1,0 -16,0ZM-3,0a3,3 0 1,1 6,0a3,3 0 1,1 -6,0Z';
const AWAY = 'M-8,0a8,8 0 1,0 16,0a8,8 0 1,0 -16,0ZM-1.4,-5H1.4V-1.4H5V1.4H1.4V5H-1.4V1.4H-5V-1.4H-1.4Z';

class Player {
  /** `motion` is null where the page has none: then the tooth alone is played. */
  constructor(page, motion) {
    Object.assign(this, { page, motion, playing: 0, before: 0 });
    this.isStill = window.matchMedia('(prefers-reduced-motion: reduce)');
    for (const part of document.querySelectorAll('.of-motion')) part.hidden = !motion;
    const hasMoments = page.session.moments.some(moment => moment.at !== null);
    byId('stops').closest('label').hidden = !hasMoments;
    byId('play').onclick = () => this.toggle();
    for (const id of ['show-instrument', 'show-force']) byId(id).onchange = () => { this.show(); page.drawSoon(false); };
    document.addEventListener('language', () => { this.show(); this.showBound(); });
    this.showBound();
  }

  // Time.

  toggle() {
    if (this.playing) {
      this.pause();
      return;
    }
    const { page } = this;
    if (page.moment >= page.session.seconds) page.setMoment(0);
    this.before = performance.now();
    this.playing = requestAnimationFrame(now => this.advance(now));
    this.showPlaying();
  }

  pause() {
    cancelAnimationFrame(this.playing);
    this.playing = 0;
    this.showPlaying();
  }

  advance(now) {
    const { page } = this, next = () => { this.playing = requestAnimationFrame(later => this.advance(later)); };
    const passed = (now - this.before) / 1000;
    if (passed <= 0 || this.isStill.matches && passed < STILL) {
      next();
      return;
    }
    this.before = now;
    const most = this.isStill.matches ? STILL : PICTURE_MOST;
    const from = page.moment, to = from + Number(byId('pace').value) * Math.min(passed, most);
    const stop = byId('stops').checked ? this.momentWithin(from, to) : null;
    if (stop) {
      this.pause();
      page.point(stop.place, stop.at, stop.number);
    } else if (to >= page.session.seconds) {
      this.pause();
      page.setMoment(page.session.seconds);
    } else {
      next();
      page.setMoment(to);
    }
  }

  /** The first moment of the feedback after a time and up to another. */
  momentWithin(from, to) {
    const within = this.page.session.moments.filter(({ at }) => at !== null && at > from + SAME_MOMENT && at <= to);
    return within.sort((a, b) => a.at - b.at)[0] || null;
  }

  showPlaying() {
    const isPlaying = this.playing !== 0;
    byId('play-sign').textContent = isPlaying ? '❚❚' : '▶';
    byId('play').setAttribute('aria-labelledby', isPlaying ? 'pause-name' : 'play-name');
    this.showCaption();
  }

  // What is shown.

  /** Shows the instrument, its force and the sentences of the time that the page shows. */
  show() {
    const { page, motion } = this;
    // At the end the result is shown, which the hand has left.
    const isHeld = motion !== null && page.moment < page.session.seconds;
    this.held = isHeld ? motion.at(page.moment * 1000) : null;
    if (page.solid) page.solid.held = byId('show-instrument').checked ? this.held : null;
    const held = byId('held');
    if (this.held) {
      const { tool, position, orientation, force } = this.held;
      const values = { tool: page.named(page.session.tools[tool]), force: Math.hypot(...force).toFixed(2) };
      held.textContent = page.say('script.held', values);
      // The same for whoever reads the page by program.
      held.dataset.pose = JSON.stringify({ seconds: page.moment, tool, position, orientation, force });
    } else {
      held.textContent = motion ? page.say('script.laid_down') : '';
      delete held.dataset.pose;
    }
    this.showCaption();
  }

  /** Says how near the instrument is to the recording. */
  showBound() {
    if (!this.motion) return;
    const { tolerance_mm: mm, tolerance_deg: degrees, force_ticks: ms } = this.motion.about;
    byId('bound').textContent = this.page.say('script.bound', { mm, degrees, ms });
  }

  /** Shows the sentences about a moment at which time stands still. */
  showCaption() {
    const { page } = this, caption = byId('caption');
    const isHere = ({ at }) => at !== null && Math.abs(at - page.moment) < SAME_MOMENT;
    const here = this.playing ? [] : page.session.moments.filter(isHere).map(moment => moment.number);
    if (caption.dataset.marks === here.join(' ')) return;
    caption.dataset.marks = here.join(' ');
    caption.replaceChildren(...here.flatMap(number => {
      const buttons = [...document.querySelectorAll(`.feedback .show[data-mark="${number}"]`)];
      return buttons.map(button => {
        const line = document.createElement('p'), flag = document.createElement('b');
        flag.textContent = number;
        const words = [...button.parentElement.childNodes].filter(node => node !== button);
        line.append(flag, ' ', ...words.map(node => node.cloneNode(true)));
        return line;
      });
    }));
    caption.hidden = here.length === 0;
  }

  /** Draws the force on the instrument over the picture of the tooth. */
  drawForce() {
    const { page } = this, { solid } = page, arrow = byId('force-arrow'), text = byId('force-text');
    const newtons = this.held ? Math.hypot(...this.held.force) : 0;
    const isShown = solid && byId('show-force').checked && newtons >= FORCE_LEAST;
    arrow.classList.toggle('unused', !isShown);
    text.classList.toggle('unused', !isShown);
    if (!isShown) return;
    const { position, force } = this.held, { right, up, back } = solid.eye;
    const [x, y] = solid.placeOf(position);
    const [across, down] = [NEWTON * dot(force, right), -NEWTON * dot(force, up)], length = Math.hypot(across, down);
    const isAlongSight = length < 0.3 * NEWTON * newtons;
    const angle = Math.atan2(down, across);
    arrow.setAttribute('d', isAlongSight ? (dot(force, back) > 0 ? TOWARD : AWAY) : arrowPath(length));
    arrow.setAttribute('transform', `translate(${x} ${y}) rotate(${isAlongSight ? 0 : angle * 180 / Math.PI})`);
    // The number stands beyond the arrow's end, within the picture.
    const beyond = isAlongSight ? 0 : length + 14 + 20 * Math.abs(Math.cos(angle)), lift = isAlongSight ? -14 : 5;
    const { clientWidth, clientHeight } = solid.canvas;
    const kept = (at, least, most) => Math.min(Math.max(at, least), most);
    text.setAttribute('x', kept(x + beyond * Math.cos(angle), 24, clientWidth - 24));
    text.setAttribute('y', kept(y + beyond * Math.sin(angle) + lift, 16, clientHeight - 8));
    text.textContent = `${newtons.toFixed(2)} N`;
  }
}
