// The motion of the instrument, as the trainee saw it.
//
// Takes the packed key poses of the page. Gives the pose and the force at any tick, whole or not; tooth space, mm and N.

class Motion {
  constructor(about, bytes) {
    this.about = about;
    let from = 0;
    // Differences: the sign in the lowest bit, seven bits in a byte, the lowest first.
    const column = count => {
      const numbers = new Float64Array(count);
      for (let i = 0, value = 0; i < count; i++) {
        let zigzag = 0, place = 1, byte;
        do {
          byte = bytes[from++];
          zigzag += (byte & 0x7f) * place;
          place *= 128;
        } while (byte & 0x80);
        value += zigzag % 2 ? -(zigzag + 1) / 2 : zigzag / 2;
        numbers[i] = value;
      }
      return numbers;
    };
    const columns = (many, count) => Array.from({ length: many }, () => column(count));
    this.ticks = column(about.keys);
    this.positions = columns(3, about.keys);
    this.orientations = columns(4, about.keys);
    this.forces = columns(3, about.forces);
  }

  /** Instrument (its index in the tray), position, orientation (unit quaternion x, y, z, w) and force on it at a tick. */
  at(tick) {
    const { ticks, about } = this, last = ticks.length - 1;
    const within = Math.min(Math.max(tick, 0), ticks[last]);
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (ticks[middle] <= within) low = middle; else high = middle;
    }
    const share = high > low ? (within - ticks[low]) / (ticks[high] - ticks[low]) : 0;
    const mixed = column => column[low] + (column[high] - column[low]) * share;
    const turn = this.orientations.map(mixed), length = Math.hypot(...turn) || 1;
    return {
      tool: about.held.filter(([from]) => from <= within).pop()[1],
      position: this.positions.map(column => mixed(column) / about.position_steps),
      orientation: turn.map(part => part / length),
      force: this.forceAt(within),
    };
  }

  /** Means over some ticks, each in the middle of its ticks. */
  forceAt(tick) {
    const { about, forces } = this, last = about.forces - 1;
    if (last < 0) return [0, 0, 0];
    const at = Math.min(Math.max((tick + 0.5) / about.force_ticks - 0.5, 0), last);
    const low = Math.min(Math.floor(at), Math.max(last - 1, 0)), high = Math.min(low + 1, last);
    return forces.map(column => (column[low] + (column[high] - column[low]) * (at - low)) / about.force_steps);
  }
}
